//! The triangles that are drawn: those of a block, or of a piece of a cut surface.

use outcrop_disk::error::Result;
use outcrop_disk::spill::Inbox;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_mesh::repair::{ComponentRun, FilledTriangle, Repaired, Surface, Vertices};
use outcrop_mesh_files::cut::{Pieces, StoredPieces};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Ids, Triangle};
use outcrop_stages::located::Located;
use outcrop_stages::order::PointStore;

/// The finished surface, as it is stored.
#[derive(Debug, Clone, Copy)]
pub enum Finished<'a> {
    /// The whole surface.
    Whole(&'a Repaired),
    /// The part inside a region, or the squares of a grid.
    Cut(&'a StoredPieces),
}

/// The finished surface while it is read.
pub(super) enum Source<'a> {
    Whole {
        surface: Box<Surface<'a>>,
        filled: Box<Inbox<FilledTriangle>>,
        used: Vertices,
    },
    Cut(Box<Pieces>),
}

/// The triangles of a part, with the positions of their corners.
pub(super) struct Part {
    /// Ids of the block.
    pub ids: Ids,
    /// Oriented triangles whose smallest vertex is in the block.
    pub triangles: Vec<Triangle>,
    /// The components of the first triangles; the others fill holes, or components are not known.
    pub runs: Vec<ComponentRun>,
    /// Positions of all corners, and of all points of the block.
    pub at: Located,
}

impl<'a> Source<'a> {
    pub fn open(finished: Finished<'a>, blocks: Blocks, workspace: &Workspace) -> Result<Self> {
        Ok(match finished {
            Finished::Whole(repaired) => Self::Whole {
                surface: Box::new(repaired.surface.open(workspace)?),
                filled: Box::new(repaired.filled.open(workspace, blocks.count())?),
                used: repaired.numbering.open(workspace)?,
            },
            Finished::Cut(pieces) => Self::Cut(Box::new(pieces.open(workspace)?)),
        })
    }

    /// Number of parts.
    pub fn count(&self, blocks: Blocks) -> usize {
        match self {
            Self::Whole { .. } => blocks.count(),
            Self::Cut(pieces) => pieces.count(),
        }
    }

    /// Bytes of memory for a part: its triangles, the positions of their corners, two of which may be in other
    /// blocks, their places in a picture, and sums over the edges at each vertex.
    pub fn memory(&self, workspace: &Workspace, blocks: Blocks, part: usize) -> u64 {
        let (points, triangles) = match self {
            Self::Whole {
                surface, filled, ..
            } => {
                let triangles = surface.records(workspace, part) + filled.rows(part);
                (blocks.ids(part).len(), triangles)
            }
            Self::Cut(pieces) => (blocks.ids(0).len(), pieces.counts(part)[2] as usize),
        };
        40 * points as u64 + 160 * triangles as u64 + (1 << 20)
    }

    /// Reads a part; none if it has no triangles.
    pub fn load(
        &self,
        unit: &Unit<'_>,
        blocks: Blocks,
        store: &PointStore,
    ) -> Result<Option<Part>> {
        let number = unit.number();
        let (triangles, runs) = match self {
            Self::Whole {
                surface, filled, ..
            } => {
                let first = blocks.ids(number).start;
                let (mut triangles, mut runs) = surface.load(unit, number)?;
                // Triangles ascend, so those that begin in earlier blocks come first in each run.
                let mut rest = &triangles[..];
                for run in &mut runs {
                    let (these, later) = rest.split_at(run.count);
                    rest = later;
                    run.count = these.iter().filter(|t| t[0] >= first).count();
                }
                triangles.retain(|t| t[0] >= first);
                let filled = filled.get(unit, number)?;
                let own = filled.iter().filter(|f| f.triangle[0] >= first);
                triangles.extend(own.map(|f| f.triangle));
                (triangles, runs)
            }
            Self::Cut(pieces) => {
                let faces = pieces.faces(unit, number)?;
                (faces.iter().map(|face| face.ids).collect(), Vec::new())
            }
        };
        let Some(first) = triangles.first().copied() else {
            return Ok(None);
        };
        let block = blocks.of(first[0].min(first[1]).min(first[2])).index();
        let corners = triangles.iter().flatten().copied();
        Ok(Some(Part {
            ids: blocks.ids(block),
            at: Located::load(store, blocks, block, corners)?,
            triangles,
            runs,
        }))
    }
}

impl Part {
    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.triangles) + bytes_of(&self.runs) + self.at.bytes()
    }
}
