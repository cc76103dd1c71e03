//! Rows: the records of scratch files, as structs with named fields.

use std::cmp::Ordering;
use std::fmt::Debug;

/// The reference of a packed word: the word's difference to it is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Word {
    /// The same word of the row before.
    Above,
    /// The word to its left, which may be larger; zero for the first word.
    Left,
    /// The word to its left, which is rarely larger; zero for the first word.
    Rising,
}

/// A row of a scratch file: a plain struct of 32-bit words, defined by `row!`.
pub trait Row: bytemuck::Pod + PartialEq + Debug + Send + Sync {
    /// The packing of each word; `None` for rows that are stored unpacked. It affects only the size of the
    /// file.
    const PACKING: Option<&'static [Word]>;

    /// Number of words of a row.
    const WORDS: usize = size_of::<Self>() / 4;

    /// The row as words.
    fn words(&self) -> &[u32] {
        bytemuck::cast_slice(std::slice::from_ref(self))
    }

    /// Compares two rows word by word, as unsigned numbers; four words at a time.
    #[inline]
    fn compare(&self, other: &Self) -> Ordering {
        let head = |row: &Self| {
            let words = row.words().iter().take(4);
            words.fold(0u128, |sum, word| sum << 32 | u128::from(*word))
        };
        let order = head(self).cmp(&head(other));
        if Self::WORDS <= 4 {
            return order;
        }
        order.then_with(|| self.words()[4..].cmp(&other.words()[4..]))
    }
}

/// A position in double precision.
impl Row for [f64; 3] {
    const PACKING: Option<&'static [Word]> = None;
}

/// The corners of a triangle in double precision.
impl Row for [[f64; 3]; 3] {
    const PACKING: Option<&'static [Word]> = None;
}

/// Plain words, without names: for tests of this module.
impl<const N: usize> Row for [u32; N] {
    const PACKING: Option<&'static [Word]> = Some(&[Word::Above; N]);
}

/// Defines a row: a struct whose fields are words or arrays of words, and how each word is packed.
///
/// `packed` takes one [`Word`] for each word, arrays counted word by word. A row with `unpacked` is
/// stored unpacked, which suits numbers that differ much from row to row; its fields may also be other types
/// of 32 and 64 bits.
#[doc(hidden)]
#[macro_export]
macro_rules! __row {
    (
        $(#[$meta:meta])*
        $vis:vis struct $name:ident { $($(#[$doc:meta])* $field:ident: $type:ty,)* }
        packed $($word:ident)*
    ) => {
        $crate::spill::row! {
            @define [$(#[$meta])* #[derive(Eq, Ord)]] [$vis] $name {$($(#[$doc])* $field: $type,)*}
            Some({
                const WORDS: &[$crate::spill::Word] = &[$($crate::spill::Word::$word),*];
                assert!(WORDS.len() * 4 == size_of::<$name>(), "one word of packing for each word");
                WORDS
            })
        }
    };
    (
        $(#[$meta:meta])*
        $vis:vis struct $name:ident { $($(#[$doc:meta])* $field:ident: $type:ty,)* }
        unpacked
    ) => {
        $crate::spill::row! {
            @define [$(#[$meta])*] [$vis] $name {$($(#[$doc])* $field: $type,)*} None
        }
    };
    (
        @define [$(#[$meta:meta])*] [$vis:vis] $name:ident
        {$($(#[$doc:meta])* $field:ident: $type:ty,)*} $packing:expr
    ) => {
        $(#[$meta])*
        #[derive(
            Debug, Clone, Copy, Default, PartialEq, PartialOrd, bytemuck::Pod, bytemuck::Zeroable,
        )]
        #[repr(C)]
        $vis struct $name { $($(#[$doc])* pub $field: $type,)* }

        impl $crate::spill::Row for $name {
            const PACKING: Option<&'static [$crate::spill::Word]> = $packing;
        }
    };
}
pub use __row as row;
