//! Properties of every mesh, for any cloud.

use super::Mesh;
use super::surface::{Surface, Triangle};
use outcrop_geom::sub;
use std::collections::{BTreeMap, BTreeSet};

/// The shape of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    pub vertices: usize,
    pub edges: usize,
    pub triangles: usize,
    /// Edges with one triangle.
    pub boundary: usize,
}

impl Shape {
    pub fn euler(&self) -> i64 {
        self.vertices as i64 - self.edges as i64 + self.triangles as i64
    }
}

/// Checks a mesh (and with `split`, that pinched vertices were split) and measures its shape.
pub fn check(mesh: &Mesh, split: bool) -> Result<Shape, String> {
    let sorted = |t: &[u32; 3]| {
        let mut t = t.map(|index| mesh.vertices[index as usize]);
        t.sort_unstable();
        t
    };
    let ids: Vec<Triangle> = mesh.triangles.iter().map(sorted).collect();
    if !ids.is_sorted_by(|a, b| a < b) {
        return Err("triangles out of order, or twice".into());
    }
    let mut half_edges = BTreeMap::new();
    for (&t, ids) in mesh.triangles.iter().zip(&ids) {
        let [p, q, r] = t.map(|index| mesh.ids[mesh.vertices[index as usize] as usize]);
        let (a, b) = (sub(q, p).map(i128::from), sub(r, p).map(i128::from));
        if a[0] * b[1] == a[1] * b[0] && a[1] * b[2] == a[2] * b[1] && a[2] * b[0] == a[0] * b[2] {
            return Err(format!("{t:?} is flat"));
        }
        if mesh.vertices[t[0] as usize] != ids[0] {
            return Err(format!("{t:?} does not begin with its smallest id"));
        }
        for (from, to) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            if half_edges.insert((from, to), t).is_some() {
                return Err(format!("two triangles run from {from} to {to}"));
            }
        }
    }
    let ascending = |t: &[u32; 3]| {
        let mut t = *t;
        t.sort_unstable();
        t
    };
    let surface = Surface::of(mesh.triangles.iter().map(ascending));
    if surface.vertices().len() != mesh.vertices.len() {
        return Err("a vertex without triangles".into());
    }
    if split
        && surface
            .vertices()
            .iter()
            .any(|&v| surface.fans(v).len() != 1)
    {
        return Err("a vertex with several fans".into());
    }
    let edges: BTreeSet<_> = half_edges
        .keys()
        .map(|&(a, b)| (a.min(b), a.max(b)))
        .collect();
    let boundary = half_edges
        .keys()
        .filter(|(a, b)| !half_edges.contains_key(&(*b, *a)))
        .count();
    Ok(Shape {
        vertices: mesh.vertices.len(),
        edges: edges.len(),
        triangles: mesh.triangles.len(),
        boundary,
    })
}
