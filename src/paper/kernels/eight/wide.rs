//! Vectors of eight `f64` in registers of 256 and 512 bits.

use super::{Eight, Numbers};
use crate::kernels::pair::Pair;
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

/// A register of 256 bits: four numbers.
#[derive(Debug, Clone, Copy)]
pub struct Four(pub __m256d);

/// Two registers of 256 bits.
pub type Avx2 = Pair<Four>;

/// A register of 512 bits.
#[derive(Debug, Clone, Copy)]
pub struct Avx512(pub __m512d);

// SAFETY (all of both types): they are named only by the versions of a kernel that are compiled for these
// instructions, and those are called only after `Level` found the instructions on the machine. Loads and
// stores stay within an array of eight and need no alignment.
operators! { Four:
    // SAFETY: see above.
    Add add(a, b) = unsafe { Self(_mm256_add_pd(a.0, b.0)) };
    // SAFETY: see above.
    Sub sub(a, b) = unsafe { Self(_mm256_sub_pd(a.0, b.0)) };
    // SAFETY: see above.
    Mul mul(a, b) = unsafe { Self(_mm256_mul_pd(a.0, b.0)) };
    // SAFETY: see above.
    Div div(a, b) = unsafe { Self(_mm256_div_pd(a.0, b.0)) };
}

impl Numbers for Four {
    const ALL: u64 = 0xf;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        // SAFETY: see above.
        unsafe { Self(_mm256_set1_pd(x)) }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see above.
        unsafe { Self(_mm256_sqrt_pd(self.0)) }
    }

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see above.
        unsafe { Self(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)) }
    }

    #[inline(always)]
    fn greater(self, other: Self) -> u64 {
        // SAFETY: see above.
        unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(self.0, other.0)) as u64 }
    }

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        // SAFETY: see above. The instruction returns its second operand unless the first is greater.
        unsafe { Self(_mm256_max_pd(self.0, other.0)) }
    }

    #[inline(always)]
    fn choose<const N: usize>(bits: u64, first: [Self; N], second: [Self; N]) -> [Self; N] {
        // SAFETY: see above.
        unsafe {
            let (all, at) = (
                _mm256_set1_epi64x(bits as i64),
                _mm256_setr_epi64x(1, 2, 4, 8),
            );
            let mask = _mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_and_si256(all, at), at));
            let mut chosen = second;
            for (chosen, first) in chosen.iter_mut().zip(first) {
                chosen.0 = _mm256_blendv_pd(chosen.0, first.0, mask);
            }
            chosen
        }
    }
}

impl Eight for Avx2 {
    type Part = Four;
    const PARTS: usize = 2;

    #[inline(always)]
    fn load_part(from: &[f64; 8], part: usize) -> Four {
        let half = &from.as_chunks::<4>().0[part];
        // SAFETY: see above; a part is four numbers.
        unsafe { Four(_mm256_loadu_pd(half.as_ptr())) }
    }

    #[inline(always)]
    fn of_parts(first: Four, last: Four) -> Self {
        Self(first, last)
    }

    #[inline(always)]
    fn load(from: &[f64; 8]) -> Self {
        // SAFETY: see above.
        unsafe {
            let p = from.as_ptr();
            Self(Four(_mm256_loadu_pd(p)), Four(_mm256_loadu_pd(p.add(4))))
        }
    }

    #[inline(always)]
    fn convert(from: &[i32; 8]) -> Self {
        // SAFETY: see above.
        unsafe {
            let p = from.as_ptr().cast::<__m128i>();
            let (low, high) = (_mm_loadu_si128(p), _mm_loadu_si128(p.add(1)));
            Self(
                Four(_mm256_cvtepi32_pd(low)),
                Four(_mm256_cvtepi32_pd(high)),
            )
        }
    }

    #[inline(always)]
    fn store(self, to: &mut [f64; 8]) {
        // SAFETY: see above.
        unsafe {
            let p = to.as_mut_ptr();
            _mm256_storeu_pd(p, self.0.0);
            _mm256_storeu_pd(p.add(4), self.1.0);
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
            let four = _mm256_max_pd(self.0.0, self.1.0);
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
        unsafe { total(_mm256_add_pd(self.0.0, self.1.0)) }
    }

    #[inline(always)]
    fn totals<const N: usize>(first: [Four; N], last: [Four; N]) -> [f64; N] {
        let mut totals = [0.0; N];
        let mut start = 0;
        while start < N {
            let mut some = [Four::splat(0.0); 4];
            for (to, (first, last)) in some.iter_mut().zip(first.iter().zip(&last).skip(start)) {
                *to = *first + *last;
            }
            for (to, total) in totals[start..].iter_mut().zip(totals_of_four(some)) {
                *to = total;
            }
            start += 4;
        }
        totals
    }
}

/// For each vector the sum of its numbers: (a0 + a2) + (a1 + a3).
#[inline(always)]
fn totals_of_four([a, b, c, d]: [Four; 4]) -> [f64; 4] {
    // The two halves of two vectors, side by side.
    #[inline(always)]
    fn halves(a: Four, b: Four) -> Four {
        // SAFETY: see above.
        unsafe {
            let low = _mm256_permute2f128_pd::<0x20>(a.0, b.0);
            let high = _mm256_permute2f128_pd::<0x31>(a.0, b.0);
            Four(_mm256_add_pd(low, high))
        }
    }
    let (even, odd) = (halves(a, c), halves(b, d));
    let mut totals = [0.0; 4];
    // SAFETY: see above.
    unsafe {
        let first = _mm256_unpacklo_pd(even.0, odd.0);
        let last = _mm256_unpackhi_pd(even.0, odd.0);
        _mm256_storeu_pd(totals.as_mut_ptr(), _mm256_add_pd(first, last));
    }
    totals
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
    one_part! {}

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

    #[inline(always)]
    fn totals<const N: usize>(first: [Self; N], _: [Self; N]) -> [f64; N] {
        let mut totals = [0.0; N];
        let mut start = 0;
        while start < N {
            let mut some = [Self::splat(0.0); 8];
            for (to, from) in some.iter_mut().zip(first.iter().skip(start)) {
                *to = *from;
            }
            for (to, total) in totals[start..].iter_mut().zip(totals_of_eight(some)) {
                *to = total;
            }
            start += 8;
        }
        totals
    }
}

/// For each vector the sum of its numbers, as [`Eight::total`]: in each step the halves of two vectors stand side
/// by side and are added.
#[inline(always)]
fn totals_of_eight(of: [Avx512; 8]) -> [f64; 8] {
    #[inline(always)]
    fn halves(a: Avx512, b: Avx512) -> Avx512 {
        // SAFETY: see above.
        unsafe {
            let low = _mm512_shuffle_f64x2::<0x44>(a.0, b.0);
            let high = _mm512_shuffle_f64x2::<0xee>(a.0, b.0);
            Avx512(_mm512_add_pd(low, high))
        }
    }
    #[inline(always)]
    fn quarters(a: Avx512, b: Avx512) -> Avx512 {
        // SAFETY: see above.
        unsafe {
            let low = _mm512_shuffle_f64x2::<0x88>(a.0, b.0);
            let high = _mm512_shuffle_f64x2::<0xdd>(a.0, b.0);
            Avx512(_mm512_add_pd(low, high))
        }
    }
    let even = quarters(halves(of[0], of[2]), halves(of[4], of[6]));
    let odd = quarters(halves(of[1], of[3]), halves(of[5], of[7]));
    let mut totals = [0.0; 8];
    // SAFETY: see above.
    unsafe {
        let first = _mm512_unpacklo_pd(even.0, odd.0);
        let last = _mm512_unpackhi_pd(even.0, odd.0);
        _mm512_storeu_pd(totals.as_mut_ptr(), _mm512_add_pd(first, last));
    }
    totals
}
