//! Vectors of eight `f64`, for loops that the compiler does not vectorise by itself.
//!
//! [`Base`] is the definition. The other types perform the same operations in wider registers.

use super::numbers::Numbers;
use std::ops::{Add, Div, Mul, Sub};

/// Eight numbers.
pub trait Eight: Numbers {
    /// Those of the numbers that one register holds. Where a loop has more sums than there are registers, it
    /// takes one part after the other.
    type Part: Numbers;
    /// Number of parts: 1 or 2.
    const PARTS: usize;
    /// Loads a part from memory.
    fn load_part(from: &[f64; 8], part: usize) -> Self::Part;
    /// The eight numbers of the first and the last part.
    fn of_parts(first: Self::Part, last: Self::Part) -> Self;
    /// Loads from memory.
    fn load(from: &[f64; 8]) -> Self;
    /// Converts integers, exactly.
    fn convert(from: &[i32; 8]) -> Self;
    /// Stores to memory.
    fn store(self, to: &mut [f64; 8]);
    /// Sets one of eight numbers in memory, with a store as wide as a load: the processor passes it on to the
    /// next load without waiting for the cache.
    #[inline(always)]
    fn put(to: &mut [f64; 8], k: usize, x: f64) {
        to[k] = x;
    }
    /// The largest number; no number is NaN.
    #[inline(always)]
    fn largest(self) -> f64 {
        let mut lanes = [0.0; 8];
        self.store(&mut lanes);
        lanes[1..]
            .iter()
            .fold(lanes[0], |a, b| if *b > a { *b } else { a })
    }
    /// The sum of the numbers `p`: ((p0 + p4) + (p2 + p6)) + ((p1 + p5) + (p3 + p7)).
    #[inline(always)]
    fn total(self) -> f64 {
        let mut p = [0.0; 8];
        self.store(&mut p);
        ((p[0] + p[4]) + (p[2] + p[6])) + ((p[1] + p[5]) + (p[3] + p[7]))
    }
    /// The sums of the numbers of several vectors, from their first and last parts, each as [`Eight::total`].
    #[inline(always)]
    fn totals<const N: usize>(first: [Self::Part; N], last: [Self::Part; N]) -> [f64; N] {
        let mut totals = [0.0; N];
        for ((total, first), last) in totals.iter_mut().zip(first).zip(last) {
            *total = Self::of_parts(first, last).total();
        }
        totals
    }
}

/// Vectors from arrays.
#[inline(always)]
pub fn loaded<F: Eight, const N: usize>(from: &[[f64; 8]; N]) -> [F; N] {
    let mut to = [F::splat(0.0); N];
    for (to, from) in to.iter_mut().zip(from) {
        *to = F::load(from);
    }
    to
}

/// Vectors as arrays.
#[inline(always)]
pub fn stored<F: Eight, const N: usize>(from: [F; N]) -> [[f64; 8]; N] {
    let mut to = [[0.0; 8]; N];
    for (to, from) in to.iter_mut().zip(from) {
        from.store(to);
    }
    to
}

/// Implements the arithmetic operators of a type.
macro_rules! operators {
    ($type:ident: $($trait:ident $name:ident($a:ident, $b:ident) = $does:expr;)*) => {
        $(impl $trait for $type {
            type Output = Self;

            #[inline(always)]
            fn $name(self, $b: Self) -> Self {
                let $a = self;
                $does
            }
        })*
    };
}

/// The part of a type that is one register.
macro_rules! one_part {
    () => {
        type Part = Self;
        const PARTS: usize = 1;

        #[inline(always)]
        fn load_part(from: &[f64; 8], _: usize) -> Self {
            Self::load(from)
        }

        #[inline(always)]
        fn of_parts(first: Self, _: Self) -> Self {
            first
        }
    };
}

/// The definition, in plain code.
#[derive(Debug, Clone, Copy)]
pub struct Base(pub [f64; 8]);

impl Base {
    #[inline(always)]
    fn zip(self, other: Self, op: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|k| op(self.0[k], other.0[k])))
    }
}

operators! { Base:
    Add add(a, b) = a.zip(b, |a, b| a + b);
    Sub sub(a, b) = a.zip(b, |a, b| a - b);
    Mul mul(a, b) = a.zip(b, |a, b| a * b);
    Div div(a, b) = a.zip(b, |a, b| a / b);
}

impl Numbers for Base {
    const ALL: u64 = 0xff;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; 8])
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    #[inline(always)]
    fn greater(self, other: Self) -> u64 {
        (0..8).fold(0, |bits, k| bits | u64::from(self.0[k] > other.0[k]) << k)
    }

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn choose<const N: usize>(bits: u64, first: [Self; N], second: [Self; N]) -> [Self; N] {
        let mut chosen = second;
        for (chosen, first) in chosen.iter_mut().zip(first) {
            for (k, (chosen, first)) in chosen.0.iter_mut().zip(first.0).enumerate() {
                *chosen = if bits >> k & 1 == 1 { first } else { *chosen };
            }
        }
        chosen
    }
}

impl Eight for Base {
    one_part! {}

    #[inline(always)]
    fn load(from: &[f64; 8]) -> Self {
        Self(*from)
    }

    #[inline(always)]
    fn convert(from: &[i32; 8]) -> Self {
        Self(from.map(f64::from))
    }

    #[inline(always)]
    fn store(self, to: &mut [f64; 8]) {
        *to = self.0;
    }
}

#[cfg(target_arch = "x86_64")]
pub use wide::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
#[allow(
    unsafe_code,
    reason = "instructions that were looked for; unaligned loads and stores"
)]
mod wide;
