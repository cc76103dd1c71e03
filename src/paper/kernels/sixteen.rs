//! Vectors of sixteen `f32`, for loops that the compiler does not keep in registers by itself.
//!
//! [`Base`] is the definition. The other types perform the same operations in wider registers.

use super::eight::Base;

/// Numbers, operations on sixteen of them, and choices between sixteen integers.
pub trait Sixteen: Sized {
    /// Sixteen numbers.
    type Floats: Copy;
    /// Sixteen integers.
    type Integers: Copy;
    /// Sixteen conditions.
    type Mask: Copy;
    /// Loads from memory.
    fn floats(from: &[f32; 16]) -> Self::Floats;
    /// Stores to memory.
    fn store_floats(x: Self::Floats, to: &mut [f32; 16]);
    /// Two vectors of eight, rounded.
    fn rounded(low: Self, high: Self) -> Self::Floats;
    /// Stores rows as columns.
    #[inline(always)]
    fn store_turned(rows: &[[f32; 16]; 16], columns: &mut [[f32; 16]; 16]) {
        for (place, row) in rows.iter().enumerate() {
            for (x, column) in row.iter().zip(&mut *columns) {
                column[place] = *x;
            }
        }
    }
    /// All integers equal to `x`.
    fn integer(x: u32) -> Self::Integers;
    /// Stores to memory.
    fn store_integers(x: Self::Integers, to: &mut [u32; 16]);
    /// Differences.
    fn minus(a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Products.
    fn times(a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Quotients.
    fn over(a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// True where `a` is less than `b`.
    fn less(a: Self::Floats, b: Self::Floats) -> Self::Mask;
    /// For each pair the first number where the mask is true, else the second.
    fn choose(mask: Self::Mask, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// The same for integers.
    fn choose_integers(mask: Self::Mask, a: Self::Integers, b: Self::Integers) -> Self::Integers;
}

impl Sixteen for Base {
    type Floats = [f32; 16];
    type Integers = [u32; 16];
    type Mask = [bool; 16];

    #[inline(always)]
    fn floats(from: &[f32; 16]) -> [f32; 16] {
        *from
    }

    #[inline(always)]
    fn store_floats(x: [f32; 16], to: &mut [f32; 16]) {
        *to = x;
    }

    #[inline(always)]
    fn rounded(low: Self, high: Self) -> [f32; 16] {
        std::array::from_fn(|k| if k < 8 { low.0[k] } else { high.0[k - 8] } as f32)
    }

    #[inline(always)]
    fn integer(x: u32) -> [u32; 16] {
        [x; 16]
    }

    #[inline(always)]
    fn store_integers(x: [u32; 16], to: &mut [u32; 16]) {
        *to = x;
    }

    #[inline(always)]
    fn minus(a: [f32; 16], b: [f32; 16]) -> [f32; 16] {
        std::array::from_fn(|k| a[k] - b[k])
    }

    #[inline(always)]
    fn times(a: [f32; 16], b: [f32; 16]) -> [f32; 16] {
        std::array::from_fn(|k| a[k] * b[k])
    }

    #[inline(always)]
    fn over(a: [f32; 16], b: [f32; 16]) -> [f32; 16] {
        std::array::from_fn(|k| a[k] / b[k])
    }

    #[inline(always)]
    fn less(a: [f32; 16], b: [f32; 16]) -> [bool; 16] {
        std::array::from_fn(|k| a[k] < b[k])
    }

    #[inline(always)]
    fn choose(mask: [bool; 16], a: [f32; 16], b: [f32; 16]) -> [f32; 16] {
        std::array::from_fn(|k| if mask[k] { a[k] } else { b[k] })
    }

    #[inline(always)]
    fn choose_integers(mask: [bool; 16], a: [u32; 16], b: [u32; 16]) -> [u32; 16] {
        std::array::from_fn(|k| if mask[k] { a[k] } else { b[k] })
    }
}

#[cfg(target_arch = "x86_64")]
#[allow(
    unsafe_code,
    reason = "instructions that were looked for; unaligned loads and stores"
)]
mod wide {
    use super::Sixteen;
    use crate::kernels::eight::{Avx2, Avx512};
    use std::arch::x86_64::*;

    // SAFETY (all of both types): they are named only by the versions of a kernel that are compiled for these
    // instructions, and those are called only after `Level` found the instructions on the machine. Loads and
    // stores stay within an array of sixteen and need no alignment.
    impl Sixteen for Avx2 {
        type Floats = [__m256; 2];
        type Integers = [__m256i; 2];
        type Mask = [__m256; 2];

        #[inline(always)]
        fn floats(from: &[f32; 16]) -> [__m256; 2] {
            // SAFETY: see above.
            unsafe {
                let p = from.as_ptr();
                [_mm256_loadu_ps(p), _mm256_loadu_ps(p.add(8))]
            }
        }

        #[inline(always)]
        fn store_floats(x: [__m256; 2], to: &mut [f32; 16]) {
            // SAFETY: see above.
            unsafe {
                let p = to.as_mut_ptr();
                _mm256_storeu_ps(p, x[0]);
                _mm256_storeu_ps(p.add(8), x[1]);
            }
        }

        #[inline(always)]
        fn rounded(low: Self, high: Self) -> [__m256; 2] {
            // SAFETY: see above.
            unsafe {
                let round =
                    |x: Self| _mm256_set_m128(_mm256_cvtpd_ps(x.1.0), _mm256_cvtpd_ps(x.0.0));
                [round(low), round(high)]
            }
        }

        #[inline(always)]
        fn integer(x: u32) -> [__m256i; 2] {
            // SAFETY: see above.
            unsafe { [_mm256_set1_epi32(x as i32); 2] }
        }

        #[inline(always)]
        fn store_integers(x: [__m256i; 2], to: &mut [u32; 16]) {
            // SAFETY: see above.
            unsafe {
                let p = to.as_mut_ptr().cast::<__m256i>();
                _mm256_storeu_si256(p, x[0]);
                _mm256_storeu_si256(p.add(1), x[1]);
            }
        }

        #[inline(always)]
        fn minus(a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            // SAFETY: see above.
            unsafe { [_mm256_sub_ps(a[0], b[0]), _mm256_sub_ps(a[1], b[1])] }
        }

        #[inline(always)]
        fn times(a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            // SAFETY: see above.
            unsafe { [_mm256_mul_ps(a[0], b[0]), _mm256_mul_ps(a[1], b[1])] }
        }

        #[inline(always)]
        fn over(a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            // SAFETY: see above.
            unsafe { [_mm256_div_ps(a[0], b[0]), _mm256_div_ps(a[1], b[1])] }
        }

        #[inline(always)]
        fn less(a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            // SAFETY: see above.
            unsafe {
                let low = _mm256_cmp_ps::<_CMP_LT_OQ>(a[0], b[0]);
                [low, _mm256_cmp_ps::<_CMP_LT_OQ>(a[1], b[1])]
            }
        }

        #[inline(always)]
        fn choose(mask: [__m256; 2], a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
            // SAFETY: see above.
            unsafe {
                let low = _mm256_blendv_ps(b[0], a[0], mask[0]);
                [low, _mm256_blendv_ps(b[1], a[1], mask[1])]
            }
        }

        #[inline(always)]
        fn choose_integers(mask: [__m256; 2], a: [__m256i; 2], b: [__m256i; 2]) -> [__m256i; 2] {
            // SAFETY: see above. A true mask has all bits set.
            unsafe {
                [
                    _mm256_blendv_epi8(b[0], a[0], _mm256_castps_si256(mask[0])),
                    _mm256_blendv_epi8(b[1], a[1], _mm256_castps_si256(mask[1])),
                ]
            }
        }
    }

    impl Sixteen for Avx512 {
        type Floats = __m512;
        type Integers = __m512i;
        type Mask = __mmask16;

        #[inline(always)]
        fn floats(from: &[f32; 16]) -> __m512 {
            // SAFETY: see above.
            unsafe { _mm512_loadu_ps(from.as_ptr()) }
        }

        #[inline(always)]
        fn store_floats(x: __m512, to: &mut [f32; 16]) {
            // SAFETY: see above.
            unsafe { _mm512_storeu_ps(to.as_mut_ptr(), x) }
        }

        #[inline(always)]
        fn rounded(low: Self, high: Self) -> __m512 {
            // SAFETY: see above.
            unsafe {
                let low = _mm512_castps256_ps512(_mm512_cvtpd_ps(low.0));
                _mm512_insertf32x8::<1>(low, _mm512_cvtpd_ps(high.0))
            }
        }

        #[inline(always)]
        fn store_turned(rows: &[[f32; 16]; 16], columns: &mut [[f32; 16]; 16]) {
            // SAFETY: see above. Pairs of rows, then of pairs, then of quarters of registers.
            unsafe {
                let mut fours = [_mm512_setzero_ps(); 16];
                for k in 0..4 {
                    let (a, b) = (Self::floats(&rows[4 * k]), Self::floats(&rows[4 * k + 1]));
                    let (c, d) = (
                        Self::floats(&rows[4 * k + 2]),
                        Self::floats(&rows[4 * k + 3]),
                    );
                    let pairs = [
                        _mm512_castps_pd(_mm512_unpacklo_ps(a, b)),
                        _mm512_castps_pd(_mm512_unpackhi_ps(a, b)),
                        _mm512_castps_pd(_mm512_unpacklo_ps(c, d)),
                        _mm512_castps_pd(_mm512_unpackhi_ps(c, d)),
                    ];
                    fours[4 * k] = _mm512_castpd_ps(_mm512_unpacklo_pd(pairs[0], pairs[2]));
                    fours[4 * k + 1] = _mm512_castpd_ps(_mm512_unpackhi_pd(pairs[0], pairs[2]));
                    fours[4 * k + 2] = _mm512_castpd_ps(_mm512_unpacklo_pd(pairs[1], pairs[3]));
                    fours[4 * k + 3] = _mm512_castpd_ps(_mm512_unpackhi_pd(pairs[1], pairs[3]));
                }
                for n in 0..4 {
                    let (a, b, c, d) = (fours[n], fours[n + 4], fours[n + 8], fours[n + 12]);
                    let even = _mm512_shuffle_f32x4::<0x88>(a, b);
                    let odd = _mm512_shuffle_f32x4::<0xdd>(a, b);
                    let even_high = _mm512_shuffle_f32x4::<0x88>(c, d);
                    let odd_high = _mm512_shuffle_f32x4::<0xdd>(c, d);
                    let (first, third) = (
                        _mm512_shuffle_f32x4::<0x88>(even, even_high),
                        _mm512_shuffle_f32x4::<0xdd>(even, even_high),
                    );
                    let (second, fourth) = (
                        _mm512_shuffle_f32x4::<0x88>(odd, odd_high),
                        _mm512_shuffle_f32x4::<0xdd>(odd, odd_high),
                    );
                    Self::store_floats(first, &mut columns[n]);
                    Self::store_floats(second, &mut columns[n + 4]);
                    Self::store_floats(third, &mut columns[n + 8]);
                    Self::store_floats(fourth, &mut columns[n + 12]);
                }
            }
        }

        #[inline(always)]
        fn integer(x: u32) -> __m512i {
            // SAFETY: see above.
            unsafe { _mm512_set1_epi32(x as i32) }
        }

        #[inline(always)]
        fn store_integers(x: __m512i, to: &mut [u32; 16]) {
            // SAFETY: see above.
            unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), x) }
        }

        #[inline(always)]
        fn minus(a: __m512, b: __m512) -> __m512 {
            // SAFETY: see above.
            unsafe { _mm512_sub_ps(a, b) }
        }

        #[inline(always)]
        fn times(a: __m512, b: __m512) -> __m512 {
            // SAFETY: see above.
            unsafe { _mm512_mul_ps(a, b) }
        }

        #[inline(always)]
        fn over(a: __m512, b: __m512) -> __m512 {
            // SAFETY: see above.
            unsafe { _mm512_div_ps(a, b) }
        }

        #[inline(always)]
        fn less(a: __m512, b: __m512) -> __mmask16 {
            // SAFETY: see above.
            unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b) }
        }

        #[inline(always)]
        fn choose(mask: __mmask16, a: __m512, b: __m512) -> __m512 {
            // SAFETY: see above.
            unsafe { _mm512_mask_blend_ps(mask, b, a) }
        }

        #[inline(always)]
        fn choose_integers(mask: __mmask16, a: __m512i, b: __m512i) -> __m512i {
            // SAFETY: see above.
            unsafe { _mm512_mask_blend_epi32(mask, b, a) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::{Level, kernel};

    kernel! {
        fn turned(rows: &[[f32; 16]; 16], columns: &mut [[f32; 16]; 16]) = turned_body<Eight>
    }

    fn turned_body<S: Sixteen>(rows: &[[f32; 16]; 16], columns: &mut [[f32; 16]; 16]) {
        S::store_turned(rows, columns);
    }

    #[test]
    fn every_level_turns_rows_into_columns() {
        let rows = std::array::from_fn(|k| std::array::from_fn(|n| (16 * k + n) as f32));
        for level in Level::all() {
            let mut columns = [[0.0; 16]; 16];
            turned(level, &rows, &mut columns);
            for (k, row) in rows.iter().enumerate() {
                let column = columns.map(|column| column[k]);
                assert_eq!(&column, row);
            }
        }
    }
}
