//! Treatment of a boundary loop: a hole is filled, any other loop is closed by ear clipping as far as it is
//! torn.

use super::ear_clipping::zip;
use super::fill::{
    Corner, Filling, begin_at_smallest, edges, fill, ids, is_outline, triangulate, undirected,
    vector_area,
};
use super::parts::Part;
use outcrop_geom::distance2;
use outcrop_geom::triangle::{area, length};
use outcrop_paper::method::METHOD;
use outcrop_stages::ids::{Id, Triangle};
use outcrop_stages::spacing::Density;
use rustc_hash::FxHashSet;

/// The rules for boundary loops.
#[derive(Debug, Clone, Copy)]
pub struct LoopRules<'a> {
    /// The density of the surface, if holes too wide for it are to stay open.
    pub density: Option<Density<'a>>,
    /// Most edges of a hole that is filled; with less than three no hole is filled.
    pub longest: usize,
    /// Close loops that are not filled by ear clipping, and leave openings open.
    pub clip_ears: bool,
}

/// Number of edges of a gap: a loop closed by one triangle that no cell saw. It is not a hole, and is closed
/// even if no holes are to be filled.
const GAP: usize = 3;

/// Edges of the longest loop that is closed by ear clipping. A loop is held as a whole, so this bounds the
/// memory.
const LONGEST: usize = 100_000;

impl LoopRules<'_> {
    /// The most edges of a loop that is examined.
    pub fn longest_loop(&self) -> usize {
        if self.only_gaps() {
            GAP
        } else if self.clip_ears {
            self.longest.max(LONGEST)
        } else {
            self.longest
        }
    }

    /// The part of a loop's filling that is not too wide; `found` is the width of the loop as it was found.
    /// `None` if there is no filling, if it is an opening, or if nothing remains.
    fn filled(
        &self,
        corners: &[Corner],
        sure: usize,
        found: &Width,
        edge: impl Fn(Id, Id) -> bool,
    ) -> Option<Part> {
        let triangles = triangulate(corners, sure, edge).ok()?;
        if found.is_spanned(corners, &triangles) {
            return None;
        }
        let part = match self.density {
            Some(density) => Part::not_wide(corners, triangles, density),
            None => Part::whole(triangles),
        };
        Some(part).filter(|part| !part.triangles.is_empty())
    }

    fn only_gaps(&self) -> bool {
        self.clip_ears && self.longest < GAP
    }

    /// Fills or closes the loop of `corners` by the rules; `edge(a, b)` is true if the mesh has that edge.
    pub fn close(&self, mut corners: Vec<Corner>, edge: impl Fn(Id, Id) -> bool) -> Filling {
        if !self.clip_ears {
            return fill(corners, 0, edge);
        }
        begin_at_smallest(&mut corners);
        let around = corners.len() > METHOD.filling.sure && is_outline(&corners);
        let found = Width::of(&corners);
        let fillable = |corners: &[Corner]| {
            !around && corners.len() <= self.longest.max(GAP) && !found.is_opening(corners)
        };
        if fillable(&corners)
            && let Some(part) = self.filled(&corners, usize::MAX, &found, &edge)
        {
            let new = ids(&corners, &part.triangles);
            return match new[..] {
                _ if part.left > 0 => Filling::Clipped(new, part.left),
                [gap] => Filling::Gap(gap),
                _ => Filling::Filled(new),
            };
        }
        if self.only_gaps() {
            return Filling::Impossible;
        }
        let clipped = zip(corners, &edge);
        let (mut triangles, mut left) = (clipped.triangles, clipped.left);
        let mut open = left.len();
        if !triangles.is_empty() && !left.is_empty() && fillable(&left) {
            let new = edges_of(&triangles);
            let taken = |a: Id, b: Id| edge(a, b) || new.contains(&undirected(a, b));
            begin_at_smallest(&mut left);
            if let Some(part) = self.filled(&left, METHOD.filling.sure, &found, taken) {
                triangles.extend(ids(&left, &part.triangles));
                open = part.left;
            }
        }
        if open == 0 {
            Filling::Filled(triangles)
        } else {
            Filling::Clipped(triangles, open)
        }
    }
}

fn edges_of(triangles: &[Triangle]) -> FxHashSet<(Id, Id)> {
    let edges = |&[a, b, c]: &Triangle| [undirected(a, b), undirected(b, c), undirected(c, a)];
    triangles.iter().flat_map(edges).collect()
}

/// The limit for the width of a loop. It follows from the edges of the loop as it was found, since ear
/// clipping leaves longer ones.
struct Width {
    edges: usize,
    squares: u128,
}

impl Width {
    fn of(corners: &[Corner]) -> Self {
        let square = |(from, to): (&Corner, &Corner)| u128::from(distance2(from.at, to.at));
        Self {
            edges: corners.len(),
            squares: edges(corners).map(square).sum(),
        }
    }

    /// True if a loop is wide for its edges: an opening such as a door, not a tear.
    fn is_opening(&self, corners: &[Corner]) -> bool {
        self.is_wide(0.5 * length(vector_area(corners)), corners.len())
    }

    /// True if the triangles that fill a loop are too large for its edges. The vector area does not show this
    /// where the loop goes around a solid body.
    fn is_spanned(&self, corners: &[Corner], filling: &[[usize; 3]]) -> bool {
        let area = |t: &[usize; 3]| area(t.map(|x| corners[x].at));
        self.is_wide(filling.iter().map(area).sum(), corners.len())
    }

    fn is_wide(&self, area: f64, edges: usize) -> bool {
        area * self.edges as f64 > METHOD.filling.opening * self.squares as f64 * edges as f64
    }
}
