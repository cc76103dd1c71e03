//! Vectors of eight `f64`, for loops that the compiler does not vectorise by itself.
//!
//! [`Base`] is the definition. The other types perform the same operations in wider registers.

use super::numbers::Numbers;
use std::ops::{Add, Div, Mul, Sub};

/// Eight numbers.
pub trait Eight: Numbers {
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
mod wide {
    use super::{Eight, Numbers};
    use std::arch::x86_64::*;
    use std::ops::{Add, Div, Mul, Sub};

    /// Two registers of 256 bits.
    #[derive(Debug, Clone, Copy)]
    pub struct Avx2(pub __m256d, pub __m256d);

    /// A register of 512 bits.
    #[derive(Debug, Clone, Copy)]
    pub struct Avx512(pub __m512d);

    // SAFETY (all of both types): they are named only by the versions of a kernel that are compiled for these
    // instructions, and those are called only after `Level` found the instructions on the machine. Loads and
    // stores stay within an array of eight and need no alignment.
    operators! { Avx2:
        Add add(a, b) = {
            // SAFETY: see above.
            unsafe { Self(_mm256_add_pd(a.0, b.0), _mm256_add_pd(a.1, b.1)) }
        };
        Sub sub(a, b) = {
            // SAFETY: see above.
            unsafe { Self(_mm256_sub_pd(a.0, b.0), _mm256_sub_pd(a.1, b.1)) }
        };
        Mul mul(a, b) = {
            // SAFETY: see above.
            unsafe { Self(_mm256_mul_pd(a.0, b.0), _mm256_mul_pd(a.1, b.1)) }
        };
        Div div(a, b) = {
            // SAFETY: see above.
            unsafe { Self(_mm256_div_pd(a.0, b.0), _mm256_div_pd(a.1, b.1)) }
        };
    }

    impl Numbers for Avx2 {
        const ALL: u64 = 0xff;

        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm256_set1_pd(x), _mm256_set1_pd(x)) }
        }

        #[inline(always)]
        fn sqrt(self) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm256_sqrt_pd(self.0), _mm256_sqrt_pd(self.1)) }
        }

        #[inline(always)]
        fn abs(self) -> Self {
            // SAFETY: see above.
            unsafe {
                let sign = _mm256_set1_pd(-0.0);
                Self(
                    _mm256_andnot_pd(sign, self.0),
                    _mm256_andnot_pd(sign, self.1),
                )
            }
        }

        #[inline(always)]
        fn greater(self, other: Self) -> u64 {
            // SAFETY: see above.
            unsafe {
                let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(self.0, other.0));
                let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(self.1, other.1));
                (low | high << 4) as u64
            }
        }

        #[inline(always)]
        fn larger(self, other: Self) -> Self {
            // SAFETY: see above. The instruction returns its second operand unless the first is greater.
            unsafe {
                Self(
                    _mm256_max_pd(self.0, other.0),
                    _mm256_max_pd(self.1, other.1),
                )
            }
        }

        #[inline(always)]
        fn choose<const N: usize>(bits: u64, first: [Self; N], second: [Self; N]) -> [Self; N] {
            // SAFETY: see above.
            unsafe {
                let all = _mm256_set1_epi64x(bits as i64);
                let (low, high) = (
                    _mm256_setr_epi64x(1, 2, 4, 8),
                    _mm256_setr_epi64x(16, 32, 64, 128),
                );
                let mask =
                    |at| _mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_and_si256(all, at), at));
                let (low, high) = (mask(low), mask(high));
                let mut chosen = second;
                for (chosen, first) in chosen.iter_mut().zip(first) {
                    chosen.0 = _mm256_blendv_pd(chosen.0, first.0, low);
                    chosen.1 = _mm256_blendv_pd(chosen.1, first.1, high);
                }
                chosen
            }
        }
    }

    impl Eight for Avx2 {
        #[inline(always)]
        fn load(from: &[f64; 8]) -> Self {
            // SAFETY: see above.
            unsafe {
                let p = from.as_ptr();
                Self(_mm256_loadu_pd(p), _mm256_loadu_pd(p.add(4)))
            }
        }

        #[inline(always)]
        fn convert(from: &[i32; 8]) -> Self {
            // SAFETY: see above.
            unsafe {
                let p = from.as_ptr().cast::<__m128i>();
                let (low, high) = (_mm_loadu_si128(p), _mm_loadu_si128(p.add(1)));
                Self(_mm256_cvtepi32_pd(low), _mm256_cvtepi32_pd(high))
            }
        }

        #[inline(always)]
        fn store(self, to: &mut [f64; 8]) {
            // SAFETY: see above.
            unsafe {
                let p = to.as_mut_ptr();
                _mm256_storeu_pd(p, self.0);
                _mm256_storeu_pd(p.add(4), self.1);
            }
        }

        #[inline(always)]
        fn put(to: &mut [f64; 8], k: usize, x: f64) {
            let (half, k) = (k / 4 % 2, (k % 4) as i64);
            // SAFETY: see above; a half is four numbers.
            unsafe {
                let to = to.as_mut_ptr().add(4 * half);
                let places = _mm256_setr_epi64x(0, 1, 2, 3);
                let at = _mm256_cmpeq_epi64(places, _mm256_set1_epi64x(k));
                let put = _mm256_blendv_pd(
                    _mm256_loadu_pd(to),
                    _mm256_set1_pd(x),
                    _mm256_castsi256_pd(at),
                );
                _mm256_storeu_pd(to, put);
            }
        }

        #[inline(always)]
        fn largest(self) -> f64 {
            // SAFETY: see above.
            unsafe {
                let four = _mm256_max_pd(self.0, self.1);
                let (low, high) = (
                    _mm256_castpd256_pd128(four),
                    _mm256_extractf128_pd::<1>(four),
                );
                let two = _mm_max_pd(low, high);
                _mm_cvtsd_f64(_mm_max_sd(two, _mm_unpackhi_pd(two, two)))
            }
        }

        #[inline(always)]
        fn total(self) -> f64 {
            // SAFETY: see above.
            unsafe { total(_mm256_add_pd(self.0, self.1)) }
        }
    }

    /// The sum of four numbers: (a0 + a2) + (a1 + a3).
    #[inline(always)]
    fn total(four: __m256d) -> f64 {
        // SAFETY: see above.
        unsafe {
            let (low, high) = (
                _mm256_castpd256_pd128(four),
                _mm256_extractf128_pd::<1>(four),
            );
            let two = _mm_add_pd(low, high);
            _mm_cvtsd_f64(_mm_add_sd(two, _mm_unpackhi_pd(two, two)))
        }
    }

    operators! { Avx512:
        // SAFETY: see above.
        Add add(a, b) = unsafe { Self(_mm512_add_pd(a.0, b.0)) };
        // SAFETY: see above.
        Sub sub(a, b) = unsafe { Self(_mm512_sub_pd(a.0, b.0)) };
        // SAFETY: see above.
        Mul mul(a, b) = unsafe { Self(_mm512_mul_pd(a.0, b.0)) };
        // SAFETY: see above.
        Div div(a, b) = unsafe { Self(_mm512_div_pd(a.0, b.0)) };
    }

    impl Numbers for Avx512 {
        const ALL: u64 = 0xff;

        #[inline(always)]
        fn splat(x: f64) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm512_set1_pd(x)) }
        }

        #[inline(always)]
        fn sqrt(self) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm512_sqrt_pd(self.0)) }
        }

        #[inline(always)]
        fn abs(self) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm512_abs_pd(self.0)) }
        }

        #[inline(always)]
        fn greater(self, other: Self) -> u64 {
            // SAFETY: see above.
            unsafe { u64::from(_mm512_cmp_pd_mask::<_CMP_GT_OQ>(self.0, other.0)) }
        }

        #[inline(always)]
        fn larger(self, other: Self) -> Self {
            // SAFETY: see above. The instruction returns its second operand unless the first is greater.
            unsafe { Self(_mm512_max_pd(self.0, other.0)) }
        }

        #[inline(always)]
        fn choose<const N: usize>(bits: u64, first: [Self; N], second: [Self; N]) -> [Self; N] {
            // SAFETY: see above.
            unsafe {
                let mut chosen = second;
                for (chosen, first) in chosen.iter_mut().zip(first) {
                    chosen.0 = _mm512_mask_blend_pd(bits as u8, chosen.0, first.0);
                }
                chosen
            }
        }
    }

    impl Eight for Avx512 {
        #[inline(always)]
        fn load(from: &[f64; 8]) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm512_loadu_pd(from.as_ptr())) }
        }

        #[inline(always)]
        fn convert(from: &[i32; 8]) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm512_cvtepi32_pd(_mm256_loadu_si256(from.as_ptr().cast()))) }
        }

        #[inline(always)]
        fn store(self, to: &mut [f64; 8]) {
            // SAFETY: see above.
            unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
        }

        #[inline(always)]
        fn put(to: &mut [f64; 8], k: usize, x: f64) {
            // SAFETY: see above.
            unsafe {
                let at = 1u8 << (k % 8);
                let put = _mm512_mask_mov_pd(_mm512_loadu_pd(to.as_ptr()), at, _mm512_set1_pd(x));
                _mm512_storeu_pd(to.as_mut_ptr(), put);
            }
        }

        #[inline(always)]
        fn largest(self) -> f64 {
            // SAFETY: see above.
            unsafe { _mm512_reduce_max_pd(self.0) }
        }

        #[inline(always)]
        fn total(self) -> f64 {
            // SAFETY: see above.
            unsafe {
                let low = _mm512_castpd512_pd256(self.0);
                total(_mm256_add_pd(low, _mm512_extractf64x4_pd::<1>(self.0)))
            }
        }
    }
}
