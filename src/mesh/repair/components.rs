//! Components across blocks: labels of blocks are merged through the crossing triangles that several blocks
//! see; then the sums over each component decide its fate.

use super::facing::{Fate, Sums, SumsRow, judge};
use super::rows::SeenTriangle;
use super::{RepairOptions, RepairStats, ascending};
use crate::surface::parity::{ParitySets, constraint};
use crate::surface::rows::TriangleTo;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Table};
use outcrop_disk::workspace::memory::{bytes_of, table_bytes};
use outcrop_disk::workspace::{Unit, lock};
use outcrop_geom::Point;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{GlobalLabel, Label};
use outcrop_stages::located::Places;
use outcrop_stages::outside::Known;
use rustc_hash::FxHashMap;
use std::sync::Mutex;

/// Merges the global labels that different blocks give to the same triangle.
pub(super) fn join(
    unit: &Unit<'_>,
    seen: &Inbox<SeenTriangle>,
    globals: &[(GlobalLabel, u32)],
    labels: u32,
) -> Result<ParitySets<GlobalLabel>> {
    let mut sets = ParitySets::new(labels as usize);
    for block in 0..globals.len() {
        unit.check_cancel()?;
        let _held = unit.reserve("labels seen", seen.rows(block) as u64 * 24)?;
        let all = seen.get(unit, block)?;
        for same in all.chunk_by(|a, b| a.triangle == b.triangle) {
            let global = |s: &SeenTriangle| {
                let (label, flip) = constraint(s.label_flip);
                (globals[s.block.index()].0.of(label), flip)
            };
            let (first, flip) = global(&same[0]);
            for (label, other) in same[1..].iter().map(global) {
                sets.join(first, label, flip ^ other);
            }
        }
    }
    sets.flatten();
    Ok(sets)
}

/// The input for the components of global labels.
pub(super) struct Parts<'a> {
    pub blocks: Blocks,
    pub places: Places<'a>,
    /// Labels and orientations of crossing triangles in the blocks that they touch.
    pub seen: &'a Inbox<SeenTriangle>,
    /// Sums over the interior triangles of each block's global labels.
    pub sums: &'a Table<SumsRow>,
    /// Bridges that several blocks see.
    pub bridges: &'a Inbox<TriangleTo>,
    /// For each block, the number of its first global label, and how many global labels it has.
    pub globals: &'a [(GlobalLabel, u32)],
    /// The merged labels.
    pub sets: &'a ParitySets<GlobalLabel>,
}

impl Parts<'_> {
    /// The component and the fate of each global label.
    pub fn judge(
        &self,
        unit: &Unit<'_>,
        options: RepairOptions,
        stats: &mut RepairStats,
    ) -> Result<(Vec<GlobalLabel>, Vec<Fate>)> {
        let all: Mutex<FxHashMap<GlobalLabel, Sums>> = Mutex::default();
        let bytes = |block: usize| {
            let labels = self.globals[block].1;
            let ids = self.blocks.ids(block).len();
            let known = self.places.outside.map_or(0, |o| o.bytes(ids));
            self.seen.rows(block) as u64 * 150 + u64::from(labels) * 500 + known + (1 << 16)
        };
        unit.for_each_unit("repair: borders", self.globals.len(), bytes, |unit| {
            let own = self.sum(unit)?;
            let mut all = lock(&all);
            for (root, sums) in own {
                all.entry(root).or_default().merge(&sums, false);
            }
            Ok(())
        })?;
        let all = std::mem::take(&mut *lock(&all));
        let _held = unit.reserve("components", all.len() as u64 * 500)?;
        let fates: FxHashMap<GlobalLabel, Fate> = all
            .iter()
            .map(|(root, sums)| (*root, judge(sums, options.least(), stats)))
            .collect();
        let labels = (0..self.sets.len()).map(GlobalLabel::at).map(|label| {
            let (root, turned) = self.sets.look(label);
            // Every label has an entry.
            let fate = fates.get(&root).copied().unwrap_or(Fate::UNKNOWN);
            let turn = fate.turn ^ turned;
            (root, Fate { turn, ..fate })
        });
        Ok(labels.unzip())
    }

    /// Sums over a block's interior triangles and over the crossing ones whose smallest vertex is in it, by
    /// the roots of their labels.
    fn sum(&self, unit: &Unit<'_>) -> Result<FxHashMap<GlobalLabel, Sums>> {
        let block = unit.number();
        let mut own: FxHashMap<GlobalLabel, Sums> = FxHashMap::default();
        let first = self.globals[block].0;
        for (label, row) in (0..).map(Label::new).zip(self.sums.get(unit, block)?) {
            let (root, turned) = self.sets.look(first.of(label));
            let sums = Sums::of(&row);
            own.entry(root).or_default().merge(&sums, turned);
        }
        let seen = self.seen.get(unit, block)?;
        let bridges = self.bridges.get(unit, block)?;
        let ids = ascending(seen.iter().flat_map(|s| s.triangle));
        let mut points: Vec<Point> = Vec::with_capacity(ids.len());
        self.places.shape.fetch(&ids, &mut points)?;
        let known = self
            .places
            .outside
            .map(|o| o.open(unit, self.blocks, block));
        let known = known.transpose()?;
        let bytes = table_bytes(&own) + bytes_of(&seen) + bytes_of(&ids) + bytes_of(&points);
        let bytes = bytes + known.as_ref().map_or(0, Known::bytes);
        let _held = unit.hold(bytes);
        for same in seen.chunk_by(|a, b| a.triangle == b.triangle) {
            let first = same[0];
            let SeenTriangle { to, triangle, .. } = first;
            if bridges.binary_search(&TriangleTo { to, triangle }).is_ok() {
                continue;
            }
            let (label, flip) = constraint(first.label_flip);
            let label = self.globals[first.block.index()].0.of(label);
            let (root, turned) = self.sets.look(label);
            // The positions of all corners were fetched.
            let corners = triangle.map(|v| points[ids.partition_point(|id| *id < v)]);
            // The smallest vertex is in this block.
            let toward = known.as_ref();
            let toward = toward.and_then(|known| known.toward(triangle[0], corners[0]));
            let sums = own.entry(root).or_default();
            sums.add(triangle, corners, turned ^ flip, toward);
            if self.places.is_noisy(triangle[0]) {
                sums.note_noise();
            }
        }
        Ok(own)
    }
}
