//! Numbers in as few bits as the largest takes: a block of 256 in 32 rows of eight lanes.
//!
//! Each lane is a string of bits: its numbers, one row after the other, lowest bits first. A *word* has 32 bits
//! of every lane, so a block of numbers of `b` bits has `b` words (the layout of Lemire and Boytsov, *Decoding
//! billions of integers per second through vectorization*, Software: Practice and Experience 45, 2015).

/// Lanes of a row.
const LANES: usize = 8;

/// Numbers in a block.
pub(super) const BLOCK: usize = 32 * LANES;

/// Bytes of a word.
const WORD: usize = 4 * LANES;

type Row = [u32; LANES];

/// Bytes of a block of numbers of `bits` bits.
pub(super) fn size(bits: u8) -> usize {
    usize::from(bits) * WORD
}

/// Writes a block of numbers below `2^bits` to `to`, which has its [`size`].
pub(super) fn pack(numbers: &[u32; BLOCK], bits: u8, to: &mut [u8]) {
    let bits = u32::from(bits);
    let mut words = to.chunks_exact_mut(WORD);
    let (mut word, mut full) = ([0; LANES], 0);
    for row in numbers.as_chunks::<LANES>().0 {
        word = each(|lane| word[lane] | row[lane] << full);
        full += bits;
        if full < u32::BITS {
            continue;
        }
        if let Some(to) = words.next() {
            store(&word, to);
        }
        full -= u32::BITS;
        // The high bits of the row that the word had no room for: none if it is exactly full.
        word = each(|lane| row[lane].checked_shr(bits - full).unwrap_or(0));
    }
}

/// Reads the numbers that [`pack`] wrote to `from`.
pub(super) fn unpack(from: &[u8], bits: u8, numbers: &mut [u32; BLOCK]) {
    let bits = u32::from(bits);
    let mask = u32::MAX.checked_shr(u32::BITS - bits).unwrap_or(0);
    let mut words = from.chunks_exact(WORD);
    let mut next = || words.next().map_or([0; LANES], load);
    let (mut word, mut left) = ([0; LANES], 0);
    for row in numbers.as_chunks_mut::<LANES>().0 {
        if left >= bits {
            *row = each(|lane| word[lane] & mask);
            word = each(|lane| word[lane].checked_shr(bits).unwrap_or(0));
            left -= bits;
        } else {
            let low = word;
            word = next();
            *row = each(|lane| (low[lane] | word[lane] << left) & mask);
            // `bits - left` of the word are taken.
            word = each(|lane| word[lane].checked_shr(bits - left).unwrap_or(0));
            left += u32::BITS - bits;
        }
    }
}

#[inline(always)]
fn each(of: impl FnMut(usize) -> u32) -> Row {
    std::array::from_fn(of)
}

#[inline(always)]
fn load(bytes: &[u8]) -> Row {
    let (numbers, _) = bytes.as_chunks::<4>();
    each(|lane| u32::from_le_bytes(numbers[lane]))
}

#[inline(always)]
fn store(row: &Row, to: &mut [u8]) {
    let (numbers, _) = to.as_chunks_mut::<4>();
    for (to, number) in numbers.iter_mut().zip(row) {
        *to = number.to_le_bytes();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_come_back_and_lie_where_the_layout_says(
            numbers in prop::collection::vec(any::<u32>(), BLOCK),
            bits in 0u8..=32,
        ) {
            let mask = ((1u64 << bits) - 1) as u32;
            let numbers: Vec<u32> = numbers.iter().map(|n| n & mask).collect();
            let numbers: [u32; BLOCK] = numbers.try_into().unwrap();
            let mut bytes = vec![0; size(bits)];
            pack(&numbers, bits, &mut bytes);
            let mut back = [7; BLOCK];
            unpack(&bytes, bits, &mut back);
            prop_assert_eq!(back, numbers);
            for (place, number) in numbers.iter().enumerate() {
                for bit in 0..usize::from(bits) {
                    let at = place / LANES * usize::from(bits) + bit;
                    let byte = bytes[at / 32 * WORD + place % LANES * 4 + at % 32 / 8];
                    prop_assert_eq!(byte >> (at % 8) & 1, (number >> bit & 1) as u8);
                }
            }
        }
    }
}
