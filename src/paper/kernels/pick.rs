//! Selection of values within a limit from columns, for loops that the compiler does not vectorise by itself.
//!
//! [`Base`] is the definition. The other types do the same with an instruction or a table.

use super::eight::Base;
use super::kernel;

/// Values processed together; the length of a column to select from is a multiple of this.
pub const BLOCK: usize = 16;

/// Keys whose ranks are counted in registers; the length of a column of keys is a multiple of this.
pub const RANKED: usize = 8;

/// Short keys whose ranks are counted in registers.
pub const SHORT_RANKED: usize = 16;

/// The lowest `count` bits of a block; all bits if `count` is larger.
#[inline(always)]
pub fn first_bits(count: usize) -> u32 {
    (1u32 << count.min(BLOCK)) - 1
}

/// The operations on one block.
pub trait Pick {
    /// Bit `k` is set if value `k` is at most `limit`.
    fn within(numbers: &[f32; BLOCK], limit: f32) -> u32;

    /// Bit `k` is set if number `k` is `number`.
    fn equal(numbers: &[u32; BLOCK], number: u32) -> u32;

    /// Writes the values whose bits are set, in their order, to the front of `to`; the rest of `to` is
    /// undefined.
    fn pack(values: &[u32; BLOCK], bits: u32, to: &mut [u32; BLOCK]);

    /// For each key of a block, how many of `keys` are smaller.
    #[inline(always)]
    fn smaller(block: &[i64; RANKED], keys: &[i64]) -> [u32; RANKED] {
        let mut smaller = [0i64; RANKED];
        for other in keys {
            for (smaller, key) in smaller.iter_mut().zip(block) {
                // Adds the sign bit of the difference, which avoids a comparison: keys are not negative.
                *smaller += ((other - key) as u64 >> 63) as i64;
            }
        }
        smaller.map(|smaller| smaller as u32)
    }

    /// As [`Pick::smaller`], for short keys.
    #[inline(always)]
    fn short_smaller(block: &[i32; SHORT_RANKED], keys: &[i32]) -> [u32; SHORT_RANKED] {
        let mut smaller = [0; SHORT_RANKED];
        for other in keys {
            for (smaller, key) in smaller.iter_mut().zip(block) {
                *smaller += u32::from(other < key);
            }
        }
        smaller
    }

    /// As [`Pick::pack`], at place `at` of a column that has room for a block there.
    #[inline(always)]
    fn pack_at(values: &[u32; BLOCK], bits: u32, to: &mut [u32], at: usize) {
        if let Some(to) = to[at..].first_chunk_mut() {
            Self::pack(values, bits, to);
        }
    }
}

impl Pick for Base {
    #[inline(always)]
    fn within(numbers: &[f32; BLOCK], limit: f32) -> u32 {
        let bit = |bits, (k, x): (usize, &f32)| bits | u32::from(*x <= limit) << k;
        numbers.iter().enumerate().fold(0, bit)
    }

    #[inline(always)]
    fn equal(numbers: &[u32; BLOCK], number: u32) -> u32 {
        let bit = |bits, (k, n): (usize, &u32)| bits | u32::from(*n == number) << k;
        numbers.iter().enumerate().fold(0, bit)
    }

    #[inline(always)]
    fn pack(values: &[u32; BLOCK], mut bits: u32, to: &mut [u32; BLOCK]) {
        for to in to {
            if bits == 0 {
                break;
            }
            *to = values[bits.trailing_zeros() as usize % BLOCK];
            bits &= bits - 1;
        }
    }
}

/// Selects from columns the values at the places where `numbers` are at most `limit`, in their order, and
/// returns how many there are. Numbers after the last whole block are ignored. Each `to` has room for all
/// values and one block.
#[inline(always)]
pub fn pick_body<P: Pick, const N: usize>(
    numbers: &[f32],
    limit: f32,
    from: [&[u32]; N],
    mut to: [&mut [u32]; N],
) -> usize {
    let from = from.map(|column| column.as_chunks::<BLOCK>().0);
    let mut count = 0;
    for (block, numbers) in numbers.as_chunks::<BLOCK>().0.iter().enumerate() {
        let bits = P::within(numbers, limit);
        for (from, to) in from.iter().zip(&mut to) {
            P::pack_at(&from[block], bits, to, count);
        }
        count += bits.count_ones() as usize;
    }
    count
}

kernel! {
    /// Selects from a column the values at the places where `numbers` are at most `limit`, in their order,
    /// and returns how many there are. Numbers after the last whole block of 16 are ignored. `to` has room
    /// for all values and 16 more.
    pub fn pick_column(numbers: &[f32], limit: f32, from: &[u32], to: &mut [u32]) -> usize = pick_one_body<Eight>
}

#[inline(always)]
fn pick_one_body<P: Pick>(numbers: &[f32], limit: f32, from: &[u32], to: &mut [u32]) -> usize {
    pick_body::<P, 1>(numbers, limit, [from], [to])
}

#[cfg(target_arch = "x86_64")]
#[allow(
    unsafe_code,
    reason = "instructions that were looked for; unaligned loads and stores"
)]
mod wide {
    use super::{BLOCK, Pick, RANKED, SHORT_RANKED};
    use crate::kernels::eight::{Avx2, Avx512};
    use std::arch::x86_64::*;

    /// For each pattern of eight bits, the indices of the set bits.
    static PLACES: [[u32; 8]; 256] = places();

    const fn places() -> [[u32; 8]; 256] {
        let mut all = [[0; 8]; 256];
        let mut bits = 0;
        while bits < 256 {
            let (mut count, mut k) = (0, 0);
            while k < 8 {
                if bits >> k & 1 == 1 {
                    all[bits][count] = k as u32;
                    count += 1;
                }
                k += 1;
            }
            bits += 1;
        }
        all
    }

    // SAFETY (all of both types): they are named only by the versions of a kernel that are compiled for these
    // instructions, and those are called only after `Level` found the instructions on the machine. Loads and
    // stores stay within an array of sixteen and need no alignment.
    impl Pick for Avx2 {
        #[inline(always)]
        fn within(numbers: &[f32; BLOCK], limit: f32) -> u32 {
            // SAFETY: see above.
            unsafe {
                let (p, limit) = (numbers.as_ptr(), _mm256_set1_ps(limit));
                let low = _mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_loadu_ps(p), limit);
                let high = _mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_loadu_ps(p.add(8)), limit);
                (_mm256_movemask_ps(low) | _mm256_movemask_ps(high) << 8) as u32
            }
        }

        #[inline(always)]
        fn equal(numbers: &[u32; BLOCK], number: u32) -> u32 {
            // SAFETY: see above.
            unsafe {
                let p = numbers.as_ptr().cast::<__m256i>();
                let number = _mm256_set1_epi32(number.cast_signed());
                let bits = |half: __m256i| {
                    let equal = _mm256_cmpeq_epi32(half, number);
                    _mm256_movemask_ps(_mm256_castsi256_ps(equal)).cast_unsigned()
                };
                bits(_mm256_loadu_si256(p)) | bits(_mm256_loadu_si256(p.add(1))) << 8
            }
        }

        #[inline(always)]
        fn pack(values: &[u32; BLOCK], bits: u32, to: &mut [u32; BLOCK]) {
            let (low, high) = (bits as usize & 0xff, bits as usize >> 8 & 0xff);
            // SAFETY: see above; the second store begins at most eight places after the first.
            unsafe {
                let (p, to) = (values.as_ptr().cast::<__m256i>(), to.as_mut_ptr());
                let packed = |half: usize, bits: usize| {
                    let places = _mm256_loadu_si256(PLACES[bits].as_ptr().cast());
                    _mm256_permutevar8x32_epi32(_mm256_loadu_si256(p.add(half)), places)
                };
                _mm256_storeu_si256(to.cast(), packed(0, low));
                let behind = to.add(low.count_ones() as usize);
                _mm256_storeu_si256(behind.cast(), packed(1, high));
            }
        }

        #[inline(always)]
        fn smaller(block: &[i64; RANKED], keys: &[i64]) -> [u32; RANKED] {
            // SAFETY: see above.
            unsafe {
                let p = block.as_ptr().cast::<__m256i>();
                let (low, high) = (_mm256_loadu_si256(p), _mm256_loadu_si256(p.add(1)));
                let (mut below, mut above) = (_mm256_setzero_si256(), _mm256_setzero_si256());
                for other in keys {
                    // True is -1.
                    let other = _mm256_set1_epi64x(*other);
                    below = _mm256_sub_epi64(below, _mm256_cmpgt_epi64(low, other));
                    above = _mm256_sub_epi64(above, _mm256_cmpgt_epi64(high, other));
                }
                let mut out = [0i64; RANKED];
                let to = out.as_mut_ptr().cast::<__m256i>();
                _mm256_storeu_si256(to, below);
                _mm256_storeu_si256(to.add(1), above);
                out.map(|count| count as u32)
            }
        }

        #[inline(always)]
        fn short_smaller(block: &[i32; SHORT_RANKED], keys: &[i32]) -> [u32; SHORT_RANKED] {
            // SAFETY: see above.
            unsafe {
                let p = block.as_ptr().cast::<__m256i>();
                let (low, high) = (_mm256_loadu_si256(p), _mm256_loadu_si256(p.add(1)));
                let (mut below, mut above) = (_mm256_setzero_si256(), _mm256_setzero_si256());
                for other in keys {
                    // True is -1.
                    let other = _mm256_set1_epi32(*other);
                    below = _mm256_sub_epi32(below, _mm256_cmpgt_epi32(low, other));
                    above = _mm256_sub_epi32(above, _mm256_cmpgt_epi32(high, other));
                }
                let mut out = [0; SHORT_RANKED];
                let to = out.as_mut_ptr().cast::<__m256i>();
                _mm256_storeu_si256(to, below);
                _mm256_storeu_si256(to.add(1), above);
                out
            }
        }
    }

    impl Pick for Avx512 {
        #[inline(always)]
        fn within(numbers: &[f32; BLOCK], limit: f32) -> u32 {
            // SAFETY: see above.
            unsafe {
                let numbers = _mm512_loadu_ps(numbers.as_ptr());
                let limit = _mm512_set1_ps(limit);
                u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(numbers, limit))
            }
        }

        #[inline(always)]
        fn equal(numbers: &[u32; BLOCK], number: u32) -> u32 {
            // SAFETY: see above.
            unsafe {
                let numbers = _mm512_loadu_si512(numbers.as_ptr().cast());
                let number = _mm512_set1_epi32(number.cast_signed());
                u32::from(_mm512_cmpeq_epi32_mask(numbers, number))
            }
        }

        #[inline(always)]
        fn pack(values: &[u32; BLOCK], bits: u32, to: &mut [u32; BLOCK]) {
            // SAFETY: see above. Packing in a register and storing all of it is faster than packing into
            // memory.
            unsafe {
                let values = _mm512_loadu_si512(values.as_ptr().cast());
                let packed = _mm512_maskz_compress_epi32(bits as u16, values);
                _mm512_storeu_si512(to.as_mut_ptr().cast(), packed);
            }
        }

        #[inline(always)]
        fn smaller(block: &[i64; RANKED], keys: &[i64]) -> [u32; RANKED] {
            // SAFETY: see above. Two sums, so that an addition need not wait for the one before.
            unsafe {
                let (block, one) = (
                    _mm512_loadu_si512(block.as_ptr().cast()),
                    _mm512_set1_epi64(1),
                );
                let mut sums = [_mm512_setzero_si512(); 2];
                let (pairs, last) = keys.as_chunks::<2>();
                for others in pairs {
                    for (sum, other) in sums.iter_mut().zip(others) {
                        let is = _mm512_cmplt_epi64_mask(_mm512_set1_epi64(*other), block);
                        *sum = _mm512_mask_add_epi64(*sum, is, *sum, one);
                    }
                }
                for other in last {
                    let is = _mm512_cmplt_epi64_mask(_mm512_set1_epi64(*other), block);
                    sums[0] = _mm512_mask_add_epi64(sums[0], is, sums[0], one);
                }
                let sum = _mm512_cvtepi64_epi32(_mm512_add_epi64(sums[0], sums[1]));
                let mut out = [0; RANKED];
                _mm256_storeu_si256(out.as_mut_ptr().cast(), sum);
                out
            }
        }

        #[inline(always)]
        fn short_smaller(block: &[i32; SHORT_RANKED], keys: &[i32]) -> [u32; SHORT_RANKED] {
            // SAFETY: see above.
            unsafe {
                let (block, one) = (
                    _mm512_loadu_si512(block.as_ptr().cast()),
                    _mm512_set1_epi32(1),
                );
                let mut sums = [_mm512_setzero_si512(); 2];
                let (pairs, last) = keys.as_chunks::<2>();
                for others in pairs {
                    for (sum, other) in sums.iter_mut().zip(others) {
                        let is = _mm512_cmplt_epi32_mask(_mm512_set1_epi32(*other), block);
                        *sum = _mm512_mask_add_epi32(*sum, is, *sum, one);
                    }
                }
                for other in last {
                    let is = _mm512_cmplt_epi32_mask(_mm512_set1_epi32(*other), block);
                    sums[0] = _mm512_mask_add_epi32(sums[0], is, sums[0], one);
                }
                let mut out = [0; SHORT_RANKED];
                let sum = _mm512_add_epi32(sums[0], sums[1]);
                _mm512_storeu_si512(out.as_mut_ptr().cast(), sum);
                out
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_level_picks_the_same(
            mut numbers in prop::collection::vec(0.0f32..100.0, 0..200),
            limit in 0.0f32..110.0,
        ) {
            numbers.extend([f32::INFINITY, f32::NAN, limit]);
            numbers.resize(numbers.len().next_multiple_of(BLOCK), f32::INFINITY);
            let from: Vec<u32> = (0..numbers.len() as u32).map(|n| n.wrapping_mul(77)).collect();
            let within = |&n: &usize| numbers[n] <= limit;
            let expected: Vec<u32> = (0..numbers.len()).filter(within).map(|n| from[n]).collect();
            for level in Level::all() {
                let mut to = vec![0; numbers.len() + BLOCK];
                let count = pick_column(level, &numbers, limit, &from, &mut to);
                prop_assert_eq!(&to[..count], &expected[..]);
            }
        }
    }
}
