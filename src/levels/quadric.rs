//! Quadrics: sums of squared distances from planes, about the position of a vertex.
//!
//! Garland and Heckbert, "Surface Simplification Using Quadric Error Metrics", 1997. Here a quadric is kept about the
//! position of its own vertex, so that large coordinates cost no precision.

pub(super) type V3 = [f64; 3];

/// Numbers of a quadric.
pub(super) const NUMBERS: usize = 11;

/// Sum over planes of area × squared distance of a position, given by its difference to that of the vertex.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Quadric {
    /// Of the second order: xx, xy, xz, yy, yz, zz.
    a: [f64; 6],
    /// Half of the first order.
    b: V3,
    c: f64,
    /// Area of the triangles.
    pub area: f64,
}

pub(super) fn minus(p: V3, q: V3) -> V3 {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

pub(super) fn dot(p: V3, q: V3) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

pub(super) fn cross(p: V3, q: V3) -> V3 {
    [
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    ]
}

/// Weight of the pull towards the middle of an edge, by which a position is chosen where the planes leave it open: a
/// part of the weight of the planes.
const PULL: f64 = 1e-4;

/// The quadrics of vertices: the planes of their triangles, by area.
pub(super) fn of_triangles(points: &[V3], triangles: &[[u32; 3]]) -> Vec<Quadric> {
    let mut all = vec![Quadric::default(); points.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| points[v as usize]);
        let normal = cross(minus(b, a), minus(c, a));
        let twice = dot(normal, normal).sqrt();
        if twice > 0.0 {
            for v in *triangle {
                let quadric = &mut all[v as usize];
                quadric.add_plane(normal.map(|x| x / twice), twice / 2.0);
                quadric.area += twice / 2.0;
            }
        }
    }
    all
}

impl Quadric {
    /// The plane with this unit normal through the vertex.
    pub fn add_plane(&mut self, n: V3, weight: f64) {
        let products = [
            n[0] * n[0],
            n[0] * n[1],
            n[0] * n[2],
            n[1] * n[1],
            n[1] * n[2],
            n[2] * n[2],
        ];
        (0..6).for_each(|k| self.a[k] += weight * products[k]);
    }

    fn times(&self, d: V3) -> V3 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        [
            xx * d[0] + xy * d[1] + xz * d[2],
            xy * d[0] + yy * d[1] + yz * d[2],
            xz * d[0] + yz * d[1] + zz * d[2],
        ]
    }

    /// Its value at the vertex.
    pub fn here(&self) -> f64 {
        self.c
    }

    /// Its value at the vertex + `d`.
    pub fn at(&self, d: V3) -> f64 {
        let ad = self.times(d);
        (dot(ad, d) + 2.0 * dot(self.b, d) + self.c).max(0.0)
    }

    /// The same quadric about the vertex + `d`.
    pub fn moved(&self, d: V3) -> Self {
        let ad = self.times(d);
        Self {
            a: self.a,
            b: [self.b[0] + ad[0], self.b[1] + ad[1], self.b[2] + ad[2]],
            c: self.at(d),
            area: self.area,
        }
    }

    /// The sum of two quadrics about the same position.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            a: std::array::from_fn(|k| self.a[k] + other.a[k]),
            b: std::array::from_fn(|k| self.b[k] + other.b[k]),
            c: self.c + other.c,
            area: self.area + other.area,
        }
    }

    /// The difference to its vertex at which it is least; where the planes leave that open, near `middle`. None if
    /// there are no planes.
    pub fn least(&self, middle: V3) -> Option<V3> {
        let trace = self.a[0] + self.a[3] + self.a[5];
        let pull = PULL * trace;
        if !(pull > 0.0 && pull.is_finite()) {
            return None;
        }
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let (xx, yy, zz) = (xx + pull, yy + pull, zz + pull);
        let right: V3 = std::array::from_fn(|k| pull * middle[k] - self.b[k]);
        // By the inverse of a symmetric positive matrix.
        let (i, j, k) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
        let determinant = xx * i + xy * j + xz * k;
        if !(determinant > 0.0 && determinant.is_finite()) {
            return None;
        }
        let (l, m, n) = (xx * zz - xz * xz, xz * xy - xx * yz, xx * yy - xy * xy);
        let rows = [[i, j, k], [j, l, m], [k, m, n]];
        let found = rows.map(|row| dot(row, right) / determinant);
        found.iter().all(|x| x.is_finite()).then_some(found)
    }

    pub fn numbers(&self) -> [f64; NUMBERS] {
        let mut all = [0.0; NUMBERS];
        all[..6].copy_from_slice(&self.a);
        all[6..9].copy_from_slice(&self.b);
        all[9] = self.c;
        all[10] = self.area;
        all
    }

    pub fn of_numbers(all: &[f64; NUMBERS]) -> Self {
        Self {
            a: std::array::from_fn(|k| all[k]),
            b: std::array::from_fn(|k| all[6 + k]),
            c: all[9],
            area: all[10],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit() -> impl Strategy<Value = V3> {
        [-1.0f64..1.0, -1.0f64..1.0, -1.0f64..1.0]
            .prop_filter("long enough", |v| dot(*v, *v) > 0.01)
            .prop_map(|v| v.map(|x| x / dot(v, v).sqrt()))
    }

    fn place() -> impl Strategy<Value = V3> {
        [-5.0f64..5.0, -5.0f64..5.0, -5.0f64..5.0]
    }

    proptest! {
        /// Against distances from the planes, one by one.
        #[test]
        fn a_sum_of_quadrics_is_the_sum_of_squared_distances(
            vertices in prop::collection::vec((place(), prop::collection::vec((unit(), 0.1f64..3.0), 1..4)), 2..6),
            p in place(),
        ) {
            let about = vertices[0].0;
            let mut sum = Quadric::default();
            for (v, planes) in &vertices {
                let mut quadric = Quadric::default();
                planes.iter().for_each(|(n, weight)| quadric.add_plane(*n, *weight));
                sum = sum.plus(&quadric.moved(minus(about, *v)));
            }
            let distance = |v: V3, n: V3| dot(n, minus(p, v));
            let all = vertices.iter().flat_map(|(v, planes)| planes.iter().map(move |plane| (*v, *plane)));
            let expected: f64 = all.map(|(v, (n, weight))| weight * distance(v, n).powi(2)).sum();
            let found = sum.at(minus(p, about));
            prop_assert!((found - expected).abs() <= 1e-9 * (1.0 + expected), "{found} {expected}");
            prop_assert_eq!(Quadric::of_numbers(&sum.numbers()), sum);
            let least = sum.least([0.0; 3]).unwrap();
            prop_assert!(sum.at(least) <= found + 1e-2 * (1.0 + expected));
        }
    }

    #[test]
    fn three_planes_give_their_corner_and_one_gives_the_middle() {
        let mut quadric = Quadric::default();
        (0..3).for_each(|k| quadric.add_plane(std::array::from_fn(|n| f64::from(n == k)), 1.0));
        let corner = quadric.moved([1.0, 2.0, 3.0]).least([0.0; 3]).unwrap();
        (0..3).for_each(|k| assert!((corner[k] + (k + 1) as f64).abs() < 1e-3, "{corner:?}"));
        let mut plane = Quadric::default();
        plane.add_plane([0.0, 0.0, 1.0], 2.0);
        let found = plane.least([0.5, 0.25, 0.5]).unwrap();
        assert!(
            (found[0] - 0.5).abs() < 1e-9 && found[2].abs() < 1e-3,
            "{found:?}"
        );
        assert_eq!(Quadric::default().least([0.0; 3]), None);
    }
}
