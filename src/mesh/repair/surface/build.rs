//! The pass that builds the surface, block by block.

use super::super::around::Around;
use super::super::components::{Parts, join};
use super::super::facing::{Fate, Sums, SumsRow, judge};
use super::super::patch::Patch;
use super::super::rows::{LabelRun, RimBits, SeenTriangle};
use super::super::{RepairOptions, RepairStats, SurfaceTriangle, bridges};
use super::{Labels, StoredSurface, label_bytes};
use crate::stitch::Stitched;
use crate::surface::parity::constraint;
use crate::surface::rows::TriangleTo;
use crate::surface::star::Triangle;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Shuffle, Table};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Block, GlobalLabel, TriangleIndex};
use outcrop_stages::located::Places;
use outcrop_stages::outside::Known;

/// The tables to which the blocks write.
struct Build<'a> {
    places: Places<'a>,
    blocks: Blocks,
    options: RepairOptions,
    triangles: Table<SurfaceTriangle>,
    runs: Table<LabelRun>,
    rims: Table<RimBits>,
    /// Sums over the interior triangles of each block's global labels.
    sums: Table<SumsRow>,
    bridges: Shuffle<TriangleTo>,
    seen: Shuffle<SeenTriangle>,
}

/// Builds the surface.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn build(
    places: Places<'_>,
    stitched: &Stitched,
    blocks: Blocks,
    options: RepairOptions,
    workspace: &Workspace,
) -> Result<(StoredSurface, RepairStats)> {
    let count = blocks.count();
    let build = Build {
        places,
        blocks,
        options,
        triangles: Table::new("repair.surface", count),
        runs: Table::new("repair.runs", count),
        rims: Table::new("repair.rims", count),
        sums: Table::new("repair.sums", count),
        bridges: Shuffle::new("repair.bridges"),
        seen: Shuffle::new("repair.seen"),
    };
    let (labels, stats) = workspace.once("surface", |unit| build.surface(unit, stitched))?;
    // The step that reads them is finished.
    build.sums.release(workspace)?;
    build.seen.release(workspace)?;
    let surface = StoredSurface {
        triangles: build.triangles,
        runs: build.runs,
        rims: build.rims,
        bridges: build.bridges,
        labels,
    };
    Ok((surface, stats))
}

impl Build<'_> {
    /// Processes all blocks, and merges their labels.
    fn surface(&self, unit: &Unit<'_>, stitched: &Stitched) -> Result<(Labels, RepairStats)> {
        let count = self.blocks.count();
        let mut stats = RepairStats::default();
        let (globals, labels) = self.all_blocks(unit, stitched, &mut stats)?;
        stitched.release(unit)?;
        let bridges = self.bridges.open(unit, count)?.unique();
        for block in 0..count {
            let own = |b: &&TriangleTo| self.blocks.of(b.triangle[0]) == b.to;
            stats.bridges_removed += bridges.get(unit, block)?.iter().filter(own).count() as u64;
        }
        let seen = self.seen.open(unit, count)?;
        let _held = unit.reserve("labels", label_bytes(labels as usize, count))?;
        let sets = join(unit, &seen, &globals, labels)?;
        let parts = Parts {
            blocks: self.blocks,
            places: self.places,
            seen: &seen,
            sums: &self.sums,
            bridges: &bridges,
            globals: &globals,
            sets: &sets,
        };
        let (components, fates) = parts.judge(unit, self.options, &mut stats)?;
        let labels = Labels {
            globals,
            components,
            fates,
        };
        Ok((labels, stats))
    }

    /// Processes all blocks; returns the numbers of their global labels as in [`Labels`], and how many there
    /// are.
    fn all_blocks(
        &self,
        workspace: &Workspace,
        stitched: &Stitched,
        stats: &mut RepairStats,
    ) -> Result<(Vec<(GlobalLabel, u32)>, u32)> {
        let count = self.blocks.count();
        let around = Around::open(stitched, self.blocks, workspace)?;
        let bytes = |b: usize| {
            let (records, ids) = (around.records(workspace, b), self.blocks.ids(b).len());
            let known = self.places.outside.map_or(0, |o| o.bytes(ids));
            230 * records as u64 + ids as u64 * 30 + known + (1 << 20)
        };
        let work = |unit: &Unit<'_>| {
            let done = self.block(unit, &around);
            done.inspect(|_| unit.advance(1))
        };
        let mut globals = vec![(GlobalLabel::default(), 0); count];
        workspace.units("repair: block", count, bytes, work, |block, (own, more)| {
            globals[block].1 = own;
            stats.add(&more);
            Ok(())
        })?;
        let mut next = 0;
        for (first, own) in &mut globals {
            *first = GlobalLabel::new(next);
            next += *own;
        }
        Ok((globals, next))
    }

    /// Processes a block; returns the number of its global labels, and counts.
    fn block(&self, unit: &Unit<'_>, around: &Around<'_>) -> Result<(u32, RepairStats)> {
        let block = unit.number();
        let ids = self.blocks.ids(block);
        let triangles = around.load(unit, block)?;
        let shape = self.places.shape.slice(ids.indices())?;
        let lists = bytes_of(&triangles) + bytes_of(&shape);
        let mut held = unit.hold(lists + Patch::estimate(triangles.len(), ids.len()));
        let mut stats = RepairStats::default();
        let patch = Patch::of(ids, &triangles);
        held.set(lists + patch.bytes());
        let bridges = if self.options.repair {
            bridges::find(ids, &triangles, &patch)
        } else {
            Vec::new()
        };
        let mut rims = vec![RimBits::default(); ids.len().div_ceil(32)];
        for (v, _) in patch.rims.iter().enumerate().filter(|(_, n)| **n > 0) {
            rims[v / 32].bits |= 1 << (v % 32);
        }
        self.rims.put(unit, block, &rims)?;
        let known = self.places.outside;
        let known = known
            .map(|o| o.open(unit, self.blocks, block))
            .transpose()?;
        let of_known = unit.hold(known.as_ref().map_or(0, Known::bytes));
        let sums = self.sum(block, &shape, known.as_ref(), &triangles, &patch, &bridges);
        drop((known, of_known));
        let (global, local) = sums.split_at(patch.global as usize);
        let global: Vec<SumsRow> = global.iter().map(Sums::row).collect();
        let more = unit.hold(bytes_of(&sums) + bytes_of(&global));
        self.sums.put(unit, block, &global)?;
        let least = self.options.least();
        let fates: Vec<Fate> = local.iter().map(|s| judge(s, least, &mut stats)).collect();
        drop((sums, global, more));
        let interior = |n: &&TriangleIndex| !self.blocks.crossing(triangles[n.index()]);
        stats.bridges_removed = bridges.iter().filter(interior).count() as u64;
        self.send(unit, &triangles, &patch, &bridges)?;
        self.write(unit, triangles, &patch, &bridges, &fates)?;
        Ok((patch.global, stats))
    }

    /// Sums over the interior triangles by label.
    fn sum(
        &self,
        block: usize,
        points: &[Point],
        known: Option<&Known<'_>>,
        triangles: &[Triangle],
        patch: &Patch,
        bridges: &[TriangleIndex],
    ) -> Vec<Sums> {
        let ids = self.blocks.ids(block);
        let mut sums = vec![Sums::default(); patch.labels as usize];
        let mut bridges = bridges.iter().peekable();
        for (number, t) in triangles.iter().enumerate() {
            let (label, flip) = constraint(patch.words[number]);
            let sum = &mut sums[label.index()];
            if patch.open[number] {
                sum.open();
            }
            if bridges.next_if(|n| n.index() == number).is_some() {
                continue;
            }
            if ids.contains(&t[0]) && ids.contains(&t[2]) {
                let corners = t.map(|v| points[ids.place(v)]);
                let toward = known.and_then(|known| known.toward(t[0], corners[0]));
                sum.add(*t, corners, flip, toward);
                if self.places.is_noisy(t[0]) {
                    sum.note_noise();
                }
            }
        }
        sums
    }

    /// Sends crossing triangles to the other blocks that see them: their labels here, and the bridges among
    /// them.
    fn send(
        &self,
        unit: &Unit<'_>,
        triangles: &[Triangle],
        patch: &Patch,
        bridges: &[TriangleIndex],
    ) -> Result<()> {
        let block = unit.number();
        let ids = self.blocks.ids(block);
        let mut seen = Vec::new();
        let mut found = Vec::new();
        for (number, &t) in triangles.iter().enumerate() {
            if ids.contains(&t[0]) && ids.contains(&t[2]) {
                continue;
            }
            let owner = self.blocks.of(t[0]);
            seen.push(SeenTriangle {
                to: owner,
                triangle: t,
                block: Block::at(block),
                label_flip: patch.words[number],
            });
            if bridges.binary_search(&TriangleIndex::at(number)).is_ok() {
                let to = |to| TriangleTo { to, triangle: t };
                found.push(to(owner));
                found.extend(self.blocks.visited(t).map(to));
            }
        }
        self.seen.send(unit, block, seen)?;
        self.bridges.send(unit, block, found)
    }

    /// Writes the remaining triangles, oriented.
    fn write(
        &self,
        unit: &Unit<'_>,
        mut triangles: Vec<Triangle>,
        patch: &Patch,
        bridges: &[TriangleIndex],
        fates: &[Fate],
    ) -> Result<()> {
        let mut runs: Vec<LabelRun> = Vec::new();
        let mut bridges = bridges.iter().peekable();
        let mut kept = 0;
        for number in 0..triangles.len() {
            if bridges.next_if(|n| n.index() == number).is_some() {
                continue;
            }
            let t = triangles[number];
            let (label, flip) = constraint(patch.words[number]);
            let fate = match label.get().checked_sub(patch.global) {
                Some(local) => fates[local as usize],
                None => Fate::UNKNOWN,
            };
            if !fate.keep {
                continue;
            }
            let turn = flip ^ fate.turn;
            triangles[kept] = if turn { [t[0], t[2], t[1]] } else { t };
            kept += 1;
            match runs.last_mut() {
                Some(run) if run.label == label => run.count += 1,
                _ => runs.push(LabelRun { count: 1, label }),
            }
        }
        let rows = bytemuck::cast_slice(&triangles[..kept]);
        self.triangles.put(unit, unit.number(), rows)?;
        self.runs.put(unit, unit.number(), &runs)
    }
}
