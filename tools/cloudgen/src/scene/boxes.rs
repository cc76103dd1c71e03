//! Bodies made of boxes that are added and taken away: their surface, without anything inside.

use std::collections::HashMap;

use crate::surface::Tessellation;
use crate::vec3::Vec3;

/// Boxes in the order in which they are added (true) or taken away, as lower and upper corners.
#[derive(Clone, Debug, Default)]
pub(super) struct Boxes(Vec<(bool, [Vec3; 2])>);

/// The space divided along the planes of all boxes.
struct Cells {
    cuts: [Vec<f64>; 3],
    solid: Vec<bool>,
}

impl Boxes {
    /// Adds a box.
    pub(super) fn add(&mut self, low: Vec3, high: Vec3) {
        self.0.push((true, [low, high]));
    }

    /// Takes a box away from what is there.
    pub(super) fn cut(&mut self, low: Vec3, high: Vec3) {
        self.0.push((false, [low, high]));
    }

    /// The surface, anticlockwise as seen from outside. It has no vertices inside edges.
    pub(super) fn surface(&self) -> Tessellation {
        let cells = Cells::new(&self.0);
        let mut mesh = Tessellation::default();
        let mut known: HashMap<[usize; 3], u32> = HashMap::new();
        let count: [usize; 3] = std::array::from_fn(|k| cells.cuts[k].len().saturating_sub(1));
        let mut vertex = |mesh: &mut Tessellation, at: [usize; 3]| {
            *known.entry(at).or_insert_with(|| {
                mesh.vertices
                    .push(std::array::from_fn(|k| cells.cuts[k][at[k]]));
                mesh.vertices.len() as u32 - 1
            })
        };
        for n in 0..count.iter().product() {
            let cell = [
                n % count[0],
                n / count[0] % count[1],
                n / count[0] / count[1],
            ];
            for (axis, up) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)] {
                if !cells.solid[n] || cells.beyond(cell, axis, up == 1) {
                    continue;
                }
                let mut corner = cell;
                corner[axis] += up;
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[s, t]| {
                    let mut at = corner;
                    at[u] += s;
                    at[v] += t;
                    vertex(&mut mesh, at)
                });
                if up == 0 {
                    quad.reverse();
                }
                let [a, b, c, d] = quad;
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh
    }
}

impl Cells {
    fn new(boxes: &[(bool, [Vec3; 2])]) -> Self {
        let cuts: [Vec<f64>; 3] = std::array::from_fn(|axis| {
            let sides = boxes.iter().flat_map(|(_, sides)| sides);
            let mut cuts: Vec<f64> = sides.map(|corner| corner[axis]).collect();
            cuts.sort_by(f64::total_cmp);
            cuts.dedup();
            cuts
        });
        let count = [0, 1, 2].map(|k| cuts[k].len().saturating_sub(1));
        let mut cells = Cells {
            solid: vec![false; count.iter().product()],
            cuts,
        };
        for (added, [low, high]) in boxes {
            let [x, y, z] = [0, 1, 2].map(|k| {
                let before = |c: f64| cells.cuts[k].partition_point(|cut| *cut < c);
                before(low[k])..before(high[k])
            });
            for (k, j) in z.flat_map(|k| y.clone().map(move |j| (k, j))) {
                let row = (k * count[1] + j) * count[0];
                cells.solid[row + x.start..row + x.end].fill(*added);
            }
        }
        cells
    }

    /// True if the cell on this side of another is solid.
    fn beyond(&self, mut cell: [usize; 3], axis: usize, up: bool) -> bool {
        let count = [0, 1, 2].map(|k| self.cuts[k].len() - 1);
        let next = if up {
            Some(cell[axis] + 1)
        } else {
            cell[axis].checked_sub(1)
        };
        let Some(next) = next.filter(|n| *n < count[axis]) else {
            return false;
        };
        cell[axis] = next;
        self.solid[(cell[2] * count[1] + cell[1]) * count[0] + cell[0]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::bodies::volume;
    use crate::surface::topology;

    #[test]
    fn a_hollow_box_with_a_window_is_a_closed_surface() {
        let mut boxes = Boxes::default();
        boxes.add([0.0; 3], [4.0, 3.0, 2.0]);
        boxes.cut([1.0; 3], [3.0, 2.0, 1.5]);
        let hollow = boxes.surface();
        assert_eq!(topology(&hollow), (4, true));
        assert!((volume(&hollow) - (24.0 - 1.0)).abs() < 1e-9);
        boxes.cut([1.5, -1.0, 1.1], [2.0, 1.5, 1.2]);
        let window = boxes.surface();
        assert_eq!(topology(&window), (2, true));
        assert!((volume(&window) - (23.0 - 0.05)).abs() < 1e-9);
    }
}
