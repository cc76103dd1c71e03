//! The labels of a block: the relative orientations of its interior triangles, as far as edges inside the
//! block determine them.

use super::parity::{ParitySets, signed, word};
use super::patches::SharedEdge;
use super::rows::{LabelledTriangle, PairSum, Relation, Seam, Upward, words};
use super::star::{EDGES, EdgesUp, Triangle, opposed};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Block, Ids, Label, TriangleIndex};

/// The labels of a block; the rows are described at [`super::orient::OrientedSurface`] and
/// [`super::orient::Weighed`].
pub(super) struct OrientedBlock {
    pub interior: Vec<LabelledTriangle>,
    pub relations: Vec<Relation>,
    pub pairs: Vec<PairSum>,
    pub ups: Vec<Upward>,
    pub seams: Vec<Seam>,
    /// Number of labels that occur in relations or pairs; their numbers come first.
    pub global: u32,
    pub labels: u32,
    pub mobius: u64,
    /// Most bytes that were in use while the block was oriented.
    pub most: u64,
}

impl OrientedBlock {
    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        let relations = bytes_of(&self.relations) + bytes_of(&self.pairs);
        bytes_of(&self.interior) + relations + bytes_of(&self.seams)
    }
}

/// Orients the interior triangles of a block and numbers their labels.
pub(super) fn orient_block(
    inner: &[Triangle],
    crossing: &[Triangle],
    blocks: Blocks,
    block: usize,
) -> OrientedBlock {
    let ids = blocks.ids(block);
    let mut edges = EdgesUp::with_room_for(ids, inner.iter());
    let mut sets = ParitySets::new(inner.len());
    let mut kept = Vec::with_capacity(inner.len());
    let mut constraints = Vec::new();
    let mut mobius = 0;
    for (number, &t) in inner.iter().enumerate() {
        let number = TriangleIndex::at(number);
        // The adjacent triangles agree and are joined, or this triangle is removed.
        constraints.clear();
        adjacent(t, &edges, inner, &ids, |other, flip| {
            constraints.push((other, flip))
        });
        if !sets.allow(&constraints) {
            mobius += 1;
            continue;
        }
        for &(other, flip) in &constraints {
            sets.join(other, number, flip);
        }
        edges.add(t, number);
        kept.push(number);
    }
    let mut connections = Connections::default();
    for &c in crossing {
        adjacent(c, &edges, inner, &ids, |other, flip| {
            connections.first.push(other);
            connections.relations.push((c, other, flip, 1));
        });
    }
    let mut done = number_labels(inner, &kept, connections, &mut sets, blocks, block, mobius);
    done.most = edges.bytes() + 8 * inner.len() as u64 + done.bytes();
    done
}

/// The connections of a block's sets that influence their orientation.
#[derive(Default)]
pub(super) struct Connections {
    /// One triangle of each set that may be connected with the rest of the cloud, in the order of labels.
    pub first: Vec<TriangleIndex>,
    /// A crossing triangle, an interior one at one of its edges, true if one must be turned against the
    /// other, and the weight of the edge.
    pub relations: Vec<(Triangle, TriangleIndex, bool, i64)>,
    /// One triangle of each of two sets, and the signed sum of weights between the sets, relative to these
    /// triangles.
    pub pairs: Vec<(TriangleIndex, TriangleIndex, i64)>,
    /// A triangle of a set, and the evidence that the set faces up, relative to the orientation of this
    /// triangle.
    pub ups: Vec<(TriangleIndex, i64)>,
    /// Edges between sets.
    pub seams: Vec<SharedEdge>,
}

/// Numbers the labels of the sets; those that may be connected with the rest of the cloud come first.
pub(super) fn number_labels(
    inner: &[Triangle],
    kept: &[TriangleIndex],
    connections: Connections,
    sets: &mut ParitySets<TriangleIndex>,
    blocks: Blocks,
    block: usize,
    mobius: u64,
) -> OrientedBlock {
    let mut label_of = vec![Label::NONE; inner.len()];
    let mut labels = 0;
    let mut find = |triangle: TriangleIndex| {
        let (root, turned) = sets.find(triangle);
        let label = &mut label_of[root.index()];
        if *label == Label::NONE {
            *label = Label::new(labels);
            labels += 1;
        }
        (*label, turned, labels)
    };
    let mut global = 0;
    for triangle in connections.first {
        global = find(triangle).2;
    }
    let mut sent = Vec::with_capacity(connections.relations.len());
    for (c, other, flip, weight) in connections.relations {
        let (label, turned, _) = find(other);
        sent.push(Relation {
            to: blocks.of(c[0]),
            triangle: c,
            block: Block::at(block),
            label_flip: word((label, flip ^ turned)),
            weight: weight as u32,
        });
    }
    let mut pairs = Vec::with_capacity(connections.pairs.len());
    for (a, b, sum) in connections.pairs {
        let ((a, turned_a, _), (b, turned_b, _)) = (find(a), find(b));
        let sum = words(signed(turned_a ^ turned_b, sum));
        pairs.push(PairSum { a, b, sum });
    }
    let mut ups = Vec::with_capacity(connections.ups.len());
    for (a, up) in connections.ups {
        let (label, turned, _) = find(a);
        if label.get() < global {
            let evidence = words(signed(turned, up));
            ups.push(Upward { label, evidence });
        }
    }
    let mut interior = Vec::with_capacity(kept.len());
    for &number in kept {
        let (label, turned, _) = find(number);
        interior.push(LabelledTriangle {
            triangle: inner[number.index()],
            label_flip: word((label, turned)),
        });
    }
    let place = |n| TriangleIndex::at(kept.partition_point(|k| *k < n));
    let seam = |edge: &SharedEdge| Seam {
        a: place(edge.a),
        b_flip: word((place(edge.b), edge.flip)),
    };
    let seams: Vec<_> = connections.seams.iter().map(seam).collect();
    OrientedBlock {
        interior,
        relations: sent,
        pairs,
        ups,
        seams,
        global,
        labels,
        mobius,
        most: 0,
    }
}

/// Calls `each` with the triangles that share an edge inside the block with `t`, and with true if `t` must be
/// turned against them.
pub(super) fn adjacent(
    t: Triangle,
    edges: &EdgesUp,
    triangles: &[Triangle],
    ids: &Ids,
    mut each: impl FnMut(TriangleIndex, bool),
) {
    for (a, b, ..) in EDGES {
        let (low, high) = (t[a], t[b]);
        if ids.contains(&high) {
            for n in edges.at_edge(low, high) {
                each(n, opposed(t, triangles[n.index()], low, high));
            }
        }
    }
}
