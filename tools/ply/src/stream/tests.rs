//! Variants of the format, and files with wrong headers.

use super::*;
use proptest::prelude::*;

#[derive(Debug, Default, PartialEq)]
struct Read {
    vertices: Vec<[f64; 3]>,
    /// Of all properties of one number.
    values: Vec<f64>,
    triangles: Vec<[u32; 3]>,
    others: u64,
}

impl Read {
    fn take(&mut self, part: Part<'_>) {
        match part {
            Part::Vertices(positions) => {
                assert!(positions.len() <= SLICE);
                self.vertices.extend_from_slice(positions);
            }
            Part::Values(values) => self.values.extend_from_slice(values),
            Part::Triangles(triangles) => {
                assert!(triangles.len() <= SLICE);
                self.triangles.extend_from_slice(triangles);
            }
            Part::Polygon(_) => self.others += 1,
        }
    }
}

fn read(bytes: &[u8]) -> Result<Read, FileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    std::fs::write(&path, bytes).unwrap();
    let mut read = Read::default();
    let mesh = MeshStream::open(&path)?;
    let columns = mesh
        .columns()
        .into_iter()
        .map(|(at, _, scalar)| (at, scalar));
    let columns = columns.collect();
    mesh.wanting(columns).read(|part| {
        read.take(part);
        Ok::<(), FileError>(())
    })?;
    Ok(read)
}

fn refusal(bytes: &[u8]) -> String {
    match read(bytes) {
        Err(error @ FileError::Content { .. }) => {
            let text = error.to_string();
            assert!(
                !text.contains('\n') && text.contains("mesh.ply: "),
                "{text}"
            );
            text.split_once("mesh.ply: ").unwrap().1.to_owned()
        }
        other => panic!("{other:?}"),
    }
}

/// A file in one of the encodings: `numbers` are (type, value); header lines precede.
fn file(encoding: &str, header: &str, numbers: &[(&str, f64)]) -> Vec<u8> {
    let format = format!("ply\nformat {encoding} 1.0\ncomment made up\n{header}end_header\n");
    let mut bytes = format.into_bytes();
    for &(kind, value) in numbers {
        let mut one = match kind {
            "char" => (value as i8).to_le_bytes().to_vec(),
            "uchar" | "uint8" => (value as u8).to_le_bytes().to_vec(),
            "short" => (value as i16).to_le_bytes().to_vec(),
            "ushort" => (value as u16).to_le_bytes().to_vec(),
            "int" | "int32" => (value as i32).to_le_bytes().to_vec(),
            "uint" => (value as u32).to_le_bytes().to_vec(),
            "float" => (value as f32).to_le_bytes().to_vec(),
            _ => value.to_le_bytes().to_vec(),
        };
        match encoding {
            "ascii" => one = format!("{value}\r\n").into_bytes(),
            "binary_big_endian" => one.reverse(),
            _ => {}
        }
        bytes.extend(one);
    }
    bytes
}

const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

#[test]
fn reads_every_variant() {
    let positions = [
        [1.0, 2.5, -3.0],
        [0.0, 0.25, 9.0],
        [7.0, 8.0, 0.5],
        [5.0, 5.0, 5.0],
    ];
    for encoding in ENCODINGS {
        for real in ["float", "double"] {
            for count in ["char", "uchar", "uint8", "short", "ushort", "int", "uint"] {
                for item in ["char", "uchar", "short", "ushort", "int", "int32", "uint"] {
                    let header = format!(
                        "element camera 2\nproperty float a\nproperty list uchar short b\n\
                         element vertex 4\nproperty uchar red\nproperty {real} z\n\
                         property {real} x\nproperty short s\nproperty {real} y\n\
                         element face 4\nproperty list {count} {item} vertex_indices\n\
                         property double quality\nobj_info end\nelement tail 1\nproperty int e\n"
                    );
                    let mut numbers = vec![
                        ("float", 1.5),
                        ("uchar", 2.0),
                        ("short", 5.0),
                        ("short", 6.0),
                        ("float", 1.5),
                        ("uchar", 0.0),
                    ];
                    for [x, y, z] in positions {
                        let red = ("uchar", 200.0);
                        numbers.extend([red, (real, z), (real, x), ("short", -7.0), (real, y)]);
                    }
                    let faces: [&[f64]; 4] = [
                        &[0.0, 1.0, 2.0],
                        &[0.0, 1.0, 2.0, 3.0],
                        &[3.0, 2.0, 1.0],
                        &[],
                    ];
                    for face in faces {
                        numbers.push((count, face.len() as f64));
                        numbers.extend(face.iter().map(|v| (item, *v)));
                        numbers.push(("double", 0.125));
                    }
                    numbers.push(("int", 3.0));
                    let got = read(&file(encoding, &header, &numbers)).unwrap();
                    assert_eq!(got.vertices, positions, "{header}");
                    assert_eq!(got.values, [200.0, -7.0].repeat(4), "{header}");
                    let divided = [[0, 1, 2], [0, 1, 2], [0, 2, 3], [3, 2, 1]];
                    assert_eq!(got.triangles, divided, "{header}");
                    assert_eq!(got.others, 2);
                }
            }
        }
    }
}

#[test]
fn lists_in_vertices_and_two_lists_in_faces() {
    for encoding in ENCODINGS {
        let header = "element face 2\nproperty list uchar float texcoord\n\
                      property list uchar int vertex_index\nproperty char flag\n\
                      element vertex 2\nproperty float x\nproperty list uchar int more\n\
                      property float y\nproperty float z\n";
        let mut numbers = vec![("uchar", 2.0), ("float", 0.5), ("float", 0.5)];
        let face = [
            ("uchar", 3.0),
            ("int", 1.0),
            ("int", -1.0),
            ("int", 2e9),
            ("char", 1.0),
        ];
        numbers.extend(face);
        numbers.extend([("uchar", 0.0), ("uchar", 1.0), ("int", 1.0), ("char", 1.0)]);
        numbers.extend([("float", 1.0), ("uchar", 1.0), ("int", 4.0)]);
        numbers.extend([("float", 2.0), ("float", 3.0)]);
        numbers.extend([
            ("float", f64::NAN),
            ("uchar", 0.0),
            ("float", f64::INFINITY),
        ]);
        numbers.push(("float", -0.5));
        let got = read(&file(encoding, header, &numbers)).unwrap();
        assert_eq!(got.triangles, [[1, NO_VERTEX, 2_000_000_000]]);
        assert_eq!(got.others, 1);
        assert_eq!(got.vertices[0], [1.0, 2.0, 3.0]);
        assert!(got.vertices[1][0].is_nan() && got.vertices[1][1] == f64::INFINITY);
    }
}

#[test]
fn many_slices_and_buffers() {
    let (vertices, faces) = (150_000u32, 200_000u32);
    let header = format!(
        "element vertex {vertices}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {faces}\nproperty list uchar uint vertex_indices\n"
    );
    for encoding in ENCODINGS {
        let mut numbers = Vec::new();
        for v in 0..vertices {
            let v = f64::from(v);
            numbers.extend([("double", v), ("double", v + 0.5), ("double", -v)]);
        }
        for f in 0..faces {
            let corners = if f % 1000 == 77 { 5 } else { 3 };
            numbers.push(("uchar", f64::from(corners)));
            numbers.extend((0..corners).map(|c| ("uint", f64::from(f + c))));
        }
        let got = read(&file(encoding, &header, &numbers)).unwrap();
        assert_eq!(got.others, 200);
        let all = (0..vertices).map(f64::from).map(|v| [v, v + 0.5, -v]);
        assert!(got.vertices.iter().copied().eq(all));
        let all = (0..faces).flat_map(|f| {
            let triangles = if f % 1000 == 77 { 3 } else { 1 };
            (1..=triangles).map(move |c| [f, f + c, f + c + 1])
        });
        assert!(got.triangles.iter().copied().eq(all));
    }
}

const SMALL: &str = "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                     element face 2\nproperty list uchar int vertex_indices\n";

fn small(encoding: &str) -> Vec<u8> {
    let mut numbers = [("float", 1.25); 6].to_vec();
    for corners in [3, 4] {
        numbers.push(("uchar", f64::from(corners)));
        numbers.extend((0..corners).map(|c| ("int", f64::from(c))));
    }
    file(encoding, SMALL, &numbers)
}

#[test]
fn every_truncation_is_refused() {
    for encoding in ENCODINGS {
        let whole = small(encoding);
        assert_eq!(read(&whole).unwrap().others, 1);
        // The last ascii number is complete without the white space after it.
        let end = whole.len() - if encoding == "ascii" { 2 } else { 0 };
        for length in 0..end {
            refusal(&whole[..length]);
        }
    }
    // Long enough for the counts of the header, but not for the second face.
    let whole = small("binary_little_endian");
    let text = refusal(&whole[..whole.len() - 3]);
    let place = whole.len() - 16;
    let found = "the end of the file after 13 bytes";
    assert_eq!(
        text,
        format!("byte {place}: found {found}, expected a face of 4 corners")
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..Default::default() })]
    #[test]
    fn damage_never_panics(
        encoding in 0usize..3,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = small(ENCODINGS[encoding]);
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Err(error) = read(&bytes) {
            prop_assert!(!error.to_string().contains('\n'), "{}", error);
        }
    }
}

/// For each line: the replaced part of a valid header, the replacement, the place in the error, and a part of
/// its text. `~` is a line end.
const HOSTILE: &str = "\
vertex 2 | vertex 4000000000 | PLY header, element vertex | 4000000000 entries of 12
vertex 2 | vertex 4294967296 | PLY header | 4294967296 vertices
face 2 | face 18446744073709551615 | PLY header, element face | 18446744073709551615
face 2 | face 99999999999999999999 | PLY header, line 8 | 99999999999999999999
face 2 | face -1 | PLY header, line 8 | \"element face -1\"
vertex_indices | corners | PLY header, element face | properties [corners]
uchar int vertex | uchar float vertex | PLY header, element face | [vertex_indices]
uchar int vertex | float int vertex | PLY header, line 9 | list float int
property float y | property float w | PLY header, element vertex | no property y
property float y | property list uchar int y | PLY header, element vertex | the list \"y\"
property float y | property float y~property float y | PLY header, element vertex | 2 properties named y
property float y | property half y | PLY header, line 6 | half
element vertex | element point | PLY header | [point, face]
element face | element vertex | PLY header | 2 elements named vertex
element face 2 | element face 0~element face 2 | PLY header | 2 elements named face
format binary_little_endian 1.0~ | comment~ | PLY header, line 10 | \"end_header\"
binary_little_endian | binary_middle_endian | PLY header, line 2 | binary_middle_endian
ply~ | plywood~ | PLY header, line 1 | \"plywood\"
element vertex 2~ | comment~ | PLY header, line 5 | property float x
end_header~ | end_headers~ | PLY header, line 10 | \"end_headers\"
comment made up | hello \u{1b}[31m | PLY header, line 3 | \"hello \\u{1b}[31m\"";

#[test]
fn hostile_headers_are_refused() {
    let with = |from: &str, to: &str| {
        let whole = small("binary_little_endian");
        let head = whole
            .windows(11)
            .position(|w| w == b"end_header\n")
            .unwrap()
            + 11;
        let header = String::from_utf8(whole[..head].to_vec()).unwrap();
        assert!(header.contains(from), "{from}");
        let mut bytes = header.replacen(from, to, 1).into_bytes();
        bytes.extend_from_slice(&whole[head..]);
        refusal(&bytes)
    };
    for line in HOSTILE.lines() {
        let line = line.replace('~', "\n");
        let fields: Vec<_> = line.split(" | ").map(str::trim_start).collect();
        let [from, to, place, found] = fields[..] else {
            panic!("{line}")
        };
        let text = with(from, to);
        let (at, rest) = text.split_once(": found ").unwrap();
        assert_eq!(at, place, "{text}");
        assert!(
            rest.split(", expected ").next().unwrap().contains(found),
            "{text}"
        );
    }
    refusal(b"");
    let endless = [b"ply\ncomment ".as_slice(), &vec![b'a'; 3 << 20]].concat();
    assert!(refusal(&endless).contains("no end in 1 MiB"));
    let lines = [b"ply\n".as_slice(), &b"comment a\n".repeat(300_000)].concat();
    refusal(&lines);
}

#[test]
fn lists_that_lie_are_refused() {
    let header = SMALL.replace("uchar int", "int int");
    let numbers = |length: f64| {
        let mut all = [("float", 0.0); 6].to_vec();
        all.extend([("int", length), ("int", 0.0), ("int", 0.0), ("int", 0.0)]);
        all
    };
    for encoding in ENCODINGS {
        for length in [-1.0, 2e9] {
            let text = refusal(&file(encoding, &header, &numbers(length)));
            assert!(text.starts_with("byte "), "{text}");
        }
    }
    let text = refusal(&file("ascii", SMALL, &[("float", 0.0), ("float", 0.0)]).repeat(9));
    assert!(
        text.contains("found 'ply' as property z, expected a number"),
        "{text}"
    );
}

#[test]
fn elements_without_properties_cost_nothing() {
    for encoding in ENCODINGS {
        let header = format!("element nothing 18446744073709551615\n{SMALL}");
        let header = header
            .replace("vertex 2", "vertex 0")
            .replace("face 2", "face 0");
        assert_eq!(
            read(&file(encoding, &header, &[])).unwrap(),
            Read::default()
        );
    }
}

#[test]
fn plain_meshes_are_known_by_their_size_or_their_faces() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let is_plain = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        MeshStream::open(&path).unwrap().is_plain().unwrap()
    };
    let header = "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 2\nproperty list uchar int vertex_indices\n";
    let of = |encoding: &str, header: &str, corners: [usize; 2]| {
        let mut numbers = vec![("float", 1.0); 3];
        for count in corners {
            numbers.push(("uchar", count as f64));
            numbers.extend(vec![("int", 0.0); count]);
        }
        file(encoding, header, &numbers)
    };
    let little = "binary_little_endian";
    let plain = of(little, header, [3, 3]);
    assert!(is_plain(&plain));
    assert!(is_plain(&of("binary_big_endian", header, [3, 3])));
    assert!(is_plain(&[&plain[..], b"more"].concat()));
    assert!(!is_plain(&of("ascii", header, [3, 3])));
    assert!(!is_plain(&of(little, header, [3, 4])));
    assert!(!is_plain(&of(little, header, [2, 3])));
    let (vertices, faces) = header.split_at(header.find("element face").unwrap());
    let turned = [faces, vertices].concat();
    let numbers = [("uchar", 3.0), ("int", 0.0), ("int", 0.0), ("int", 0.0)].repeat(2);
    let numbers = [&numbers[..], &[("float", 0.0); 3]].concat();
    assert!(!is_plain(&file(little, &turned, &numbers)));
}
