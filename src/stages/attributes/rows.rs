//! Rows of this stage: the values of a point behind the key of its position.

use outcrop_disk::spill::{Row, row};
use outcrop_geom::{Point, hilbert};

/// Defines a row with values of some words.
macro_rules! valued {
    ($name:ident, $words:literal, $($word:ident)*) => {
        row! {
            /// The values of a point, sent to a bucket.
            pub struct $name {
                /// Number of the bucket.
                to: u32,
                /// The key of the position on the curve.
                key: hilbert::Key,
                /// The values, in words that compare like them.
                values: [u32; $words],
            }
            packed Above Above Above Above $($word)*
        }
    };
}

valued!(Row1, 1, Above);
valued!(Row2, 2, Above Above);
valued!(Row6, 6, Above Above Above Above Above Above);
valued!(
    Row12, 12,
    Above Above Above Above Above Above Above Above Above Above Above Above
);

valued!(
    Row13, 13,
    Above Above Above Above Above Above Above Above Above Above Above Above Above
);

valued!(
    Row15, 15,
    Above Above Above Above Above Above Above Above Above Above Above Above Above Above Above
);

row! {
    /// A word of the values of a point.
    pub struct Word {
        /// The word.
        word: u32,
    }
    packed Above
}

/// Words of a row before its values.
const HEAD: usize = 4;

/// The row of a point, for no bucket yet.
pub fn row<R: Row>(point: Point, values: &[u8]) -> R {
    let mut row = R::zeroed();
    let words: &mut [u32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut row));
    words[1..HEAD].copy_from_slice(&hilbert::encode(point));
    for (word, bytes) in words[HEAD..].iter_mut().zip(values.chunks(4)) {
        let mut all = [0; 4];
        all[..bytes.len()].copy_from_slice(bytes);
        *word = u32::from_be_bytes(all);
    }
    row
}

/// The key of a row.
pub fn key(row: &impl Row) -> hilbert::Key {
    let words = row.words();
    [words[1], words[2], words[3]]
}

/// The values of a row.
pub fn values(row: &impl Row) -> &[u32] {
    &row.words()[HEAD..]
}

/// Writes the numbers of the buckets, which begin at `cuts`, into ascending rows.
pub fn send_to<R: Row>(rows: &mut [R], cuts: &[hilbert::Key]) {
    let mut bucket = 0;
    for row in rows {
        while cuts.get(bucket).is_some_and(|cut| *cut <= key(row)) {
            bucket += 1;
        }
        let words: &mut [u32] = bytemuck::cast_slice_mut(std::slice::from_mut(row));
        words[0] = bucket as u32;
    }
}
