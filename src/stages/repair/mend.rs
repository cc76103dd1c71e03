//! What is done about a boundary loop: filled if it is a hole, closed as far as it is torn if it is
//! more than that.

use super::fill::{Corner, Filling, begin_at_smallest, fill, length};
use super::zip::zip;
use crate::geom::distance2;
use crate::stages::located::normal;
use rustc_hash::FxHashSet;

/// How boundary loops are treated.
#[derive(Debug, Clone, Copy)]
pub struct Mending {
    /// Most edges of a hole that is filled.
    pub longest: usize,
    /// Zip what is not filled, and leave openings open.
    pub zip: bool,
}

/// Longer loops are left alone, so that memory does not follow the boundary.
const LONGEST_ZIPPED: usize = 100_000;

/// A loop is an opening if its area is larger than so many squares over its edges: a round hole of
/// some 100 edges.
const OPENING: f64 = 8.0;

/// A loop of so few edges is a hole: pieces with so short an outline were removed.
const SMALL: usize = 6;

impl Mending {
    /// The longest loop that is looked at.
    pub fn longest_loop(&self) -> usize {
        if self.zip {
            self.longest.max(LONGEST_ZIPPED)
        } else {
            self.longest
        }
    }

    /// Closes the loop of `corners` if that is what it wants; `edge(a, b)` tells if the mesh has an
    /// edge.
    pub fn mend(&self, mut corners: Vec<Corner>, edge: impl Fn(u32, u32) -> bool) -> Filling {
        if !self.zip {
            return fill(corners, 0, edge);
        }
        begin_at_smallest(&mut corners);
        if corners.len() <= self.longest && !is_opening(&corners, squares(&corners)) {
            let filling = fill(corners.clone(), SMALL, &edge);
            if matches!(filling, Filling::Filled(_)) {
                return filling;
            }
        }
        let zipped = zip(corners, &edge);
        let (mut triangles, left) = (zipped.triangles, zipped.left);
        if left.is_empty() {
            return Filling::Filled(triangles);
        }
        let edges = left.len();
        if edges <= self.longest && !triangles.is_empty() && !is_opening(&left, zipped.squares) {
            let new = edges_of(&triangles);
            let taken = |a: u32, b: u32| edge(a, b) || new.contains(&(a.min(b), a.max(b)));
            if let Filling::Filled(more) = fill(left, SMALL, taken) {
                triangles.extend(more);
                return Filling::Filled(triangles);
            }
        }
        Filling::Zipped(triangles, edges)
    }
}

fn edges_of(triangles: &[[u32; 3]]) -> FxHashSet<(u32, u32)> {
    let edges = |t: &[u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    let ordered = |(a, b): (u32, u32)| (a.min(b), a.max(b));
    triangles.iter().flat_map(edges).map(ordered).collect()
}

/// The sum of the squares over the edges of a loop.
fn squares(corners: &[Corner]) -> f64 {
    let next = |x: usize| &corners[(x + 1) % corners.len()];
    let square = |x: usize| u128::from(distance2(corners[x].at, next(x).at));
    (0..corners.len()).map(square).sum::<u128>() as f64
}

/// True if a loop is wide for the length of its edges: a door and not a tear.
fn is_opening(corners: &[Corner], squares: f64) -> bool {
    let n = corners.len();
    let mut area = [0i128; 3];
    for x in 0..n {
        let (from, to) = (&corners[(x + n - 1) % n], &corners[x]);
        let part = normal(corners[0].at, from.at, to.at);
        (0..3).for_each(|k| area[k] += part[k]);
    }
    0.5 * length(area) > OPENING * squares
}
