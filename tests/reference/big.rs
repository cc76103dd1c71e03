//! Integers wide enough for all values here, for exact signs.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

/// A two's-complement integer of `W` 64-bit words, lowest first; overflow is not checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Big<const W: usize>([u64; W]);

impl<const W: usize> Big<W> {
    pub const ZERO: Self = Self([0; W]);

    /// -1, 0 or 1.
    pub fn sign(&self) -> i32 {
        if self.0[W - 1] >> 63 == 1 {
            -1
        } else {
            i32::from(*self != Self::ZERO)
        }
    }

    /// `2^exponent`.
    pub fn power_of_two(exponent: usize) -> Self {
        assert!(exponent < 64 * W - 1);
        let mut words = [0; W];
        words[exponent / 64] = 1 << (exponent % 64);
        Self(words)
    }

    /// The value rounded towards zero to about 60 bits, as a float; for inspection only.
    pub fn approximate(&self) -> f64 {
        let size = if self.sign() < 0 { -*self } else { *self };
        let value = size
            .0
            .iter()
            .rev()
            .fold(0.0, |sum, &word| sum * 2f64.powi(64) + word as f64);
        value * f64::from(self.sign())
    }
}

impl<const W: usize> From<i128> for Big<W> {
    fn from(value: i128) -> Self {
        let mut words = [if value < 0 { u64::MAX } else { 0 }; W];
        words[0] = value as u64;
        words[1] = (value >> 64) as u64;
        Self(words)
    }
}

impl<const W: usize> From<i64> for Big<W> {
    fn from(value: i64) -> Self {
        Self::from(i128::from(value))
    }
}

impl<const W: usize> Add for Big<W> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let mut carry = false;
        Self(std::array::from_fn(|k| {
            let (sum, over) = self.0[k].overflowing_add(other.0[k]);
            let (sum, over_again) = sum.overflowing_add(u64::from(carry));
            carry = over | over_again;
            sum
        }))
    }
}

impl<const W: usize> Neg for Big<W> {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.map(|word| !word)) + Self::from(1i64)
    }
}

impl<const W: usize> Sub for Big<W> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<const W: usize> Mul for Big<W> {
    type Output = Self;
    /// Two's complement multiplies like unsigned numbers, modulo `2^(64 W)`.
    fn mul(self, other: Self) -> Self {
        let mut words = [0u64; W];
        for a in 0..W {
            let mut carry = 0u128;
            for b in 0..W - a {
                let product = u128::from(self.0[a]) * u128::from(other.0[b]);
                let sum = u128::from(words[a + b]) + product + carry;
                words[a + b] = sum as u64;
                carry = sum >> 64;
            }
        }
        Self(words)
    }
}

impl<const W: usize> PartialOrd for Big<W> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<const W: usize> Ord for Big<W> {
    fn cmp(&self, other: &Self) -> Ordering {
        (*self - *other).sign().cmp(&0)
    }
}

/// A vector of three.
pub type Big3<const W: usize> = [Big<W>; 3];

pub fn vector<const W: usize, T: Copy + Into<Big<W>>>(v: [T; 3]) -> Big3<W> {
    v.map(Into::into)
}

pub fn plus<const W: usize>(a: Big3<W>, b: Big3<W>) -> Big3<W> {
    std::array::from_fn(|k| a[k] + b[k])
}

pub fn dot<const W: usize>(a: Big3<W>, b: Big3<W>) -> Big<W> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross<const W: usize>(a: Big3<W>, b: Big3<W>) -> Big3<W> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub fn determinant<const W: usize>(rows: [Big3<W>; 3]) -> Big<W> {
    dot(rows[0], cross(rows[1], rows[2]))
}
