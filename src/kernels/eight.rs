//! Eight `f64` at a time: what the compiler does not widen by itself.
//!
//! [`Base`] is the definition. The others do the same operations in wider registers.

/// Eight numbers; every operation is that of each number by itself.
pub(crate) trait Eight: Copy {
    /// From memory.
    fn load(from: &[f64; 8]) -> Self;
    /// From integers, exactly.
    fn convert(from: &[i32; 8]) -> Self;
    /// One number eight times.
    fn splat(x: f64) -> Self;
    /// To memory.
    fn store(self, to: &mut [f64; 8]);
    /// Sums.
    fn add(self, other: Self) -> Self;
    /// Differences.
    fn sub(self, other: Self) -> Self;
    /// Products.
    fn mul(self, other: Self) -> Self;
    /// Absolute values.
    fn abs(self) -> Self;
    /// Bit `k` is set if number `k` is greater than the other one (false for NaN).
    fn greater(self, other: Self) -> u64;
    /// Of each pair the first if it is greater, else the second.
    fn larger(self, other: Self) -> Self;
}

/// The definition.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Base([f64; 8]);

impl Base {
    #[inline(always)]
    fn zip(self, other: Self, op: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|k| op(self.0[k], other.0[k])))
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
    fn splat(x: f64) -> Self {
        Self([x; 8])
    }

    #[inline(always)]
    fn store(self, to: &mut [f64; 8]) {
        *to = self.0;
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
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
}

#[cfg(target_arch = "x86_64")]
pub(crate) use wide::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
#[allow(
    unsafe_code,
    reason = "instructions that were looked for; unaligned loads and stores"
)]
mod wide {
    use super::Eight;
    use std::arch::x86_64::*;

    /// Two registers of 256 bits.
    #[derive(Debug, Clone, Copy)]
    pub(crate) struct Avx2(__m256d, __m256d);

    /// A register of 512 bits.
    #[derive(Debug, Clone, Copy)]
    pub(crate) struct Avx512(__m512d);

    // SAFETY (all of both): the types are named only by the versions of a kernel that are compiled for
    // these instructions, and those are called only after `Level` found them on the machine. Loads
    // and stores are within an array of eight and need no alignment.
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
        fn splat(x: f64) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm256_set1_pd(x), _mm256_set1_pd(x)) }
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
        fn add(self, other: Self) -> Self {
            // SAFETY: see above.
            unsafe {
                Self(
                    _mm256_add_pd(self.0, other.0),
                    _mm256_add_pd(self.1, other.1),
                )
            }
        }

        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            // SAFETY: see above.
            unsafe {
                Self(
                    _mm256_sub_pd(self.0, other.0),
                    _mm256_sub_pd(self.1, other.1),
                )
            }
        }

        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            // SAFETY: see above.
            unsafe {
                Self(
                    _mm256_mul_pd(self.0, other.0),
                    _mm256_mul_pd(self.1, other.1),
                )
            }
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
            // SAFETY: see above. The instruction gives its second operand unless the first is greater.
            unsafe {
                Self(
                    _mm256_max_pd(self.0, other.0),
                    _mm256_max_pd(self.1, other.1),
                )
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
        fn splat(x: f64) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm512_set1_pd(x)) }
        }

        #[inline(always)]
        fn store(self, to: &mut [f64; 8]) {
            // SAFETY: see above.
            unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
        }

        #[inline(always)]
        fn add(self, other: Self) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm512_add_pd(self.0, other.0)) }
        }

        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm512_sub_pd(self.0, other.0)) }
        }

        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            // SAFETY: see above.
            unsafe { Self(_mm512_mul_pd(self.0, other.0)) }
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
            // SAFETY: see above. The instruction gives its second operand unless the first is greater.
            unsafe { Self(_mm512_max_pd(self.0, other.0)) }
        }
    }
}
