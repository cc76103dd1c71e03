//! Distinct triples with their counts, by block: the sums over the cells of all tiles (paper, 3.4).

use outcrop_disk::error::Result;
use outcrop_disk::spill::{Shuffle, Table, release, row};
use outcrop_disk::workspace::memory::{Reservation, bytes_of};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::{CellTriples, CountedTriple, SentTriple};
use outcrop_stages::ids::{Block, Id, Triangle, same};
use serde::{Deserialize, Serialize};

row! {
    /// A crossing triple that is sent to a block of its other vertices.
    pub struct VisitingTriple {
        /// Number of the block.
        to: Block,
        /// Ids, ascending.
        triple: Triangle,
        /// Cells, 1 to 3.
        count: u32,
    }
    packed Above Above Rising Rising Above
}

/// All triples with their counts, ascending.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Triples {
    /// Triples by the block of their smallest vertex.
    pub own: Table<CountedTriple>,
    /// Crossing triples, sent to each other block that contains one of their vertices.
    pub visiting: Shuffle<VisitingTriple>,
}

release!(Triples: own, visiting);

/// Distinct triples by count.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, PartialEq, Eq)]
pub struct TripleStats {
    /// All distinct triples.
    pub triples: u64,
    /// Triples seen by all three cells.
    pub t3: u64,
    /// Triples seen by two cells.
    pub t2: u64,
    /// Triples seen by one cell.
    pub t1: u64,
    /// Triples with vertices in more than one block.
    pub crossing: u64,
}

/// Adds up the counts of all tiles.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn triples(
    cells: &CellTriples,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<(Triples, TripleStats)> {
    let own = Table::new("triples.own", blocks.count());
    let visiting = Shuffle::new("triples.sent");
    let inbox = cells.sent.open(workspace, cells.tiles.count())?;
    let count: u64 = cells.off.total(workspace)?;
    let _off = workspace.reserve("off the surface", 4 * count)?;
    let mut off: Vec<Id> = Vec::with_capacity(count as usize);
    let unit = workspace.unit();
    for tile in 0..cells.off.count() {
        off.extend(cells.off.get(&unit, tile)?);
    }
    let runs = Runs::of(&off, blocks.points(), workspace)?;
    let is_off = |v: &Id| runs.contain(*v) && off.binary_search(v).is_ok();
    let bytes = |block: usize| {
        let tiles = cells.tiles.of_block(block);
        tiles
            .map(|t| 50 * (cells.own.expected_rows(workspace, t) + inbox.rows(t)) as u64)
            .sum()
    };
    let work = |unit: &Unit<'_>| {
        let block = unit.number();
        let mut all = Vec::new();
        let mut held = unit.hold(0);
        for tile in cells.tiles.of_block(block) {
            let (seen, received) = (cells.own.get(unit, tile)?, inbox.get(unit, tile)?);
            all.reserve_exact(seen.len() + received.len());
            merge(&seen, &received, &mut all);
            held.set(bytes_of(&all) + bytes_of(&seen) + bytes_of(&received));
        }
        if !off.is_empty() {
            all.retain(|t: &CountedTriple| !t.triple.iter().any(is_off));
        }
        let mut sent = Vec::new();
        let mut local = [0u64; 4];
        for &CountedTriple { triple, count } in &all {
            local[(count - 1) as usize] += 1;
            let visited = blocks.visited(triple);
            sent.extend(visited.map(|to| VisitingTriple { to, triple, count }));
            local[3] += u64::from(blocks.crossing(triple));
        }
        held.set(bytes_of(&all) + bytes_of(&sent));
        own.put(unit, block, &all)?;
        visiting.send(unit, block, sent)?;
        unit.advance(all.len() as u64);
        Ok(local)
    };
    let mut counts = [0u64; 4];
    workspace.units("triples: block", blocks.count(), bytes, work, |_, more| {
        counts.iter_mut().zip(more).for_each(|(n, more)| *n += more);
        Ok(())
    })?;
    let [t1, t2, t3, crossing] = counts;
    let stats = TripleStats {
        triples: t1 + t2 + t3,
        t3,
        t2,
        t1,
        crossing,
    };
    Ok((Triples { own, visiting }, stats))
}

/// The runs of ids with points off the surface: these are few and together, so most other points need no
/// search.
struct Runs {
    words: Vec<u64>,
    _held: Reservation,
}

impl Runs {
    /// Binary logarithm of the number of ids in a run.
    const SHIFT: u32 = 7;

    fn of(off: &[Id], points: usize, workspace: &Workspace) -> Result<Self> {
        let words = (points >> Self::SHIFT) / 64 + 1;
        let mut runs = Self {
            _held: workspace.reserve("off the surface", 8 * words as u64)?,
            words: vec![0; words],
        };
        for id in off {
            let run = id.index() >> Self::SHIFT;
            runs.words[run / 64] |= 1 << (run % 64);
        }
        Ok(runs)
    }

    fn contain(&self, id: Id) -> bool {
        let run = id.index() >> Self::SHIFT;
        self.words[run / 64] >> (run % 64) & 1 == 1
    }
}

/// Merges two ascending lists and adds up the counts; `received` may contain a triple more than once.
fn merge(own: &[CountedTriple], received: &[SentTriple], all: &mut Vec<CountedTriple>) {
    let received = received.iter().map(|sent| CountedTriple {
        triple: sent.triple,
        count: sent.count,
    });
    let mut a = own.iter().copied().peekable();
    let mut b = received.peekable();
    loop {
        let next = match (a.peek(), b.peek()) {
            (Some(x), Some(y)) if y.triple < x.triple => b.next(),
            (None, _) => b.next(),
            _ => a.next(),
        };
        let Some(next) = next else { break };
        match all.last_mut() {
            Some(last) if same(last.triple, next.triple) => last.count += next.count,
            _ => all.push(next),
        }
    }
}
