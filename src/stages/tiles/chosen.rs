//! Points of a tile that can be neighbours, where others cannot.

use outcrop_disk::workspace::memory::bytes_of;
use outcrop_paper::kernels::BLOCK;

/// One bit for each point of a tile.
#[derive(Debug)]
pub(super) struct Chosen(Vec<u16>);

impl Chosen {
    /// The bits of points, in order.
    pub fn of(points: impl Iterator<Item = bool>) -> Self {
        let mut words = Vec::with_capacity(points.size_hint().0 / BLOCK + 2);
        let (mut word, mut bit) = (0, 0);
        for chosen in points {
            word |= u16::from(chosen) << bit;
            bit += 1;
            if bit == u16::BITS {
                words.push(word);
                (word, bit) = (0, 0);
            }
        }
        // A block that begins at the last point ends in the word after it.
        words.extend([word, 0]);
        Self(words)
    }

    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.0)
    }

    /// True if the point at `index` is chosen.
    pub fn get(&self, index: usize) -> bool {
        self.block(index) & 1 != 0
    }

    /// The bits of the block that begins at `index`.
    #[inline(always)]
    pub fn block(&self, index: usize) -> u32 {
        let (word, bit) = (index / BLOCK, index % BLOCK);
        let words = self.0.get(word..word + 2).map_or([0; 2], |w| [w[0], w[1]]);
        (u32::from(words[0]) | u32::from(words[1]) << BLOCK) >> bit & ((1 << BLOCK) - 1)
    }
}
