//! Components and orientation of a surface given block by block: each block by itself, and what comes of
//! it with the crossing triangles.

use super::evidence::Evidence;
use super::labels::orient_block;
use super::parity::{ParitySets, constraint};
use super::rows::{
    LabelledTo, LabelledTriangle, Normal, PairSum, Relation, Seam, TriangleRow, Upward,
};
use super::star::Triangle;
use super::weigh::weigh_block;
use crate::error::Result;
use crate::spill::{Shuffle, Table};
use crate::stages::blocks::Blocks;
use crate::workspace::Workspace;
use crate::workspace::memory::{Holding, Reservation, bytes_of, hold};
use crate::workspace::persist::{Persist, Saved};

const SHUFFLE_BUFFER: u64 = 8 << 20;

/// An oriented surface: every triangle has a label and an orientation relative to it. Triangles of one
/// label are of one component; the labels of a component are joined in `sets`.
#[derive(Debug)]
pub struct Oriented {
    /// Interior triangles by block; labels are the block's own.
    pub interior: Table<LabelledTriangle>,
    /// Crossing triangles for each block they touch; labels are global.
    pub crossing: Table<LabelledTo>,
    /// For each block, the global label of its label 0 and the number of labels that are global.
    pub globals: Vec<(u32, u32)>,
    /// For each block, the number of its labels.
    pub labels: Vec<u32>,
    /// Relations of the global labels.
    pub sets: ParitySets,
    /// Which roots have a crossing triangle.
    pub crosses: Vec<bool>,
    /// For each block the edges between triangles of different labels, if there is evidence: where the two run
    /// against each other in the end, the second goes.
    pub seams: Option<Table<Seam>>,
    /// Triangles removed because they close a Möbius band.
    pub mobius: u64,
    /// Triangles that are left.
    pub triangles: u64,
    pub(super) _held: Reservation,
}

/// A surface whose blocks are oriented, but not yet what lies between them.
#[derive(Debug)]
pub struct OrientedInside {
    pub(super) interior: Table<LabelledTriangle>,
    pub(super) relations: Table<Relation>,
    pub(super) weighed: Option<Weighed>,
    /// Crossing triangles by the block of their smallest vertex.
    pub(super) crossing: Table<TriangleRow>,
    /// For each block, the number of labels that are global, and of all.
    pub(super) labels: Vec<(u32, u32)>,
    pub(super) mobius: u64,
    pub(super) triangles: u64,
}

/// Evidence on the orientation of each block's labels, by block.
#[derive(Debug)]
pub(super) struct Weighed {
    /// Sums of pairs of global labels.
    pub pairs: Table<PairSum>,
    /// Evidence that global labels face up.
    pub ups: Table<Upward>,
    /// See [`Oriented::seams`].
    pub seams: Table<Seam>,
    /// Unit normals of the crossing triangles, in their order.
    pub normals: Table<Normal>,
}

impl Weighed {
    fn create(workspace: &Workspace, name: &str, count: usize) -> Result<Self> {
        let table = |part: &str| format!("{name}.{part}");
        Ok(Self {
            pairs: Table::create(workspace, &table("pairs"), count)?,
            ups: Table::create(workspace, &table("ups"), count)?,
            seams: Table::create(workspace, &table("seams"), count)?,
            normals: Table::create(workspace, &table("normals"), count)?,
        })
    }
}

/// The triangles around a block, and what else was found there.
pub struct BlockTriangles<T> {
    /// All that touch the block, ascending.
    pub triangles: Vec<Triangle>,
    /// What speaks for their orientation; without, the order of triangles decides.
    pub evidence: Option<Evidence>,
    /// What the caller wants to know of the block.
    pub found: T,
    /// What it holds.
    pub held: Holding,
}

/// Orients a surface: the interior triangles of every block by themselves, ascending; the crossing
/// ones follow in [`OrientedInside::join`]. A triangle that would make the surface non-orientable is
/// removed.
///
/// `around(block)` gives all triangles that touch a block, ascending; `bytes(block)` what that
/// takes in memory; `each` gets what else was found in each block.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn orient_inside<T: Persist + Send>(
    name: &str,
    around: impl Fn(usize) -> Result<BlockTriangles<T>> + Sync,
    mut each: impl FnMut(usize, T) + Send,
    bytes: impl Fn(usize) -> u64 + Sync,
    blocks: Blocks,
    evidence: bool,
    workspace: &Workspace,
) -> Result<OrientedInside> {
    let count = blocks.count();
    let table = |part: &str| format!("{name}.{part}");
    let interior = Table::create(workspace, &table("interior"), count)?;
    let first = Table::create(workspace, &table("border"), count)?;
    let relations = table("relations");
    let shuffle = Shuffle::between_units(workspace, &relations, SHUFFLE_BUFFER, count)?;
    let weighed = evidence
        .then(|| Weighed::create(workspace, name, count))
        .transpose()?;
    let work = |block| {
        let BlockTriangles {
            triangles: mut inner,
            evidence,
            found,
            held: _held,
        } = around(block)?;
        let crossing: Vec<Triangle> = inner.extract_if(.., |t| blocks.crossing(*t)).collect();
        let _crossing = hold(bytes_of(&crossing));
        let done = match &evidence {
            Some(evidence) => weigh_block(&inner, &crossing, evidence, blocks, block),
            None => orient_block(&inner, &crossing, blocks, block),
        };
        interior.put(block, &done.interior)?;
        shuffle.send_from(block, &done.relations)?;
        let mine = |t: &Triangle| blocks.of(t[0]) == block as u32;
        let mine: Vec<Triangle> = crossing.iter().copied().filter(mine).collect();
        first.put(block, bytemuck::cast_slice(&mine))?;
        if let (Some(weighed), Some(evidence)) = (&weighed, &evidence) {
            weighed.pairs.put(block, &done.pairs)?;
            weighed.ups.put(block, &done.ups)?;
            weighed.seams.put(block, &done.seams)?;
            let normal = |t: &Triangle| Normal {
                normal: evidence.normal(*t).map(|x| x as f32),
            };
            let normals: Vec<_> = mine.iter().map(normal).collect();
            weighed.normals.put(block, &normals)?;
        }
        workspace.advance(1);
        let own = (done.global, done.labels);
        Ok((own, (done.mobius, done.interior.len()), found))
    };
    let mut labels = vec![(0u32, 0u32); count];
    let (mut mobius, mut triangles) = (0, 0);
    workspace.units("block", count, &bytes, work, |block, (own, more, found)| {
        labels[block] = own;
        mobius += more.0;
        triangles += more.1 as u64;
        each(block, found);
        Ok(())
    })?;
    Ok(OrientedInside {
        interior,
        relations: shuffle.deliver(workspace, count)?,
        weighed,
        crossing: first,
        labels,
        mobius,
        triangles,
    })
}

impl Oriented {
    /// The interior triangles of a block without those that are cut where labels run against each other, and
    /// how many these are.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn inside(&self, block: usize) -> Result<(Vec<LabelledTriangle>, u64)> {
        let mut interior = self.interior.get(block)?;
        let Some(seams) = &self.seams else {
            return Ok((interior, 0));
        };
        let (first, globals) = self.globals[block];
        // Labels at seams are global.
        let turned = |t: &LabelledTriangle| {
            let (label, flip) = constraint(t.label_flip);
            debug_assert!(label < globals, "a seam at a label of the block alone");
            self.sets.look(first + label).1 ^ flip
        };
        let mut gone = 0;
        let mut cut = vec![false; interior.len()];
        for Seam { a, b_flip } in seams.get(block)? {
            let (b, flip) = constraint(b_flip);
            let (a, b) = (a as usize, b as usize);
            if !cut[a] && !cut[b] && turned(&interior[a]) ^ turned(&interior[b]) != flip {
                cut[b] = true;
                gone += 1;
            }
        }
        if gone > 0 {
            let mut number = 0;
            interior.retain(|_| {
                number += 1;
                !cut[number - 1]
            });
        }
        Ok((interior, gone))
    }
}

impl Persist for Oriented {
    fn save(&self, out: &mut Vec<u8>) {
        self.interior.save(out);
        self.crossing.save(out);
        self.globals.save(out);
        self.labels.save(out);
        self.sets.save(out);
        self.crosses.save(out);
        self.seams.save(out);
        (self.mobius, self.triangles).save(out);
    }

    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let (interior, crossing) = Persist::load(from)?;
        let (globals, labels) = Persist::load(from)?;
        let sets = ParitySets::load(from)?;
        let (crosses, seams) = Persist::load(from)?;
        let (mobius, triangles) = Persist::load(from)?;
        let bytes = label_bytes(sets.len());
        Ok(Self {
            interior,
            crossing,
            globals,
            labels,
            _held: from.workspace.reserve("labels", bytes)?,
            sets,
            crosses,
            seams,
            mobius,
            triangles,
        })
    }
}

/// Bytes that this number of global labels takes.
pub(super) fn label_bytes(labels: usize) -> u64 {
    labels as u64 * 16 + 1024
}
