//! The surface on which the kernels are measured, as the stages provide it.
#![allow(dead_code, reason = "every bench uses a part of this")]

use outcrop_cloudgen::{Cloud, Kind};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_geom::Point;
use outcrop_stages::ids::Id;
use outcrop_stages::order::{Orderer, PAGE, PointStore};
use outcrop_stages::tiles::Tile;
use outcrop_stages::tiles::near::Search;
use outcrop_stages::tiles::neighbors::Neighbors;
use std::sync::Arc;

/// Neighbours of a plane, the pipeline's default.
pub const NEIGHBORS: usize = 30;

/// Approximate number of candidates of a query.
pub const CANDIDATES: usize = 192;

/// Approximate number of neighbours listed for a query.
pub const LISTED: usize = 40;

/// Numbers without a pattern.
pub fn column(count: usize, seed: u32) -> Vec<i32> {
    let mixed = |n: u32| {
        (n + 1)
            .wrapping_mul(seed)
            .rotate_left(13)
            .wrapping_mul(0x9e37_79b1)
    };
    (0..count as u32).map(|n| (mixed(n) >> 12) as i32).collect()
}

/// A workspace of one thread in the temporary folder.
pub fn workspace() -> Workspace {
    let memory = MemoryPool::new(1 << 30).expect("more than the minimum");
    let folder = std::env::temp_dir();
    Workspace::new(&folder, memory, 1, Arc::new(Silent), Cancel::new()).expect("a scratch folder")
}

/// A uniform sample of a bumpy closed surface in no order, on a lattice of a thousandth.
pub fn points(count: usize) -> Vec<Point> {
    let cloud = Cloud::new(Kind::Bumpy).points(count as u64);
    let mut positions = vec![[0.0; 3]; count];
    cloud
        .generator()
        .expect("sane parameters")
        .fill(0, &mut positions);
    positions
        .iter()
        .map(|p| p.map(|c| ((c + 1000.0) * 1000.0) as i32))
        .collect()
}

/// The same points as an ordered store.
pub fn store(count: usize, workspace: &Workspace) -> PointStore {
    let orderer = Orderer::new(workspace).expect("memory");
    orderer
        .push(workspace, &points(count))
        .expect("scratch space");
    let (stored, _) = orderer.finish(workspace, PAGE).expect("scratch space");
    stored.open(workspace).expect("scratch file")
}

/// The id and nearest neighbours of every point, at least [`NEIGHBORS`], nearest first.
pub fn neighbors(count: usize) -> Vec<(Id, Neighbors)> {
    let workspace = workspace();
    let store = store(count, &workspace);
    let tile = Tile::load(&store, 0..store.len()).expect("scratch file");
    let mut all = Vec::with_capacity(count);
    tile.for_each_query(
        NEIGHBORS,
        &mut Search::default(),
        |_| (),
        |id, _, query| {
            all.extend(query.map(|q| (id, q.near().clone())));
        },
    );
    all
}
