//! Rows of triangles and their orientations.

use super::parity::{OrientationConstraint, Turned, constraint};
use super::star::Triangle;
use outcrop_disk::spill::row;
use outcrop_stages::ids::{Block, GlobalLabel, Label, TriangleIndex};

row! {
    /// A triangle.
    pub struct TriangleRow {
        /// Ids, ascending.
        triangle: Triangle,
    }
    packed Above Rising Rising
}

row! {
    /// A triangle sent to a block.
    pub struct TriangleTo {
        /// Number of the block.
        to: Block,
        /// Ids, ascending.
        triangle: Triangle,
    }
    packed Above Above Rising Rising
}

row! {
    /// A triangle and its orientation.
    pub struct LabelledTriangle {
        /// Ids, ascending.
        triangle: Triangle,
        /// `label << 1 | flip`: its label, and 1 if it is turned against its ascending ids relative to the
        /// label.
        label_flip: Turned<Label>,
    }
    packed Above Rising Rising Above
}

row! {
    /// A labelled triangle sent to a block.
    pub struct LabelledTo {
        /// Number of the block.
        to: Block,
        /// Ids, ascending.
        triangle: Triangle,
        /// See [`LabelledTriangle`].
        label_flip: Turned<GlobalLabel>,
    }
    packed Above Above Rising Rising Above
}

row! {
    /// The constraint of an interior triangle of a block on a crossing triangle.
    pub struct Relation {
        /// Block of the smallest vertex of the crossing triangle.
        to: Block,
        /// The crossing triangle.
        triangle: Triangle,
        /// Block of the interior triangle.
        block: Block,
        /// `label << 1 | flip`: its label, and 1 if the crossing triangle is turned against the label.
        label_flip: Turned<Label>,
        /// Weight of the common edge.
        weight: u32,
    }
    packed Above Above Above Above Above Above Above
}

row! {
    /// The sum of weights between two labels of a block.
    pub struct PairSum {
        /// The first label.
        a: Label,
        /// The second label.
        b: Label,
        /// Weights for the two being oriented alike, less those against; see [`words`].
        sum: [u32; 2],
    }
    packed Above Above Above Above
}

row! {
    /// Evidence that a label faces up.
    pub struct Upward {
        /// The label.
        label: Label,
        /// Evidence for facing up, less that for facing down; see [`words`].
        evidence: [u32; 2],
    }
    packed Above Above Above
}

row! {
    /// An edge between triangles of different labels, given by their indices among the interior triangles.
    pub struct Seam {
        /// Index of the first triangle.
        a: TriangleIndex,
        /// `index << 1 | flip` of the second triangle; 1 if it must be turned against the first.
        b_flip: Turned<TriangleIndex>,
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

/// A sum as two words, lower word first.
pub fn words(sum: i64) -> [u32; 2] {
    [sum as u32, (sum >> 32) as u32]
}

/// The sum from two words.
pub fn sum([low, high]: [u32; 2]) -> i64 {
    i64::from(high.cast_signed()) << 32 | i64::from(low)
}

/// The constraints of interior triangles on the crossing triangle `t` of `block`, with their weights, from
/// its `relations`; with global labels.
pub(super) fn interior_constraints(
    globals: &[(GlobalLabel, u32)],
    relations: &[Relation],
    block: usize,
    t: Triangle,
) -> impl Iterator<Item = (OrientationConstraint<GlobalLabel>, i64)> {
    let key = (Block::at(block), t);
    let start = relations.partition_point(|r| (r.to, r.triangle) < key);
    relations[start..]
        .iter()
        .take_while(move |r| (r.to, r.triangle) == key)
        .map(|r| {
            let (label, flip) = constraint(r.label_flip);
            let first = globals[r.block.index()].0;
            ((first.of(label), flip), i64::from(r.weight))
        })
}
