//! Levels of detail: tilesets are read back and compared with their meshes.

mod globe;
mod meshes;
mod resumed;
mod tileset;

use meshes::{Mesh, hills, sphere};
use outcrop::levels::{Options, TilesReport};
use outcrop::{Observer, Planned, Tiles};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use tileset::{Tile, Tileset};

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

/// A component of linear light as one of sRGB.
fn srgb(linear: u16) -> u8 {
    let x = f64::from(linear) / 65535.0;
    let encoded = match x <= 0.003_130_8 {
        true => 12.92 * x,
        false => 1.055 * x.powf(1.0 / 2.4) - 0.055,
    };
    (255.0 * encoded).round() as u8
}

/// Positions of a mesh in steps from the origin of a tileset.
fn steps(mesh: &Mesh, tileset: &Tileset) -> Vec<[i64; 3]> {
    let step = |p: &[f64; 3]| {
        std::array::from_fn(|k| {
            let steps = (p[k] - tileset.origin[k]) / tileset.step;
            assert!((steps - steps.round()).abs() < 1e-3, "{steps}");
            steps.round() as i64
        })
    };
    mesh.vertices.iter().map(step).collect()
}

type Corner = [i64; 3];

/// The triangle from its least corner on, in its direction.
fn turned([a, b, c]: [Corner; 3]) -> [Corner; 3] {
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
}

fn sorted(triangles: &[[u32; 3]], positions: &[Corner]) -> Vec<[Corner; 3]> {
    let corners = triangles
        .iter()
        .map(|t| turned(t.map(|v| positions[v as usize])));
    let mut all: Vec<_> = corners.collect();
    all.sort_unstable();
    all
}

/// The leaves have every triangle once, with its exact coordinates.
fn leaves_are_the_mesh(case: &Case) {
    let mut found: Vec<_> = case
        .tileset
        .leaves()
        .flat_map(|leaf| sorted(&leaf.triangles, &leaf.exact))
        .collect();
    found.sort_unstable();
    let want = sorted(&case.mesh.triangles, &steps(&case.mesh, &case.tileset));
    assert!(found == want, "{} of {} triangles", found.len(), want.len());
}

/// Edges by their ends, with the number of triangles in each direction.
fn edges<'a>(
    tiles: impl Iterator<Item = (&'a [[u32; 3]], &'a [Corner])>,
) -> BTreeMap<[Corner; 2], [u32; 2]> {
    let mut all: BTreeMap<[Corner; 2], [u32; 2]> = BTreeMap::new();
    for (triangles, positions) in tiles {
        for &[a, b, c] in triangles {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                let (p, q) = (positions[a as usize], positions[b as usize]);
                if p != q {
                    all.entry([p.min(q), p.max(q)]).or_default()[usize::from(p > q)] += 1;
                }
            }
        }
    }
    all
}

fn open(edges: &BTreeMap<[Corner; 2], [u32; 2]>) -> BTreeSet<[Corner; 2]> {
    let open = edges.iter().filter(|(_, count)| count[0] + count[1] == 1);
    open.map(|(ends, _)| *ends).collect()
}

/// A set of tiles that cover the mesh: tiles are refined by chance.
fn cut(tileset: &Tileset, rng: &mut oorandom::Rand32, chance: f32) -> Vec<usize> {
    let (mut left, mut cut) = (vec![0], Vec::new());
    while let Some(tile) = left.pop() {
        let children = &tileset.tiles[tile].children;
        match !children.is_empty() && rng.rand_float() < chance {
            true => left.extend(children),
            false => cut.push(tile),
        }
    }
    cut
}

/// Whatever tiles are shown together, their open edges are between vertices of the boundary of the mesh, and each
/// edge has at most one triangle in each direction if the mesh has.
fn cuts_have_no_cracks(case: &Case) {
    let positions = steps(&case.mesh, &case.tileset);
    let whole = edges([(&*case.mesh.triangles, &*positions)].into_iter());
    let boundary: BTreeSet<Corner> = open(&whole).into_iter().flatten().collect();
    let is_manifold = whole.values().all(|count| *count <= [1, 1]);
    let mut rng = oorandom::Rand32::new(7);
    let mut mixed = 0;
    for chance in [0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0, 0.85, 0.6] {
        let cut = cut(&case.tileset, &mut rng, chance);
        let tiles: Vec<&Tile> = cut.iter().map(|tile| &case.tileset.tiles[*tile]).collect();
        let levels: BTreeSet<u64> = tiles.iter().map(|tile| tile.level).collect();
        mixed += usize::from(levels.len() > 2);
        let found = edges(tiles.iter().map(|tile| (&*tile.triangles, &*tile.drawn)));
        // Positions that are drawn are those of the mesh here, see `low_bits_are_kept` for others.
        for ends in open(&found) {
            assert!(
                ends.iter().all(|end| boundary.contains(end)),
                "a crack at {ends:?}"
            );
        }
        if is_manifold {
            assert!(
                found.values().all(|count| *count <= [1, 1]),
                "folds at {chance}"
            );
        }
    }
    assert!(mixed > 0, "no cut has tiles of three levels");
}

/// Errors never fall towards the root, and exceed the distance of a tile from its part of the mesh.
fn errors_are_true(case: &Case) {
    let tiles = &case.tileset.tiles;
    for tile in tiles {
        for child in &tile.children {
            assert!(tiles[*child].error < tile.error);
        }
        if tile.children.is_empty() {
            assert_eq!((tile.error, tile.level), (0.0, 0));
            continue;
        }
        let (mut left, mut full) = (tile.children.clone(), Vec::new());
        while let Some(child) = left.pop() {
            left.extend(&tiles[child].children);
            if tiles[child].children.is_empty() {
                full.push(&tiles[child]);
            }
        }
        let distance = meshes::distance(&[tile], &full).max(meshes::distance(&full, &[tile]));
        let distance = distance * case.tileset.step;
        assert!(
            distance <= tile.error,
            "{distance} is more than {}",
            tile.error
        );
        // They are no exaggeration either.
        assert!(
            tile.error <= 30.0 * distance + 2.0 * case.tileset.step,
            "{distance} {}",
            tile.error
        );
    }
}

/// Boxes hold their tiles and those of the children.
fn boxes_hold_their_tiles(case: &Case) {
    let tileset = &case.tileset;
    for tile in &tileset.tiles {
        let volume = tile.volume;
        for position in &tile.drawn {
            for axis in 0..3 {
                let from = position[axis] as f64 * tileset.step - volume[axis];
                assert!(from.abs() <= volume[3 + axis] * (1.0 + 1e-12));
            }
        }
        for child in &tile.children {
            let child = tileset.tiles[*child].volume;
            for axis in 0..3 {
                let from = (child[axis] - volume[axis]).abs() + child[3 + axis];
                assert!(from <= volume[3 + axis] * (1.0 + 1e-9));
            }
        }
    }
}

/// The lines of the leaves are the boundary of the mesh; those of other tiles are open edges of it.
fn lines_are_the_boundary(case: &Case) {
    let positions = steps(&case.mesh, &case.tileset);
    let want = open(&edges([(&*case.mesh.triangles, &*positions)].into_iter()));
    let lines = |tile: &Tile| -> Vec<[Corner; 2]> {
        let ends = |line: &[u32; 2]| line.map(|v| tile.exact[v as usize]);
        tile.lines
            .iter()
            .map(ends)
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect()
    };
    let found: Vec<_> = case.tileset.leaves().flat_map(lines).collect();
    assert_eq!(found.len(), want.len());
    assert!(found.into_iter().collect::<BTreeSet<_>>() == want);
    assert_eq!(case.report.boundary_edges, want.len() as u64);
    let root = &case.tileset.tiles[0];
    let open = open(&edges([(&*root.triangles, &*root.exact)].into_iter()));
    assert!(lines(root).into_iter().collect::<BTreeSet<_>>() == open);
}

fn all(case: &Case) {
    leaves_are_the_mesh(case);
    cuts_have_no_cracks(case);
    errors_are_true(case);
    boxes_hold_their_tiles(case);
    lines_are_the_boundary(case);
    assert!(case.tileset.tiles[0].bytes <= 1_000_000);
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
    refused("0 0 0\n0 1 0\n1 0 0\n4 0 1 2 0\n", "not triangles");
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
