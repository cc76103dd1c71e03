//! Lossy tilesets beside those that keep every bit.

use crate::levels::MEMORY;
use crate::levels::checks::{Corner, cut, edges, open};
use crate::levels::meshes::{Mesh, distance, hills};
use crate::levels::tileset::{Tile, Tileset};
use outcrop::Tiles;
use outcrop::levels::{Options, TilesReport};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

fn made(mesh: &Path, folder: &Path, lossy: bool, (memory, threads): (u64, usize)) -> TilesReport {
    let options = Options {
        most_triangles: 500,
        lossy,
        ..Options::default()
    };
    let tiles = Tiles::new(mesh, folder).options(options).memory(memory);
    tiles.threads(threads).run().unwrap()
}

/// The same mesh with every bit, and lossy.
struct Both {
    folder: tempfile::TempDir,
    exact: Tileset,
    lossy: Tileset,
    reports: [TilesReport; 2],
}

fn both(mesh: &Mesh) -> Both {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    mesh.write(&path);
    let [exact, lossy] = ["exact", "lossy"].map(|name| folder.path().join(name));
    let reports = [(&exact, false), (&lossy, true)]
        .map(|(folder, lossy)| made(&path, folder, lossy, (MEMORY, 2)));
    Both {
        exact: Tileset::read(&exact),
        lossy: Tileset::read(&lossy),
        folder,
        reports,
    }
}

/// All leaves below a tile, or itself.
fn leaves_below(tileset: &Tileset, tile: usize) -> Vec<&Tile> {
    let (mut left, mut leaves) = (vec![tile], Vec::new());
    while let Some(tile) = left.pop() {
        let tile = &tileset.tiles[tile];
        left.extend(&tile.children);
        if tile.children.is_empty() {
            leaves.push(tile);
        }
    }
    leaves
}

/// Errors of all tiles, leaves too, are at least the distances from the mesh with every bit.
fn errors_are_true(both: &Both) {
    let (exact, lossy) = (&both.exact, &both.lossy);
    for (number, tile) in lossy.tiles.iter().enumerate() {
        let full = leaves_below(exact, number);
        let apart = distance(&[tile], &full).max(distance(&full, &[tile])) * lossy.step;
        assert!(
            apart <= tile.error,
            "tile {number} of level {}: {apart} is more than {}, {} with every bit",
            tile.level,
            tile.error,
            exact.tiles[number].error
        );
        assert!(
            tile.error
                <= exact.tiles[number].error
                    + both.reports[1].lossy.unwrap().leaf_error * 1.000_001
        );
        for child in &tile.children {
            assert!(lossy.tiles[*child].error < tile.error);
        }
    }
}

/// Whatever tiles are shown together, edges are only open at the boundary of the mesh, up to the rounding. (That of the
/// rounded leaves has less: where it collapsed, edges of two triangles are at one place.)
fn cuts_have_no_cracks(both: &Both) {
    let leaves = both.exact.leaves();
    let whole = edges(leaves.map(|leaf| (&*leaf.triangles, &*leaf.exact)));
    let boundary: BTreeSet<Corner> = open(&whole).into_iter().flatten().collect();
    let most = both.reports[1].lossy.unwrap().leaf_error / both.lossy.step;
    let is_near = |end: &Corner| {
        boundary.iter().any(|p| {
            let apart = (0..3).map(|k| ((p[k] - end[k]) as f64).powi(2));
            apart.sum::<f64>().sqrt() <= most
        })
    };
    let mut rng = oorandom::Rand32::new(7);
    for chance in [0.0, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0, 0.85, 0.6] {
        let cut = cut(&both.lossy, &mut rng, chance);
        let tiles = cut.iter().map(|tile| &both.lossy.tiles[*tile]);
        let found = edges(tiles.map(|tile| (&*tile.triangles, &*tile.drawn)));
        for ends in open(&found) {
            assert!(ends.iter().all(is_near), "a crack at {ends:?}");
        }
    }
}

#[test]
fn a_lossy_landscape() {
    let mut mesh = hills(90, true);
    mesh.add_values();
    let both = both(&mesh);
    errors_are_true(&both);
    cuts_have_no_cracks(&both);
    let lossy = both.reports[1].lossy.unwrap();
    // No more than half the diagonal of a quarter of the median edge, which is about 1.
    assert!(
        lossy.leaf_error > 0.0 && lossy.leaf_error < 0.3,
        "{lossy:?}"
    );
    assert_eq!((lossy.collapsed, both.reports[0].lossy), (0, None));
    assert!(both.lossy.tiles[0].error > both.exact.tiles[0].error);
    // Each vertex is drawn at one place in all tiles, of any level, that have it.
    let mut drawn: BTreeMap<Corner, Corner> = BTreeMap::new();
    let (mut shared, mut moved) = (0, 0);
    for (exact, lossy) in both.exact.tiles.iter().zip(&both.lossy.tiles) {
        assert!(lossy.is_short && exact.triangles.len() == lossy.triangles.len());
        assert_eq!(exact.exact.len(), lossy.drawn.len());
        for (from, to) in exact.exact.iter().zip(&lossy.drawn) {
            shared += usize::from(drawn.contains_key(from));
            moved += usize::from(from != to);
            assert_eq!(drawn.entry(*from).or_insert(*to), to);
        }
        values_are_near(exact, lossy);
    }
    assert!(shared > 1000 && moved > 1000, "{shared} {moved}");
    let bytes = both.reports.map(|report| report.bytes);
    assert!(bytes[1] * 10 < bytes[0] * 9, "{bytes:?}");
}

/// Colours, intensities, times and normals of the lossy tile are about those of the other.
fn values_are_near(exact: &Tile, lossy: &Tile) {
    for vertex in 0..exact.exact.len() {
        for k in 0..3 {
            let wide = &exact.others["COLOR_0"][8 * vertex + 2 * k..][..2];
            let wide = f64::from(u16::from_le_bytes(wide.try_into().unwrap())) / 65535.0;
            let narrow = f64::from(lossy.others["COLOR_0"][4 * vertex + k]) / 255.0;
            assert!((wide - narrow).abs() <= 0.51 / 255.0, "{wide} {narrow}");
        }
        let float = |tile: &Tile, name: &str| {
            f64::from(f32::from_le_bytes(
                tile.others[name][4 * vertex..][..4].try_into().unwrap(),
            ))
        };
        let intensity = &exact.others["_INTENSITY"][4 * vertex..][..2];
        let intensity = f64::from(u16::from_le_bytes(intensity.try_into().unwrap()));
        assert!((float(lossy, "_INTENSITY") - intensity).abs() <= 65_521.0 / 512.0);
        let [a, b] = [exact, lossy].map(|tile| float(tile, "_GPS_TIME"));
        assert!((a - b).abs() <= 8100.0 / 16.0 / 512.0, "{a} {b}");
        let [a, b] = [exact, lossy].map(|tile| tile.normals[vertex].map(f64::from));
        let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
        let cosine = dot(a, b) / (dot(a, a) * dot(b, b)).sqrt();
        assert!(cosine > 5f64.to_radians().cos(), "{a:?} {b:?}");
    }
}

/// Spots where vertices are much nearer to each other than the step, also across tiles.
#[test]
fn collapsed_triangles_are_left_out_without_cracks() {
    let mut mesh = hills(90, true);
    for p in &mut mesh.vertices {
        let [x, y] = [p[0] - 635_000.0, p[1] - 4_848_000.0];
        let spot = [(x / 15.0).round() * 15.0, (y / 15.0).round() * 15.0];
        let far = (x - spot[0]).hypot(y - spot[1]);
        if far < 4.0 {
            let near = [spot[0] + 635_000.0, spot[1] + 4_848_000.0, p[2]];
            (0..3).for_each(|k| p[k] = near[k] + (p[k] - near[k]) * 0.02);
            (0..3).for_each(|k| p[k] = (p[k] * 1000.0).round() / 1000.0);
        }
    }
    let both = both(&mesh);
    let lossy = both.reports[1].lossy.unwrap();
    assert!(lossy.collapsed > 50, "{lossy:?}");
    let leaves: usize = both.lossy.leaves().map(|leaf| leaf.triangles.len()).sum();
    assert_eq!(leaves as u64 + lossy.collapsed, both.reports[1].triangles);
    errors_are_true(&both);
    cuts_have_no_cracks(&both);
    let about = &both.lossy.json["extras"]["outcrop"]["lossy"];
    assert_eq!(about["collapsed"], lossy.collapsed);
}

#[test]
fn a_lossy_tileset_is_the_same_for_any_memory_and_threads() {
    let mut mesh = hills(60, true);
    mesh.add_values();
    let both = both(&mesh);
    let (path, again) = (
        both.folder.path().join("mesh.ply"),
        both.folder.path().join("again"),
    );
    made(&path, &again, true, (2 * MEMORY, 1));
    let first = both.folder.path().join("lossy");
    for number in 0..both.reports[1].tiles {
        let name = format!("tiles/{number}.glb");
        let [a, b] = [&first, &again].map(|folder| std::fs::read(folder.join(&name)).unwrap());
        assert!(a == b, "{name}");
    }
    let [a, b] = [&first, &again].map(|folder| std::fs::read(folder.join("tileset.json")).unwrap());
    assert!(a == b);
}

/// Without the option tiles are what they were before there was one.
#[test]
fn without_the_option_every_bit_stays() {
    let mut mesh = hills(60, true);
    mesh.add_values();
    let both = both(&mesh);
    let mut sum = 0;
    for number in 0..both.reports[0].tiles {
        let file =
            std::fs::read(both.folder.path().join(format!("exact/tiles/{number}.glb"))).unwrap();
        // Without the JSON, which has the version of the program.
        let json = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
        sum = crc32c::crc32c_append(sum, &file[20 + json..]);
    }
    for tile in &both.exact.tiles {
        sum = crc32c::crc32c_append(sum, &tile.error.to_le_bytes());
    }
    assert_eq!(sum, 3_958_770_040);
}
