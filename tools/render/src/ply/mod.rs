//! Reading PLY meshes and clouds.

mod header;

use std::{
    fs::File,
    io::{BufRead, BufReader},
    path::Path,
};

use crate::error::{Error, Result};
use crate::vec3::Vec3;
use header::{Body, Element, Header, Scalar, Shape};

/// A mesh, or a cloud if there are no triangles.
#[derive(Debug, Default)]
pub(crate) struct Mesh {
    /// Vertices relative to `origin`.
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Middle of the bounding box, so that the numbers stay small far from the zero point.
    pub origin: Vec3,
}

/// Reads a file whole.
pub(crate) fn read(path: &Path) -> Result<Mesh> {
    let file = File::open(path).map_err(|e| Error::io(path, "open", e))?;
    let bytes = file
        .metadata()
        .map_err(|e| Error::io(path, "examine", e))?
        .len();
    read_from(BufReader::with_capacity(1 << 20, file), bytes, path)
}

/// Reads from any source; `bytes` bounds what is reserved for the counts that the header claims.
fn read_from(mut input: impl BufRead, bytes: u64, path: &Path) -> Result<Mesh> {
    let header = Header::read(&mut input).map_err(|e| Error::ply(path, "header", e))?;
    let mut body = Numbers {
        input,
        body: header.body,
        token: Vec::new(),
    };
    let mut mesh = Mesh::default();
    let mut has_faces = false;
    for element in &header.elements {
        let room = element.count.min(bytes / 4) as usize;
        let mut row = 0;
        let result = match element.name.as_str() {
            "vertex" => read_vertices(&mut body, element, room, &mut row, &mut mesh.positions),
            "face" => {
                has_faces = true;
                let vertices = mesh.positions.len();
                read_faces(
                    &mut body,
                    element,
                    (room, vertices),
                    &mut row,
                    &mut mesh.triangles,
                )
            }
            // What follows the faces is of no interest, what precedes them must be stepped over.
            _ if has_faces => break,
            _ => skip(&mut body, element, &mut row),
        };
        result.map_err(|what| Error::ply(path, format!("{} {row}", element.name), what))?;
    }
    if mesh.positions.len() >= u32::MAX as usize {
        return Err(Error::ply(
            path,
            "header",
            "more vertices than 32-bit indices can name",
        ));
    }
    mesh.recentre();
    Ok(mesh)
}

impl Mesh {
    fn recentre(&mut self) {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in &self.positions {
            if p.iter().all(|c| c.is_finite()) {
                for k in 0..3 {
                    low[k] = low[k].min(p[k]);
                    high[k] = high[k].max(p[k]);
                }
            }
        }
        if low[0] <= high[0] {
            self.origin = std::array::from_fn(|k| low[k] / 2.0 + high[k] / 2.0);
            for p in &mut self.positions {
                *p = crate::vec3::sub(*p, self.origin);
            }
        }
    }
}

fn read_vertices(
    body: &mut Numbers<impl BufRead>,
    element: &Element,
    room: usize,
    row: &mut u64,
    out: &mut Vec<Vec3>,
) -> Result<(), String> {
    let axis = |name: &str| ["x", "y", "z"].iter().position(|axis| *axis == name);
    let axes: Vec<Option<usize>> = element.properties.iter().map(|p| axis(&p.name)).collect();
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        let is_k = |(slot, p): (&Option<usize>, &header::Property)| {
            *slot == Some(k) && matches!(p.shape, Shape::One(_))
        };
        if !axes.iter().zip(&element.properties).any(is_k) {
            return Err(format!("there is no property {name}"));
        }
    }
    out.reserve_exact(room);
    while *row < element.count {
        let mut place = [0.0; 3];
        for (property, axis) in element.properties.iter().zip(&axes) {
            match (property.shape, axis) {
                (Shape::One(scalar), Some(k)) => place[*k] = body.next(scalar)?,
                (shape, _) => body.skip(shape)?,
            }
        }
        out.push(place);
        *row += 1;
    }
    Ok(())
}

fn read_faces(
    body: &mut Numbers<impl BufRead>,
    element: &Element,
    (room, vertices): (usize, usize),
    row: &mut u64,
    out: &mut Vec<[u32; 3]>,
) -> Result<(), String> {
    let is_corners = |name: &str| name == "vertex_indices" || name == "vertex_index";
    if !element.properties.iter().any(|p| is_corners(&p.name)) {
        return Err("there is no property vertex_indices".to_owned());
    }
    out.reserve_exact(room);
    let mut corners: Vec<u32> = Vec::new();
    while *row < element.count {
        for property in &element.properties {
            let (true, Shape::List { length, item }) = (is_corners(&property.name), property.shape)
            else {
                body.skip(property.shape)?;
                continue;
            };
            corners.clear();
            for _ in 0..body.length(length)? {
                let index = body.next(item)?;
                if !(0.0..vertices as f64).contains(&index) || index.fract() != 0.0 {
                    return Err(format!("index {index} with {vertices} vertices"));
                }
                corners.push(index as u32);
            }
            // Polygons become fans.
            for pair in corners.get(1..).unwrap_or_default().windows(2) {
                out.push([corners[0], pair[0], pair[1]]);
            }
        }
        *row += 1;
    }
    Ok(())
}

fn skip(body: &mut Numbers<impl BufRead>, element: &Element, row: &mut u64) -> Result<(), String> {
    while *row < element.count {
        element
            .properties
            .iter()
            .try_for_each(|property| body.skip(property.shape))?;
        *row += 1;
    }
    Ok(())
}

/// The body as a sequence of numbers, whatever the encoding. All types fit into f64 exactly.
struct Numbers<R> {
    input: R,
    body: Body,
    token: Vec<u8>,
}

impl<R: BufRead> Numbers<R> {
    fn next(&mut self, scalar: Scalar) -> Result<f64, String> {
        if self.body == Body::Ascii {
            return self.next_token();
        }
        Ok(match scalar {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.bytes()?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.bytes()?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.bytes()?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.bytes()?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.bytes()?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.bytes()?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.bytes()?)),
            Scalar::F64 => f64::from_le_bytes(self.bytes()?),
        })
    }

    /// The next bytes in little-endian order.
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut bytes = [0; N];
        self.input
            .read_exact(&mut bytes)
            .map_err(|e| match e.kind() {
                std::io::ErrorKind::UnexpectedEof => "the file ends early".to_owned(),
                _ => e.to_string(),
            })?;
        if self.body == Body::BigEndian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn next_token(&mut self) -> Result<f64, String> {
        self.token.clear();
        loop {
            let buffer = self.input.fill_buf().map_err(|e| e.to_string())?;
            if buffer.is_empty() {
                break;
            }
            // Leading blanks first, then up to the next blank, over as many buffers as it takes.
            let begin = if self.token.is_empty() {
                buffer
                    .iter()
                    .take_while(|b| b.is_ascii_whitespace())
                    .count()
            } else {
                0
            };
            let word = buffer[begin..]
                .iter()
                .take_while(|b| !b.is_ascii_whitespace())
                .count();
            self.token.extend_from_slice(&buffer[begin..begin + word]);
            let more = begin + word == buffer.len();
            self.input.consume(begin + word);
            if !more {
                break;
            }
        }
        if self.token.is_empty() {
            return Err("the file ends early".to_owned());
        }
        let text = String::from_utf8_lossy(&self.token);
        text.parse()
            .map_err(|_| format!("\"{text}\" is not a number"))
    }

    fn length(&mut self, scalar: Scalar) -> Result<u64, String> {
        let length = self.next(scalar)?;
        if (0.0..4e9).contains(&length) && length.fract() == 0.0 {
            Ok(length as u64)
        } else {
            Err(format!("a list of length {length}"))
        }
    }

    fn skip(&mut self, shape: Shape) -> Result<(), String> {
        match shape {
            Shape::One(scalar) => self.next(scalar).map(drop),
            Shape::List { length, item } => {
                (0..self.length(length)?).try_for_each(|_| self.next(item).map(drop))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(bytes: &[u8]) -> Result<Mesh> {
        read_from(bytes, bytes.len() as u64, Path::new("test.ply"))
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
            assert_eq!(mesh.origin, [1.0, 2.0, 0.5]);
            assert_eq!(mesh.positions[2], [1.0, 2.0, 0.0]);
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
            // Cut anywhere it is an error, never a panic.
            for end in 0..bytes.len() - 1 {
                assert!(parse(&bytes[..end]).is_err(), "cut at {end}");
            }
        }
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
