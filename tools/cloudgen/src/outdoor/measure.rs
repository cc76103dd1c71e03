//! Comparison of a mesh of the outdoor world with the open ground.

use std::path::Path;

use super::{OUTDOOR_SIDE, height};
use crate::error::{Error, Result};
use crate::ply_stream::PlyStream;
use crate::vec3::{Vec3, cross, length, sub};

/// Width of the cells that mark open ground.
const CELL: f64 = 0.1;

/// Discs are enlarged by this, since a cell is judged by one corner.
const CELL_MARGIN: f64 = 0.15;

/// Ground closer to the border is not open.
const BORDER: f64 = 3.0;

/// A triangle is near-horizontal if the z component of its unit normal is larger.
const FLAT: f64 = 0.7;

/// A triangle is a sail if its centroid is farther above or below the ground.
const SAIL: f64 = 1.0;

/// Marks an edge of a triangle over open ground, in the word of its other end.
const OPEN: u32 = 1 << 31;

/// Comparison of a mesh with the ground. Open ground is away from every house, tree and wall, and from the
/// border. The mesh over it should face up, have no boundary and be near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundReport {
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Share of the near-horizontal area that faces down; NaN if there is none.
    pub down_share: f64,
    /// The same share over open ground.
    pub open_down_share: f64,
    /// Area of all triangles over open ground.
    pub open_area: f64,
    /// Area of triangles over open ground whose centroid is more than 1 above or below it.
    pub open_sail_area: f64,
    /// Edges with one triangle.
    pub boundary_edges: u64,
    /// Those with a triangle over open ground.
    pub open_boundary_edges: u64,
}

impl GroundReport {
    /// All figures as JSON, on one line.
    pub fn to_json(&self) -> String {
        let number = |value: f64| match value.is_finite() {
            true => value.to_string(),
            false => "null".to_owned(),
        };
        format!(
            "{{\"triangles\": {}, \"down_share\": {}, \"open_down_share\": {}, \"open_area\": {}, \
             \"open_sail_area\": {}, \"boundary_edges\": {}, \"open_boundary_edges\": {}}}",
            self.triangles,
            number(self.down_share),
            number(self.open_down_share),
            number(self.open_area),
            number(self.open_sail_area),
            self.boundary_edges,
            self.open_boundary_edges,
        )
    }
}

/// Measures a mesh whose coordinates are those of the land plus `offset`. Takes 24 bytes for each vertex, or
/// 4 for each vertex and 12 for each triangle, whichever is more.
pub(crate) fn measure(discs: &[[f64; 3]], offset: Vec3, path: &Path) -> Result<GroundReport> {
    let mesh = PlyStream::open(path)?;
    let most = u32::MAX as usize / 3;
    if mesh.faces() > most {
        return Err(Error::mesh(path, format!("more than {most} triangles")));
    }
    if mesh.vertex_count() > OPEN as usize {
        return Err(Error::mesh(path, format!("more than {OPEN} vertices")));
    }
    let vertices = mesh.vertices()?;
    let ground = Ground::new(discs);
    let mut open = vec![false; mesh.faces()];
    let mut areas = Areas::default();
    mesh.for_each_face(|face, corners| {
        let corners = corners.map(|v| sub(vertices[v as usize], offset));
        open[face] = areas.add(&ground, &corners);
    })?;
    drop((vertices, ground));
    let [all, over_ground] =
        boundary(&mesh, &open)?.ok_or_else(|| Error::mesh(path, "it changed while it was read"))?;
    let share = |[down, all]: [f64; 2]| down / all;
    Ok(GroundReport {
        triangles: mesh.faces() as u64,
        down_share: share(areas.all),
        open_down_share: share(areas.open),
        open_area: areas.over,
        open_sail_area: areas.sails,
        boundary_edges: all,
        open_boundary_edges: over_ground,
    })
}

/// Areas; of near-horizontal triangles, the area that faces down, and all.
#[derive(Default)]
struct Areas {
    all: [f64; 2],
    open: [f64; 2],
    over: f64,
    sails: f64,
}

impl Areas {
    /// Adds a triangle; returns true if it is over open ground.
    fn add(&mut self, ground: &Ground, [a, b, c]: &[Vec3; 3]) -> bool {
        let normal = cross(sub(*b, *a), sub(*c, *a));
        let double = length(normal);
        let up = normal[2] / double.max(1e-30);
        let [x, y, z] = std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0);
        let open = ground.is_open(x, y);
        let area = double / 2.0;
        let flat = if up.abs() > FLAT { area } else { 0.0 };
        let down = if up < 0.0 { flat } else { 0.0 };
        self.all = [self.all[0] + down, self.all[1] + flat];
        if open {
            self.open = [self.open[0] + down, self.open[1] + flat];
            self.over += area;
            if (z - height(x, y)).abs() > SAIL {
                self.sails += area;
            }
        }
        open
    }
}

/// Open ground, by cells.
struct Ground {
    row: usize,
    near: Vec<bool>,
}

impl Ground {
    fn new(discs: &[[f64; 3]]) -> Self {
        let row = (OUTDOOR_SIDE / CELL) as usize + 1;
        let mut near = vec![false; row * row];
        for &[x, y, radius] in discs {
            // The cast saturates.
            let range = |middle: f64| {
                let low = ((middle - radius) / CELL) as usize;
                let high = ((middle + radius) / CELL) as usize + 3;
                low.saturating_sub(1)..high.min(row)
            };
            let reach = radius + CELL_MARGIN;
            for i in range(x) {
                for j in range(y) {
                    let (u, v) = (i as f64 * CELL - x, j as f64 * CELL - y);
                    near[i * row + j] |= u * u + v * v < reach * reach;
                }
            }
        }
        Ground { row, near }
    }

    fn is_open(&self, x: f64, y: f64) -> bool {
        let inside = |c: f64| c > BORDER && c < OUTDOOR_SIDE - BORDER;
        if !inside(x) || !inside(y) {
            return false;
        }
        let [i, j] = [x, y].map(|c| (c / CELL) as usize);
        !self.near[i * self.row + j]
    }
}

/// Edges with one triangle: all, and those of open triangles. None if the file changed between reads.
fn boundary(mesh: &PlyStream, open: &[bool]) -> Result<Option<[u64; 2]>> {
    // Edges belong to their lower vertex: counted first, then stored contiguously.
    let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    let mut ends = vec![0u32; mesh.vertex_count()];
    mesh.for_each_face(|_, corners| {
        for (a, b) in edges(corners) {
            ends[a.min(b) as usize] += 1;
        }
    })?;
    let mut total = 0;
    for end in &mut ends {
        // From here on the start of each group, which becomes its end.
        total += std::mem::replace(end, total);
    }
    let mut others = vec![0u32; total as usize];
    mesh.for_each_face(|face, corners| {
        let flag = if open[face] { OPEN } else { 0 };
        for (a, b) in edges(corners) {
            let end = &mut ends[a.min(b) as usize];
            if let Some(other) = others.get_mut(*end as usize) {
                *other = a.max(b) | flag;
            }
            *end += 1;
        }
    })?;
    let (mut start, mut found) = (0, [0; 2]);
    for &end in &ends {
        let Some(list) = others.get_mut(start..end as usize) else {
            return Ok(None);
        };
        list.sort_unstable_by_key(|other| other & !OPEN);
        for same in list.chunk_by(|a, b| (a ^ b) & !OPEN == 0) {
            if let [single] = same {
                found[0] += 1;
                found[1] += u64::from(single & OPEN != 0);
            }
        }
        start = end as usize;
    }
    Ok(Some(found))
}
