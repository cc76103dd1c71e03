//! PLY of other programs: polygons in each encoding, odd properties, and damage.

use super::*;
use outcrop_disk::workspace::progress::Observer;
use std::sync::Mutex;

/// Numbers of these types as text, or as bytes of either order.
fn body(encoding: &str, numbers: &[(&str, f64)]) -> Vec<u8> {
    if encoding == "ascii" {
        let words: Vec<String> = numbers.iter().map(|(_, x)| x.to_string()).collect();
        return words.join(" ").into_bytes();
    }
    let each = numbers.iter().flat_map(|&(scalar, x)| {
        let mut bytes = match scalar {
            "uchar" => vec![x as u8],
            "short" => (x as i16).to_le_bytes().to_vec(),
            "int" => (x as i32).to_le_bytes().to_vec(),
            "uint" => (x as u32).to_le_bytes().to_vec(),
            "float" => (x as f32).to_le_bytes().to_vec(),
            _ => x.to_le_bytes().to_vec(),
        };
        if encoding == "binary_big_endian" {
            bytes.reverse();
        }
        bytes
    });
    each.collect()
}

fn file(encoding: &str, header: &str, numbers: &[(&str, f64)]) -> Vec<u8> {
    let mut bytes = format!("ply\nformat {encoding} 1.0\n{header}end_header\n").into_bytes();
    bytes.extend(body(encoding, numbers));
    bytes
}

const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

/// Collects the warnings of a run.
#[derive(Default)]
struct Said(Mutex<Vec<String>>);

impl Observer for Said {
    fn warn(&self, text: &str) {
        self.0.lock().unwrap().push(text.to_owned());
    }
}

/// As Blender and MeshLab write: faces of several sizes, with more properties, among other elements.
#[test]
fn ply_of_other_programs_is_read_in_each_encoding() {
    for encoding in ENCODINGS {
        for count in ["uchar", "short", "int", "uint"] {
            let header = format!(
                "comment offsetx 100\ncomment offsety 0\ncomment offsetz 0\n\
                 element camera 1\nproperty list uchar float view\n\
                 element vertex 4\nproperty uchar red\nproperty double z\nproperty float y\n\
                 property uchar green\nproperty double x\nproperty uchar blue\nproperty float quality\n\
                 element face 3\nproperty uchar flag\nproperty list {count} short vertex_index\n\
                 property list uchar float texcoord\n\
                 element edge 1\nproperty int vertex1\n"
            );
            let mut numbers = vec![("uchar", 2.0), ("float", 0.0), ("float", 1.0)];
            for (n, [x, y, z]) in (0..).zip(SQUARE) {
                let [red, green, blue] = [n, 10 + n, 250 + n].map(|c| ("uchar", f64::from(c)));
                let quality = ("float", 0.5 * f64::from(n));
                numbers.extend([red, ("double", z), ("float", y), green]);
                numbers.extend([("double", x), blue, quality]);
            }
            for corners in [&[0, 1, 2, 3][..], &[3, 2, 1], &[1, 2]] {
                numbers.extend([("uchar", 7.0), (count, corners.len() as f64)]);
                numbers.extend(corners.iter().map(|c| ("short", f64::from(*c))));
                numbers.extend([("uchar", 1.0), ("float", 0.5)]);
            }
            numbers.push(("int", 3.0));
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.ply");
            std::fs::write(&path, file(encoding, &header, &numbers)).unwrap();
            let said = Arc::new(Said::default());
            let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
            let workspace =
                Workspace::new(folder.path(), memory, 2, said.clone(), Cancel::new()).unwrap();
            let got = read_file(&path, &workspace).unwrap();
            assert_eq!(got.positions, SQUARE, "{header}");
            assert_eq!(got.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 1]]);
            assert_eq!(got.values[..4], [0.0, 10.0, 250.0, 0.0]);
            assert_eq!(got.values[12..], [3.0, 13.0, 253.0, 1.5]);
            let words = said.0.lock().unwrap().join("\n");
            assert_eq!(words.lines().count(), 2, "{words}");
            assert!(words.contains(
                "1 faces with more than three corners were divided into triangles from their first one"
            ));
            assert!(words.contains("1 faces with less than three corners were left out"));
            let mesh = PlyMesh::open_any(&path, &workspace).unwrap();
            assert_eq!(mesh.origin(), Some([100.0, 0.0, 0.0]));
            assert!(mesh.fixed().unwrap().is_some() && !mesh.has_floats());
            let names: Vec<_> = mesh.columns().iter().map(|c| c.1.to_owned()).collect();
            assert_eq!(names, ["red", "green", "blue", "quality"]);
        }
    }
}

const TRIANGLE: &str = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                        element face 1\nproperty list int int vertex_indices\n";

/// A mesh whose faces all take the same number of bytes is read where it is, not copied.
#[test]
fn ply_of_triangles_is_read_where_it_is() {
    let numbers = |corners: &[i32]| {
        let mut numbers = vec![("float", 0.5); 9];
        numbers.push(("int", corners.len() as f64));
        numbers.extend(corners.iter().map(|c| ("int", f64::from(*c))));
        numbers
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    let workspace = workspace(folder.path());
    let copies = |bytes: Vec<u8>| {
        let before = workspace.io.written();
        std::fs::write(&path, bytes).unwrap();
        let mesh = PlyMesh::open_any(&path, &workspace).unwrap();
        assert!(mesh.has_floats());
        workspace.io.written() > before
    };
    for encoding in &ENCODINGS[1..] {
        let plain = file(encoding, TRIANGLE, &numbers(&[0, 1, 2]));
        assert!(!copies(plain.clone()));
        assert!(!copies([&plain[..], b"\n"].concat()));
        assert!(copies(file(encoding, TRIANGLE, &numbers(&[0, 1, 2, 1]))));
    }
    assert!(copies(file("ascii", TRIANGLE, &numbers(&[0, 1, 2]))));
}

#[test]
fn ply_that_is_damaged_has_one_clear_line() {
    let vertices = vec![("float", 0.5); 9];
    let wrong = |encoding: &str, header: &str, corners: &[f64]| {
        let corners = corners.iter().map(|c| ("int", *c));
        let numbers: Vec<_> = vertices.iter().copied().chain(corners).collect();
        said(read("a.ply", &file(encoding, header, &numbers)))
    };
    for encoding in ENCODINGS {
        for length in [f64::from(i32::MAX), 5.0] {
            let found = wrong(encoding, TRIANGLE, &[length, 0.0, 1.0, 2.0, 1.0]);
            assert!(found.contains("found the end of the file after"), "{found}");
            let expected = match encoding == "ascii" && length == 5.0 {
                true => "expected an integer".to_owned(),
                false => format!("expected a face of {length} corners"),
            };
            assert!(found.ends_with(&expected), "{found}");
        }
        let many = TRIANGLE.replace("face 1", "face 18446744073709551615");
        let found = wrong(encoding, &many, &[4.0, 0.0, 1.0, 2.0, 1.0]);
        assert!(found.contains("18446744073709551615 entries"), "{found}");
        let reals = TRIANGLE.replace("int int", "int float");
        let found = wrong(encoding, &reals, &[4.0, 0.0, 1.0, 2.0, 1.0]);
        assert!(found.contains("expected integer vertex indices"), "{found}");
    }
    for encoding in &ENCODINGS[1..] {
        let found = wrong(encoding, TRIANGLE, &[-4.0, 0.0, 1.0, 2.0, 1.0]);
        assert!(
            found.contains("found a list of -4 items, expected 0 or more"),
            "{found}"
        );
    }
    // A corner that is no vertex is passed on, to be refused or counted as that of a triangle is.
    let numbers = [
        &vertices[..],
        &[4.0, 0.0, 1.0, 2.0, 99.0].map(|c| ("int", c)),
    ]
    .concat();
    let got = read("a.ply", &file("ascii", TRIANGLE, &numbers)).unwrap();
    assert_eq!(got.triangles, [[0, 1, 2], [0, 2, 99]]);
    let text = file("ascii", TRIANGLE, &numbers);
    for end in 0..text.len() - 1 {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        std::fs::write(&path, &text[..end]).unwrap();
        let cut = PlyMesh::open_any(&path, &workspace(folder.path()));
        assert!(cut.is_err(), "cut at {end}");
    }
}
