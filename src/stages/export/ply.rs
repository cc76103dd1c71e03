//! Binary little-endian PLY.

use super::format::{CoordinateType, Layout, Mesh, MeshFormat, Records};
use outcrop_ply::{Encoding, Scalar, TRIANGLE, put_triangle};

/// Binary little-endian PLY.
pub struct Ply;

impl MeshFormat for Ply {
    fn extensions(&self) -> &'static [&'static str] {
        &["ply"]
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
        let layout = outcrop_ply::Layout {
            encoding: Encoding::Little,
            comment: Some(concat!("made by outcrop ", env!("CARGO_PKG_VERSION"))),
            vertices: mesh.vertices,
            coordinates,
            triangles: Some((mesh.triangles, index)),
        };
        let header = layout.header().into_bytes();
        let vertices = Records {
            at: header.len() as u64,
            bytes: 3 * coordinates.bytes() as u64,
        };
        let triangles = Records {
            at: vertices.offset(mesh.vertices),
            bytes: TRIANGLE as u64,
        };
        Layout {
            header,
            vertices,
            triangles,
            bytes: triangles.offset(mesh.triangles),
        }
    }

    fn put_vertices(&self, mesh: &Mesh, positions: &[[f64; 3]], bytes: &mut Vec<u8>) {
        for position in positions {
            match mesh.coordinates {
                CoordinateType::Float => {
                    let words = position.map(|x| (x as f32).to_le_bytes());
                    bytes.extend_from_slice(words.as_flattened());
                }
                CoordinateType::Double => {
                    bytes.extend_from_slice(position.map(f64::to_le_bytes).as_flattened());
                }
            }
        }
    }

    fn put_triangles(&self, _: &Mesh, triangles: &[[u32; 3]], bytes: &mut Vec<u8>) {
        triangles.iter().for_each(|t| put_triangle(*t, bytes));
    }
}
