//! A part of a surface in memory, and what a cylinder or a line meets of it.

use super::grid::Grid;
use crate::compare::pages::Item;
use outcrop_disk::error::Result;
use outcrop_geom::vector::{Box3, V3, add, cross, dot, scale, sub};

/// A vertex of a mesh with its share of the triangles around it, or a point of a cloud.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub position: V3,
    /// A third of the sum of the area vectors of its triangles; zero for a cloud.
    pub facing: V3,
    /// A third of the area of its triangles; 1 for a cloud.
    pub weight: f64,
}

/// The points of a surface in a box.
#[derive(Debug, Default)]
pub(super) struct Patch {
    /// Each position once.
    points: Vec<Point>,
    grid: Grid,
    /// The points by the cells of the grid.
    sorted: Vec<Point>,
    /// Positions along an axis, and weights, of the points in a cylinder; then what an earlier cylinder left.
    inside: Vec<(f64, f64)>,
}

/// The points of a surface inside a cylinder.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layer {
    /// Mean position along the axis, by weight.
    pub mean: f64,
    /// Square of the standard error of the mean.
    pub error2: f64,
}

/// Cosine of the largest tilt of a layer that is farther away than the radius: of 60°. A wall of a new house meets the
/// ground behind it, which is no change of the wall.
const TILT: f64 = 0.5;

/// A line through a point with a direction of length 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis {
    pub at: V3,
    pub along: V3,
}

impl Axis {
    /// The box around the part of the cylinder of this radius that is at most `far` from the point.
    pub fn around(&self, radius: f64, far: f64) -> Box3 {
        let [x, y, z] = [0, 1, 2].map(|k| (self.along[k] * far).abs() + radius);
        Box3 {
            min: sub(self.at, [x, y, z]),
            max: add(self.at, [x, y, z]),
        }
    }

    /// Where a point is along the axis, and whether it is inside the cylinder of this radius, and faces along it as
    /// [`is_along`] says, or has no direction.
    #[inline]
    fn holds(&self, point: &Point, radius: f64, least: f64) -> (f64, bool) {
        let d = sub(point.position, self.at);
        let t = dot(d, self.along);
        let is_near = dot(d, d) - t * t <= radius * radius;
        let faces = is_along(point.facing, self, least) | (point.facing == [0.0; 3]);
        (t, is_near & faces)
    }

    /// Where the line meets a triangle that faces along it.
    pub fn meeting(&self, [a, b, c]: &[V3; 3], least: f64) -> Option<f64> {
        let normal = cross(sub(*b, *a), sub(*c, *a));
        if !is_along(normal, self, least) {
            return None;
        }
        let slope = dot(normal, self.along);
        let [a, b, c] = [a, b, c].map(|p| sub(*p, self.at));
        let side = |p: V3, q: V3| dot(cross(p, q), self.along);
        let inside = side(a, b) >= 0.0 && side(b, c) >= 0.0 && side(c, a) >= 0.0;
        inside.then(|| dot(normal, a) / slope)
    }
}

/// A box with this much more on all sides.
pub(super) fn grown(Box3 { min, max }: Box3, by: f64) -> Box3 {
    Box3 {
        min: min.map(|c| c - by),
        max: max.map(|c| c + by),
    }
}

/// Part of the radius up to which a layer is looked for at first: most surfaces did not move.
const USUAL: f64 = 0.25;

/// Cells of a grid in a radius: of smaller ones less is looked at in vain.
const CELLS: f64 = 2.0;

impl Patch {
    pub fn clear(&mut self) {
        self.points.clear();
    }

    pub fn add(&mut self, point: Point) {
        self.points.push(point);
    }

    /// Divides the points into cells for cylinders of this radius.
    pub fn divide(&mut self, radius: f64) {
        let positions = self.points.iter().map(|point| point.position);
        self.grid.set(positions, radius / CELLS);
        self.sorted.clear();
        let numbers = self.grid.numbers();
        self.sorted
            .extend(numbers.map(|number| self.points[number]));
        self.inside.resize(self.points.len() + 1, (0.0, 0.0));
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let points = (self.points.capacity() + self.sorted.capacity()) * size_of::<Point>();
        (points + self.inside.capacity() * 16) as u64 + self.grid.bytes()
    }

    /// The mean direction of the surface within a radius of one of its vertices, of length 1; what faces the
    /// other way does not count.
    pub fn normal(&self, vertex: &Point, radius: f64) -> Option<V3> {
        let mut sum = [0.0; 3];
        let around = grown(vertex.position.bounds(), radius);
        self.grid.near(&around, |run| {
            for point in &self.sorted[run] {
                let d = sub(point.position, vertex.position);
                let counts =
                    (dot(d, d) <= radius * radius) & (dot(point.facing, vertex.facing) > 0.0);
                // No branch: about half of the points count.
                let share = f64::from(u8::from(counts));
                for (sum, facing) in sum.iter_mut().zip(point.facing) {
                    *sum += share * facing;
                }
            }
        });
        let length = dot(sum, sum).sqrt();
        (length > 0.0).then(|| scale(sum, 1.0 / length))
    }

    /// True if a point that faces along the axis is inside a cylinder, at most `far` from the axis' point.
    pub fn has(&self, axis: &Axis, radius: f64, far: f64) -> bool {
        // Where both surfaces are, there is a point nearby.
        [0.5, 1.0].iter().any(|part| {
            let mut found = false;
            self.grid
                .near(&axis.around(part * radius, part * far), |run| {
                    found = found
                        || self.sorted[run].iter().any(|point| {
                            let (t, counts) = axis.holds(point, radius, 0.0);
                            counts && t.abs() <= far
                        });
                });
            found
        })
    }

    /// Finds the points in the cylinder, at most `reach` from the axis' point. Returns their number.
    fn look(&mut self, axis: &Axis, radius: f64, reach: f64, least: f64) -> usize {
        let Self {
            grid,
            sorted,
            inside,
            ..
        } = self;
        let mut count = 0;
        grid.near(&axis.around(radius, reach), |run| {
            for point in &sorted[run] {
                let (t, counts) = axis.holds(point, radius, least);
                // No branch: about half of the points count.
                inside[count] = (t, point.weight);
                count += usize::from(counts & (t.abs() <= reach));
            }
        });
        count
    }

    /// The part of the surface inside a cylinder that is nearest to the axis' point, at most `far` from it: all
    /// points up to a radius before and behind the nearest one. What faces away does not count, and farther away than a
    /// radius nothing that is tilted more than [`TILT`]. `hit` tells where the axis meets the surface.
    pub fn layer(
        &mut self,
        axis: &Axis,
        radius: f64,
        far: f64,
        hit: impl FnOnce(f64) -> Result<Option<f64>>,
    ) -> Result<Option<Layer>> {
        let least = if far > radius { TILT } else { 0.0 };
        let reach = match far > radius {
            true => far + radius,
            false => far.min(USUAL * radius) + radius,
        };
        let mut count = self.look(axis, radius, reach, least);
        let nearest = self.inside[..count].iter().map(|(t, _)| *t);
        let nearest = nearest.min_by(|a, b| {
            let by_length = a.abs().total_cmp(&b.abs());
            by_length.then(a.total_cmp(b))
        });
        let nearest = nearest.filter(|t| t.abs() <= far);
        if nearest.is_some_and(|t| t.abs() + radius > reach) {
            count = self.look(axis, radius, far + radius, least);
        }
        let hit = match nearest {
            Some(t) if t.abs() <= radius => None,
            _ => hit(least)?,
        };
        Ok(match (nearest, hit) {
            // A large triangle has no corner here.
            (None, Some(t)) => Some(Layer {
                mean: t,
                error2: 0.0,
            }),
            (Some(near), Some(t)) if t.abs() < near.abs() - radius => Some(Layer {
                mean: t,
                error2: 0.0,
            }),
            (Some(near), _) => {
                let near = |t: &&(f64, f64)| (t.0 - near).abs() <= radius;
                Some(spread(self.inside[..count].iter().filter(near).copied()))
            }
            (None, None) => None,
        })
    }
}

/// Mean and standard error of positions with weights.
fn spread(points: impl Iterator<Item = (f64, f64)> + Clone) -> Layer {
    let (mut all, mut squares, mut sum) = (0.0, 0.0, 0.0);
    for (t, weight) in points.clone() {
        all += weight;
        squares += weight * weight;
        sum += weight * t;
    }
    let mean = sum / all;
    // As many points of equal weight would tell as much.
    let number = all * all / squares;
    let scatter: f64 = points.map(|(t, w)| w * (t - mean) * (t - mean)).sum();
    let error2 = match number > 1.0 {
        true => scatter / all / (number - 1.0),
        false => 0.0,
    };
    Layer { mean, error2 }
}

/// True if a direction has more than this cosine with the axis.
fn is_along(facing: V3, axis: &Axis, least: f64) -> bool {
    let along = dot(facing, axis.along);
    along > 0.0 && along * along > least * least * dot(facing, facing)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: V3 = [0.0, 0.0, 1.0];

    fn row(n: i32, z: f64, facing: V3) -> impl Iterator<Item = Point> {
        (0..n).map(move |k| Point {
            position: [0.1 * f64::from(k), 0.0, z + 0.01 * f64::from(k % 2)],
            facing,
            weight: 1.0,
        })
    }

    fn patch(points: impl Iterator<Item = Point>) -> Patch {
        let mut patch = Patch::default();
        points.for_each(|point| patch.add(point));
        patch.divide(1.0);
        patch
    }

    const AXIS: Axis = Axis {
        at: [0.0; 3],
        along: UP,
    };

    #[test]
    fn a_line_meets_what_faces_along_it() {
        let triangle = [[0.0, 0.0, 3.0], [2.0, 2.0, 3.0], [0.0, 2.0, 3.0]];
        let at = |along: V3| Axis {
            at: [0.5, 1.5, 1.0],
            along,
        };
        assert_eq!(at(UP).meeting(&triangle, 0.0), Some(2.0));
        assert_eq!(at([0.0, 0.0, -1.0]).meeting(&triangle, 0.0), None);
        assert_eq!(at([0.8, 0.0, 0.6]).meeting(&triangle, 0.9), None);
        // No vertex is in the cylinder.
        let mut none = patch(row(0, 0.0, UP));
        let layer = none.layer(&AXIS, 0.1, 9.0, |_| Ok(Some(2.0)));
        let layer = layer.unwrap().unwrap();
        assert_eq!((layer.mean, layer.error2), (2.0, 0.0));
    }

    #[test]
    fn the_nearest_layer_counts() {
        let mut patch = patch(row(4, 1.0, UP).chain(row(4, 5.0, UP)));
        let layer = patch.layer(&AXIS, 1.0, 9.0, |_| Ok(None)).unwrap().unwrap();
        assert!((layer.mean - 1.005).abs() < 1e-12);
        // The variance of four values, half of them 0.01 higher, is 0.0001 / 3; that of their mean a quarter of it.
        assert!((layer.error2 - 1e-4 / 12.0).abs() < 1e-12, "{layer:?}");
    }

    #[test]
    fn a_layer_is_whole_wherever_its_nearest_point_is() {
        // The nearest point is farther away than most, and the rest of its layer farther than is looked at first.
        let mut patch = patch(row(4, 0.9, UP).chain(row(4, 1.8, UP)));
        let layer = patch.layer(&AXIS, 1.0, 1.0, |_| Ok(None)).unwrap().unwrap();
        assert!((layer.mean - 1.355).abs() < 1e-12, "{layer:?}");
        assert!(patch.has(&AXIS, 1.0, 1.0) && !patch.has(&AXIS, 1.0, 0.8));
    }

    #[test]
    fn normals_leave_out_what_faces_away() {
        let patch = patch(row(4, 0.0, UP).chain(row(4, 0.2, [0.0, 0.0, -1.0])));
        let [first, ..] = patch.points[..] else {
            panic!("no points")
        };
        assert_eq!(patch.normal(&first, 1.0), Some(UP));
        assert_eq!(
            patch.normal(
                &Point {
                    facing: [0.0; 3],
                    ..first
                },
                1.0
            ),
            None
        );
    }
}
