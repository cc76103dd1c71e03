//! The surface by block: bridges are found, triangles oriented, components kept or removed.
//!
//! One pass reads all triangles. Each block on its own divides the triangles that touch it into labels,
//! orients the components that lie entirely in the block, and removes small ones. The labels of components
//! that extend further are merged through the triangles that several blocks see.

mod build;

pub use build::build;

use super::facing::Fate;
use super::rows::{LabelRun, RimBits};
use super::{OrientedTriangle, SurfaceTriangle};
use crate::surface::rows::TriangleTo;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Shuffle, Table, release};
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_stages::ids::{Block, GlobalLabel};
use serde::{Deserialize, Serialize};

/// The oriented surface, without small components and bridges.
#[derive(Debug, Serialize, Deserialize)]
pub struct StoredSurface {
    /// Triangles that touch each block, ascending, oriented relative to their label.
    triangles: Table<SurfaceTriangle>,
    /// The labels of these triangles; global labels come first.
    runs: Table<LabelRun>,
    /// The vertices of each block that have a boundary edge.
    rims: Table<RimBits>,
    /// Bridges at crossing triangles, once or more for each block that they touch.
    bridges: Shuffle<TriangleTo>,
    labels: Labels,
}

release!(StoredSurface: triangles, runs, rims, bridges);

/// The global labels: those of triangles that several blocks see.
#[derive(Debug, Serialize, Deserialize)]
struct Labels {
    /// For each block, the number of its first global label, and how many global labels it has.
    globals: Vec<(GlobalLabel, u32)>,
    /// For each global label its component, and the decision about it.
    components: Vec<GlobalLabel>,
    fates: Vec<Fate>,
}

/// The surface while it is read.
#[derive(Debug)]
pub struct Surface<'a> {
    stored: &'a StoredSurface,
    /// Bridges at crossing triangles, once for each block that they touch.
    bridges: Inbox<TriangleTo>,
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

impl StoredSurface {
    /// Opens the surface.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`].
    pub fn open(&self, workspace: &Workspace) -> Result<Surface<'_>> {
        let (labels, blocks) = (self.labels.components.len(), self.labels.globals.len());
        Ok(Surface {
            _held: workspace.reserve("labels", label_bytes(labels, blocks))?,
            bridges: self.bridges.open(workspace, blocks)?.unique(),
            stored: self,
        })
    }
}

impl Surface<'_> {
    /// An upper bound on the number of triangles that touch a block.
    #[must_use]
    pub fn records(&self, workspace: &Workspace, block: usize) -> usize {
        self.stored.triangles.expected_rows(workspace, block)
    }

    /// All triangles that touch a block, oriented, ascending by sorted ids; and their components.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn load(
        &self,
        unit: &Unit<'_>,
        block: usize,
    ) -> Result<(Vec<OrientedTriangle>, Vec<ComponentRun>)> {
        let StoredSurface {
            triangles,
            runs,
            labels,
            ..
        } = self.stored;
        let mut triangles: Vec<OrientedTriangle> = bytemuck::cast_vec(triangles.get(unit, block)?);
        let bridges = self.bridges.get(unit, block)?;
        let is_bridge = |[i, a, b]: OrientedTriangle| {
            let key = TriangleTo {
                to: Block::at(block),
                triangle: [i, a.min(b), a.max(b)],
            };
            !bridges.is_empty() && bridges.binary_search(&key).is_ok()
        };
        let (first, globals) = labels.globals[block];
        let runs = runs.get(unit, block)?;
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
            if label.get() >= globals {
                triangles.copy_within(all, to);
                to += count as usize;
                kept.push(run(label.get() << 1, before, to));
                continue;
            }
            let label = first.of(label).index();
            let Fate { keep, turn } = labels.fates[label];
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
                kept.push(run(labels.components[label].get() << 1 | 1, before, to));
            }
        }
        triangles.truncate(to);
        Ok((triangles, kept))
    }

    /// The vertices of a block that have a boundary edge.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn rims(&self, unit: &Unit<'_>, block: usize) -> Result<Vec<RimBits>> {
        self.stored.rims.get(unit, block)
    }
}

/// Bytes for a number of global labels and blocks.
fn label_bytes(labels: usize, blocks: usize) -> u64 {
    (labels * 10 + blocks * 8 + 1024) as u64
}
