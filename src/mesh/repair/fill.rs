//! Filling a hole by splitting its boundary loop (paper, section 3.6).

use outcrop_geom::triangle::{add, length, normal, on_a_line};
use outcrop_geom::{Point, distance2};
use outcrop_paper::method::METHOD;
use outcrop_stages::ids::{Id, Triangle};

/// A vertex of a boundary loop.
#[derive(Debug, Clone, Copy)]
pub struct Corner {
    /// Its id.
    pub id: Id,
    /// Its position.
    pub at: Point,
    /// Position of the third vertex of the triangle at the edge from the previous corner.
    pub apex: Point,
    /// Its position in the file.
    pub file: Point,
    /// True if the vertex has several fans.
    pub pinched: bool,
}

/// Outcome for a boundary loop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Filling {
    /// One oriented triangle fills the loop: a triangle that no cell saw, not a hole.
    Gap(Triangle),
    /// Filled completely, by these oriented triangles.
    Filled(Vec<Triangle>),
    /// Closed in part, by these oriented triangles; and the number of open edges left.
    Clipped(Vec<Triangle>, usize),
    /// The loop is an outline: it goes around a piece of surface and not around a hole.
    Outline,
    /// No valid triangulation was found.
    Impossible,
}

/// Triangulates the hole inside `corners`; `edge(a, b)` is true if the mesh has that edge.
///
/// Loops of more than `sure` edges are first tested for being an outline.
pub fn fill(mut corners: Vec<Corner>, sure: usize, edge: impl Fn(Id, Id) -> bool) -> Filling {
    begin_at_smallest(&mut corners);
    match triangulate(&corners, sure, edge) {
        Ok(triangles) => Filling::Filled(ids(&corners, &triangles)),
        Err(why) => why,
    }
}

/// The ids of the corners of triangles.
pub fn ids(corners: &[Corner], triangles: &[[usize; 3]]) -> Vec<Triangle> {
    let of = |t: &[usize; 3]| t.map(|x| corners[x].id);
    triangles.iter().map(of).collect()
}

/// Triangulates, with triangles given by indices into `corners`, which must start at the smallest edge.
pub fn triangulate(
    corners: &[Corner],
    sure: usize,
    edge: impl Fn(Id, Id) -> bool,
) -> Result<Vec<[usize; 3]>, Filling> {
    let n = corners.len();
    if goes_around_a_triangle(corners) || n > sure && is_outline(corners) {
        return Err(Filling::Outline);
    }
    let mut splitter = Splitter {
        corners,
        edge,
        chords: Vec::new(),
        out: Vec::new(),
    };
    if splitter.split(&(0..n).collect::<Vec<_>>()) {
        Ok(splitter.out)
    } else {
        Err(Filling::Impossible)
    }
}

/// Rotates a loop so that its smallest edge, by (from, to), comes first. The result then does not depend on
/// the corner at which the loop was found.
pub fn begin_at_smallest(corners: &mut [Corner]) {
    let n = corners.len();
    let keys = edges(corners).map(|(from, to)| (from.id, to.id));
    if let Some((_, first)) = keys.zip(0..).min() {
        corners.rotate_left((first + n - 1) % n);
    }
}

/// The edges of a loop; the first one leads to the first corner.
pub fn edges(corners: &[Corner]) -> impl Iterator<Item = (&Corner, &Corner)> + Clone {
    let from = corners.last().into_iter().chain(corners);
    from.zip(corners)
}

/// An edge as a key that does not depend on its direction.
pub fn undirected(a: Id, b: Id) -> (Id, Id) {
    (a.min(b), a.max(b))
}

/// Twice the vector area of a loop.
pub fn vector_area(corners: &[Corner]) -> [i128; 3] {
    let mut area = [0i128; 3];
    for (from, to) in edges(corners) {
        add(&mut area, normal(corners[0].at, from.at, to.at));
    }
    area
}

/// The distance of two points.
pub fn distance(a: Point, b: Point) -> f64 {
    (distance2(a, b) as f64).sqrt()
}

/// True if the loop goes around a single triangle without neighbours.
fn goes_around_a_triangle(corners: &[Corner]) -> bool {
    matches!(corners, [a, b, c] if b.apex == c.at && c.apex == a.at && a.apex == b.at)
}

/// True if the vector area of the loop points away from the triangles along it: its product with the sum of
/// their normals is below minus one half of the product of the lengths.
pub fn is_outline(corners: &[Corner]) -> bool {
    let mut normals = [0i128; 3];
    let mut lengths = 0.0;
    for (from, to) in edges(corners) {
        let m = normal(to.at, from.at, to.apex);
        lengths += length(m);
        add(&mut normals, m);
    }
    let area = vector_area(corners);
    let product: f64 = (0..3).map(|k| area[k] as f64 * normals[k] as f64).sum();
    product < -METHOD.filling.outline * length(area) * lengths
}

struct Splitter<'a, E> {
    corners: &'a [Corner],
    edge: E,
    chords: Vec<(Id, Id)>,
    out: Vec<[usize; 3]>,
}

impl<E: Fn(Id, Id) -> bool> Splitter<'_, E> {
    /// Splits the loop until only triangles are left; false if no valid chord is left.
    fn split(&mut self, ring: &[usize]) -> bool {
        // An explicit stack: a long thin hole is split as often as it has edges.
        let mut rings = vec![ring.to_vec()];
        while let Some(ring) = rings.pop() {
            if let [a, b, c] = ring[..] {
                if self.is_flat(a, b, c) {
                    return false;
                }
                self.out.push([a, b, c]);
                continue;
            }
            let Some((i, j)) = self.best_chord(&ring) else {
                return false;
            };
            let (a, b) = (self.corners[ring[i]].id, self.corners[ring[j]].id);
            self.chords.push(undirected(a, b));
            rings.push(ring[..=i].iter().chain(&ring[j..]).copied().collect());
            rings.push(ring[i..=j].to_vec());
        }
        true
    }

    fn is_flat(&self, a: usize, b: usize, c: usize) -> bool {
        let corners = [a, b, c].map(|x| &self.corners[x]);
        on_a_line(corners.map(|c| c.at)) || on_a_line(corners.map(|c| c.file))
    }

    /// The chord with the smallest ratio of its length to the length of the shorter way around.
    fn best_chord(&self, ring: &[usize]) -> Option<(usize, usize)> {
        let n = ring.len();
        let at = |x: usize| self.corners[ring[x]].at;
        let length = |x: usize, y: usize| distance(at(x), at(y));
        let mut along = Vec::with_capacity(n);
        let mut total = 0.0;
        for x in 0..n {
            along.push(total);
            total += length(x, (x + 1) % n);
        }
        let columns = [0, 1, 2].map(|axis| {
            let column = (0..n).map(|x| f64::from(at(x)[axis]));
            column.collect::<Vec<_>>()
        });
        let mut best: Option<(f64, usize, usize)> = None;
        for i in 0..n {
            let last = if i == 0 { n - 1 } else { n };
            for start in (i + 2..last).step_by(LANES) {
                let chords = start..(start + LANES).min(last);
                if let Some((least, ..)) = best
                    && !may_be_less(&columns, &along, total, i, chords.clone(), least)
                {
                    continue;
                }
                for j in chords {
                    let way = along[j] - along[i];
                    let ratio = length(i, j) / way.min(total - way);
                    if best.is_none_or(|(least, ..)| ratio < least) && self.allowed(ring, i, j) {
                        best = Some((ratio, i, j));
                    }
                }
            }
        }
        best.map(|(_, i, j)| (i, j))
    }

    fn allowed(&self, ring: &[usize], i: usize, j: usize) -> bool {
        let (a, b) = (&self.corners[ring[i]], &self.corners[ring[j]]);
        if a.id == b.id
            || a.pinched && b.pinched
            || (self.edge)(a.id, b.id)
            || self.chords.contains(&undirected(a.id, b.id))
        {
            return false;
        }
        let n = ring.len();
        let inner = j - i == 2 && self.is_flat(ring[i], ring[i + 1], ring[j]);
        let outer = n - (j - i) == 2 && self.is_flat(ring[i], ring[j], ring[(j + 1) % n]);
        !inner && !outer
    }
}

/// Chords that are compared together with the best so far.
const LANES: usize = 8;

/// False if no chord from `i` to a corner in `to` has a ratio below `least`; without a division or a root.
#[inline]
fn may_be_less(
    columns: &[Vec<f64>; 3],
    along: &[f64],
    total: f64,
    i: usize,
    to: std::ops::Range<usize>,
    least: f64,
) -> bool {
    // More than the rounding of both sides.
    let slack = least * (1.0 + 1e-9);
    let [x, y, z] = columns.each_ref().map(|column| &column[to.clone()]);
    let own = columns.each_ref().map(|column| column[i]);
    let mut less = false;
    for (((x, y), z), along_j) in x.iter().zip(y).zip(z).zip(&along[to]) {
        let (x, y, z) = (x - own[0], y - own[1], z - own[2]);
        let way = along_j - along[i];
        let limit = slack * way.min(total - way);
        less |= x * x + y * y + z * z <= limit * limit;
    }
    less
}
