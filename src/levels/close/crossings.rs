//! Patches that cross the mesh, another patch or themselves.
//!
//! A tree over the boxes of the triangles of as many patches as fit is asked for every triangle of the mesh and of all
//! patches. So the mesh is read once for each part of the patches, usually once.

use super::patches::Patches;
use crate::meet::{Corners, bounds, cross_each_other};
use crate::source::{READER, Source};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_geom::boxes::BoxTree;
use std::collections::BTreeMap;

/// Triangles of patches that are in memory at a time, unless a batch has more.
const PART: usize = 1 << 18;

/// Bytes of memory for each of them, while the tree is built.
const EACH: u64 = 80 + BoxTree::<f64>::BYTES;

/// Patches in memory.
struct Part {
    numbers: Vec<u32>,
    triangles: Vec<Corners>,
    tree: BoxTree<f64>,
}

impl Part {
    fn of(triangles: Vec<(u32, Corners)>) -> Self {
        let tree = BoxTree::of(triangles.iter().map(|(_, t)| bounds(t)));
        let (numbers, triangles) = triangles.into_iter().unzip();
        Self {
            numbers,
            triangles,
            tree,
        }
    }

    /// Counts a triangle for each patch whose triangles it crosses.
    fn count(&self, t: &Corners, own: Option<u32>, found: &mut BTreeMap<u32, u64>) {
        let mut crossed: Vec<u32> = Vec::new();
        for other in self.tree.meeting(bounds(t)) {
            let number = self.numbers[other];
            if crossed.contains(&number) {
                continue;
            }
            if cross_each_other(t, &self.triangles[other]) {
                crossed.push(number);
            }
        }
        for number in crossed {
            *found.entry(number).or_default() += 1;
            // The other patch crosses this one as well, unless both are one.
            if let Some(own) = own.filter(|own| *own != number) {
                *found.entry(own).or_default() += 1;
            }
        }
    }
}

/// For each loop whose patch crosses something, the number of triangles of the mesh and of patches that cross it.
/// `step` names the work; of `tries` those with the loops that `chosen` says are tested, and the loops `tested`.
pub(super) fn find(
    source: &Source,
    step: u32,
    tries: &[&Patches],
    chosen: impl Fn(u32, usize) -> bool + Sync,
    tested: impl Fn(u32) -> bool + Sync,
    workspace: &Workspace,
) -> Result<BTreeMap<u32, u64>> {
    let batches = tries.first().map_or(0, |patches| patches.placed.count());
    let mut all = BTreeMap::new();
    let (mut batch, mut number) = (0, 0);
    while batch < batches {
        let mut rows = 0;
        let first = batch;
        while batch < batches && (rows == 0 || rows < PART) {
            for patches in tries {
                rows += patches.placed.rows(workspace, batch)?;
            }
            batch += 1;
        }
        let _held = workspace.reserve("close: crossings", rows as u64 * EACH + (1 << 20))?;
        let unit = workspace.unit();
        let mut triangles = Vec::with_capacity(rows);
        for batch in first..batch {
            for (n, patches) in tries.iter().enumerate() {
                let rows = patches.placed.get(&unit, batch)?;
                let rows = rows
                    .iter()
                    .filter(|row| tested(row.number) && chosen(row.number, n));
                triangles.extend(rows.map(|row| (row.number, row.positions)));
            }
        }
        let part = Part::of(triangles);
        let ranges = source.ranges();
        let observer = &workspace.observer;
        observer.begin("find crossings", "triangles", source.triangles);
        workspace.units(
            (
                format!("crossings {step} {number}"),
                "close: crossings of ranges",
            ),
            ranges + batches,
            |_| READER + (2 << 20),
            |unit| {
                let mut found = BTreeMap::new();
                if unit.number() < ranges {
                    source.read(unit, |triangles, positions| {
                        for t in triangles {
                            part.count(&positions.corners(*t)?, None, &mut found);
                        }
                        Ok(())
                    })?;
                    return Ok(found);
                }
                for (n, patches) in tries.iter().enumerate() {
                    for row in patches.placed.get(unit, unit.number() - ranges)? {
                        if chosen(row.number, n) {
                            part.count(&row.positions, Some(row.number), &mut found);
                        }
                    }
                }
                Ok(found)
            },
            |_, found: BTreeMap<u32, u64>| {
                for (number, count) in found {
                    *all.entry(number).or_default() += count;
                }
                Ok(())
            },
        )?;
        observer.end();
        number += 1;
    }
    Ok(all)
}
