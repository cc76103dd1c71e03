//! Wavefront OBJ: text, with lines of fixed widths.

use super::format::{Layout, MADE_BY, Mesh, MeshFormat, Positions, VertexColumn, four, two};
use outcrop_geom::lattice::Lattice;
use outcrop_ply::Scalar;
use std::io::Write;

/// Wavefront OBJ. Numbers are padded with spaces on their left.
pub struct Obj;

/// Bytes of a colour component: a space, and a number from 0 to 1 with six decimals.
const COLOUR: usize = 9;

/// Bytes of a normal's component: a space, and a number from -1 to 1 with six decimals.
const NORMAL: usize = 10;

/// Coordinates that are not known yet have as many characters as these, for estimates.
const USUAL: [[f64; 3]; 2] = [[0.0; 3], [999_999.0; 3]];

impl MeshFormat for Obj {
    fn name(&self) -> &'static str {
        "OBJ"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["obj"]
    }

    fn wants_bounds(&self) -> bool {
        true
    }

    fn holds_doubles(&self) -> bool {
        true
    }

    fn holds(&self, mesh: &Mesh, column: &VertexColumn) -> bool {
        mesh.is_colour_or_normal(column)
    }

    fn layout(&self, mesh: &Mesh) -> Layout {
        let mut header = format!("# {MADE_BY}\n");
        for comment in &mesh.comments {
            let line = comment.replace(char::is_control, " ");
            header += &format!("# {line}\n");
        }
        let mut vertex = 2 + widths(mesh).iter().map(|w| 1 + w).sum::<usize>();
        vertex += mesh.colours().map_or(0, |_| 3 * COLOUR);
        vertex += mesh.normals().map_or(0, |_| 3 + 3 * NORMAL);
        let corner = 1 + corner_width(mesh);
        let triangle = 2 + 3 * corner;
        Layout::of(header.into_bytes(), mesh, vertex as u64, triangle as u64)
    }

    fn put_vertices(
        &self,
        mesh: &Mesh,
        positions: &[[f64; 3]],
        values: &[u8],
        bytes: &mut Vec<u8>,
    ) {
        let (widths, decimals) = (widths(mesh), mesh.decimals);
        let (colours, normals) = (mesh.colours(), mesh.normals());
        let each = mesh.value_bytes();
        for (number, position) in positions.iter().enumerate() {
            let values = &values[number * each..][..each];
            bytes.push(b'v');
            for (x, width) in position.iter().zip(widths) {
                put(bytes, *x, width, decimals);
            }
            if let Some((places, scalar)) = colours {
                for at in places {
                    put(bytes, share(values, at, scalar), COLOUR - 1, 6);
                }
            }
            bytes.push(b'\n');
            if let Some(places) = normals {
                bytes.extend_from_slice(b"vn");
                for at in places {
                    let x = f32::from_le_bytes(four(values, at));
                    put(bytes, x.into(), NORMAL - 1, 6);
                }
                bytes.push(b'\n');
            }
        }
    }

    fn put_triangles(
        &self,
        mesh: &Mesh,
        triangles: &[[u32; 3]],
        _: &[Positions],
        bytes: &mut Vec<u8>,
    ) {
        let (digits, width) = (digits(mesh.vertices), corner_width(mesh));
        let mut text = vec![b' '; 2 + 3 * (1 + width)];
        (text[0], text[2 + 3 * (1 + width) - 1]) = (b'f', b'\n');
        for triangle in triangles {
            for (corner, vertex) in triangle.iter().enumerate() {
                let end = 1 + (corner + 1) * (1 + width);
                let number = u64::from(*vertex) + 1;
                if mesh.normals().is_none() {
                    right(&mut text[end - digits..end], number);
                    continue;
                }
                // `a//a`, without spaces between.
                let used = digits_of(number);
                let field = &mut text[end - width..end];
                field.fill(b' ');
                right(field, number);
                let slashes = width - used - 2;
                field[slashes..slashes + 2].fill(b'/');
                right(&mut field[..slashes], number);
            }
            bytes.extend_from_slice(&text);
        }
    }
}

/// Appends a space, and `x` in `width` characters.
fn put(bytes: &mut Vec<u8>, x: f64, width: usize, decimals: usize) {
    // Not the negative zero. Writing to a vector cannot fail.
    let _ = write!(bytes, " {:>width$.decimals$}", x + 0.0);
}

/// Writes a number at the end of `field`; what is before it becomes spaces.
fn right(field: &mut [u8], mut number: u64) {
    let mut at = field.len();
    while at > 0 {
        at -= 1;
        field[at] = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    field[..at].fill(b' ');
}

/// A component of a colour as a share of the largest. It is rounded up, so that readers that cut it off get
/// the same number as those that round.
fn share(values: &[u8], at: usize, scalar: Scalar) -> f64 {
    let (value, most) = match scalar {
        Scalar::U16 => (
            u16::from_le_bytes(two(values, at)).into(),
            u64::from(u16::MAX),
        ),
        _ => (u64::from(values[at]), u64::from(u8::MAX)),
    };
    (value * 1_000_000).div_ceil(most) as f64 / 1e6
}

/// Characters of a number of vertices, and so of the largest index.
fn digits(vertices: u64) -> usize {
    digits_of(vertices)
}

fn digits_of(number: u64) -> usize {
    number.checked_ilog10().unwrap_or(0) as usize + 1
}

/// Characters of a corner.
fn corner_width(mesh: &Mesh) -> usize {
    let digits = digits(mesh.vertices);
    match mesh.normals() {
        Some(_) => 2 * digits + 2,
        None => digits,
    }
}

/// Characters of a coordinate along each axis. The lowest and the highest coordinate are the longest.
fn widths(mesh: &Mesh) -> [usize; 3] {
    let [low, high] = mesh.bounds.unwrap_or(USUAL);
    let length = |x: f64| format!("{:.*}", mesh.decimals, x + 0.0).len();
    [0, 1, 2].map(|k| length(low[k]).max(length(high[k])))
}

/// Decimals of a coordinate on a lattice: exact if step and offset have at most three decimals more than the
/// step's first digit, else those of a hundredth of a step.
pub fn decimals(lattice: &Lattice) -> usize {
    let (step, mut first, mut power) = (lattice.step, 0usize, 1.0);
    while step * power < 1.0 && first < 320 {
        (first, power) = (first + 1, power * 10.0);
    }
    let whole = |x: f64, decimals: usize| {
        let scaled = x.abs() * 10f64.powi(decimals as i32);
        let off = (scaled - scaled.round()).abs();
        // Rounding errors of the number itself.
        off <= 1e-9 + 4.0 * f64::EPSILON * scaled
    };
    let exact = |d: &usize| {
        let off = step * 10f64.powi(*d as i32);
        (off - off.round()).abs() <= 1e-9 * off && lattice.offset.iter().all(|x| whole(*x, *d))
    };
    let found = (first.saturating_sub(1)..=first + 3).find(exact);
    found.unwrap_or(first + 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::format::normal_columns;

    fn lattice(step: f64, offset: [f64; 3]) -> Lattice {
        Lattice {
            step,
            offset,
            base: [0; 3],
            exact: true,
        }
    }

    #[test]
    fn decimals_keep_the_step() {
        for (step, offset, expected) in [
            (0.01, 0.0, 2),
            (0.001, 500_000.0, 3),
            (0.001, 5_400_000.123_4, 4),
            (0.01, 1.0 / 3.0, 4),
            (1.0, 0.0, 0),
            (0.5, 0.0, 1),
            (0.25, 0.0, 2),
            (2f64.powi(-20), 0.0, 9),
            (10.0, 0.0, 0),
            (0.0254, 0.0, 4),
            (1e-300, 0.0, 300),
        ] {
            let found = decimals(&lattice(step, [0.0, offset, 0.0]));
            assert_eq!(found, expected, "step {step}, offset {offset}");
        }
    }

    /// A mesh of two vertices with normals, and colours of this type.
    fn mesh(scalar: Scalar) -> Mesh {
        let colours = ["red", "green", "blue"].map(|name| VertexColumn {
            name: name.into(),
            scalar,
        });
        Mesh {
            vertices: 12,
            triangles: 1,
            columns: normal_columns().chain(colours).collect(),
            comments: vec!["a\nb".into()],
            bounds: Some([[-0.001, 0.0, 5.0], [9.996, 1e6, 5.0]]),
            decimals: 2,
            ..Mesh::default()
        }
    }

    #[test]
    fn lines_have_one_width_whatever_is_in_them() {
        let mut bytes = Vec::new();
        let mesh_8 = mesh(Scalar::U8);
        let mut values = Vec::new();
        for (normal, colour) in [
            ([0.0f32, -1.0, 0.5], [0, 127, 255]),
            ([1.0, 0.0, -0.5], [1, 2, 3]),
        ] {
            values.extend(normal.iter().flat_map(|x| x.to_le_bytes()));
            values.extend_from_slice(&colour);
        }
        let positions = [[-0.001, 0.0, 5.0], [9.996, 999_999.994, 5.0]];
        Obj.put_vertices(&mesh_8, &positions, &values, &mut bytes);
        Obj.put_triangles(&mesh_8, &[[0, 9, 11]], &[], &mut bytes);
        let lines = "v -0.00       0.00 5.00 0.000000 0.498040 1.000000\n\
                     vn  0.000000 -1.000000  0.500000\n\
                     v 10.00  999999.99 5.00 0.003922 0.007844 0.011765\n\
                     vn  1.000000  0.000000 -0.500000\n\
                     f   1//1 10//10 12//12\n";
        assert_eq!(String::from_utf8(bytes).unwrap(), lines);
        let layout = Obj.layout(&mesh_8);
        let record = lines.find("v 10").unwrap() as u64;
        assert_eq!(layout.vertices.bytes, record);
        assert_eq!(layout.triangles.bytes, lines.len() as u64 - 2 * record);
        let header = format!("# {MADE_BY}\n# a b\n");
        assert_eq!(layout.header, header.into_bytes());
    }

    /// Readers compute the byte by rounding or by cutting off.
    #[test]
    fn colours_can_be_read_back() {
        for value in 0..=u8::MAX {
            let read = share(&[value], 0, Scalar::U8) * 255.0;
            assert!(
                read as u8 == value && read.round() as u8 == value,
                "{value}"
            );
        }
        for value in 0..=u16::MAX {
            let read = share(&value.to_le_bytes(), 0, Scalar::U16) * 65535.0;
            assert!(
                read as u16 == value && read.round() as u16 == value,
                "{value}"
            );
        }
    }
}
