//! Arithmetic written once for one number and for vectors of them.

use std::ops::{Add, Div, Mul, Sub};

/// One or several numbers; every operation applies to each of them.
pub trait Numbers:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// One set bit for each number.
    const ALL: u64;
    /// All numbers equal to `x`.
    fn splat(x: f64) -> Self;
    /// Square roots.
    fn sqrt(self) -> Self;
    /// Absolute values.
    fn abs(self) -> Self;
    /// Bit `k` is set if number `k` is greater than that of `other` (false for NaN).
    fn greater(self, other: Self) -> u64;
    /// For each pair the first number if it is greater, else the second.
    fn larger(self, other: Self) -> Self;
    /// For each pair the first number if its bit is set, else the second; applied to `N` vectors with the
    /// same bits.
    fn choose<const N: usize>(bits: u64, first: [Self; N], second: [Self; N]) -> [Self; N];
}

/// One number.
impl Numbers for f64 {
    const ALL: u64 = 1;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn greater(self, other: Self) -> u64 {
        u64::from(self > other)
    }

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn choose<const N: usize>(bits: u64, first: [Self; N], second: [Self; N]) -> [Self; N] {
        if bits != 0 { first } else { second }
    }
}
