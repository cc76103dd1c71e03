//! What says to which set of triangles one belongs, as a word.

/// A home as a word: `number << 2 | local << 1 | flip`; `number` is a global label, or a number
/// within the block if `local`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Home {
    /// Global label, or number within the block.
    pub number: u32,
    /// Whose number it is.
    pub local: bool,
    /// Orientation of the triangle relative to its home.
    pub flip: bool,
}

impl Home {
    /// As one word.
    #[must_use]
    pub fn word(self) -> u32 {
        self.number << 2 | u32::from(self.local) << 1 | u32::from(self.flip)
    }

    /// From a word.
    #[must_use]
    pub fn from_word(word: u32) -> Self {
        Self {
            number: word >> 2,
            local: word & 2 != 0,
            flip: word & 1 != 0,
        }
    }
}
