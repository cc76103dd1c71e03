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

/// Triangles of a leaf, and children of a box.
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

    fn of(corners: impl Iterator<Item = V3>) -> Self {
        corners.fold(Self::EMPTY, |all, p| all.joined(p, p))
    }

    fn of_all(all: &[Self]) -> Self {
        let all = all.iter();
        all.fold(Self::EMPTY, |all, one| all.joined(one.min, one.max))
    }
}

/// Boxes that are looked at together, in single precision, so a little larger.
#[derive(Debug, Clone)]
struct Boxes {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
}

/// Below 1 by more than all roundings of a squared distance in single precision.
const ROUNDING: f32 = 0.999_998;

impl Boxes {
    /// Those behind the last one are empty: infinitely far from everything.
    fn of(boxes: impl Iterator<Item = Bounds>) -> Self {
        let mut all = Self {
            min: [[f32::INFINITY; WIDTH]; 3],
            max: [[f32::NEG_INFINITY; WIDTH]; 3],
        };
        for (lane, one) in boxes.enumerate() {
            for k in 0..3 {
                all.min[k][lane] = (one.min[k] as f32).next_down();
                all.max[k][lane] = (one.max[k] as f32).next_up();
            }
        }
        all
    }

    /// For each box a squared distance from a point, not more than the true one; 0 inside.
    fn distances2(&self, p: V3) -> [f32; WIDTH] {
        let mut sums = [0.0f32; WIDTH];
        for (k, x) in p.into_iter().enumerate() {
            let (low, high) = ((x as f32).next_down(), (x as f32).next_up());
            for (lane, sum) in sums.iter_mut().enumerate() {
                let gap = (self.min[k][lane] - high).max(low - self.max[k][lane]);
                let gap = gap.max(0.0);
                *sum += gap * gap;
            }
        }
        sums.map(|sum| sum * ROUNDING)
    }
}

/// The tree of a surface that has triangles.
pub(super) struct Tree<'a> {
    surface: Surface<'a>,
    /// Numbers of the runs, sorted.
    runs: Vec<u32>,
    /// The boxes of the triangles of each run, of [`WIDTH`] runs, and so on, up to boxes that have all.
    levels: Vec<Vec<Boxes>>,
}

/// Leaf and triangle where the last search ended: the next one, of a point nearby, begins there.
pub(super) type Hint = (usize, usize);

impl<'a> Tree<'a> {
    pub fn new(surface: Surface<'a>) -> Self {
        let points = |run: &'a [[u32; 3]]| {
            let corners = run.as_flattened().iter();
            corners.map(|corner| surface.points[*corner as usize])
        };
        let runs = surface.triangles.chunks(WIDTH);
        let boxes: Vec<Bounds> = runs.map(|run| Bounds::of(points(run))).collect();
        let whole = Bounds::of_all(&boxes);
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
        let triangles = |run: &u32| {
            let first = *run as usize * WIDTH;
            let end = (first + WIDTH).min(surface.triangles.len());
            let run = surface.triangles[first..end].iter();
            Boxes::of(run.map(|t| Bounds::of(points(std::slice::from_ref(t)))))
        };
        let mut levels = vec![runs.iter().map(triangles).collect::<Vec<_>>()];
        let mut boxes: Vec<Bounds> = runs.iter().map(|n| boxes[*n as usize]).collect();
        while boxes.len() > 1 {
            let above = boxes.chunks(WIDTH);
            levels.push(
                above
                    .clone()
                    .map(|b| Boxes::of(b.iter().copied()))
                    .collect(),
            );
            boxes = above.map(Bounds::of_all).collect();
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
        let found = distance2(&corners, self.p);
        self.best2 = self.best2.min(found);
        found <= self.enough2
    }

    /// Looks at the triangles of a leaf; returns the one that is enough.
    fn leaf(&mut self, leaf: usize) -> Option<Hint> {
        let first = self.tree.runs[leaf] as usize * WIDTH;
        let boxes = self.tree.levels[0][leaf].distances2(self.p);
        for (triangle, distance2) in (first..).zip(boxes) {
            let is_near = f64::from(distance2) <= self.best2 && distance2 < f32::INFINITY;
            if is_near && self.is_enough(triangle) {
                return Some((leaf, triangle));
            }
        }
        None
    }

    /// Looks at all that is in a box, the nearest first; returns the triangle that is enough. The depth of the
    /// recursion is the number of levels.
    fn below(&mut self, level: usize, number: usize) -> Option<Hint> {
        if level == 0 {
            return self.leaf(number);
        }
        let boxes = self.tree.levels[level][number].distances2(self.p);
        let mut near = [(0.0, 0); WIDTH];
        let mut count = 0;
        for (child, distance2) in (number * WIDTH..).zip(boxes) {
            if f64::from(distance2) <= self.best2 && distance2 < f32::INFINITY {
                let mut at = count;
                while at > 0 && near[at - 1].0 > distance2 {
                    near[at] = near[at - 1];
                    at -= 1;
                }
                near[at] = (distance2, child);
                count += 1;
            }
        }
        for (distance2, child) in near[..count].iter().copied() {
            if f64::from(distance2) > self.best2 {
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
