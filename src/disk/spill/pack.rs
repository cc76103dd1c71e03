//! Packing of rows: each word is stored as a difference, without the difference's leading zero bytes.
//!
//! Packed rows are frames of up to [`FRAME`] rows. A frame begins with two bits for each word, 32 words to a
//! little-endian `u64`: the word's difference takes 0, 1, 2 or 4 bytes. The differences follow in the same
//! order. After the last frame come [`PADDING`] zeros, so that four bytes can always be read.

use super::row::{Row, Word};
use std::marker::PhantomData;

/// Rows in a frame.
const FRAME: usize = 512;
/// Zeros at the end.
const PADDING: usize = 4;
/// For each value of the two bits: the bytes of a difference, and the mask for the four bytes read.
const LENGTH: [usize; 4] = [0, 1, 2, 4];
const MASK: [u32; 4] = [0, 0xff, 0xffff, u32::MAX];

/// The packing of a word as masks, so that packing takes no branch.
#[derive(Clone, Copy)]
struct Masks {
    above: u32,
    left: u32,
    /// 1 if differences have both signs: the sign is then moved to the lowest bit.
    signed: u32,
}

impl Masks {
    const fn of(word: Word) -> Self {
        let above = if matches!(word, Word::Above) {
            u32::MAX
        } else {
            0
        };
        Self {
            above,
            left: !above,
            signed: if matches!(word, Word::Rising) { 0 } else { 1 },
        }
    }

    fn predict(self, above: u32, left: u32) -> u32 {
        above & self.above | left & self.left
    }

    fn fold(self, difference: u32) -> u32 {
        let sign = ((difference as i32) >> 31) as u32;
        (difference << self.signed) ^ (sign & 0u32.wrapping_sub(self.signed))
    }

    fn unfold(self, folded: u32) -> u32 {
        (folded >> self.signed) ^ 0u32.wrapping_sub(folded & self.signed)
    }
}

/// Largest number of words of a packed row.
const MOST_WORDS: usize = 19;

/// The masks of a row's words, a constant.
struct Packing<R>(PhantomData<R>);

impl<R: Row> Packing<R> {
    const MASKS: [Masks; MOST_WORDS] = {
        let mut masks = [Masks::of(Word::Above); MOST_WORDS];
        if let Some(words) = R::PACKING {
            assert!(words.len() == R::WORDS && words.len() <= MOST_WORDS);
            let mut word = 0;
            while word < words.len() {
                masks[word] = Masks::of(words[word]);
                word += 1;
            }
        }
        masks
    };
}

/// Upper bound of the bytes of `records` packed rows of `words` words.
#[cfg(test)]
fn most_bytes(records: usize, words: usize) -> usize {
    let tags = |records: usize| (records * words).div_ceil(32) * 8;
    records / FRAME * tags(FRAME) + tags(records % FRAME) + records * words * 4 + PADDING
}

/// Appends the packed rows to `bytes`.
pub fn pack<R: Row>(records: &[R], bytes: &mut Vec<u8>) {
    let mut above = R::zeroed();
    let mut tags: Vec<u8> = Vec::new();
    let mut buffer = vec![0u8; FRAME * size_of::<R>() + PADDING];
    for frame in records.chunks(FRAME) {
        tags.clear();
        let mut used = 0;
        let (mut tag, mut shift) = (0u64, 0);
        for record in frame {
            let mut left = 0;
            for word in 0..R::WORDS {
                let (masks, value) = (Packing::<R>::MASKS[word], record.words()[word]);
                let above = above.words()[word];
                let difference = value.wrapping_sub(masks.predict(above, left));
                let folded = masks.fold(difference);
                let class = usize::from(folded > 0)
                    + usize::from(folded > 0xff)
                    + usize::from(folded > 0xffff);
                buffer[used..used + 4].copy_from_slice(&folded.to_le_bytes());
                used += LENGTH[class];
                tag |= (class as u64) << shift;
                shift += 2;
                if shift == 64 {
                    tags.extend_from_slice(&tag.to_le_bytes());
                    (tag, shift) = (0, 0);
                }
                left = value;
            }
            above = *record;
        }
        if shift > 0 {
            tags.extend_from_slice(&tag.to_le_bytes());
        }
        bytes.extend_from_slice(&tags);
        bytes.extend_from_slice(&buffer[..used]);
    }
    bytes.extend_from_slice(padding(records.len()));
}

/// Fills `records` from the bytes that [`pack`] made of the same number of rows; `None` if they are invalid.
#[must_use]
pub fn unpack<R: Row>(bytes: &[u8], records: &mut [R]) -> Option<()> {
    let mut above = R::zeroed();
    let mut at = 0;
    for frame in records.chunks_mut(FRAME) {
        let size = (frame.len() * R::WORDS).div_ceil(32) * 8;
        let mut tags = bytes.get(at..at + size)?.chunks_exact(8);
        at += size;
        let (mut tag, mut left_in_tag) = (0u64, 0);
        for record in frame {
            let mut left = 0;
            let words: &mut [u32] = bytemuck::cast_slice_mut(std::slice::from_mut(record));
            for (word, value) in words.iter_mut().enumerate() {
                let masks = Packing::<R>::MASKS[word];
                if left_in_tag == 0 {
                    tag = u64::from_le_bytes(tags.next()?.try_into().ok()?);
                    left_in_tag = 32;
                }
                let class = (tag & 3) as usize;
                tag >>= 2;
                left_in_tag -= 1;
                let four: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
                let folded = u32::from_le_bytes(four) & MASK[class];
                at += LENGTH[class];
                let predicted = masks.predict(above.words()[word], left);
                left = masks.unfold(folded).wrapping_add(predicted);
                *value = left;
            }
            above = *record;
        }
    }
    (bytes.len() == at + padding(records.len()).len()).then_some(())
}

/// The zeros after `records` packed rows; none after no rows.
fn padding(records: usize) -> &'static [u8] {
    if records == 0 { &[] } else { &[0; PADDING] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spill::row;
    use proptest::prelude::*;

    row! {
        /// The packing of most rows: ids that rise within a row.
        struct Triangle { i: u32, j: u32, k: u32, }
        packed Above Rising Rising
    }

    row! {
        /// Every kind of difference once.
        struct Mixed { a: u32, b: u32, c: u32, }
        packed Rising Above Left
    }

    row! {
        /// No difference to the row above.
        struct Leftwards { words: [u32; 3], }
        packed Left Rising Left
    }

    /// Small, medium and large words.
    fn word() -> impl Strategy<Value = u32> {
        prop_oneof![0u32..4, 0u32..70_000, any::<u32>(), Just(u32::MAX)]
    }

    fn comes_back<R: Row>(words: &[[u32; 3]]) {
        let rows: &[R] = bytemuck::cast_slice(words);
        let mut bytes = Vec::new();
        pack(rows, &mut bytes);
        assert!(bytes.len() <= most_bytes(rows.len(), 3));
        let mut back = vec![R::zeroed(); rows.len()];
        assert!(unpack(&bytes, &mut back).is_some());
        assert_eq!(back, rows);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn any_rows_come_back(
            words in prop::collection::vec(prop::array::uniform3(word()), 0..1600),
        ) {
            comes_back::<Triangle>(&words);
            comes_back::<Mixed>(&words);
            comes_back::<Leftwards>(&words);
            comes_back::<[u32; 3]>(&words);
        }

        /// Any bytes give rows or `None`.
        #[test]
        fn no_bytes_are_too_bad(
            bytes in prop::collection::vec(any::<u8>(), 0..3000),
            count in 0usize..700,
        ) {
            let _ = unpack(&bytes, &mut vec![Triangle::default(); count]);
            let _ = unpack(&bytes, &mut vec![Mixed::default(); count]);
            let _ = unpack(&bytes, &mut vec![Leftwards::default(); count]);
        }

        /// Missing or added bytes are an error even without a checksum.
        #[test]
        fn a_wrong_length_is_noticed(
            words in prop::collection::vec(prop::array::uniform3(word()), 1..700),
            cut in 1usize..20,
            more in 1usize..20,
        ) {
            let mut bytes = Vec::new();
            pack(&words, &mut bytes);
            let mut back = vec![[0; 3]; words.len()];
            let shorter = &bytes[..bytes.len() - cut.min(bytes.len())];
            prop_assert!(unpack(shorter, &mut back).is_none());
            bytes.resize(bytes.len() + more, 0);
            prop_assert!(unpack(&bytes, &mut back).is_none());
        }
    }

    #[test]
    fn neighbouring_triangles_take_few_bytes() {
        let rows: Vec<_> = (0..30_000u32)
            .map(|n| Triangle {
                i: n / 2,
                j: n / 2 + 1 + n % 2,
                k: n / 2 + 40,
            })
            .collect();
        let mut bytes = Vec::new();
        pack(&rows, &mut bytes);
        assert!(bytes.len() < 4 * rows.len(), "{}", bytes.len());
    }
}
