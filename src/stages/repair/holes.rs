//! Finds boundary loops and has them filled: those inside a block at once, those across blocks
//! from the fragments that the blocks leave.

use super::fill::{Corner, Filling};
use super::mend::Mending;
use super::rim::{BlockRim, Outline};
use super::surface::Surface;
use super::{EXCHANGE_BUFFER, RepairStats, from_smallest};
use crate::error::Result;
use crate::spill::{Exchange, Sections};
use crate::stages::blocks::Blocks;
use crate::stages::located::Places;
use crate::stages::surface::star::sorted;
use crate::workspace::Workspace;
use rustc_hash::FxHashMap;
use std::sync::{Mutex, PoisonError};

/// A part of a loop inside one block: it enters at `start` (from, at) and leaves at `end` (at, to).
#[derive(Debug, Clone, Copy)]
struct Fragment {
    start: (u32, u32),
    end: (u32, u32),
    steps: usize,
    /// Where its steps are kept; `None` if it is too long by itself.
    kept: Option<usize>,
}

struct Found {
    fragments: Vec<Fragment>,
    settled: Settled,
    outline: Outline,
}

/// Fills holes as `mending` says, or none; `[block, i, a, b]` for each block that a triangle
/// touches, and what the boundary looks like.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn fill(
    places: Places<'_>,
    surface: &Surface,
    mending: Option<Mending>,
    blocks: Blocks,
    stats: &mut RepairStats,
    workspace: &Workspace,
) -> Result<(Sections<4>, Outline)> {
    let _held = workspace.reserve("exchange", EXCHANGE_BUFFER)?;
    let exchange = Exchange::<4>::new(workspace, "repair.filled", EXCHANGE_BUFFER);
    let kept = Sections::<1>::create(workspace, "repair.fragments", 0)?;
    let found = Mutex::new(Found {
        fragments: Vec::new(),
        settled: Settled::default(),
        outline: Outline::new(blocks, workspace)?,
    });
    let bytes =
        |b: usize| 150 * surface.records(b) as u64 + blocks.ids(b).len() as u64 * 40 + (1 << 20);
    workspace.for_each_unit("repair: block", blocks.count(), bytes, |block| {
        let rim = BlockRim::load(places, surface, blocks, block)?;
        let mut settled = Settled::default();
        let fragments = match mending {
            Some(mending) => fill_inside(&rim, mending, &kept, &mut settled)?,
            None => Vec::new(),
        };
        exchange.send(&addressed(&settled.triangles, blocks))?;
        let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
        found.fragments.extend(fragments);
        found.settled.add(&settled);
        found.outline.add(block, &blocks.ids(block), &rim);
        found.outline.pinches.put(block, &rim.pinches)?;
        found.outline.pinched.put(block, &rim.pinched())?;
        drop(found);
        workspace.observer.advance(1);
        Ok(())
    })?;
    let found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    let (mut settled, mut outline) = (found.settled, found.outline);
    let _fragments = workspace.reserve("fragments", found.fragments.len() as u64 * 120)?;
    for ring in link_up(&found.fragments) {
        workspace.check_cancel()?;
        let edges: usize = ring.iter().map(|&f| found.fragments[f].steps).sum();
        let Some(mending) = mending.filter(|m| edges <= m.longest_loop()) else {
            settled.too_long();
            continue;
        };
        let filling = fill_across(places, &ring, &found.fragments, &kept, mending)?;
        settled.settle(filling, edges);
        exchange.send(&addressed(&settled.triangles, blocks))?;
        settled.triangles.clear();
    }
    stats.add(&settled.stats);
    outline.boundary_edges -= settled.edges;
    Ok((exchange.deliver(workspace, blocks.count())?, outline))
}

/// Fills the holes that lie in a block by themselves, and keeps the parts of the others.
fn fill_inside(
    rim: &BlockRim,
    mending: Mending,
    kept: &Sections<1>,
    settled: &mut Settled,
) -> Result<Vec<Fragment>> {
    let (loops, open) = rim.trace();
    for ring in loops {
        if ring.len() > mending.longest_loop() {
            settled.too_long();
            continue;
        }
        let corners = ring.iter().map(|s| rim.corner(s)).collect();
        let filling = mending.mend(corners, |a, b| rim.has_edge(a, b));
        settled.settle(filling, ring.len());
    }
    let mut fragments = Vec::with_capacity(open.len());
    for part in open {
        let (first, last) = (part[0], part[part.len() - 1]);
        let words = (part.len() <= mending.longest_loop()).then(|| rim.words(&part));
        fragments.push(Fragment {
            start: (first.from, first.at),
            end: (last.at, last.to),
            steps: part.len(),
            kept: words.map(|w| kept.append(&w)).transpose()?,
        });
    }
    Ok(fragments)
}

/// What became of loops.
#[derive(Default)]
struct Settled {
    stats: RepairStats,
    /// Edges of the holes that were filled.
    edges: u64,
    triangles: Vec<[u32; 3]>,
}

impl Settled {
    fn settle(&mut self, filling: Filling, edges: usize) {
        if matches!(filling, Filling::Gap(_)) {
            self.stats.gaps_closed += 1;
        } else {
            self.stats.holes_found += 1;
        }
        match filling {
            Filling::Gap(t) => self.close(vec![t], edges),
            Filling::Filled(new) => {
                self.stats.holes_filled += 1;
                self.stats.hole_triangles += new.len() as u64;
                self.close(new, edges);
            }
            Filling::Zipped(new, left) => {
                self.stats.holes_zipped += 1;
                self.stats.hole_triangles += new.len() as u64;
                self.close(new, edges - left);
            }
            Filling::Outline => self.stats.holes_outline += 1,
            Filling::Impossible => self.stats.holes_not_filled += 1,
        }
    }

    fn close(&mut self, new: Vec<[u32; 3]>, edges: usize) {
        self.edges += edges as u64;
        self.triangles.extend(new.into_iter().map(from_smallest));
    }

    fn too_long(&mut self) {
        self.stats.holes_found += 1;
        self.stats.holes_too_long += 1;
    }

    /// Adds up all but the triangles.
    fn add(&mut self, other: &Self) {
        self.stats.add(&other.stats);
        self.edges += other.edges;
    }
}

fn addressed(triangles: &[[u32; 3]], blocks: Blocks) -> Vec<[u32; 4]> {
    let mut sent = Vec::with_capacity(triangles.len());
    for &t in triangles {
        sent.push([blocks.of(t[0]), t[0], t[1], t[2]]);
        let sorted = sorted(t);
        sent.extend(blocks.visited(sorted).map(|b| [b, t[0], t[1], t[2]]));
    }
    sent
}

/// Chains fragments to loops; every fragment is in one.
fn link_up(fragments: &[Fragment]) -> Vec<Vec<usize>> {
    let by_start: FxHashMap<(u32, u32), usize> = fragments
        .iter()
        .enumerate()
        .map(|(i, f)| (f.start, i))
        .collect();
    let mut seen = vec![false; fragments.len()];
    let mut loops = Vec::new();
    for first in 0..fragments.len() {
        let mut ring = Vec::new();
        let mut at = Some(first);
        while let Some(index) = at.filter(|i| !seen[*i]) {
            seen[index] = true;
            ring.push(index);
            at = by_start.get(&fragments[index].end).copied();
        }
        if !ring.is_empty() {
            loops.push(ring);
        }
    }
    loops
}

fn fill_across(
    places: Places<'_>,
    ring: &[usize],
    fragments: &[Fragment],
    kept: &Sections<1>,
    mending: Mending,
) -> Result<Filling> {
    let mut parts: Vec<(u32, u32, bool)> = Vec::new();
    let mut edges: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for &f in ring {
        let Some(section) = fragments[f].kept else {
            return Ok(Filling::Impossible);
        };
        let words = kept.get(section)?;
        let mut at = 0;
        while at < words.len() {
            let [id, apex, pinched, count] = std::array::from_fn(|k| words[at + k][0]);
            let around = words[at + 4..at + 4 + count as usize]
                .iter()
                .map(|w| w[0])
                .collect();
            edges.insert(id, around);
            parts.push((id, apex, pinched == 1));
            at += 4 + count as usize;
        }
    }
    let mut ids: Vec<u32> = parts.iter().flat_map(|&(id, apex, _)| [id, apex]).collect();
    ids.sort_unstable();
    ids.dedup();
    let mut points = Vec::with_capacity(ids.len());
    places.shape.fetch(&ids, &mut points)?;
    let mut in_file = Vec::new();
    if places.differ() {
        places.file.fetch(&ids, &mut in_file)?;
    }
    let rank = |v: u32| ids.partition_point(|x| *x < v);
    let at = |v: u32| points[rank(v)];
    let corner = |&(id, apex, pinched): &(u32, u32, bool)| Corner {
        id,
        at: at(id),
        apex: at(apex),
        file: *in_file.get(rank(id)).unwrap_or(&at(id)),
        pinched,
    };
    let corners = parts.iter().map(corner).collect();
    Ok(mending.mend(corners, |a, b| {
        edges.get(&a).is_some_and(|around| around.contains(&b))
    }))
}
