//! An R\*-tree of boxes: those that meet a box, and the nearest to a point.

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{
    AABB, RStarInsertionStrategy, RTree, RTreeNum, RTreeObject, RTreeParams, SelectionFunction,
};

/// A box and its number.
type Entry<S> = GeomWithData<Rectangle<[S; 3]>, u32>;

/// Children of a node. Filling the tree at once divides by two along each axis until this number is left, so a
/// node has at least two; the default (6) would leave many with one.
#[derive(Debug)]
struct Wide;

impl RTreeParams for Wide {
    const MIN_SIZE: usize = 4;
    const MAX_SIZE: usize = 16;
    const REINSERTION_COUNT: usize = 4;
    type DefaultInsertionStrategy = RStarInsertionStrategy;
}

/// Numbered boxes with corners in `S`, which must hold the squared distances that are asked for. Results do
/// not depend on the shape of the tree, except for the order of equally near boxes.
#[derive(Debug)]
pub struct BoxTree<S: RTreeNum>(RTree<Entry<S>, Wide>);

/// Selects boxes by their corners.
struct That<F>(F);

impl<S: RTreeNum, F: Fn([S; 3], [S; 3]) -> bool> SelectionFunction<Entry<S>> for That<F> {
    fn should_unpack_parent(&self, around: &AABB<[S; 3]>) -> bool {
        self.0(around.lower(), around.upper())
    }

    fn should_unpack_leaf(&self, entry: &Entry<S>) -> bool {
        self.should_unpack_parent(&entry.envelope())
    }
}

impl<S: RTreeNum> BoxTree<S> {
    /// Bytes for each box, also while the tree is built: a node takes 72 with coordinates of 8, there is at
    /// most one inner node for two boxes, and the allocator adds to each.
    pub const BYTES: u64 = 128;

    /// The tree of boxes with these lowest and highest corners, numbered from 0.
    pub fn of(boxes: impl Iterator<Item = [[S; 3]; 2]>) -> Self {
        let entry = |(number, [min, max]): (u32, [[S; 3]; 2])| {
            Entry::new(Rectangle::from_corners(min, max), number)
        };
        let entries = (0..).zip(boxes).map(entry).collect();
        Self(RTree::bulk_load_with_params(entries))
    }

    /// The boxes that share a point with the box of these corners, in any order.
    pub fn meeting(&self, [min, max]: [[S; 3]; 2]) -> impl Iterator<Item = usize> {
        let wanted = AABB::from_corners(min, max);
        let entries = self.0.locate_in_envelope_intersecting(wanted);
        entries.map(|entry| entry.data as usize)
    }

    /// The boxes whose corners are `wanted`, with these corners, in any order. It must be true of a box around a
    /// wanted box; it may become false between two steps.
    pub fn that(
        &self,
        wanted: impl Fn([S; 3], [S; 3]) -> bool,
    ) -> impl Iterator<Item = (usize, [[S; 3]; 2])> {
        let entries = self.0.locate_with_selection_function(That(wanted));
        entries.map(|entry| {
            let corners = [entry.geom().lower(), entry.geom().upper()];
            (entry.data as usize, corners)
        })
    }

    /// All boxes with their squared distance from a point, the nearest first.
    pub fn nearest(&self, p: [S; 3]) -> impl Iterator<Item = (S, usize)> {
        let entries = self.0.nearest_neighbor_iter_with_distance_2(p);
        entries.map(|(entry, distance2)| (distance2, entry.data as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;
    use crate::aabb::Aabb;
    use proptest::prelude::*;

    /// Boxes of all sizes, also single points, and at the ends of the lattice.
    fn boxes() -> impl Strategy<Value = Vec<Aabb>> {
        let corner = |side| prop::array::uniform3(0..side);
        let of = |side| (corner(side), corner(side)).prop_map(|(a, b)| Aabb::of(&[a, b]));
        let small = (corner(1 << 30), corner(9)).prop_map(|(a, b): (Point, Point)| {
            Aabb::of(&[a, [0, 1, 2].map(|k| (a[k] - b[k]).max(0))])
        });
        let any = prop_oneof![4 => small, 1 => of(1 << 30), 2 => of(20)];
        prop::collection::vec(any, 0..400)
    }

    fn inner_nodes(node: &rstar::ParentNode<Entry<i64>>) -> usize {
        let inner = |node: &rstar::RTreeNode<_>| match node {
            rstar::RTreeNode::Leaf(_) => 0,
            rstar::RTreeNode::Parent(node) => inner_nodes(node),
        };
        1 + node.children().iter().map(inner).sum::<usize>()
    }

    #[test]
    fn a_tree_takes_no_more_than_its_bytes() {
        assert_eq!(size_of::<rstar::RTreeNode<Entry<i64>>>(), 72);
        assert_eq!(size_of::<rstar::RTreeNode<Entry<f64>>>(), 72);
        for count in (1..2500i64).chain([4097, 50_000, 131_072]) {
            let at = |k: i64| [k * 7919 % 1009, k * 104_729 % 997, k % 13];
            let tree = BoxTree::of((0..count).map(|k| [at(k), at(k)]));
            let inner = inner_nodes(tree.0.root()) as u64;
            // Eight bytes for each allocation.
            let bytes = (count as u64 + inner) * 72 + inner * 8;
            assert!(
                bytes <= count as u64 * BoxTree::<i64>::BYTES + 256,
                "{count}: {bytes}"
            );
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn queries_find_as_much_as_a_look_at_every_box(
            boxes in boxes(), wanted in boxes(), p in prop::array::uniform3(0..1 << 30),
        ) {
            let tree = BoxTree::of(boxes.iter().map(|b| b.wide(0)));
            for wanted in &wanted {
                let mut found: Vec<_> = tree.meeting(wanted.wide(0)).collect();
                found.sort_unstable();
                let meet = |k: &usize| boxes[*k].distance2_box(wanted) == 0;
                prop_assert_eq!(found, (0..boxes.len()).filter(meet).collect::<Vec<_>>());
            }
            for p in boxes.iter().map(|b| b.max).take(9).chain([p, [0; 3], [(1 << 30) - 1; 3]]) {
                let found: Vec<_> = tree.nearest(p.map(i64::from)).collect();
                prop_assert!(found.is_sorted_by_key(|(distance2, _)| *distance2));
                let mut all: Vec<_> = found.iter().map(|(d, k)| (*k, *d as u64)).collect();
                all.sort_unstable();
                let expected: Vec<_> = boxes.iter().map(|b| b.distance2(p)).enumerate().collect();
                prop_assert_eq!(&all, &expected);
                let low = |min: [i64; 3], _: [i64; 3]| min[0] <= i64::from(p[0]);
                let (mut some, corners): (Vec<_>, Vec<_>) = tree.that(low).unzip();
                prop_assert!(some.iter().zip(&corners).all(|(k, at)| *at == boxes[*k].wide(0)));
                some.sort_unstable();
                let low = |k: &usize| boxes[*k].min[0] <= p[0];
                prop_assert_eq!(some, (0..boxes.len()).filter(low).collect::<Vec<_>>());
            }
        }
    }
}
