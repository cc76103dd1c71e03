//! Finds boundary loops and has them filled: loops inside a block immediately, loops across blocks later,
//! from the fragments that the blocks write.

use super::boundary::LoopRules;
use super::fill::{Corner, Filling};
use super::loops::Step;
use super::rim::{BlockRim, FragmentRow, NumberingInput, RimCounts};
use super::surface::StoredSurface;
use super::{FilledTriangle, RepairStats, ascending, from_smallest};
use crate::surface::star::sorted;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Shuffle, Table};
use outcrop_disk::workspace::place::Place;
use outcrop_disk::workspace::{Unit, Workspace, lock};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Id, Triangle};
use outcrop_stages::located::Places;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

/// Part of a loop inside one block: it enters at `start` (from, at) and leaves at `end` (at, to).
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Fragment {
    start: (Id, Id),
    end: (Id, Id),
    steps: usize,
    /// Its stored steps; `None` if the fragment alone exceeds the longest loop.
    kept: Option<Place>,
}

/// The loops of a block and the outcome for them.
#[derive(Serialize, Deserialize)]
struct Found {
    fragments: Vec<Fragment>,
    stats: RepairStats,
    edges: u64,
    rim: RimCounts,
}

/// Fills holes by the `rules`, or none. Returns the triangles that fill them and the boundary that
/// is left.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn fill(
    places: Places<'_>,
    surface: &StoredSurface,
    rules: Option<LoopRules<'_>>,
    blocks: Blocks,
    stats: &mut RepairStats,
    workspace: &Workspace,
) -> Result<(Shuffle<FilledTriangle>, NumberingInput)> {
    let count = blocks.count();
    let surface = surface.open(workspace)?;
    let shuffle = Shuffle::new("repair.filled");
    let kept = Table::new("repair.fragments", count);
    let mut numbering = NumberingInput::new(blocks);
    let bytes = |b: usize| {
        let records = surface.records(workspace, b);
        150 * records as u64 + blocks.ids(b).len() as u64 * 40 + (1 << 20)
    };
    let work = |unit: &Unit<'_>| {
        let rim = BlockRim::load(unit, places, &surface, blocks)?;
        let _held = unit.hold(rim.bytes());
        let mut settled = Settled::default();
        let fragments = match rules {
            Some(rules) => fill_inside(unit, &rim, rules, &kept, &mut settled)?,
            None => Vec::new(),
        };
        let sent = addressed(&settled.triangles, blocks);
        shuffle.send(unit, unit.number(), sent)?;
        let found = Found {
            fragments,
            stats: settled.stats,
            edges: settled.edges,
            rim: numbering.put(unit, &rim)?,
        };
        unit.advance(1);
        Ok(found)
    };
    let (mut faces, mut steps) = (vec![0; count], 0);
    let mut fragments = Vec::new();
    let mut settled = Settled::default();
    workspace.units("repair: block", count, bytes, work, |block, found| {
        fragments.extend(found.fragments);
        settled.stats.add(&found.stats);
        settled.edges += found.edges;
        faces[block] = found.rim.faces;
        steps += found.rim.steps;
        Ok(())
    })?;
    (numbering.faces, numbering.boundary_edges) = (faces, steps);
    // Sorted, since blocks finish in any order.
    fragments.sort_unstable_by_key(|fragment: &Fragment| fragment.start);
    let _fragments = workspace.reserve("fragments", fragments.len() as u64 * 144)?;
    let parts = Fragments {
        places,
        rules,
        fragments: &fragments,
        kept: &kept,
    };
    let step = workspace.step("rings")?;
    let known: FxHashMap<u64, (RepairStats, u64)> = step.finished()?.into_iter().collect();
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
                step.finish(number, &value, |unit| shuffle.send(unit, sender, sent))?;
                value
            }
        };
        settled.stats.add(&stats);
        settled.edges += edges;
    }
    stats.add(&settled.stats);
    numbering.boundary_edges -= settled.edges;
    kept.release(workspace)?;
    Ok((shuffle, numbering))
}

/// Fills the loops that lie inside a block, and stores the fragments of the others.
fn fill_inside(
    unit: &Unit<'_>,
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
    let is_kept = |part: &&Vec<Step>| part.len() <= rules.longest_loop();
    let short = open.iter().filter(is_kept);
    let rows: Vec<_> = short.map(|part| rim.rows(part)).collect();
    let mut stored = kept.put_parts(unit, unit.number(), &rows)?.into_iter();
    let fragment = |part: &Vec<Step>| {
        let (first, last) = (part[0], part[part.len() - 1]);
        Fragment {
            start: (first.from, first.at),
            end: (last.at, last.to),
            steps: part.len(),
            kept: if is_kept(&part) { stored.next() } else { None },
        }
    };
    Ok(open.iter().map(fragment).collect())
}

/// The outcome for several loops.
#[derive(Default)]
struct Settled {
    stats: RepairStats,
    /// Number of edges of the holes that were filled.
    edges: u64,
    triangles: Vec<Triangle>,
}

impl Settled {
    fn settle(&mut self, filling: Filling, edges: usize) {
        let is_gap = matches!(filling, Filling::Gap(_));
        let stats = &mut self.stats;
        let (count, new, left) = match filling {
            Filling::Gap(gap) => (&mut stats.gaps_closed, vec![gap], 0),
            Filling::Filled(new) => (&mut stats.holes_filled, new, 0),
            Filling::Clipped(new, left) => (&mut stats.holes_clipped, new, left),
            Filling::Outline => (&mut stats.holes_outline, Vec::new(), edges),
            Filling::Impossible => (&mut stats.holes_not_filled, Vec::new(), edges),
        };
        *count += 1;
        if !is_gap {
            stats.holes_found += 1;
            stats.hole_triangles += new.len() as u64;
        }
        self.edges += (edges - left) as u64;
        self.triangles.extend(new.into_iter().map(from_smallest));
    }

    fn too_long(&mut self) {
        self.stats.holes_found += 1;
        self.stats.holes_too_long += 1;
    }
}

fn addressed(triangles: &[Triangle], blocks: Blocks) -> Vec<FilledTriangle> {
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
    let starts = fragments.iter().map(|f| f.start);
    let by_start: FxHashMap<(Id, Id), usize> = starts.zip(0..).collect();
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

/// Bytes for each edge of a loop across blocks while it is filled: its rows and corners, and lists.
const EDGE_BYTES: u64 = 400;

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
        let edges = |ring: &Vec<usize>| ring.iter().map(|&f| self.fragments[f].steps).sum();
        let longest = self.rules.map_or(0, |rules| rules.longest_loop());
        let fillings = Mutex::new(vec![None; rings.len()]);
        let bytes = |number: usize| {
            let edges: usize = edges(&rings[number]);
            edges.min(longest) as u64 * EDGE_BYTES
        };
        workspace.for_each_unit("repair: loops", rings.len(), bytes, |unit| {
            let ring = &rings[unit.number()];
            if let Some(rules) = self.rules
                && edges(ring) <= longest
            {
                let filling = self.fill_across(unit, ring, rules)?;
                lock(&fillings)[unit.number()] = Some(filling);
            }
            Ok(())
        })?;
        let mut settled = Settled::default();
        for (ring, filling) in rings.iter().zip(lock(&fillings).drain(..)) {
            match filling {
                Some(filling) => settled.settle(filling, edges(ring)),
                None => settled.too_long(),
            }
        }
        Ok(settled)
    }

    /// Fills the loop of fragments `ring`.
    fn fill_across(
        &self,
        unit: &Unit<'_>,
        ring: &[usize],
        rules: LoopRules<'_>,
    ) -> Result<Filling> {
        let places = self.places;
        let mut rows = Vec::new();
        let mut parts: Vec<(Id, Id, bool)> = Vec::new();
        let mut edges: FxHashMap<Id, Vec<Id>> = FxHashMap::default();
        for &f in ring {
            let Some(place) = self.fragments[f].kept else {
                return Ok(Filling::Impossible);
            };
            self.kept.read(unit, place, &mut rows)?;
            for step in rows.chunk_by(|a, b| a.id == b.id) {
                let first = step[0];
                edges.insert(first.id, step.iter().map(|row| row.neighbor).collect());
                parts.push((first.id, first.apex, first.pinched == 1));
            }
        }
        let ids = ascending(parts.iter().flat_map(|&(id, apex, _)| [id, apex]));
        let mut points = Vec::with_capacity(ids.len());
        places.shape.fetch(&ids, &mut points)?;
        let mut in_file = Vec::new();
        if places.differ() {
            places.file.fetch(&ids, &mut in_file)?;
        }
        let rank = |v: Id| ids.partition_point(|x| *x < v);
        let at = |v: Id| points[rank(v)];
        let corner = |&(id, apex, pinched): &(Id, Id, bool)| Corner {
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
}
