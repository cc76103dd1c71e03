//! The nearest triangle of a surface, by a tree of boxes.
//!
//! Neighbours in the list of triangles are mostly neighbours in space. So a leaf of the tree is a run of that list, and
//! only leaves are sorted, along the Z-order curve.

use super::cells::key;
use outcrop_geom::distance::distance2;

pub(super) type V3 = [f64; 3];

/// A surface: points and corners.
#[derive(Clone, Copy)]
pub(super) struct Surface<'a> {
    pub points: &'a [V3],
    pub triangles: &'a [[u32; 3]],
}

impl Surface<'_> {
    pub fn corners(&self, triangle: usize) -> [V3; 3] {
        self.triangles[triangle].map(|corner| self.points[corner as usize])
    }
}

/// Triangles of a leaf.
const RUN: usize = 8;

/// Children of a box.
const WIDTH: usize = 8;

/// Bits of a coordinate in the keys by which leaves are sorted.
const BITS: u32 = 10;

/// A closed box.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    min: V3,
    max: V3,
}

impl Bounds {
    const EMPTY: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    fn joined(self, min: V3, max: V3) -> Self {
        Self {
            min: std::array::from_fn(|k| self.min[k].min(min[k])),
            max: std::array::from_fn(|k| self.max[k].max(max[k])),
        }
    }

    /// Squared distance to a point; 0 inside.
    fn distance2(&self, p: V3) -> f64 {
        let gap = |k: usize| (self.min[k] - p[k]).max(p[k] - self.max[k]).max(0.0);
        let (x, y, z) = (gap(0), gap(1), gap(2));
        x * x + y * y + z * z
    }

    /// Squared distance of the farthest corner.
    fn reach2(&self, p: V3) -> f64 {
        let far = |k: usize| (self.max[k] - p[k]).max(p[k] - self.min[k]);
        let (x, y, z) = (far(0), far(1), far(2));
        x * x + y * y + z * z
    }
}

/// The tree of a surface that has triangles.
pub(super) struct Tree<'a> {
    surface: Surface<'a>,
    /// Numbers of the runs, sorted.
    runs: Vec<u32>,
    /// Boxes by level: those of the runs first, then those of [`WIDTH`] boxes of the level below, up to a single one.
    levels: Vec<Vec<Bounds>>,
}

/// Leaf and triangle where the last search ended: the next one, of a point nearby, begins there.
pub(super) type Hint = (usize, usize);

impl<'a> Tree<'a> {
    pub fn new(surface: Surface<'a>) -> Self {
        let runs = surface.triangles.chunks(RUN);
        let boxes: Vec<Bounds> = runs
            .map(|run| {
                let corners = run.as_flattened().iter();
                let corners = corners.map(|corner| surface.points[*corner as usize]);
                corners.fold(Bounds::EMPTY, |all, p| all.joined(p, p))
            })
            .collect();
        let join = |all: &[Bounds]| {
            let all = all.iter();
            all.fold(Bounds::EMPTY, |all, one| all.joined(one.min, one.max))
        };
        let whole = join(&boxes);
        let side = (0..3).fold(f64::MIN_POSITIVE, |side: f64, k| {
            side.max(whole.max[k] - whole.min[k])
        });
        let most = f64::from((1u32 << BITS) - 1);
        let place = |one: &Bounds| {
            let middle = |k: usize| (one.min[k] + one.max[k]) / 2.0 - whole.min[k];
            key([0, 1, 2].map(|k| (middle(k) / side * most) as u32), BITS)
        };
        let numbered = boxes.iter().zip(0u32..);
        let mut placed: Vec<(u64, u32)> = numbered.map(|(one, n)| (place(one), n)).collect();
        placed.sort_unstable();
        let runs: Vec<u32> = placed.into_iter().map(|(_, n)| n).collect();
        let mut levels = vec![runs.iter().map(|n| boxes[*n as usize]).collect::<Vec<_>>()];
        while let Some(last) = levels.last()
            && last.len() > 1
        {
            levels.push(last.chunks(WIDTH).map(join).collect());
        }
        Self {
            surface,
            runs,
            levels,
        }
    }

    /// The distance to the nearest triangle if it is more than `enough`; otherwise any number up to that.
    pub fn distance(&self, p: V3, enough: f64, hint: &mut Hint) -> f64 {
        let enough2 = enough * enough;
        // Most points have a triangle that is near enough, which is found soon among the few boxes that are.
        let mut search = Search {
            tree: self,
            p,
            enough2,
            best2: enough2,
        };
        let (leaf, triangle) = *hint;
        let top = self.levels.len() - 1;
        if search.is_enough(triangle) {
            return enough;
        }
        let found = search.leaf(leaf);
        if let Some(found) = found.or_else(|| search.below(top, 0)) {
            *hint = found;
            return enough;
        }
        search.best2 = f64::INFINITY;
        if search.leaf(leaf).is_none() {
            search.below(top, 0);
        }
        search.best2.sqrt()
    }
}

/// A search for the nearest triangle.
struct Search<'a> {
    tree: &'a Tree<'a>,
    p: V3,
    /// Squared distance at which it ends.
    enough2: f64,
    /// The least squared distance so far; what is not nearer is passed over.
    best2: f64,
}

impl Search<'_> {
    /// Looks at a triangle; true if that is enough.
    fn is_enough(&mut self, triangle: usize) -> bool {
        let corners = self.tree.surface.corners(triangle);
        let around = corners
            .iter()
            .fold(Bounds::EMPTY, |all, p| all.joined(*p, *p));
        if around.distance2(self.p) > self.best2 {
            return false;
        }
        let found = distance2(&corners, self.p);
        self.best2 = self.best2.min(found);
        found <= self.enough2
    }

    /// Looks at the triangles of a leaf; returns the one that is enough.
    fn leaf(&mut self, leaf: usize) -> Option<Hint> {
        let first = self.tree.runs[leaf] as usize * RUN;
        if self.tree.levels[0][leaf].reach2(self.p) <= self.enough2 {
            self.best2 = self.enough2;
            return Some((leaf, first));
        }
        let end = (first + RUN).min(self.tree.surface.triangles.len());
        let found = (first..end).find(|triangle| self.is_enough(*triangle));
        found.map(|triangle| (leaf, triangle))
    }

    /// Looks at all that is in a box, the nearest first; returns the triangle that is enough. The depth of the
    /// recursion is the number of levels.
    fn below(&mut self, level: usize, number: usize) -> Option<Hint> {
        if level == 0 {
            return self.leaf(number);
        }
        let inside = &self.tree.levels[level - 1];
        let first = number * WIDTH;
        let inside = &inside[first..(first + WIDTH).min(inside.len())];
        let mut near = [(0.0, 0); WIDTH];
        let mut count = 0;
        for (child, one) in inside.iter().enumerate() {
            let distance2 = one.distance2(self.p);
            if distance2 < self.best2 {
                let mut at = count;
                while at > 0 && near[at - 1].0 > distance2 {
                    near[at] = near[at - 1];
                    at -= 1;
                }
                near[at] = (distance2, first + child);
                count += 1;
            }
        }
        for (distance2, child) in near[..count].iter().copied() {
            if distance2 >= self.best2 {
                break;
            }
            let found = self.below(level - 1, child);
            if found.is_some() {
                return found;
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn coordinates() -> impl Strategy<Value = V3> {
        [-40i32..40, -40i32..40, -3i32..3].prop_map(|p| p.map(f64::from))
    }

    proptest! {
        #[test]
        fn the_nearest_of_all_triangles_is_found(
            points in prop::collection::vec(coordinates(), 3..300),
            picks in prop::collection::vec(any::<[prop::sample::Index; 3]>(), 1..400),
            asked in prop::collection::vec((coordinates(), 0.0f64..20.0), 1..40),
        ) {
            let triangles: Vec<[u32; 3]> = picks
                .iter()
                .map(|t| t.map(|corner| corner.index(points.len()) as u32))
                .collect();
            let surface = Surface { points: &points, triangles: &triangles };
            let (tree, mut hint) = (Tree::new(surface), Hint::default());
            for (p, enough) in asked {
                let all = (0..triangles.len()).map(|n| distance2(&surface.corners(n), p));
                let nearest = all.fold(f64::INFINITY, f64::min).sqrt();
                let found = tree.distance(p, enough, &mut hint);
                prop_assert_eq!(found.max(enough), nearest.max(enough));
                prop_assert_eq!(tree.distance(p, 0.0, &mut Hint::default()), nearest);
            }
        }
    }
}
