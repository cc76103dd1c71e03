//! Whole meshes and clouds in memory.

use crate::error::{Error, Result};
use crate::header::{Element, Field, Header};
use crate::numbers::Numbers;
use crate::types::{Property, Scalar};
use std::io::BufRead;

/// A mesh, or a cloud if there are no triangles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Positions of the vertices.
    pub vertices: Vec<[f64; 3]>,
    /// Colours of the vertices, from 0 to 255; empty if the file has none.
    pub colors: Vec<[u8; 3]>,
    /// Corners of the triangles, as indices of vertices; polygons become fans.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Reads a file of `bytes` bytes, which bounds the memory allocated by the counts of the header. Elements
    /// other than vertices and faces are skipped; data after both are not read.
    ///
    /// # Errors
    /// [`Error`] with the entry.
    pub fn read(mut input: impl BufRead, bytes: u64) -> Result<Self> {
        let header = Header::read(&mut input)?;
        let mut numbers = Numbers::new(input, header.encoding);
        let mut mesh = Self::default();
        let place = |name| header.element(name).map(|e| e.map(|(at, _)| at));
        let (vertex, face) = (place("vertex")?, place("face")?);
        let last = vertex.max(face).map_or(0, |last| last + 1);
        let vertices = match vertex {
            Some(at) => header.elements[at].count,
            None => 0,
        };
        if vertices > u64::from(u32::MAX) {
            let found = format!("{vertices} vertices");
            return Err(Error::input("PLY header", found, "at most 4294967295"));
        }
        for (at, element) in header.elements[..last].iter().enumerate() {
            let least = element.least_bytes(header.encoding).max(1);
            let room = element.count.min(bytes / least + 1) as usize;
            if Some(at) == vertex {
                read_vertices(&mut numbers, element, room, &mut mesh)?;
            } else if Some(at) == face {
                mesh.triangles.reserve_exact(room);
                read_faces(&mut numbers, element, vertices, &mut mesh.triangles)?;
            } else if !element.properties.is_empty() {
                for row in 0..element.count {
                    let skipped = numbers.skip_entry(element);
                    skipped.map_err(|found| wrong(element, row, found))?;
                }
            }
        }
        Ok(mesh)
    }
}

fn wrong(element: &Element, row: u64, found: String) -> Error {
    let expected = format!("{} entries of element {}", element.count, element.name);
    Error::input(format!("{} {row}", element.name), found, expected)
}

fn read_vertices(
    numbers: &mut Numbers<impl BufRead>,
    element: &Element,
    room: usize,
    mesh: &mut Mesh,
) -> Result<()> {
    let coordinates = element.coordinates()?;
    let colors = colors(element);
    mesh.vertices.reserve_exact(room);
    if !colors.is_empty() {
        mesh.colors.reserve_exact(room);
    }
    let mut values = Vec::new();
    for row in 0..element.count {
        let point = numbers.point_with(element, &coordinates, &colors, &mut values);
        mesh.vertices
            .push(point.map_err(|found| wrong(element, row, found))?);
        if let [r, g, b] = values[..] {
            let scalar = colors[0].1;
            mesh.colors.push([r, g, b].map(|c| byte(scalar, c)));
        }
    }
    Ok(())
}

/// Index and type of the properties red, green and blue; empty unless all are there in this order, of one type.
fn colors(element: &Element) -> Vec<Field> {
    let place = |name: &str| {
        let mut numbers = element.properties.iter().enumerate();
        numbers.find_map(|(at, (own, property))| match property {
            Property::One(scalar) if own == name => Some((at, *scalar)),
            _ => None,
        })
    };
    let found: Vec<_> = ["red", "green", "blue"]
        .iter()
        .filter_map(|name| place(name))
        .collect();
    let ascend = found
        .windows(2)
        .all(|w| w[0].0 < w[1].0 && w[0].1 == w[1].1);
    if found.len() == 3 && ascend {
        found
    } else {
        Vec::new()
    }
}

/// A colour as a number from 0 to 255: integers of more than 8 bits are those of 16, floats go from 0 to 1.
fn byte(scalar: Scalar, value: f64) -> u8 {
    match scalar {
        Scalar::U8 | Scalar::I8 => value as u8,
        Scalar::F32 | Scalar::F64 => (value * 255.0).round() as u8,
        _ => (value / 256.0) as u8,
    }
}

fn read_faces(
    numbers: &mut Numbers<impl BufRead>,
    element: &Element,
    vertices: u64,
    out: &mut Vec<[u32; 3]>,
) -> Result<()> {
    let (list, count, item) = element.corners()?;
    let mut corners: Vec<u32> = Vec::new();
    for row in 0..element.count {
        let mut face = || -> Result<(), String> {
            for (at, (_, property)) in element.properties.iter().enumerate() {
                if at != list {
                    numbers.skip(*property)?;
                    continue;
                }
                corners.clear();
                for _ in 0..numbers.length(count)? {
                    let corner = numbers.next(item)?;
                    if !(0.0..vertices as f64).contains(&corner) || corner.fract() != 0.0 {
                        return Err(format!("corner {corner} with {vertices} vertices"));
                    }
                    corners.push(corner as u32);
                }
            }
            Ok(())
        };
        face().map_err(|found| wrong(element, row, found))?;
        for pair in corners.get(1..).unwrap_or_default().windows(2) {
            out.push([corners[0], pair[0], pair[1]]);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(bytes: &[u8]) -> Result<Mesh> {
        Mesh::read(bytes, bytes.len() as u64)
    }

    const HEADER: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty float z\n\
                          property uchar red\nelement face 2\n\
                          property list uchar int vertex_indices\nend_header\n";

    #[test]
    fn ascii_and_both_binary_forms_agree() {
        let corners = [
            [0.0, 0.0, 0.5],
            [2.0, 0.0, 0.5],
            [2.0, 4.0, 0.5],
            [0.0, 4.0, 0.5],
        ];
        let mut ascii = format!("ply\nformat ascii 1.0\ncomment x\n{HEADER}").into_bytes();
        let mut little = format!("ply\nformat binary_little_endian 1.0\n{HEADER}").into_bytes();
        let mut big = format!("ply\nformat binary_big_endian 1.0\n{HEADER}").into_bytes();
        for [x, y, z] in corners {
            ascii.extend(format!("{x} {y}  {z} 9\r\n").bytes());
            little.extend((x as f32).to_le_bytes());
            little.extend(f64::to_le_bytes(y));
            little.extend((z as f32).to_le_bytes());
            little.push(9);
            big.extend((x as f32).to_be_bytes());
            big.extend(f64::to_be_bytes(y));
            big.extend((z as f32).to_be_bytes());
            big.push(9);
        }
        for polygon in [&[0i32, 1, 2, 3][..], &[0, 1, 2]] {
            ascii.extend(format!("{}", polygon.len()).bytes());
            little.push(polygon.len() as u8);
            big.push(polygon.len() as u8);
            for index in polygon {
                ascii.extend(format!(" {index}").bytes());
                little.extend(index.to_le_bytes());
                big.extend(index.to_be_bytes());
            }
            ascii.push(b'\n');
        }
        for bytes in [ascii, little, big] {
            let mesh = parse(&bytes).unwrap();
            assert_eq!(mesh.vertices, corners);
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
            // A file cut at any place is an error, never a panic.
            for end in 0..bytes.len() - 1 {
                assert!(parse(&bytes[..end]).is_err(), "cut at {end}");
            }
        }
    }

    #[test]
    fn colours_are_read_from_all_types() {
        for (scalar, values) in [
            ("uchar", "255 128 0"),
            ("ushort", "65535 32896 0"),
            ("float", "1 0.502 0"),
        ] {
            let color = |name| format!("property {scalar} {name}\n");
            let text = format!(
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                 property float z\n{}{}property int more\n{}end_header\n1 2 3 {}\n",
                color("red"),
                color("green"),
                color("blue"),
                values
                    .rsplit_once(' ')
                    .map_or(String::new(), |(a, b)| format!("{a} 7 {b}")),
            );
            let mesh = parse(text.as_bytes()).unwrap();
            assert_eq!(
                (mesh.vertices[0], mesh.colors[0]),
                ([1.0, 2.0, 3.0], [255, 128, 0])
            );
        }
        assert!(parse(format!("ply\nformat ascii 1.0\n{HEADER}").as_bytes()).is_err());
    }

    #[test]
    fn bad_indices_are_refused() {
        for index in ["4", "-1", "0.5", "nan", "1e20"] {
            let text = format!(
                "ply\nformat ascii 1.0\n{HEADER}0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n\
                 3 0 1 {index}\n3 0 1 2\n"
            );
            assert!(parse(text.as_bytes()).is_err(), "{index}");
        }
    }

    #[test]
    fn huge_claims_are_not_believed() {
        let text = "ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\n\
                    property float x\nproperty float y\nproperty float z\nend_header\n";
        assert!(parse(text.as_bytes()).is_err());
    }
}
