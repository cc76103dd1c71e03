//! Triples with their counts, by block: what the cells of all tiles saw, added up (paper, 3.4).

use crate::error::Result;
use crate::spill::layouts::{LABELLED, SENT_LABELLED};
use crate::spill::{Exchange, Sections};
use crate::stages::blocks::Blocks;
use crate::stages::cells::CellTriples;
use crate::workspace::Workspace;
use crate::workspace::memory::{Holding, bytes_of};
use crate::workspace::persist::persist;
use serde::Serialize;

const EXCHANGE_BUFFER: u64 = 16 << 20;

/// All triples `[i, j, k, count]` with `i < j < k`, ascending.
#[derive(Debug)]
pub struct Triples {
    /// By the block of the smallest vertex.
    pub own: Sections<4>,
    /// Crossing triples, `[block, i, j, k, count]`, for the blocks of their other vertices.
    pub visiting: Sections<5>,
}

/// Distinct triples by count.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct TripleStats {
    /// All distinct triples.
    pub triples: u64,
    /// Seen by all three cells.
    pub t3: u64,
    /// Seen by two cells.
    pub t2: u64,
    /// Seen by one cell.
    pub t1: u64,
    /// Those with vertices in more than one block.
    pub crossing: u64,
}

persist!(Triples { own, visiting });
persist!(TripleStats {
    triples,
    t3,
    t2,
    t1,
    crossing
});

/// Adds up the counts of all tiles.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn triples(
    cells: CellTriples,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<(Triples, TripleStats)> {
    let own = Sections::with_layout(workspace, "triples.own", blocks.count(), LABELLED)?;
    let exchange = Exchange::between(
        workspace,
        "triples.sent",
        EXCHANGE_BUFFER,
        blocks.count(),
        SENT_LABELLED,
    )?;
    let count: u64 = cells.off.total();
    let _off = workspace.reserve("off the surface", 4 * count)?;
    let mut off: Vec<u32> = Vec::with_capacity(count as usize);
    for tile in 0..cells.off.count() {
        off.extend(cells.off.get(tile)?.into_iter().flatten());
    }
    let is_off = |v: &u32| off.binary_search(v).is_ok();
    let bytes = |block: usize| {
        let tiles = cells.tiles.of_block(block);
        tiles
            .map(|t| 50 * (cells.own.records(t) + cells.received.records(t)) as u64)
            .sum()
    };
    let work = |block| {
        let mut all = Vec::new();
        let mut held = Holding::default();
        for tile in cells.tiles.of_block(block) {
            let (seen, received) = (cells.own.get(tile)?, cells.received.get(tile)?);
            all.reserve_exact(seen.len() + received.len());
            merge(&seen, &received, &mut all);
            held.set(bytes_of(&all) + bytes_of(&seen) + bytes_of(&received));
        }
        if !off.is_empty() {
            all.retain(|r| !r[..3].iter().any(is_off));
        }
        let mut sent = Vec::new();
        let mut local = [0u64; 4];
        for &[i, j, k, count] in &all {
            local[(count - 1) as usize] += 1;
            for visited in blocks.visited([i, j, k]) {
                sent.push([visited, i, j, k, count]);
            }
            local[3] += u64::from(blocks.crossing([i, j, k]));
        }
        held.set(bytes_of(&all) + bytes_of(&sent));
        own.put(block, &all)?;
        exchange.send_from(block, &sent)?;
        workspace.advance(all.len() as u64);
        Ok(local)
    };
    let mut counts = [0u64; 4];
    workspace.units("triples: block", blocks.count(), bytes, work, |_, more| {
        counts.iter_mut().zip(more).for_each(|(n, more)| *n += more);
        Ok(())
    })?;
    let visiting = exchange.deliver(workspace, blocks.count())?;
    let [t1, t2, t3, crossing] = counts;
    Ok((
        Triples { own, visiting },
        TripleStats {
            triples: t1 + t2 + t3,
            t3,
            t2,
            t1,
            crossing,
        },
    ))
}

/// Merges two ascending lists, adding up counts; `received` may hold a triple more than once.
fn merge(own: &[[u32; 4]], received: &[[u32; 5]], all: &mut Vec<[u32; 4]>) {
    let received = received.iter().map(|&[_, i, j, k, count]| [i, j, k, count]);
    let mut a = own.iter().copied().peekable();
    let mut b = received.peekable();
    loop {
        let take_a = match (a.peek(), b.peek()) {
            (Some(x), Some(y)) => x[..3] <= y[..3],
            (Some(_), None) => true,
            (None, Some(_)) => false,
            (None, None) => break,
        };
        let Some(next) = (if take_a { a.next() } else { b.next() }) else {
            break;
        };
        match all.last_mut() {
            Some(last) if last[..3] == next[..3] => last[3] += next[3],
            _ => all.push(next),
        }
    }
}
