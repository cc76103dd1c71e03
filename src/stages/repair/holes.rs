//! Finds boundary loops and has them filled: loops inside a block immediately, loops across blocks later,
//! from the fragments that the blocks write.

use super::boundary::LoopRules;
use super::fill::{Corner, Filling};
use super::rim::{BlockRim, FragmentRow, NumberingInput, RimCounts, RimFiles};
use super::surface::Surface;
use super::{FilledTriangle, RepairStats, SHUFFLE_BUFFER, from_smallest};
use crate::error::Result;
use crate::spill::{Shuffle, Table};
use crate::stages::blocks::Blocks;
use crate::stages::located::Places;
use crate::stages::surface::star::sorted;
use crate::workspace::Workspace;
use crate::workspace::persist::persist;
use rustc_hash::FxHashMap;

/// Part of a loop inside one block: it enters at `start` (from, at) and leaves at `end` (at, to).
#[derive(Debug, Clone, Copy)]
struct Fragment {
    start: (u32, u32),
    end: (u32, u32),
    steps: usize,
    /// Index of its stored steps; `None` if the fragment alone exceeds the longest loop.
    kept: Option<usize>,
}

persist!(Fragment {
    start,
    end,
    steps,
    kept
});

/// The loops of a block and the outcome for them.
struct Found {
    fragments: Vec<Fragment>,
    stats: RepairStats,
    edges: u64,
    rim: RimCounts,
}

persist!(Found {
    fragments,
    stats,
    edges,
    rim
});

/// Fills holes as `mending` prescribes, or none. Returns the triangles that fill them and the boundary that
/// is left.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn fill(
    places: Places<'_>,
    surface: &Surface,
    rules: Option<LoopRules<'_>>,
    blocks: Blocks,
    stats: &mut RepairStats,
    workspace: &Workspace,
) -> Result<(Table<FilledTriangle>, NumberingInput)> {
    let count = blocks.count();
    let shuffle = Shuffle::between_units(workspace, "repair.filled", SHUFFLE_BUFFER, count)?;
    let kept = Table::create(workspace, "repair.fragments", 0)?;
    let files = RimFiles::create(workspace, count)?;
    let bytes =
        |b: usize| 150 * surface.records(b) as u64 + blocks.ids(b).len() as u64 * 40 + (1 << 20);
    let work = |block| {
        let rim = BlockRim::load(places, surface, blocks, block)?;
        let mut settled = Settled::default();
        let fragments = match rules {
            Some(rules) => fill_inside(&rim, rules, &kept, &mut settled)?,
            None => Vec::new(),
        };
        shuffle.send_from(block, &addressed(&settled.triangles, blocks))?;
        let found = Found {
            fragments,
            stats: settled.stats,
            edges: settled.edges,
            rim: files.put(block, &rim)?,
        };
        workspace.advance(1);
        Ok(found)
    };
    let mut rims = vec![RimCounts::default(); count];
    let mut fragments = Vec::new();
    let mut settled = Settled::default();
    workspace.units("repair: block", count, bytes, work, |block, found| {
        fragments.extend(found.fragments);
        settled.stats.add(&found.stats);
        settled.edges += found.edges;
        rims[block] = found.rim;
        Ok(())
    })?;
    let mut numbering = files.numbering_input(&rims, blocks, workspace)?;
    // Sorted, since blocks finish in any order.
    fragments.sort_unstable_by_key(|fragment: &Fragment| fragment.start);
    let _fragments = workspace.reserve("fragments", fragments.len() as u64 * 120)?;
    let parts = Fragments {
        places,
        rules,
        fragments: &fragments,
        kept: &kept,
    };
    let step = workspace.step("rings")?;
    let known: FxHashMap<u64, (RepairStats, u64)> = step.finished(workspace)?.into_iter().collect();
    let rings = link_up(&fragments);
    for (number, batch) in (0u64..).zip(rings.chunks(RINGS)) {
        workspace.check_cancel()?;
        let (stats, edges) = match known.get(&number) {
            Some(done) => *done,
            None => {
                let done = parts.fill(batch, workspace)?;
                let value = (done.stats, done.edges);
                let sent = addressed(&done.triangles, blocks);
                let sender = count + number as usize;
                step.finish(number, &value, || shuffle.send_from(sender, &sent))?;
                value
            }
        };
        settled.stats.add(&stats);
        settled.edges += edges;
    }
    stats.add(&settled.stats);
    numbering.boundary_edges -= settled.edges;
    Ok((shuffle.deliver(workspace, blocks.count())?, numbering))
}

/// Fills the loops that lie inside a block, and stores the fragments of the others.
fn fill_inside(
    rim: &BlockRim,
    rules: LoopRules<'_>,
    kept: &Table<FragmentRow>,
    settled: &mut Settled,
) -> Result<Vec<Fragment>> {
    let (loops, open) = rim.trace();
    for ring in loops {
        if ring.len() > rules.longest_loop() {
            settled.too_long();
            continue;
        }
        let corners = ring.iter().map(|s| rim.corner(s)).collect();
        let filling = rules.close(corners, |a, b| rim.has_edge(a, b));
        settled.settle(filling, ring.len());
    }
    let mut fragments = Vec::with_capacity(open.len());
    for part in open {
        let (first, last) = (part[0], part[part.len() - 1]);
        let rows = (part.len() <= rules.longest_loop()).then(|| rim.rows(&part));
        fragments.push(Fragment {
            start: (first.from, first.at),
            end: (last.at, last.to),
            steps: part.len(),
            kept: rows.map(|rows| kept.append(&rows)).transpose()?,
        });
    }
    Ok(fragments)
}

/// The outcome for several loops.
#[derive(Default)]
struct Settled {
    stats: RepairStats,
    /// Number of edges of the holes that were filled.
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
            Filling::Clipped(new, left) => {
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
}

fn addressed(triangles: &[[u32; 3]], blocks: Blocks) -> Vec<FilledTriangle> {
    let mut sent = Vec::with_capacity(triangles.len());
    for &triangle in triangles {
        let to = |to| FilledTriangle { to, triangle };
        sent.push(to(blocks.of(triangle[0])));
        sent.extend(blocks.visited(sorted(triangle)).map(to));
    }
    sent
}

/// Chains fragments into loops; every fragment belongs to one.
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

/// Loops across blocks that are processed at a time.
const RINGS: usize = 256;

/// Fragments of loops across blocks, and the rules for filling them.
struct Fragments<'a> {
    places: Places<'a>,
    rules: Option<LoopRules<'a>>,
    fragments: &'a [Fragment],
    kept: &'a Table<FragmentRow>,
}

impl Fragments<'_> {
    /// Fills the loops `rings`, each a list of fragments.
    fn fill(&self, rings: &[Vec<usize>], workspace: &Workspace) -> Result<Settled> {
        let mut settled = Settled::default();
        for ring in rings {
            workspace.check_cancel()?;
            let edges: usize = ring.iter().map(|&f| self.fragments[f].steps).sum();
            let Some(rules) = self.rules.filter(|m| edges <= m.longest_loop()) else {
                settled.too_long();
                continue;
            };
            let filling = fill_across(self.places, ring, self.fragments, self.kept, rules)?;
            settled.settle(filling, edges);
        }
        Ok(settled)
    }
}

fn fill_across(
    places: Places<'_>,
    ring: &[usize],
    fragments: &[Fragment],
    kept: &Table<FragmentRow>,
    rules: LoopRules<'_>,
) -> Result<Filling> {
    let mut parts: Vec<(u32, u32, bool)> = Vec::new();
    let mut edges: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for &f in ring {
        let Some(section) = fragments[f].kept else {
            return Ok(Filling::Impossible);
        };
        for step in kept.get(section)?.chunk_by(|a, b| a.id == b.id) {
            let FragmentRow {
                id, apex, pinched, ..
            } = step[0];
            edges.insert(id, step.iter().map(|row| row.neighbor).collect());
            parts.push((id, apex, pinched == 1));
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
    Ok(rules.close(corners, |a, b| {
        edges.get(&a).is_some_and(|around| around.contains(&b))
    }))
}
