//! The mesh file: used points renumbered, pinched vertices split, slices written in parallel at
//! known offsets under a temporary name, then renamed.

mod number;
mod ply;

pub use ply::CoordinateType;

use crate::error::{Error, Result};
use crate::geom::lattice::Lattice;
use crate::spill::Sections;
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::repair::Repaired;
use crate::stages::surface::star::sorted;
use crate::workspace::Workspace;
use number::Numbering;
use serde::Serialize;
use std::path::Path;

/// Counts of the finished mesh.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct MeshStats {
    /// Vertices, copies included.
    pub vertices: u64,
    /// Points of the cloud that are a vertex.
    pub points_used: u64,
    /// Copies made to split pinched vertices.
    pub pinched_copies: u64,
    /// Triangles.
    pub triangles: u64,
    /// Edges with one triangle.
    pub boundary_edges: u64,
}

/// All triangles of the mesh that touch a block, as they run, ascending by sorted ids.
fn triangles_around(repaired: &Repaired, block: usize) -> Result<Vec<[u32; 3]>> {
    let around = repaired.around.get(block)?;
    let filled = repaired.filled.get(block)?;
    let mut triangles: Vec<[u32; 3]> = around.iter().map(|t| [t[0], t[1], t[2]]).collect();
    if !filled.is_empty() {
        triangles.extend(filled.iter().map(|t| [t[1], t[2], t[3]]));
        triangles.sort_unstable_by_key(|t| sorted(*t));
    }
    Ok(triangles)
}

fn block_bytes(repaired: &Repaired, blocks: Blocks, block: usize) -> u64 {
    let records = repaired.around.records(block) + repaired.filled.records(block);
    120 * records as u64 + blocks.ids(block).len() as u64 * 60 + (1 << 20)
}

/// Writes the mesh to `output`.
///
/// # Errors
/// [`Error::Io`], [`Error::Disk`], [`Error::NoTriangles`], [`Error::Corrupt`], [`Error::Memory`],
/// [`Error::Cancelled`].
pub fn export(
    store: &PointStore,
    repaired: &Repaired,
    blocks: Blocks,
    lattice: &Lattice,
    coordinates: CoordinateType,
    output: &Path,
    workspace: &Workspace,
) -> Result<MeshStats> {
    let numbering = number::number(repaired, blocks, workspace)?;
    let stats = numbering.stats;
    if stats.triangles == 0 {
        return Err(Error::NoTriangles {
            why: NO_TRIANGLES.into(),
        });
    }
    let file = ply::MeshFile::create(output, coordinates, &stats, workspace)?;
    let bytes = |block| block_bytes(repaired, blocks, block);
    workspace.for_each_unit("export: block", blocks.count(), bytes, |block| {
        write_block(store, repaired, &numbering, blocks, lattice, &file, block)?;
        workspace.observer.advance(1);
        Ok(())
    })?;
    file.finish()?;
    Ok(stats)
}

const NO_TRIANGLES: &str = "no three cells agree on one that belongs to a component large enough; \
    try a larger --radius, --smooth 1 for noisy scans, or a smaller --min-component";

fn write_block(
    store: &PointStore,
    repaired: &Repaired,
    numbering: &Numbering,
    blocks: Blocks,
    lattice: &Lattice,
    file: &ply::MeshFile,
    block: usize,
) -> Result<()> {
    let ids = blocks.ids(block);
    let points = store.slice(ids.start as usize..ids.end as usize)?;
    let at = |v: u32| lattice.position(points[(v - ids.start) as usize]);
    let used: Vec<[f64; 3]> = ids.clone().filter(|v| numbering.used(*v)).map(at).collect();
    file.vertices(numbering.first_used(block), &used)?;
    let copies: Vec<[f64; 3]> = numbering
        .copies
        .get(block)?
        .iter()
        .map(|c| at(c[0]))
        .collect();
    file.vertices(numbering.first_copy(block), &copies)?;
    let splits = numbering.splits.get(block)?;
    let triangles = triangles_around(repaired, block)?;
    let mine = triangles
        .into_iter()
        .filter(|t| blocks.of(t[0]) == block as u32);
    let faces: Vec<[u32; 3]> = mine
        .map(|t| renumber(t, &splits, numbering, block))
        .collect();
    file.faces(numbering.first_face(block), &faces)
}

/// The triangle in the file's numbers; a corner in a fan with a copy of its own takes the copy.
fn renumber(t: [u32; 3], splits: &[[u32; 7]], numbering: &Numbering, block: usize) -> [u32; 3] {
    let key = sorted(t);
    let start = splits.partition_point(|s| s[..4] < [block as u32, key[0], key[1], key[2]][..]);
    let mine = splits[start..].iter().take_while(|s| s[1..4] == key[..]);
    let mut out = t.map(|v| numbering.vertex(v));
    for s in mine {
        for (corner, v) in out.iter_mut().zip(t) {
            if v == s[4] {
                *corner = numbering.first_copy(s[5] as usize) as u32 + s[6];
            }
        }
    }
    out
}

type Splits = Sections<7>;
