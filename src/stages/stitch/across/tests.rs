//! Tests: turns that are abandoned for lack of memory, and repeated.

use super::super::base::base;
use super::super::interior::insert;
use super::*;
use crate::geom::Point;
use crate::stages::cells::{DiskRadius, TileRanges, Widen, cells};
use crate::stages::located::Places;
use crate::stages::order::Orderer;
use crate::stages::triples::triples;

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
    let workspace = &Workspace::for_tests(1);
    let orderer = Orderer::new(workspace).unwrap();
    orderer.push(workspace, &sheet()).unwrap();
    let store = orderer.finish(workspace, 64).unwrap().0;
    let blocks = Blocks::new(store.len(), BLOCK);
    let tiles = TileRanges::new(blocks, BLOCK);
    let (radius, widen) = (DiskRadius::Auto, Widen::OnLines);
    let seen = cells(&store, tiles, 12, radius, widen, None, workspace)
        .unwrap()
        .0;
    let triples = triples(seen, blocks, workspace).unwrap().0;
    let places = Places {
        shape: &store,
        file: &store,
        density: None,
    };
    let division = Some(crate::Division::default());
    let (base, _) = base(places, triples, blocks, division, workspace).unwrap();
    let interior = Interior::create(workspace, blocks.count()).unwrap();
    for block in 0..blocks.count() {
        insert(places, &base, &interior, blocks, block, -0.5).unwrap();
    }
    let mut pass = Pass::new(&base, &interior, blocks, -0.5, workspace).unwrap();
    let (mut turns, mut given_up) = (0, 0);
    while pass.group < blocks.count() {
        let group = pass.group;
        // Not beyond this turn.
        let ready = |block: u32| base.spans[block as usize].0 as usize <= group;
        let mut most = starved.then_some(0);
        let free = workspace.memory.available();
        loop {
            pass.advance(ready, most).unwrap();
            if pass.group > group {
                break;
            }
            given_up += 1;
            assert_eq!(workspace.memory.available(), free, "of group {group}");
            most = most.map(|most| most + most / 4 + 256);
        }
        turns += 1;
    }
    let (crossing, counts) = pass.finish().unwrap();
    let all = |table: &Table<TriangleTo>| {
        let all = 0..blocks.count();
        all.map(|block| table.get(block).unwrap()).collect()
    };
    let left = Left {
        added: all(&crossing.added),
        removed: all(&crossing.removed),
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
