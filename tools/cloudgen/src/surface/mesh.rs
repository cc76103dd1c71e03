//! A given triangle mesh as a surface.

use std::{collections::HashMap, path::Path};

use super::tessellate::Tessellation;
use super::{Line, Sample, Surface, inside};
use crate::error::{Error, Result};
use crate::picker::Picker;
use crate::vec3::{Vec3, add, cross, dot, length, normalize, scale, sub};

/// A triangle mesh, moved to the origin and scaled.
#[derive(Debug)]
pub(crate) struct Mesh {
    mesh: Tessellation,
    picker: Picker,
    /// Curvature at each vertex: change of the normal per length.
    curvature: Vec<f64>,
    bounds: [Vec3; 2],
}

impl Mesh {
    /// `path` is for error messages.
    pub(crate) fn new(mesh: &Tessellation, size: f64, path: &Path) -> Result<Self> {
        let mut mesh = weld(mesh);
        let [low, high] = mesh.bounds();
        let unit = size / length(sub(high, low));
        let middle = scale(add(low, high), 0.5);
        for vertex in &mut mesh.vertices {
            *vertex = scale(sub(*vertex, middle), unit);
        }
        let area: f64 = (0..mesh.triangles.len()).map(|t| area(&mesh, t)).sum();
        // Also refuses a mesh with coordinates that are not finite.
        if !(area > 0.0 && area.is_finite()) {
            return Err(Error::mesh(path, "no triangle with an area"));
        }
        let picker = Picker::new((0..mesh.triangles.len()).map(|t| self::area(&mesh, t)));
        Ok(Mesh {
            curvature: curvature(&mesh),
            bounds: mesh.bounds(),
            picker,
            mesh,
        })
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        corners(&self.mesh, triangle)
    }
}

/// Merges vertices at one position; removes unused ones.
fn weld(mesh: &Tessellation) -> Tessellation {
    let mut known: HashMap<[u64; 3], u32> = HashMap::new();
    let mut out = Tessellation::default();
    for triangle in &mesh.triangles {
        let triangle = triangle.map(|v| {
            // Adding zero gives both zeros the same sign.
            let place = mesh.vertices[v as usize].map(|c| c + 0.0);
            *known.entry(place.map(f64::to_bits)).or_insert_with(|| {
                out.vertices.push(place);
                out.vertices.len() as u32 - 1
            })
        });
        let [a, b, c] = triangle;
        if a != b && b != c && c != a {
            out.triangles.push(triangle);
        }
    }
    out
}

fn corners(mesh: &Tessellation, triangle: usize) -> [Vec3; 3] {
    mesh.triangles[triangle].map(|v| mesh.vertices[v as usize])
}

/// The normal; its length is twice the area.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    cross(sub(b, a), sub(c, a))
}

fn area(mesh: &Tessellation, triangle: usize) -> f64 {
    length(normal(corners(mesh, triangle))) / 2.0
}

/// For each vertex the mean over its edges of the change of the vertex normal per length.
fn curvature(mesh: &Tessellation) -> Vec<f64> {
    let mut normals = vec![[0.0; 3]; mesh.vertices.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let normal = normal(corners(mesh, t));
        for &v in triangle {
            normals[v as usize] = add(normals[v as usize], normal);
        }
    }
    let normals: Vec<Vec3> = normals.into_iter().map(normalize).collect();
    let mut sums = vec![(0.0, 0u32); mesh.vertices.len()];
    for &[a, b, c] in &mesh.triangles {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let [p, q] = [p, q].map(|v| v as usize);
            let edge = length(sub(mesh.vertices[p], mesh.vertices[q]));
            if edge > 0.0 {
                let turn = length(sub(normals[p], normals[q])) / edge;
                for v in [p, q] {
                    sums[v] = (sums[v].0 + turn, sums[v].1 + 1);
                }
            }
        }
    }
    let mean = |(sum, count): (f64, u32)| sum / f64::from(count.max(1));
    sums.into_iter().map(mean).collect()
}

/// Squared distance of a point to a triangle.
pub(crate) fn distance2([a, b, c]: [Vec3; 3], p: Vec3) -> f64 {
    let full = normal([a, b, c]);
    let inner = |(s, e): (Vec3, Vec3)| dot(cross(sub(e, s), sub(p, s)), full) >= 0.0;
    let edges = [(a, b), (b, c), (c, a)];
    let square = dot(full, full);
    if square > 0.0 && edges.into_iter().all(inner) {
        let height = dot(full, sub(p, a));
        return height * height / square;
    }
    let to_edge = |(s, e): (Vec3, Vec3)| {
        let along = sub(e, s);
        let t = (dot(sub(p, s), along) / dot(along, along)).clamp(0.0, 1.0);
        let off = sub(p, add(s, scale(along, t)));
        dot(off, off)
    };
    edges.into_iter().map(to_edge).fold(f64::INFINITY, f64::min)
}

impl Surface for Mesh {
    fn area(&self) -> f64 {
        self.picker.total()
    }

    fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    fn at(&self, u: f64, v: f64) -> Sample {
        let (triangle, t) = self.picker.pick(u);
        let corners = self.corners(triangle);
        Sample {
            position: inside(&corners, t, v),
            normal: normalize(normal(corners)),
        }
    }

    /// None: a mesh has no direction for scanning.
    fn scan_lines(&self, _spacing: f64) -> Vec<Line> {
        Vec::new()
    }

    fn on_line(&self, line: &Line, t: f64, v: f64) -> Sample {
        let _ = line;
        self.at(t, v)
    }

    fn distance(&self, p: Vec3) -> f64 {
        let square = |t| distance2(self.corners(t), p);
        let triangles = 0..self.mesh.triangles.len();
        triangles.map(square).fold(f64::INFINITY, f64::min).sqrt()
    }

    fn curvature(&self, u: f64, v: f64) -> Option<f64> {
        let (triangle, t) = self.picker.pick(u);
        let at = |vertex: u32| [self.curvature[vertex as usize], 0.0, 0.0];
        Some(inside(&self.mesh.triangles[triangle].map(at), t, v)[0])
    }

    fn reference(&self, _tolerance: f64) -> Tessellation {
        self.mesh.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_a_triangle() {
        let triangle = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        for (p, d) in [
            ([0.5, 0.5, 3.0], 3.0),
            ([-1.0, 1.0, 0.0], 1.0),
            ([3.0, 0.0, 0.0], 1.0),
            ([2.0, 2.0, 0.0], 2f64.sqrt()),
            ([-3.0, -4.0, 0.0], 5.0),
        ] {
            assert!((distance2(triangle, p).sqrt() - d).abs() < 1e-12, "{p:?}");
        }
    }

    #[test]
    fn copies_of_vertices_are_welded() {
        let mesh = Tessellation {
            vertices: vec![
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 1.0, 0.0],
                [-0.0, 0.0, 0.0],
                [9.0, 9.0, 9.0],
                [0.0, 1.0, 0.0],
            ],
            triangles: vec![[0, 1, 2], [3, 2, 5], [0, 3, 5]],
        };
        let welded = weld(&mesh);
        assert_eq!(welded.vertices.len(), 4);
        assert_eq!(welded.triangles, [[0, 1, 2], [0, 2, 3]]);
    }
}
