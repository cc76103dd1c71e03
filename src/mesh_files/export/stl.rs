//! Binary STL: triangles with the positions of their corners, without vertices.

use super::format::{Exceeded, Layout, MADE_BY, Mesh, MeshFormat, Positions, VertexColumn};

/// Binary STL.
pub struct Stl;

/// Bytes of a triangle: a normal, three positions, and two bytes without meaning.
const TRIANGLE: u64 = 50;

/// Bytes of the text at the start.
const TEXT: usize = 80;

impl MeshFormat for Stl {
    fn name(&self) -> &'static str {
        "STL"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["stl"]
    }

    fn wants_positions(&self) -> bool {
        true
    }

    fn holds_doubles(&self) -> bool {
        false
    }

    fn holds(&self, _: &Mesh, _: &VertexColumn) -> bool {
        false
    }

    fn exceeded(&self, mesh: &Mesh) -> Option<Exceeded> {
        let most = u64::from(u32::MAX);
        (mesh.triangles > most).then_some(Exceeded {
            unit: "triangles",
            found: mesh.triangles,
            most,
        })
    }

    fn layout(&self, mesh: &Mesh) -> Layout {
        // It must not begin with `solid`, as STL files of text do.
        let mut header = MADE_BY.as_bytes().to_vec();
        header.resize(TEXT, b' ');
        let count = u32::try_from(mesh.triangles).unwrap_or(u32::MAX);
        header.extend_from_slice(&count.to_le_bytes());
        Layout::of(header, mesh, 0, TRIANGLE)
    }

    fn put_vertices(&self, _: &Mesh, _: &[[f64; 3]], _: &[u8], _: &mut Vec<u8>) {}

    fn put_triangles(
        &self,
        _: &Mesh,
        _: &[[u32; 3]],
        positions: &[Positions],
        bytes: &mut Vec<u8>,
    ) {
        for corners in positions {
            let vectors = [normal(corners), corners[0], corners[1], corners[2]];
            let words = vectors.map(|v| v.map(|x| (x as f32).to_le_bytes()));
            bytes.extend_from_slice(words.as_flattened().as_flattened());
            bytes.extend_from_slice(&[0; 2]);
        }
    }
}

/// The unit normal of a triangle; zero if it has no area.
fn normal([a, b, c]: &Positions) -> [f64; 3] {
    let to = |p: &[f64; 3]| [0, 1, 2].map(|k| p[k] - a[k]);
    let (u, v) = (to(b), to(c));
    let n = [1, 2, 0].map(|k| {
        let (i, j) = (k, (k + 1) % 3);
        u[i] * v[j] - u[j] * v[i]
    });
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    if length > 0.0 && length.is_finite() {
        n.map(|x| x / length)
    } else {
        [0.0; 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_have_32_bits() {
        let mesh = |triangles| Mesh {
            triangles,
            ..Mesh::default()
        };
        let most = u64::from(u32::MAX);
        assert_eq!(Stl.exceeded(&mesh(most)), None);
        assert_eq!(Stl.exceeded(&mesh(most + 1)).unwrap().found, most + 1);
        assert_eq!(Stl.layout(&mesh(most)).header[80..], [255; 4]);
        assert_eq!(Stl.layout(&mesh(most)).bytes, 84 + 50 * most);
    }

    #[test]
    fn a_triangle_without_area_has_no_normal() {
        let flat = [[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]];
        assert_eq!(normal(&flat), [0.0; 3]);
        assert_eq!(
            normal(&[[0.0; 3], [0.0, 5.0, 0.0], [0.0, 0.0, 2.0]]),
            [1.0, 0.0, 0.0]
        );
    }
}
