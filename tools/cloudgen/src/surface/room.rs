//! A furnished box room seen from inside.

use super::refine::rectangle;
use super::tessellate::Tessellation;
use super::{Line, Sample, Surface};
use crate::picker::Picker;
use crate::vec3::{Vec3, cross, dot, length, sub};

/// Two rooms joined by a doorway, with a pillar and a table: the boundary between the air and the
/// solids, all faces axis-parallel, in metres before scaling.
///
/// The air is bounded by one closed surface. The doorway joins two balls to one; the pillar from floor to
/// ceiling and the three further legs of the table add a handle each.
#[derive(Debug)]
pub(crate) struct Room {
    faces: Vec<Face>,
    picker: Picker,
    unit: f64,
}

/// Width, depth and height of the room.
const EXTENT: Vec3 = [8.0, 6.0, 3.0];

/// The solids inside, as lower and upper corners.
const SOLIDS: [[Vec3; 2]; 9] = [
    // Inner wall, left of, right of and above the doorway.
    [[5.0, 0.0, 0.0], [5.2, 2.4, 3.0]],
    [[5.0, 3.4, 0.0], [5.2, 6.0, 3.0]],
    [[5.0, 2.4, 2.1], [5.2, 3.4, 3.0]],
    // Pillar.
    [[1.5, 4.2, 0.0], [1.9, 4.6, 3.0]],
    // Table: top and legs.
    [[2.0, 1.0, 0.72], [3.8, 2.0, 0.80]],
    [[2.05, 1.05, 0.0], [2.17, 1.17, 0.72]],
    [[3.63, 1.05, 0.0], [3.75, 1.17, 0.72]],
    [[2.05, 1.83, 0.0], [2.17, 1.95, 0.72]],
    [[3.63, 1.83, 0.0], [3.75, 1.95, 0.72]],
];

/// An axis-parallel rectangle.
#[derive(Clone, Copy, Debug)]
struct Face {
    low: Vec3,
    high: Vec3,
    normal: Vec3,
    /// Axis of the scan lines, and the axis across them.
    run: usize,
    across: usize,
}

impl Face {
    fn width(&self, axis: usize) -> f64 {
        self.high[axis] - self.low[axis]
    }
}

/// The room divided along all planes of the solids into cells of air and solid cells.
struct Cells {
    /// Sorted coordinates of the cuts along each axis.
    cuts: [Vec<f64>; 3],
}

impl Cells {
    fn new() -> Self {
        let cuts = std::array::from_fn(|axis| {
            let mut cuts = vec![0.0, EXTENT[axis]];
            cuts.extend(SOLIDS.iter().flatten().map(|corner| corner[axis]));
            cuts.sort_by(f64::total_cmp);
            cuts.dedup();
            cuts
        });
        Cells { cuts }
    }

    /// True if a cell is solid; all cells outside the room are.
    fn solid(&self, cell: [isize; 3]) -> bool {
        let mut middle = [0.0; 3];
        for (axis, &k) in cell.iter().enumerate() {
            let cuts = &self.cuts[axis];
            let Some(k) = usize::try_from(k).ok().filter(|k| k + 1 < cuts.len()) else {
                return true;
            };
            middle[axis] = f64::midpoint(cuts[k], cuts[k + 1]);
        }
        let within = |[low, high]: &[Vec3; 2]| {
            (0..3).all(|axis| low[axis] < middle[axis] && middle[axis] < high[axis])
        };
        SOLIDS.iter().any(within)
    }

    /// Every rectangle between a cell of air and a solid one: lower and upper cut of each axis,
    /// the normal axis, and the sign of the direction into the air.
    fn boundary(&self) -> Vec<([[usize; 3]; 2], usize, f64)> {
        let mut faces = Vec::new();
        let count = |axis: usize| self.cuts[axis].len() - 1;
        for z in 0..count(2) {
            for y in 0..count(1) {
                for x in 0..count(0) {
                    let cell = [x as isize, y as isize, z as isize];
                    if self.solid(cell) {
                        continue;
                    }
                    for axis in 0..3 {
                        for (side, sign) in [(0, 1.0), (1, -1.0)] {
                            let mut beyond = cell;
                            beyond[axis] += 2 * side as isize - 1;
                            if self.solid(beyond) {
                                let mut corners = [[x, y, z], [x + 1, y + 1, z + 1]];
                                corners[0][axis] += side;
                                corners[1][axis] += side;
                                corners[1][axis] -= 1;
                                faces.push((corners, axis, sign));
                            }
                        }
                    }
                }
            }
        }
        faces
    }
}

impl Room {
    pub(crate) fn new(size: f64) -> Self {
        let unit = size / length(EXTENT);
        let cells = Cells::new();
        let place = |corner: [usize; 3]| {
            std::array::from_fn(|k| (cells.cuts[k][corner[k]] - EXTENT[k] / 2.0) * unit)
        };
        let face = |(corners, axis, sign): ([[usize; 3]; 2], usize, f64)| {
            let mut normal = [0.0; 3];
            normal[axis] = sign;
            Face {
                low: place(corners[0]),
                high: place(corners[1]),
                normal,
                run: usize::from(axis == 0),
                across: if axis == 2 { 1 } else { 2 },
            }
        };
        let mut faces: Vec<Face> = cells.boundary().into_iter().map(face).collect();
        // Coplanar faces are grouped: a sweep covers wall by wall.
        let key = |f: &Face| (f.run, f.across, f.low[3 - f.run - f.across]);
        faces.sort_by(|a, b| {
            let (a, b) = (key(a), key(b));
            (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2))
        });
        let picker = Picker::new(faces.iter().map(|f| f.width(f.run) * f.width(f.across)));
        Room {
            faces,
            picker,
            unit,
        }
    }

    fn point(face: &Face, run: f64, across: f64) -> Sample {
        let mut position = face.low;
        position[face.run] = run;
        position[face.across] = across;
        Sample {
            position,
            normal: face.normal,
        }
    }
}

impl Surface for Room {
    fn area(&self) -> f64 {
        self.picker.total()
    }

    fn bounds(&self) -> [Vec3; 2] {
        let half = EXTENT.map(|e| e * self.unit / 2.0);
        [half.map(|c| -c), half]
    }

    fn at(&self, u: f64, v: f64) -> Sample {
        let (face, t) = self.picker.pick(u);
        let face = &self.faces[face];
        let (run, across) = (face.width(face.run) * v, face.width(face.across) * t);
        Self::point(
            face,
            face.low[face.run] + run,
            face.low[face.across] + across,
        )
    }

    fn scan_lines(&self, spacing: f64) -> Vec<Line> {
        let mut lines = Vec::new();
        for (patch, face) in self.faces.iter().enumerate() {
            // Multiples of the spacing in the whole room: lines continue over neighbouring faces.
            let first = (face.low[face.across] / spacing).ceil() as i64;
            let weight = face.width(face.run);
            lines.extend(
                (first..)
                    .map(|k| k as f64 * spacing)
                    .take_while(|&at| at < face.high[face.across])
                    .map(|at| Line {
                        patch: patch as u32,
                        at,
                        weight,
                    }),
            );
        }
        if lines.is_empty() {
            // If there are so few points that no line meets a face: one line along the middle of each.
            lines.extend(self.faces.iter().enumerate().map(|(patch, face)| Line {
                patch: patch as u32,
                at: f64::midpoint(face.low[face.across], face.high[face.across]),
                weight: face.width(face.run),
            }));
        }
        lines
    }

    fn on_line(&self, line: &Line, t: f64, _v: f64) -> Sample {
        let face = &self.faces[line.patch as usize];
        Self::point(face, face.low[face.run] + face.width(face.run) * t, line.at)
    }

    fn distance(&self, p: Vec3) -> f64 {
        let nearest = |face: &Face| {
            let off: Vec3 = std::array::from_fn(|k| p[k] - p[k].clamp(face.low[k], face.high[k]));
            off.iter().map(|c| c * c).sum::<f64>()
        };
        self.faces
            .iter()
            .map(nearest)
            .fold(f64::INFINITY, f64::min)
            .sqrt()
    }

    fn reference(&self, _tolerance: f64) -> Tessellation {
        let mut mesh = Tessellation::default();
        for face in &self.faces {
            let along = |axis: usize| {
                let mut side = [0.0; 3];
                side[axis] = face.width(axis);
                side
            };
            let (u, v) = (along(face.run), along(face.across));
            // Anticlockwise as seen from the air.
            if dot(cross(u, v), face.normal) > 0.0 {
                rectangle(&mut mesh, face.low, u, v);
            } else {
                rectangle(&mut mesh, face.low, v, u);
            }
        }
        mesh
    }

    fn scanner(&self) -> Vec3 {
        sub([3.2, 3.1, 1.6], EXTENT.map(|e| e / 2.0)).map(|c| c * self.unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::{BTreeMap, BTreeSet};

    #[test]
    fn boundary_is_a_closed_manifold_of_genus_four() {
        let faces = Cells::new().boundary();
        let mut vertices = BTreeSet::new();
        let mut edges: BTreeMap<_, u32> = BTreeMap::new();
        for (corners, axis, _) in &faces {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let corner = |high_u: usize, high_v: usize| {
                let mut c = corners[0];
                c[u] = corners[high_u][u];
                c[v] = corners[high_v][v];
                c
            };
            let ring = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            for k in 0..4 {
                let (a, b) = (ring[k], ring[(k + 1) % 4]);
                vertices.insert(a);
                *edges.entry((a.min(b), a.max(b))).or_default() += 1;
            }
        }
        assert!(edges.values().all(|&n| n == 2));
        assert_eq!(
            vertices.len() as i64 - edges.len() as i64 + faces.len() as i64,
            2 - 2 * 4
        );
    }
}
