//! What is true of every tileset.

use super::Case;
use crate::levels::meshes::Mesh;
use crate::levels::tileset::{Tile, Tileset};
use std::collections::{BTreeMap, BTreeSet};

/// A component of linear light as one of sRGB.
pub fn srgb(linear: u16) -> u8 {
    let x = f64::from(linear) / 65535.0;
    let encoded = match x <= 0.003_130_8 {
        true => 12.92 * x,
        false => 1.055 * x.powf(1.0 / 2.4) - 0.055,
    };
    (255.0 * encoded).round() as u8
}

/// Positions of a mesh in steps from the origin of a tileset.
pub fn steps(mesh: &Mesh, tileset: &Tileset) -> Vec<[i64; 3]> {
    let step = |p: &[f64; 3]| {
        std::array::from_fn(|k| {
            let steps = (p[k] - tileset.origin[k]) / tileset.step;
            assert!((steps - steps.round()).abs() < 1e-3, "{steps}");
            steps.round() as i64
        })
    };
    mesh.vertices.iter().map(step).collect()
}

pub type Corner = [i64; 3];

/// The triangle from its least corner on, in its direction.
pub fn turned([a, b, c]: [Corner; 3]) -> [Corner; 3] {
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
}

pub fn sorted(triangles: &[[u32; 3]], positions: &[Corner]) -> Vec<[Corner; 3]> {
    let corners = triangles
        .iter()
        .map(|t| turned(t.map(|v| positions[v as usize])));
    let mut all: Vec<_> = corners.collect();
    all.sort_unstable();
    all
}

/// The leaves have every triangle once, with its exact coordinates.
pub fn leaves_are_the_mesh(case: &Case) {
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
pub fn edges<'a>(
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

pub fn open(edges: &BTreeMap<[Corner; 2], [u32; 2]>) -> BTreeSet<[Corner; 2]> {
    let open = edges.iter().filter(|(_, count)| count[0] + count[1] == 1);
    open.map(|(ends, _)| *ends).collect()
}

/// A set of tiles that cover the mesh: tiles are refined by chance.
pub fn cut(tileset: &Tileset, rng: &mut oorandom::Rand32, chance: f32) -> Vec<usize> {
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
pub fn cuts_have_no_cracks(case: &Case) {
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
pub fn errors_are_true(case: &Case) {
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
        let distance = crate::levels::meshes::distance(&[tile], &full)
            .max(crate::levels::meshes::distance(&full, &[tile]));
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
pub fn boxes_hold_their_tiles(case: &Case) {
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
pub fn lines_are_the_boundary(case: &Case) {
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

pub fn all(case: &Case) {
    leaves_are_the_mesh(case);
    cuts_have_no_cracks(case);
    errors_are_true(case);
    boxes_hold_their_tiles(case);
    lines_are_the_boundary(case);
    assert!(case.tileset.tiles[0].bytes <= 1_000_000);
}
