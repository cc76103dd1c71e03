//! Rows of triangles and of how they run.

use super::parity::{OrientationConstraint, constraint};
use super::star::Triangle;
use crate::spill::row;

row! {
    /// A triangle.
    pub struct TriangleRow {
        /// Ids, ascending.
        triangle: Triangle,
    }
    packed Above Rising Rising
}

row! {
    /// A triangle for a block.
    pub struct TriangleTo {
        /// Number of the block.
        to: u32,
        /// Ids, ascending.
        triangle: Triangle,
    }
    packed Above Above Rising Rising
}

row! {
    /// A triangle and how it runs.
    pub struct LabelledTriangle {
        /// Ids, ascending.
        triangle: Triangle,
        /// `label << 1 | flip`: whether it runs against its ids relative to the label.
        label_flip: u32,
    }
    packed Above Rising Rising Above
}

row! {
    /// A labelled triangle for a block.
    pub struct LabelledTo {
        /// Number of the block.
        to: u32,
        /// Ids, ascending.
        triangle: Triangle,
        /// As [`LabelledTriangle`] has it.
        label_flip: u32,
    }
    packed Above Above Rising Rising Above
}

row! {
    /// The constraint that an interior triangle of a block is for a crossing triangle.
    pub struct Relation {
        /// Block of the smallest vertex of the crossing triangle.
        to: u32,
        /// The crossing triangle.
        triangle: Triangle,
        /// Block of the interior triangle.
        block: u32,
        /// `label << 1 | flip`: its label, and whether the crossing triangle is turned against that.
        label_flip: u32,
        /// Weight of the common edge.
        weight: u32,
    }
    packed Above Above Above Above Above Above Above
}

row! {
    /// The sum of weights between two labels of a block.
    pub struct PairSum {
        /// The first label.
        a: u32,
        /// The second label.
        b: u32,
        /// For running alike, less those against; see [`words`].
        sum: [u32; 2],
    }
    packed Above Above Above Above
}

row! {
    /// Evidence that a label faces up.
    pub struct Upward {
        /// The label.
        label: u32,
        /// For facing up, less that for facing down; see [`words`].
        evidence: [u32; 2],
    }
    packed Above Above Above
}

row! {
    /// An edge between triangles of different labels, by their places among the interior ones.
    pub struct Seam {
        /// The first triangle.
        a: u32,
        /// `place << 1 | flip` of the second, and whether it must be turned against the first.
        b_flip: u32,
    }
    packed Above Above
}

row! {
    /// The unit normal of a triangle.
    pub struct Normal {
        /// Its components.
        normal: [f32; 3],
    }
    unpacked
}

/// A sum as two words, the lower first.
pub fn words(sum: i64) -> [u32; 2] {
    [sum as u32, (sum >> 32) as u32]
}

/// The sum of two words.
pub fn sum([low, high]: [u32; 2]) -> i64 {
    i64::from(high.cast_signed()) << 32 | i64::from(low)
}

/// The constraints, with their weights, that interior triangles are for the crossing triangle `t` of
/// `block`: from its `relations`, with global labels.
pub(super) fn interior_constraints(
    globals: &[(u32, u32)],
    relations: &[Relation],
    block: usize,
    t: Triangle,
) -> impl Iterator<Item = (OrientationConstraint, i64)> {
    let key = (block as u32, t);
    let start = relations.partition_point(|r| (r.to, r.triangle) < key);
    relations[start..]
        .iter()
        .take_while(move |r| (r.to, r.triangle) == key)
        .map(|r| {
            let (label, flip) = constraint(r.label_flip);
            let first = globals[r.block as usize].0;
            ((first + label, flip), i64::from(r.weight))
        })
}
