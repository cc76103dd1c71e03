//! Distances by brute force, to triangles by a search on the simplex instead of by regions.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

/// A triangle mesh; a cloud if there are no triangles.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    pub positions: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn vertices(&self) -> String {
        let mut text = String::new();
        for [x, y, z] in &self.positions {
            writeln!(text, "{x} {y} {z}").unwrap();
        }
        text
    }

    fn faces(&self) -> String {
        let mut text = String::new();
        for [a, b, c] in &self.triangles {
            writeln!(text, "3 {a} {b} {c}").unwrap();
        }
        text
    }

    fn elements(&self) -> [String; 2] {
        [
            format!(
                "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n",
                self.positions.len()
            ),
            format!(
                "element face {}\nproperty list uchar uint vertex_indices\n",
                self.triangles.len()
            ),
        ]
    }

    pub fn ply(&self) -> String {
        let [vertex, face] = self.elements();
        let body = self.vertices() + &self.faces();
        format!("ply\nformat ascii 1.0\n{vertex}{face}end_header\n{body}")
    }

    pub fn ply_faces_first(&self) -> String {
        let [vertex, face] = self.elements();
        let body = self.faces() + &self.vertices();
        format!("ply\nformat ascii 1.0\n{face}{vertex}end_header\n{body}")
    }

    pub fn binary(&self) -> Vec<u8> {
        let [vertex, face] = self.elements();
        let header = format!("ply\nformat binary_little_endian 1.0\n{vertex}{face}end_header\n");
        let mut bytes = header.into_bytes();
        for c in self.positions.iter().flatten() {
            bytes.extend(c.to_le_bytes());
        }
        for triangle in &self.triangles {
            bytes.push(3);
            triangle.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        }
        bytes
    }

    /// Distance to the nearest point of any triangle.
    pub fn distance(&self, p: [f64; 3]) -> f64 {
        let corners = |t: &[u32; 3]| t.map(|v| self.positions[v as usize]);
        let all = self.triangles.iter().map(|t| to_triangle(corners(t), p));
        all.fold(f64::INFINITY, f64::min)
    }
}

fn to_point(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// Distance to the nearest of `points`.
pub fn nearest(points: &[[f64; 3]], p: [f64; 3]) -> f64 {
    points
        .iter()
        .map(|q| to_point(*q, p))
        .fold(f64::INFINITY, f64::min)
}

/// The distance is a convex function along any line in the triangle, and so is the least distance along lines
/// through one corner: a nested ternary search.
fn to_triangle([a, b, c]: [[f64; 3]; 3], p: [f64; 3]) -> f64 {
    let mix = |x: [f64; 3], y: [f64; 3], t: f64| [0, 1, 2].map(|i| x[i] + t * (y[i] - x[i]));
    // Along a segment the foot of the perpendicular is the nearest point.
    let along = |x: [f64; 3], y: [f64; 3]| {
        let (mut above, mut below) = (0.0, 0.0);
        for i in 0..3 {
            above += (p[i] - x[i]) * (y[i] - x[i]);
            below += (y[i] - x[i]).powi(2);
        }
        let t = if below > 0.0 {
            (above / below).clamp(0.0, 1.0)
        } else {
            0.0
        };
        to_point(mix(x, y, t), p)
    };
    // Segments from a point of `a b` to the point of `c b` at the same fraction: parallel to `a c`.
    let at = |t: f64| along(mix(a, b, t), mix(c, b, t));
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..90 {
        let (m, n) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if at(m) <= at(n) {
            high = n;
        } else {
            low = m;
        }
    }
    at(low).min(at(high)).min(at(0.0)).min(at(1.0))
}

/// The unit sphere, in `n` rings of `n` vertices and two poles.
pub fn sphere(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for ring in 0..n {
        let theta = PI * f64::from(ring + 1) / f64::from(n + 1);
        for step in 0..n {
            let phi = TAU * f64::from(step) / f64::from(n);
            let (s, c) = theta.sin_cos();
            mesh.positions.push([s * phi.cos(), s * phi.sin(), c]);
        }
    }
    let (north, south) = (n * n, n * n + 1);
    mesh.positions.extend([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]);
    for step in 0..n {
        let next = (step + 1) % n;
        mesh.triangles.push([north, step, next]);
        mesh.triangles
            .push([south, n * (n - 1) + next, n * (n - 1) + step]);
        for ring in 0..n - 1 {
            let at = |ring: u32, step: u32| ring * n + step;
            let [a, b, c, d] = [
                at(ring, step),
                at(ring + 1, step),
                at(ring + 1, next),
                at(ring, next),
            ];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}
