//! The surface by block: bridges are found, triangles oriented, components kept or removed.
//!
//! One pass reads all triangles. Each block on its own divides the triangles that touch it into labels,
//! orients the components that lie entirely in the block, and removes small ones. The labels of components
//! that extend further are merged through the triangles that several blocks see.

use super::components::{Parts, join};
use super::facing::{Fate, Sums, SumsRow, judge};
use super::patch::Patch;
use super::rows::{LabelRun, RimBits, SeenTriangle};
use super::{
    OrientedTriangle, RepairOptions, RepairStats, SHUFFLE_BUFFER, SurfaceTriangle, around, bridges,
    flips,
};
use crate::error::Result;
use crate::geom::Point;
use crate::spill::{Shuffle, Table};
use crate::stages::blocks::Blocks;
use crate::stages::located::Places;
use crate::stages::stitch::Stitched;
use crate::stages::surface::parity::constraint;
use crate::stages::surface::rows::TriangleTo;
use crate::stages::surface::star::Triangle;
use crate::workspace::Workspace;
use crate::workspace::memory::{Reservation, bytes_of, hold};
use crate::workspace::persist::{Persist, Saved};

/// The oriented surface, without small components and bridges.
#[derive(Debug)]
pub struct Surface {
    /// Triangles that touch each block, ascending, oriented relative to their label.
    triangles: Table<SurfaceTriangle>,
    /// The labels of these triangles; global labels come first.
    runs: Table<LabelRun>,
    /// The vertices of each block that have a boundary edge.
    rims: Table<RimBits>,
    /// Bridges at crossing triangles, once for each block that they touch.
    bridges: Table<TriangleTo>,
    /// For each block, the number of its first global label, and how many global labels it has.
    globals: Vec<(u32, u32)>,
    /// For each global label its component, and the decision about it.
    components: Vec<u32>,
    fates: Vec<Fate>,
    _held: Reservation,
}

/// A run of consecutive triangles of one component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ComponentRun {
    /// Number of triangles.
    pub count: usize,
    /// The component; the number is only meaningful within a block.
    pub component: u32,
}

impl Surface {
    /// An upper bound on the number of triangles that touch a block.
    #[must_use]
    pub fn records(&self, block: usize) -> usize {
        self.triangles.rows(block)
    }

    /// All triangles that touch a block, oriented, ascending by sorted ids; and their components.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn load(&self, block: usize) -> Result<(Vec<OrientedTriangle>, Vec<ComponentRun>)> {
        let mut triangles: Vec<OrientedTriangle> = bytemuck::cast_vec(self.triangles.get(block)?);
        let bridges = self.bridges.get(block)?;
        let is_bridge = |[i, a, b]: OrientedTriangle| {
            let key = TriangleTo {
                to: block as u32,
                triangle: [i, a.min(b), a.max(b)],
            };
            !bridges.is_empty() && bridges.binary_search(&key).is_ok()
        };
        let (first, globals) = self.globals[block];
        let runs = self.runs.get(block)?;
        let mut kept = Vec::with_capacity(runs.len());
        let (mut from, mut to) = (0, 0);
        for LabelRun { count, label } in runs {
            let all = from..from + count as usize;
            from = all.end;
            let run = |component, before, after| ComponentRun {
                count: after - before,
                component,
            };
            let before = to;
            if label >= globals {
                triangles.copy_within(all, to);
                to += count as usize;
                kept.push(run(label << 1, before, to));
                continue;
            }
            let label = (first + label) as usize;
            let Fate { keep, turn } = self.fates[label];
            if !keep {
                continue;
            }
            for n in all {
                let t = triangles[n];
                if !is_bridge(t) {
                    triangles[to] = if turn { [t[0], t[2], t[1]] } else { t };
                    to += 1;
                }
            }
            if to > before {
                kept.push(run(self.components[label] << 1 | 1, before, to));
            }
        }
        triangles.truncate(to);
        Ok((triangles, kept))
    }

    /// The vertices of a block that have a boundary edge.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn rims(&self, block: usize) -> Result<Vec<RimBits>> {
        self.rims.get(block)
    }
}

/// The tables to which the blocks write, and the totals.
struct Build<'a> {
    places: Places<'a>,
    stitched: &'a Stitched,
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
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn build(
    places: Places<'_>,
    stitched: Stitched,
    blocks: Blocks,
    options: RepairOptions,
    workspace: &Workspace,
) -> Result<(Surface, RepairStats)> {
    let build = Build::create(places, &stitched, blocks, options, workspace)?;
    let bytes = |b: usize| {
        let records = stitched.interior.rows(b) + stitched.added.rows(b);
        230 * records as u64 + blocks.ids(b).len() as u64 * 30 + (1 << 20)
    };
    let work = |block| {
        let done = build.block(block);
        done.inspect(|_| workspace.advance(1))
    };
    let mut stats = RepairStats::default();
    let mut own_globals = vec![0u32; blocks.count()];
    let name = "repair: block";
    workspace.units(name, blocks.count(), bytes, work, |block, (own, more)| {
        own_globals[block] = own;
        stats.add(&more);
        Ok(())
    })?;
    let bridges = build.bridges.deliver_unique(workspace, blocks.count())?;
    for block in 0..blocks.count() {
        let own = |b: &&TriangleTo| blocks.of(b.triangle[0]) == b.to;
        stats.bridges_removed += bridges.get(block)?.iter().filter(own).count() as u64;
    }
    let seen = build.seen.deliver(workspace, blocks.count())?;
    let (triangles, runs, rims, sums) = (build.triangles, build.runs, build.rims, build.sums);
    drop(stitched);
    let mut next = 0;
    let mut globals = Vec::with_capacity(blocks.count());
    for own in own_globals {
        globals.push((next, own));
        next += own;
    }
    let held = workspace.reserve("labels", label_bytes(next as usize, globals.len()))?;
    let sets = join(&seen, &globals, next, workspace)?;
    let parts = Parts {
        store: places.shape,
        seen: &seen,
        sums: &sums,
        bridges: &bridges,
        globals: &globals,
        sets: &sets,
    };
    let (components, fates) = parts.judge(options, &mut stats, workspace)?;
    let surface = Surface {
        triangles,
        runs,
        rims,
        bridges,
        globals,
        components,
        fates,
        _held: held,
    };
    Ok((surface, stats))
}

/// Bytes for a number of global labels and blocks.
fn label_bytes(labels: usize, blocks: usize) -> u64 {
    (labels * 10 + blocks * 8 + 1024) as u64
}

impl Persist for Surface {
    fn save(&self, out: &mut Vec<u8>) {
        self.triangles.save(out);
        self.runs.save(out);
        self.rims.save(out);
        self.bridges.save(out);
        self.globals.save(out);
        self.components.save(out);
        self.fates.save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let (triangles, runs, rims) = Persist::load(from)?;
        let bridges = Persist::load(from)?;
        let (globals, components, fates): (Vec<_>, Vec<_>, _) = Persist::load(from)?;
        let bytes = label_bytes(components.len(), globals.len());
        Ok(Self {
            triangles,
            runs,
            rims,
            bridges,
            _held: from.workspace.reserve("labels", bytes)?,
            globals,
            components,
            fates,
        })
    }
}

impl<'a> Build<'a> {
    fn create(
        places: Places<'a>,
        stitched: &'a Stitched,
        blocks: Blocks,
        options: RepairOptions,
        workspace: &Workspace,
    ) -> Result<Self> {
        let (count, buffer) = (blocks.count(), SHUFFLE_BUFFER);
        Ok(Self {
            places,
            stitched,
            blocks,
            options,
            triangles: Table::create(workspace, "repair.surface", count)?,
            runs: Table::create(workspace, "repair.runs", count)?,
            rims: Table::create(workspace, "repair.rims", count)?,
            sums: Table::create(workspace, "repair.sums", count)?,
            bridges: Shuffle::between_units(workspace, "repair.bridges", buffer, count)?,
            seen: Shuffle::between_units(workspace, "repair.seen", buffer, count)?,
        })
    }

    /// Processes a block; returns the number of its global labels, and counts.
    fn block(&self, block: usize) -> Result<(u32, RepairStats)> {
        let ids = self.blocks.ids(block);
        let mut triangles = around::load(self.stitched, block)?;
        let _held = hold(bytes_of(&triangles));
        let range = ids.start as usize..ids.end as usize;
        let shape = self.places.shape.slice(range.clone())?;
        let _shape = hold(bytes_of(&shape));
        let mut stats = RepairStats::default();
        if self.options.repair && self.options.flip && self.places.differ() {
            let points = self.places.file.slice(range)?;
            let _held = hold(bytes_of(&points));
            stats.edges_flipped = flips::flip(ids.clone(), &mut triangles, &points, &shape);
        }
        let patch = Patch::of(ids.clone(), &triangles);
        let bridges = if self.options.repair {
            bridges::find(ids.clone(), &triangles, &patch)
        } else {
            Vec::new()
        };
        let mut rims = vec![RimBits::default(); ids.len().div_ceil(32)];
        for (v, _) in patch.rims.iter().enumerate().filter(|(_, n)| **n > 0) {
            rims[v / 32].bits |= 1 << (v % 32);
        }
        self.rims.put(block, &rims)?;
        let sums = self.sum(block, &shape, &triangles, &patch, &bridges);
        let (global, local) = sums.split_at(patch.global as usize);
        let global: Vec<SumsRow> = global.iter().map(Sums::row).collect();
        let held = hold(bytes_of(&sums) + bytes_of(&global));
        self.sums.put(block, &global)?;
        let least = self.options.least();
        let fates: Vec<Fate> = local.iter().map(|s| judge(s, least, &mut stats)).collect();
        drop((sums, global, held));
        let interior = |n: &&u32| !self.blocks.crossing(triangles[**n as usize]);
        stats.bridges_removed = bridges.iter().filter(interior).count() as u64;
        self.send(block, &triangles, &patch, &bridges)?;
        self.write(block, triangles, &patch, &bridges, &fates)?;
        Ok((patch.global, stats))
    }

    /// Sums over the interior triangles by label.
    fn sum(
        &self,
        block: usize,
        points: &[Point],
        triangles: &[Triangle],
        patch: &Patch,
        bridges: &[u32],
    ) -> Vec<Sums> {
        let ids = self.blocks.ids(block);
        let mut sums = vec![Sums::default(); patch.labels as usize];
        let _held = hold(bytes_of(&sums));
        let mut bridges = bridges.iter().peekable();
        for (number, t) in triangles.iter().enumerate() {
            let (label, flip) = constraint(patch.words[number]);
            let sum = &mut sums[label as usize];
            if patch.open[number] {
                sum.open();
            }
            if bridges.next_if(|n| **n as usize == number).is_some() {
                continue;
            }
            if ids.contains(&t[0]) && ids.contains(&t[2]) {
                let corners = t.map(|v| points[(v - ids.start) as usize]);
                sum.add(*t, corners, flip);
            }
        }
        sums
    }

    /// Sends crossing triangles to the other blocks that see them: their labels here, and the bridges among
    /// them.
    fn send(
        &self,
        block: usize,
        triangles: &[Triangle],
        patch: &Patch,
        bridges: &[u32],
    ) -> Result<()> {
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
                block: block as u32,
                label_flip: patch.words[number],
            });
            if bridges.binary_search(&(number as u32)).is_ok() {
                let to = |to| TriangleTo { to, triangle: t };
                found.push(to(owner));
                found.extend(self.blocks.visited(t).map(to));
            }
        }
        self.seen.send_from(block, &seen)?;
        self.bridges.send_from(block, &found)
    }

    /// Writes the remaining triangles, oriented.
    fn write(
        &self,
        block: usize,
        mut triangles: Vec<Triangle>,
        patch: &Patch,
        bridges: &[u32],
        fates: &[Fate],
    ) -> Result<()> {
        let mut runs: Vec<LabelRun> = Vec::new();
        let mut bridges = bridges.iter().peekable();
        let mut kept = 0;
        for number in 0..triangles.len() {
            if bridges.next_if(|n| **n as usize == number).is_some() {
                continue;
            }
            let t = triangles[number];
            let (label, flip) = constraint(patch.words[number]);
            let fate = match label.checked_sub(patch.global) {
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
        self.triangles.put(block, rows)?;
        self.runs.put(block, &runs)
    }
}
