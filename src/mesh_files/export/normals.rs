//! Normals of vertices: the sum of the normals of the triangles around each, weighed by their areas.
//!
//! Sums are integers, so their order does not matter. A block sees all triangles that touch it, so nothing is
//! sent between blocks.

use super::corners::Corners;
use super::number::{Split, split_block};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Table};
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::Point;
use outcrop_geom::triangle::direction as unit_vector;
use outcrop_mesh::repair::{FilledTriangle, Surface};
use outcrop_mesh::surface::star::sorted;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Id, Triangle};
use outcrop_stages::order::PointStore;

/// A sum of doubled area vectors on the lattice. One of them has 62 bits.
type Sum = [i128; 3];

/// Normals of a block's vertices.
pub struct Normals {
    /// By point; of a pinched vertex that of the fan which keeps the point.
    pub points: Vec<[f32; 3]>,
    /// By copy.
    pub copies: Vec<[f32; 3]>,
}

/// The sources of normals.
pub struct Sources<'a> {
    /// Positions.
    pub store: &'a PointStore,
    /// Triangles.
    pub surface: &'a Surface<'a>,
    /// Triangles that fill holes.
    pub filled: &'a Inbox<FilledTriangle>,
    /// Vertices that may have several fans.
    pub pinches: &'a Table<Id>,
    /// Division into blocks.
    pub blocks: Blocks,
}

impl Normals {
    /// Bytes of memory for a block of `points` points that `triangles` triangles touch: sums and normals;
    /// triangles, and those at pinched vertices with their stars.
    pub fn estimate(points: u64, triangles: u64) -> u64 {
        Corners::estimate(points, triangles) + 68 * points + 60 * triangles
    }

    /// Computes the normals of a block.
    pub fn of(unit: &Unit<'_>, from: &Sources<'_>, block: usize) -> Result<Self> {
        let ids = from.blocks.ids(block);
        let (mut triangles, _) = from.surface.load(unit, block)?;
        let filled = from.filled.get(unit, block)?;
        triangles.extend(filled.iter().map(|f| f.triangle));
        drop(filled);
        let corners = Corners::load(from.store, ids, triangles.iter())?;
        let mut sums = vec![Sum::default(); ids.len()];
        let lists = bytes_of(&triangles) + corners.bytes() + bytes_of(&sums);
        let mut held = unit.hold(lists);
        let own = |v: Id| ids.find(v);
        for &t in &triangles {
            let area = doubled_area(t.map(|v| corners.at(v)));
            for v in t {
                if let Some(sum) = sums.get_mut(own(v)) {
                    add(sum, area, 1);
                }
            }
        }
        let mut copies = Vec::new();
        let pinches = from.pinches.get(unit, block)?;
        if !pinches.is_empty() {
            let at_pinch = |t: &Triangle| t.iter().any(|v| pinches.binary_search(v).is_ok());
            triangles.retain(at_pinch);
            triangles.sort_unstable_by_key(|t| sorted(*t));
            held.set(lists + 24 * triangles.len() as u64 + 8 * ids.len() as u64);
            let (copied, splits) = split_block(&pinches, &triangles, from.blocks, block);
            copies = vec![Sum::default(); copied.len()];
            for Split {
                triangle,
                vertex,
                copy,
                ..
            } in splits
            {
                let found = triangles.binary_search_by_key(&triangle, |t| sorted(*t));
                let t = triangles[found.unwrap_or_else(|next| next)];
                let area = doubled_area(t.map(|v| corners.at(v)));
                add(&mut sums[own(vertex)], area, -1);
                add(&mut copies[copy as usize], area, 1);
            }
        }
        Ok(Self {
            points: sums.iter().map(unit_vector).collect(),
            copies: copies.iter().map(unit_vector).collect(),
        })
    }

    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.points) + bytes_of(&self.copies)
    }
}

fn add(sum: &mut Sum, area: [i64; 3], sign: i128) {
    for (sum, x) in sum.iter_mut().zip(area) {
        *sum += sign * i128::from(x);
    }
}

/// The cross product of two sides, exactly: coordinates have 30 bits, so products have 60.
fn doubled_area([a, b, c]: [Point; 3]) -> [i64; 3] {
    let to = |p: Point| [0, 1, 2].map(|k| i64::from(p[k]) - i64::from(a[k]));
    let (u, v) = (to(b), to(c));
    [1, 2, 0].map(|i| {
        let j = (i + 1) % 3;
        u[i] * v[j] - u[j] * v[i]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_are_exact_at_the_ends_of_the_lattice() {
        let most = (1 << 30) - 1;
        let area = doubled_area([[0, 0, 0], [most, 0, most], [0, most, most]]);
        let m = i64::from(most) * i64::from(most);
        assert_eq!(area, [-m, -m, m]);
        let area = doubled_area([[most, 0, 0], [0, most, 0], [0, 0, most]]);
        assert_eq!(area, [m, m, m]);
        // The largest component there is.
        let area = doubled_area([[0, most, 0], [most, 0, 0], [most, most, most]]);
        assert_eq!(area[2], m);
    }

    #[test]
    fn directions_are_unit_vectors_of_any_sum() {
        let huge = i128::from(i64::MAX) << 60;
        assert_eq!(unit_vector(&[0, 0, 0]), [0.0, 0.0, 1.0]);
        assert_eq!(unit_vector(&[0, -3, 4]), [0.0, -0.6, 0.8]);
        assert_eq!(unit_vector(&[-1, 0, 0]), [-1.0, 0.0, 0.0]);
        let [x, y, z] = unit_vector(&[huge, huge, -huge]);
        assert!(x == y && y == -z && (x * x * 3.0 - 1.0).abs() < 1e-6);
    }
}
