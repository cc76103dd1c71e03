//! Finds boundary loops and has them filled: those inside a block at once, those across blocks
//! from the fragments that the blocks leave.

use super::fill::{Corner, Filling, fill as fill_loop};
use super::loops::{Step, neighbors, steps};
use super::{EXCHANGE_BUFFER, RepairStats, from_smallest};
use crate::error::Result;
use crate::geom::Point;
use crate::spill::{Exchange, Sections};
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::surface::star::{Star, sorted};
use crate::workspace::Workspace;
use rustc_hash::FxHashMap;
use std::sync::Mutex;

/// A part of a loop inside one block: it enters at `start` (from, at) and leaves at `end` (at, to).
#[derive(Debug, Clone, Copy)]
struct Fragment {
    start: (u32, u32),
    end: (u32, u32),
    steps: usize,
    /// Where its steps are kept; `None` if it is too long by itself.
    kept: Option<usize>,
}

#[derive(Default)]
struct Found {
    fragments: Vec<Fragment>,
    stats: RepairStats,
}

/// Fills holes of up to `limit` edges; `[block, i, a, b]` for each block that a triangle touches.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn fill(
    store: &PointStore,
    around: &Sections<4>,
    limit: usize,
    blocks: Blocks,
    stats: &mut RepairStats,
    workspace: &Workspace,
) -> Result<Sections<4>> {
    let _held = workspace.reserve("exchange", EXCHANGE_BUFFER)?;
    let exchange = Exchange::<4>::new(workspace, "repair.filled", EXCHANGE_BUFFER);
    let kept = Sections::<1>::create(workspace, "repair.fragments", 0)?;
    let found = Mutex::new(Found::default());
    let bytes =
        |b: usize| 150 * around.records(b) as u64 + blocks.ids(b).len() as u64 * 40 + (1 << 20);
    workspace.for_each_unit("repair: block", blocks.count(), bytes, |block| {
        let work = BlockHoles::load(store, around, blocks, block)?;
        let (loops, open) = work.trace();
        let mut local = RepairStats::default();
        let mut triangles = Vec::new();
        for ring in loops {
            local.holes_found += 1;
            if ring.len() > limit {
                local.holes_too_long += 1;
                continue;
            }
            let corners = ring.iter().map(|s| work.corner(s)).collect();
            let filling = fill_loop(corners, |a, b| work.has_edge(a, b));
            settle(filling, &mut local, &mut triangles);
        }
        let mut fragments = Vec::with_capacity(open.len());
        for part in open {
            let (first, last) = (part[0], part[part.len() - 1]);
            let words = (part.len() <= limit).then(|| work.words(&part));
            let kept = words.map(|w| kept.append(&w)).transpose()?;
            let (start, end) = ((first.from, first.at), (last.at, last.to));
            fragments.push(Fragment {
                start,
                end,
                steps: part.len(),
                kept,
            });
        }
        exchange.send(&addressed(&triangles, blocks))?;
        let mut found = found
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        found.fragments.extend(fragments);
        add(&mut found.stats, &local);
        drop(found);
        workspace.observer.advance(1);
        Ok(())
    })?;
    let mut found = found
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let _fragments = workspace.reserve("fragments", found.fragments.len() as u64 * 120)?;
    let mut triangles = Vec::new();
    let local = &mut found.stats;
    for ring in link_up(&found.fragments) {
        workspace.check_cancel()?;
        local.holes_found += 1;
        let edges: usize = ring.iter().map(|&f| found.fragments[f].steps).sum();
        if edges > limit {
            local.holes_too_long += 1;
            continue;
        }
        let filling = fill_across(store, &ring, &found.fragments, &kept)?;
        settle(filling, local, &mut triangles);
        exchange.send(&addressed(&triangles, blocks))?;
        triangles.clear();
    }
    add(stats, local);
    exchange.deliver(workspace, blocks.count())
}

fn add(total: &mut RepairStats, more: &RepairStats) {
    total.holes_found += more.holes_found;
    total.holes_filled += more.holes_filled;
    total.holes_outline += more.holes_outline;
    total.holes_too_long += more.holes_too_long;
    total.holes_not_filled += more.holes_not_filled;
    total.hole_triangles += more.hole_triangles;
}

fn settle(filling: Filling, stats: &mut RepairStats, triangles: &mut Vec<[u32; 3]>) {
    match filling {
        Filling::Filled(new) => {
            stats.holes_filled += 1;
            stats.hole_triangles += new.len() as u64;
            triangles.extend(new.into_iter().map(from_smallest));
        }
        Filling::Outline => stats.holes_outline += 1,
        Filling::Impossible => stats.holes_not_filled += 1,
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

/// A block's boundary.
struct BlockHoles {
    ids: std::ops::Range<u32>,
    triangles: Vec<[u32; 4]>,
    star: Star,
    own: Vec<Point>,
    foreign: FxHashMap<u32, Point>,
    steps: Vec<Step>,
}

impl BlockHoles {
    fn load(
        store: &PointStore,
        around: &Sections<4>,
        blocks: Blocks,
        block: usize,
    ) -> Result<Self> {
        let ids = blocks.ids(block);
        let triangles = around.get(block)?;
        let plain: Vec<[u32; 3]> = triangles.iter().map(|t| [t[0], t[1], t[2]]).collect();
        let star = Star::of(ids.clone(), &plain);
        let own = store.slice(ids.start as usize..ids.end as usize)?;
        let mut far: Vec<u32> = plain
            .into_iter()
            .flatten()
            .filter(|v| !ids.contains(v))
            .collect();
        far.sort_unstable();
        far.dedup();
        let mut points = Vec::with_capacity(far.len());
        store.fetch(&far, &mut points)?;
        let foreign = far.into_iter().zip(points).collect();
        let mut work = Self {
            ids,
            triangles,
            star,
            own,
            foreign,
            steps: Vec::new(),
        };
        work.steps = steps(&work.star, &work.triangles, |v| work.position(v));
        Ok(work)
    }

    fn position(&self, v: u32) -> Point {
        if self.ids.contains(&v) {
            self.own[(v - self.ids.start) as usize]
        } else {
            self.foreign[&v]
        }
    }

    fn corner(&self, step: &Step) -> Corner {
        Corner {
            id: step.at,
            at: self.position(step.at),
            apex: self.position(step.apex),
            pinched: step.pinched,
        }
    }

    fn has_edge(&self, a: u32, b: u32) -> bool {
        self.star
            .at(a)
            .iter()
            .any(|&n| self.triangles[n as usize][..3].contains(&b))
    }

    /// Loops that stay in the block, and parts of loops that leave it.
    fn trace(&self) -> (Vec<Vec<Step>>, Vec<Vec<Step>>) {
        let mut seen = vec![false; self.steps.len()];
        let next = |step: &Step| {
            let key = (step.at, step.to);
            let at = self.steps.partition_point(|s| (s.from, s.at) < key);
            (at < self.steps.len() && (self.steps[at].from, self.steps[at].at) == key).then_some(at)
        };
        let mut follow = |start: usize| {
            let mut part = Vec::new();
            let mut at = Some(start);
            while let Some(index) = at.filter(|i| !seen[*i]) {
                seen[index] = true;
                part.push(self.steps[index]);
                at = next(&self.steps[index]);
            }
            part
        };
        let enters = |s: &Step| !self.ids.contains(&s.from);
        let open = (0..self.steps.len())
            .filter(|&i| enters(&self.steps[i]))
            .map(&mut follow)
            .collect();
        let loops = (0..self.steps.len())
            .map(&mut follow)
            .filter(|part: &Vec<Step>| !part.is_empty());
        (loops.collect(), open)
    }

    /// Steps as words: for each vertex its id, apex, whether it is pinched, number of neighbours,
    /// neighbours.
    fn words(&self, part: &[Step]) -> Vec<[u32; 1]> {
        let mut words = Vec::new();
        for step in part {
            let around = neighbors(&self.star, &self.triangles, step.at);
            words.extend(
                [
                    step.at,
                    step.apex,
                    u32::from(step.pinched),
                    around.len() as u32,
                ]
                .map(|w| [w]),
            );
            words.extend(around.into_iter().map(|v| [v]));
        }
        words
    }
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
    store: &PointStore,
    ring: &[usize],
    fragments: &[Fragment],
    kept: &Sections<1>,
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
    store.fetch(&ids, &mut points)?;
    let at = |v: u32| points[ids.partition_point(|x| *x < v)];
    let corner = |&(id, apex, pinched): &(u32, u32, bool)| Corner {
        id,
        at: at(id),
        apex: at(apex),
        pinched,
    };
    let corners = parts.iter().map(corner).collect();
    Ok(fill_loop(corners, |a, b| {
        edges.get(&a).is_some_and(|around| around.contains(&b))
    }))
}
