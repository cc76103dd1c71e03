//! Records as few bytes: every word as a difference, every difference without its leading zeros.
//!
//! Packed records are frames of up to [`FRAME`] records. A frame begins with two bits for each word,
//! 32 words to a little-endian `u64`: the word's difference takes 0, 1, 2 or 4 bytes, which follow in
//! the same order. After the last frame come [`PADDING`] zeros, so that four bytes can always be read.

use super::Record;

/// Records in a frame.
const FRAME: usize = 512;
/// Zeros at the end.
const PADDING: usize = 4;
/// Bytes of a difference, and which of four bytes read they are, by its two bits.
const LENGTH: [usize; 4] = [0, 1, 2, 4];
const MASK: [u32; 4] = [0, 0xff, 0xffff, u32::MAX];

/// What a word of a record is written as the difference to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Word {
    /// The same word of the record before.
    Above,
    /// The word to its left, which may be larger; zero for the first word.
    Left,
    /// The word to its left, which is rarely larger; zero for the first word.
    Rising,
}

/// How each word of a record is packed. It changes how many bytes the records take and nothing else.
pub type Layout<const N: usize> = [Word; N];

/// Layouts of the records that most files hold.
pub mod layouts {
    use super::{Layout, Word};

    /// `[i, j, k]`, `i < j < k`, ascending.
    pub const TRIANGLE: Layout<3> = [Word::Above, Word::Rising, Word::Rising];
    /// `[i, j, k, attribute]`, `i < j < k`, ascending.
    pub const LABELLED: Layout<4> = [Word::Above, Word::Rising, Word::Rising, Word::Above];
    /// `[receiver, i, j, k]`, `i < j < k`, ascending.
    pub const SENT: Layout<4> = [Word::Above, Word::Above, Word::Rising, Word::Rising];
    /// `[receiver, i, j, k, attribute]`, `i < j < k`, ascending.
    pub const SENT_LABELLED: Layout<5> = [
        Word::Above,
        Word::Above,
        Word::Rising,
        Word::Rising,
        Word::Above,
    ];
    /// `[i, a, b]` with `i` smaller than `a` and `b`, ascending by `i`.
    pub const ORIENTED: Layout<3> = [Word::Above, Word::Rising, Word::Left];
}

/// A layout as masks, so that packing a word takes no branch.
struct Masks<const N: usize> {
    above: [u32; N],
    left: [u32; N],
    /// 1 if differences go up and down alike, so that the sign is moved to the lowest bit.
    signed: [u32; N],
}

impl<const N: usize> Masks<N> {
    fn of(layout: Layout<N>) -> Self {
        let mask = |yes: bool| if yes { u32::MAX } else { 0 };
        Self {
            above: layout.map(|w| mask(w == Word::Above)),
            left: layout.map(|w| mask(w != Word::Above)),
            signed: layout.map(|w| u32::from(w != Word::Rising)),
        }
    }

    fn predict(&self, word: usize, above: &Record<N>, left: u32) -> u32 {
        above[word] & self.above[word] | left & self.left[word]
    }

    fn fold(&self, word: usize, difference: u32) -> u32 {
        let sign = ((difference as i32) >> 31) as u32;
        let signed = self.signed[word];
        (difference << signed) ^ (sign & 0u32.wrapping_sub(signed))
    }

    fn unfold(&self, word: usize, folded: u32) -> u32 {
        let signed = self.signed[word];
        (folded >> signed) ^ 0u32.wrapping_sub(folded & signed)
    }
}

/// Bytes that `records` records of `words` words take at most.
#[cfg(test)]
fn most_bytes(records: usize, words: usize) -> usize {
    let tags = |records: usize| (records * words).div_ceil(32) * 8;
    records / FRAME * tags(FRAME) + tags(records % FRAME) + records * words * 4 + PADDING
}

/// Appends the packed records to `bytes`.
pub fn pack<const N: usize>(records: &[Record<N>], layout: Layout<N>, bytes: &mut Vec<u8>) {
    let masks = Masks::of(layout);
    let mut above = [0; N];
    let mut tags: Vec<u8> = Vec::new();
    let mut buffer = vec![0u8; FRAME * N * 4 + PADDING];
    for frame in records.chunks(FRAME) {
        tags.clear();
        let mut used = 0;
        let (mut tag, mut shift) = (0u64, 0);
        for record in frame {
            let mut left = 0;
            for (word, &value) in record.iter().enumerate() {
                let difference = value.wrapping_sub(masks.predict(word, &above, left));
                let folded = masks.fold(word, difference);
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

/// Fills `records` from exactly the bytes that [`pack`] made of as many; `None` if they cannot be.
#[must_use]
pub fn unpack<const N: usize>(
    bytes: &[u8],
    layout: Layout<N>,
    records: &mut [Record<N>],
) -> Option<()> {
    let masks = Masks::of(layout);
    let mut above = [0; N];
    let mut at = 0;
    for frame in records.chunks_mut(FRAME) {
        let size = (frame.len() * N).div_ceil(32) * 8;
        let mut tags = bytes.get(at..at + size)?.chunks_exact(8);
        at += size;
        let (mut tag, mut left_in_tag) = (0u64, 0);
        for record in frame {
            let mut left = 0;
            for (word, value) in record.iter_mut().enumerate() {
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
                let predicted = masks.predict(word, &above, left);
                left = masks.unfold(word, folded).wrapping_add(predicted);
                *value = left;
            }
            above = *record;
        }
    }
    (bytes.len() == at + padding(records.len()).len()).then_some(())
}

/// What ends so many packed records; none take no bytes.
fn padding(records: usize) -> &'static [u8] {
    if records == 0 { &[] } else { &[0; PADDING] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Words small, large and in between.
    fn word() -> impl Strategy<Value = u32> {
        prop_oneof![0u32..4, 0u32..70_000, any::<u32>(), Just(u32::MAX)]
    }

    fn layout() -> impl Strategy<Value = Layout<3>> {
        prop::array::uniform3(prop::sample::select(vec![
            Word::Above,
            Word::Left,
            Word::Rising,
        ]))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn any_records_come_back(
            records in prop::collection::vec(prop::array::uniform3(word()), 0..1600),
            layout in layout(),
        ) {
            let mut bytes = Vec::new();
            pack(&records, layout, &mut bytes);
            prop_assert!(bytes.len() <= most_bytes(records.len(), 3));
            let mut back = vec![[0; 3]; records.len()];
            prop_assert!(unpack(&bytes, layout, &mut back).is_some());
            prop_assert_eq!(back, records);
        }

        /// Whatever the bytes are, the answer is records or `None`.
        #[test]
        fn no_bytes_are_too_bad(
            bytes in prop::collection::vec(any::<u8>(), 0..3000),
            count in 0usize..700,
            layout in layout(),
        ) {
            let mut records = vec![[0; 3]; count];
            let _ = unpack(&bytes, layout, &mut records);
        }

        /// Bytes that are missing or added are noticed even without a checksum.
        #[test]
        fn a_wrong_length_is_noticed(
            records in prop::collection::vec(prop::array::uniform3(word()), 1..700),
            cut in 1usize..20,
            more in 1usize..20,
        ) {
            let layout = [Word::Above; 3];
            let mut bytes = Vec::new();
            pack(&records, layout, &mut bytes);
            let mut back = vec![[0; 3]; records.len()];
            let shorter = &bytes[..bytes.len() - cut.min(bytes.len())];
            prop_assert!(unpack(shorter, layout, &mut back).is_none());
            bytes.resize(bytes.len() + more, 0);
            prop_assert!(unpack(&bytes, layout, &mut back).is_none());
        }
    }

    #[test]
    fn neighbouring_triangles_take_few_bytes() {
        let records: Vec<_> = (0..30_000u32)
            .map(|n| [n / 2, n / 2 + 1 + n % 2, n / 2 + 40, 3])
            .collect();
        let layout = [Word::Above, Word::Rising, Word::Rising, Word::Above];
        let mut bytes = Vec::new();
        pack(&records, layout, &mut bytes);
        assert!(bytes.len() < 4 * records.len(), "{}", bytes.len());
    }
}
