//! Two vectors as one, so that their chains of operations run side by side.

use super::numbers::Numbers;
use std::ops::{Add, Div, Mul, Sub};

/// Twice as many numbers, for operations that would wait for one another.
#[derive(Debug, Clone, Copy)]
pub struct Pair<F>(pub F, pub F);

impl<F: Numbers> Numbers for Pair<F> {
    const ALL: u64 = F::ALL << Self::HALF | F::ALL;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(F::splat(x), F::splat(x))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }

    #[inline(always)]
    fn greater(self, other: Self) -> u64 {
        self.0.greater(other.0) | self.1.greater(other.1) << Self::HALF
    }

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self(self.0.larger(other.0), self.1.larger(other.1))
    }

    #[inline(always)]
    fn choose<const N: usize>(bits: u64, first: [Self; N], second: [Self; N]) -> [Self; N] {
        let mut chosen = second;
        for (chosen, first) in chosen.iter_mut().zip(first) {
            [chosen.0] = F::choose(bits & F::ALL, [first.0], [chosen.0]);
            [chosen.1] = F::choose(bits >> Self::HALF, [first.1], [chosen.1]);
        }
        chosen
    }
}

impl<F: Numbers> Pair<F> {
    /// Numbers in one of the two.
    const HALF: u32 = F::ALL.count_ones();
}

/// Implements the operators of a [`Pair`].
macro_rules! pair {
    ($($trait:ident $name:ident;)*) => {
        $(impl<F: Numbers> $trait for Pair<F> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(self.0.$name(other.0), self.1.$name(other.1))
            }
        })*
    };
}

pair! { Add add; Sub sub; Mul mul; Div div; }
