//! Tests: turns that are abandoned for lack of memory, and repeated.

use super::super::base::base;
use super::super::interior::Interior;
use super::*;
use crate::stitch::StitchOptions;
use crate::triples::triples;
use outcrop_disk::workspace::Workspace;
use outcrop_geom::Point;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::{CellOptions, DiskRadius, TileRanges, Widen, cells};
use outcrop_stages::located::Places;
use outcrop_stages::order::Orderer;

/// Points in a row of the sheet, and in a block.
const SIDE: i32 = 50;
const BLOCK: u32 = 100;

/// A square sheet with noise of up to one spacing, so that there are candidates everywhere.
fn sheet() -> Vec<Point> {
    let noise = |n: i32| {
        let n = (n as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        ((n ^ n >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as i32 % 100
    };
    let at = |n: i32| [100 * (n % SIDE), 100 * (n / SIDE), 500 + noise(n)];
    (0..SIDE * SIDE).map(at).collect()
}

/// The result of a pass for each block, and its counts.
#[derive(Debug, PartialEq)]
struct Left {
    added: Vec<Vec<TriangleTo>>,
    removed: Vec<Vec<TriangleTo>>,
    counts: InsertStats,
}

/// Takes the pass over the sheet. If `starved`, each turn is first tried without memory, and then with more
/// and more. Returns the result, the number of turns, and how often one was abandoned.
fn across(starved: bool) -> (Left, [usize; 2]) {
    let workspace = &Workspace::for_tests(1).expect("a scratch folder");
    let orderer = Orderer::new(workspace).unwrap();
    orderer.push(workspace, &sheet()).unwrap();
    let stored = orderer.finish(workspace, 64).unwrap().0;
    let store = stored.open(workspace).unwrap();
    let blocks = Blocks::new(store.len(), BLOCK);
    let tiles = TileRanges::new(blocks, BLOCK);
    let options = CellOptions {
        neighbors: 12,
        radius: DiskRadius::Auto,
        widen: Widen::OnLines,
        density: None,
        directions: None,
    };
    let seen = cells(&store, tiles, options, workspace).unwrap().0;
    let triples = triples(&seen, blocks, workspace).unwrap().0;
    let places = Places::new(&store, None, None, None);
    let options = StitchOptions {
        cos_max_angle: 0.0,
        weigh: Some(crate::surface::evidence::Division::default()),
        keep_triples: false,
    };
    let (base, _) = base(places, &triples, blocks, options, workspace).unwrap();
    let interior = Interior::new(blocks.count());
    let unit = &workspace.unit();
    let insertion = Insertion {
        places,
        base: &base,
        interior: &interior,
        blocks,
        cos_max_angle: -0.5,
        workspace,
    };
    for block in 0..blocks.count() {
        insert(insertion, block, unit).unwrap();
    }
    let mut pass = Pass::new(insertion).unwrap();
    let (mut turns, mut given_up) = (0, 0);
    while pass.group < blocks.count() {
        let group = pass.group;
        // Not beyond this turn.
        let ready =
            |block: outcrop_stages::ids::Block| base.spans[block.index()].0.index() <= group;
        let mut most = starved.then_some(0);
        let free = workspace.memory.available();
        loop {
            pass.advance(unit, ready, most).unwrap();
            if pass.group > group {
                break;
            }
            given_up += 1;
            assert_eq!(workspace.memory.available(), free, "of group {group}");
            most = most.map(|most| most + most / 4 + 256);
        }
        turns += 1;
    }
    let (stitched, counts) = pass.finish(unit).unwrap();
    let all = |sent: &Shuffle<TriangleTo>| {
        let (all, inbox) = (
            0..blocks.count(),
            sent.open(workspace, blocks.count()).unwrap(),
        );
        all.map(|block| inbox.get(unit, block).unwrap()).collect()
    };
    let left = Left {
        added: all(&stitched.added),
        removed: all(&stitched.removed),
        counts,
    };
    (left, [turns, given_up])
}

#[test]
fn a_turn_that_is_given_up_is_taken_again() {
    let (want, [_, given_up]) = across(false);
    assert_eq!(given_up, 0);
    assert!(want.counts.accepted > 50, "{:?}", want.counts);
    let (got, [turns, given_up]) = across(true);
    // At the start, before a block is read, and before its triangles are stored.
    assert!(given_up > 10 * turns, "{given_up} of {turns}");
    assert_eq!(got, want);
}
