//! Binary little-endian PLY.

use super::format::{CoordinateType, Layout, MADE_BY, Mesh, MeshFormat, Positions, VertexColumn};
use outcrop_ply::{Encoding, Scalar, TRIANGLE, put_triangle};

/// Binary little-endian PLY.
pub struct Ply;

/// The last line of a header.
const END: &str = "end_header\n";

impl MeshFormat for Ply {
    fn name(&self) -> &'static str {
        "PLY"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["ply"]
    }

    fn holds_doubles(&self) -> bool {
        true
    }

    fn holds_filled(&self) -> bool {
        true
    }

    fn holds(&self, _: &Mesh, _: &VertexColumn) -> bool {
        true
    }

    fn layout(&self, mesh: &Mesh) -> Layout {
        let coordinates = match mesh.coordinates {
            CoordinateType::Float => Scalar::F32,
            CoordinateType::Double => Scalar::F64,
        };
        // With up to 2^31 vertices, use the signed index type that every reader supports.
        let index = match mesh.vertices <= 1 << 31 {
            true => Scalar::I32,
            false => Scalar::U32,
        };
        let comments = [MADE_BY]
            .into_iter()
            .chain(mesh.comments.iter().map(String::as_str));
        let columns = mesh.columns.iter();
        let layout = outcrop_ply::Layout {
            encoding: Encoding::Little,
            comments: &comments.collect::<Vec<_>>(),
            vertices: mesh.vertices,
            coordinates,
            columns: &columns.map(|c| (&*c.name, c.scalar)).collect::<Vec<_>>(),
            triangles: Some((mesh.triangles, index)),
        };
        let vertex = 3 * coordinates.bytes() + mesh.value_bytes();
        let mut header = layout.header();
        let mut triangle = TRIANGLE as u64;
        if mesh.filled.is_some() {
            let lines = header.strip_suffix(END).unwrap_or(&header);
            header = format!("{lines}property uchar filled\n{END}");
            triangle += 1;
        }
        Layout::of(header.into_bytes(), mesh, vertex as u64, triangle)
    }

    fn put_vertices(
        &self,
        mesh: &Mesh,
        positions: &[[f64; 3]],
        values: &[u8],
        bytes: &mut Vec<u8>,
    ) {
        let each = mesh.value_bytes();
        for (number, position) in positions.iter().enumerate() {
            match mesh.coordinates {
                CoordinateType::Float => {
                    let words = position.map(|x| (x as f32).to_le_bytes());
                    bytes.extend_from_slice(words.as_flattened());
                }
                CoordinateType::Double => {
                    bytes.extend_from_slice(position.map(f64::to_le_bytes).as_flattened());
                }
            }
            bytes.extend_from_slice(&values[number * each..][..each]);
        }
    }

    fn put_triangles(
        &self,
        mesh: &Mesh,
        triangles: &[[u32; 3]],
        _: &[Positions],
        bytes: &mut Vec<u8>,
    ) {
        for t in triangles {
            put_triangle(*t, bytes);
            bytes.extend(mesh.filled.map(u8::from));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::format::VertexColumn;
    use outcrop_ply::{Header, Property};

    #[test]
    fn columns_and_comments_are_read_as_they_were_written() {
        let column = |name: &str, scalar| VertexColumn {
            name: name.into(),
            scalar,
        };
        let mesh = Mesh {
            vertices: 3,
            triangles: 1,
            coordinates: CoordinateType::Double,
            columns: vec![column("red", Scalar::U8), column("height", Scalar::F32)],
            comments: vec!["crs\nend_header".into()],
            ..Mesh::default()
        };
        let layout = Ply.layout(&mesh);
        let mut bytes = layout.header.clone();
        let positions = [[0.0, 0.5, 1e6], [1.0, -0.5, 1e-6], [3.0, 2.5, 0.1]];
        let mut values = Vec::new();
        for n in 0..3u8 {
            values.push(200 + n);
            values.extend_from_slice(&(f32::from(n) + 0.25).to_le_bytes());
        }
        Ply.put_vertices(&mesh, &positions, &values, &mut bytes);
        assert_eq!(bytes.len() as u64, layout.vertices.offset(3));
        Ply.put_triangles(&mesh, &[[2, 0, 1]], &[], &mut bytes);
        assert_eq!(bytes.len() as u64, layout.bytes);

        let read = outcrop_ply::Mesh::read(&bytes[..], layout.bytes).unwrap();
        assert_eq!(read.vertices, positions);
        assert_eq!(read.triangles, [[2, 0, 1]]);
        let header = Header::read(&mut &bytes[..]).unwrap();
        let vertex = &header.elements[0].properties;
        let added = [("red", Scalar::U8), ("height", Scalar::F32)]
            .map(|(name, scalar)| (name.to_owned(), Property::One(scalar)));
        assert_eq!(vertex[3..], added);
        // The second vertex ends with its values.
        let end = layout.vertices.offset(2) as usize;
        assert_eq!(bytes[end - 5], 201);
        assert_eq!(bytes[end - 4..end], 1.25f32.to_le_bytes());
        let text = String::from_utf8_lossy(&layout.header);
        assert!(text.contains("comment crs end_header\n"), "{text}");
    }
}
