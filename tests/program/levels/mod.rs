//! Levels of detail: tilesets are read back and compared with their meshes.

mod checks;
mod closed;
mod cloud;
mod crossed;
mod globe;
mod kills;
mod lossy;
mod meshes;
mod resumed;
mod single;
mod tileset;

use checks::{Corner, all, cut, errors_are_true, leaves_are_the_mesh, srgb, steps};
use meshes::{Mesh, hills, sphere};
use outcrop::levels::{Options, TilesReport};
use outcrop::{Observer, Planned, Tiles};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use tileset::Tileset;

const MEMORY: u64 = 192 << 20;

/// A tileset of a mesh with leaves of at most `most` triangles.
fn made(mesh: &Path, folder: &Path, most: u32) -> TilesReport {
    let options = Options {
        most_triangles: most,
        ..Options::default()
    };
    let tiles = Tiles::new(mesh, folder).options(options).memory(MEMORY);
    tiles.threads(2).run().unwrap()
}

struct Case {
    _folder: tempfile::TempDir,
    mesh: Mesh,
    path: PathBuf,
    tileset: Tileset,
    report: TilesReport,
}

fn case(mesh: Mesh, most: u32) -> Case {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    mesh.write(&path);
    let output = folder.path().join("tiles");
    let report = made(&path, &output, most);
    let tileset = Tileset::read(&output);
    Case {
        _folder: folder,
        mesh,
        path,
        tileset,
        report,
    }
}

#[test]
fn a_landscape_with_holes() {
    let case = case(hills(90, true), 500);
    assert!(
        case.report.levels > 3 && case.report.leaves > 20,
        "{:?}",
        case.report
    );
    all(&case);
    assert!(case.path.exists());
}

#[test]
fn a_closed_surface() {
    let case = case(sphere(70), 400);
    all(&case);
    assert_eq!(case.report.boundary_edges, 0);
    // No tile turned triangles over, but for slivers: those of a sphere face outwards.
    let root = &case.tileset.tiles[0];
    let middle =
        [0, 1, 2].map(|k| root.exact.iter().map(|p| p[k]).sum::<i64>() / root.exact.len() as i64);
    let (mut outwards, mut inwards) = (0.0, 0.0);
    for triangle in &root.triangles {
        let [a, b, c] = triangle.map(|v| {
            let p = root.exact[v as usize];
            [0, 1, 2].map(|k| (p[k] - middle[k]) as f64)
        });
        let volume = a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        *if volume > 0.0 {
            &mut outwards
        } else {
            &mut inwards
        } += volume.abs();
    }
    assert!(inwards < 2e-3 * outwards, "{inwards} {outwards}");
    for (p, normal) in root.exact.iter().zip(&root.normals) {
        let out = (0..3)
            .map(|k| (p[k] - middle[k]) as f64 * f64::from(normal[k]))
            .sum::<f64>();
        assert!(out > 0.0);
    }
}

#[test]
fn the_order_of_the_file_does_not_matter_for_what_is_kept() {
    let mut mesh = hills(60, true);
    mesh.shuffle(3);
    all(&case(mesh, 300));
}

#[test]
fn values_stay_with_their_vertices() {
    let mut mesh = hills(60, false);
    mesh.add_values();
    let case = case(mesh, 500);
    leaves_are_the_mesh(&case);
    let columns = case.tileset.json["extras"]["outcrop"]["columns"]
        .as_array()
        .unwrap();
    assert_eq!(columns.len(), 2);
    assert_eq!(columns[1]["attribute"], "_GPS_TIME");
    let offset = columns[1]["offset"].as_f64().unwrap();
    let at: BTreeMap<Corner, usize> = steps(&case.mesh, &case.tileset)
        .into_iter()
        .zip(0..)
        .collect();
    for tile in &case.tileset.tiles {
        for (number, position) in tile.exact.iter().enumerate() {
            let (color, intensity, time) = Mesh::values_of(at[position]);
            let components = tile.others["COLOR_0"][8 * number..][..6].chunks_exact(2);
            let components = components.map(|b| srgb(u16::from_le_bytes([b[0], b[1]])));
            assert_eq!(components.collect::<Vec<u8>>(), color);
            let bytes = &tile.others["_INTENSITY"][4 * number..][..2];
            assert_eq!(bytes, intensity.to_le_bytes());
            let bytes = &tile.others["_GPS_TIME"][4 * number..][..4];
            let found = f64::from(f32::from_le_bytes(bytes.try_into().unwrap())) + offset;
            assert!((found - time).abs() < 1e-3, "{found} {time}");
        }
    }
}

/// A mesh so large for its step that the root cannot show all bits.
#[test]
fn low_bits_are_kept() {
    let mut mesh = hills(80, true);
    for (number, p) in mesh.vertices.iter_mut().enumerate() {
        for (axis, x) in p.iter_mut().enumerate() {
            let fine = (number * 7919 * (axis + 1) % 100_000) as f64 / 1e5;
            *x = (*x - [635_000.0, 4_848_000.0, 0.0][axis]).floor() * 200.0 + fine;
            *x = (*x * 1e5).round() / 1e5;
        }
    }
    let case = case(mesh, 400);
    assert!(
        case.report.exact && case.report.step == 1e-5,
        "{:?}",
        case.report
    );
    leaves_are_the_mesh(&case);
    errors_are_true(&case);
    // Tiles of all levels draw a vertex at one place, if they are shown together.
    let root = &case.tileset.tiles[0];
    assert!(root.exact != root.drawn);
    let mut rng = oorandom::Rand32::new(5);
    for chance in [0.5, 0.7, 0.9, 1.0] {
        let mut drawn: BTreeMap<Corner, Corner> = BTreeMap::new();
        for tile in cut(&case.tileset, &mut rng, chance) {
            let tile = &case.tileset.tiles[tile];
            for (exact, at) in tile.exact.iter().zip(&tile.drawn) {
                assert_eq!(drawn.entry(*exact).or_insert(*at), at);
                assert!((0..3).all(|k| (0..65536).contains(&(exact[k] - at[k]))));
            }
        }
    }
}

#[test]
fn odd_meshes() {
    let flat = |vertices: &[[f64; 3]], triangles: &[[u32; 3]]| {
        case(Mesh::of(vertices.to_vec(), triangles.to_vec()), 100)
    };
    let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for triangles in [
        vec![[0, 1, 2]],
        // Degenerate ones, the same one twice, three at one edge, and turned against each other.
        vec![[0, 0, 1], [1, 2, 2], [3, 3, 3], [0, 1, 2]],
        vec![[0, 1, 2], [0, 1, 2]],
        vec![[0, 1, 2], [0, 1, 3], [1, 0, 3]],
    ] {
        let case = flat(&corner, &triangles);
        leaves_are_the_mesh(&case);
        assert_eq!(case.report.tiles, 1);
    }
    // All vertices at one place, and many triangles at one vertex, cannot be divided.
    let case = flat(&[[2.5; 3]; 9], &vec![[0, 4, 8]; 1000]);
    leaves_are_the_mesh(&case);
    let fan: Vec<[u32; 3]> = (1..999).map(|n| [0, n, n + 1]).collect();
    let around =
        |n: u32| [f64::from(n).sin(), f64::from(n).cos(), 0.25].map(|x| (x * 1e4).round() / 1e4);
    let vertices: Vec<_> = (0..1000).map(around).collect();
    leaves_are_the_mesh(&flat(&vertices, &fan));
    // Huge and tiny coordinates, which need rounding, are refused or near.
    let case = flat(
        &[[0.0; 3], [1e99, 0.0, 0.0], [0.0, 1e99, 1e-9]],
        &[[0, 1, 2]],
    );
    assert!(!case.report.exact);
    assert_eq!(case.tileset.leaves().next().unwrap().triangles.len(), 1);
}

/// Soup: no two triangles share a vertex, so nothing can be contracted across them.
#[test]
fn a_soup_of_triangles() {
    let grid = hills(40, false);
    let corners = grid.triangles.iter().flatten();
    let vertices: Vec<_> = corners.map(|v| grid.vertices[*v as usize]).collect();
    let triangles = (0..vertices.len() as u32 / 3).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]);
    let case = case(Mesh::of(vertices, triangles.collect()), 300);
    leaves_are_the_mesh(&case);
    errors_are_true(&case);
}

#[test]
fn wrong_meshes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let output = folder.path().join("tiles");
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n\
                  property double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let refused = |body: &str, words: &str| {
        std::fs::write(&path, format!("{header}{body}")).unwrap();
        let error = Tiles::new(&path, &output).memory(MEMORY).run().unwrap_err();
        assert!(matches!(error, outcrop::Error::Input { .. }));
        assert!(error.to_string().contains(words), "{error}");
        assert_eq!(
            std::fs::read_dir(folder.path()).unwrap().count(),
            1,
            "something is left"
        );
    };
    refused(
        "0 0 0\n0 1 nan\n1 0 0\n3 0 1 2\n",
        "vertex 1: found a position 0 1 NaN",
    );
    refused(
        "0 0 0\n0 1 0\n1 0 0\n3 0 1 3\n",
        "found a triangle 0 1 3, expected vertices below 3",
    );
    refused("0 0 0\n0 1 0\n1 0 0\n3 0 1\n", "end of the file");
    let none = header.replace("face 1", "face 0");
    std::fs::write(&path, none + "0 0 0\n0 1 0\n1 0 0\n").unwrap();
    let error = Tiles::new(&path, &output).memory(MEMORY).run().unwrap_err();
    assert!(error.to_string().contains("found no triangle"), "{error}");
    // A folder with other files is not touched.
    std::fs::create_dir(&output).unwrap();
    std::fs::write(output.join("thesis.tex"), "").unwrap();
    let error = Tiles::new(&path, &output).memory(MEMORY).run().unwrap_err();
    assert!(matches!(error, outcrop::Error::Parameter { .. }), "{error}");
    assert!(output.join("thesis.tex").exists());
}

/// Notes the plans, and the stages that begin.
#[derive(Default)]
struct Notes(Mutex<(usize, Vec<&'static str>, Vec<&'static str>)>);

impl Observer for Notes {
    fn plan(&self, stages: &[Planned]) {
        let mut notes = self.0.lock().unwrap();
        assert!(stages.iter().all(|stage| stage.seconds > 0.0));
        notes.0 += 1;
        notes.1 = stages.iter().map(|stage| stage.name).collect();
    }

    fn begin(&self, name: &'static str, _: &'static str, _: u64) {
        let mut notes = self.0.lock().unwrap();
        assert_eq!(notes.1.first(), Some(&name), "after {:?}", notes.2);
        notes.1.remove(0);
        notes.2.push(name);
    }
}

#[test]
fn all_stages_are_planned_before_they_begin() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    hills(60, true).write(&path);
    let options = Options {
        most_triangles: 300,
        ..Options::default()
    };
    let notes = Arc::new(Notes::default());
    let tiles = Tiles::new(&path, folder.path().join("tiles")).options(options);
    let report = tiles.memory(MEMORY).observer(notes.clone()).run().unwrap();
    let (plans, left, begun) = std::mem::take(&mut *notes.0.lock().unwrap());
    assert!(plans == 3 && left.is_empty(), "{plans} plans, {left:?}");
    let mut expected = vec!["read mesh", "divide", "share", "leaves"];
    expected.resize(3 + report.levels as usize, "level");
    expected.push("write");
    assert_eq!(begun, expected);
    assert!(report.levels > 2);
}
