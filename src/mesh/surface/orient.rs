//! Components and orientation of a surface given block by block: first each block on its own, then the blocks
//! together with the crossing triangles.

use super::evidence::{Division, Evidence};
use super::labels::orient_block;
use super::parity::{ParitySets, constraint};
use super::rows::{
    LabelledTo, LabelledTriangle, Normal, PairSum, Relation, Seam, TriangleRow, Upward,
};
use super::star::Triangle;
use super::weigh::weigh_block;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Shuffle, Table, release};
use outcrop_disk::workspace::memory::{Reservation, bytes_of};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Block, GlobalLabel};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::ops::Deref;

/// An oriented surface: every triangle has a label and an orientation relative to it. Triangles with the same
/// label are in the same component; the labels of a component are merged in `sets`.
#[derive(Debug, Serialize, Deserialize)]
pub struct OrientedSurface {
    /// Interior triangles by block; labels are numbered within the block.
    pub interior: Table<LabelledTriangle>,
    /// Crossing triangles, once for each block they touch; labels are global.
    pub sent: Shuffle<LabelledTo>,
    /// For each block, the global label of its label 0 and the number of labels that are global.
    pub globals: Vec<(GlobalLabel, u32)>,
    /// For each block, the number of its labels.
    pub labels: Vec<u32>,
    /// The merged global labels, with relative orientations.
    pub sets: ParitySets<GlobalLabel>,
    /// For each root, true if its component has a crossing triangle.
    pub crosses: Vec<bool>,
    /// For each block, the edges between triangles of different labels, if there is evidence. If the two
    /// triangles are not oriented alike in the end, the second one is removed.
    pub seams: Option<Table<Seam>>,
    /// Triangles removed because they close a Möbius band.
    pub mobius: u64,
    /// Triangles that are left.
    pub triangles: u64,
}

release!(OrientedSurface: interior, sent; seams);

/// An oriented surface that can be read.
#[derive(Debug)]
pub struct Oriented {
    surface: OrientedSurface,
    /// Crossing triangles, once for each block they touch; labels are global.
    pub crossing: Inbox<LabelledTo>,
    _held: Reservation,
}

impl Deref for Oriented {
    type Target = OrientedSurface;

    fn deref(&self) -> &OrientedSurface {
        &self.surface
    }
}

/// A surface with oriented blocks, before the blocks are oriented relative to each other.
#[derive(Debug)]
pub struct OrientedInside {
    pub(super) interior: Table<LabelledTriangle>,
    pub(super) relations: Shuffle<Relation>,
    pub(super) weighed: Option<Weighed>,
    /// Crossing triangles by the block of their smallest vertex.
    pub(super) crossing: Table<TriangleRow>,
    /// For each block, the number of its global labels, and of all its labels.
    pub(super) labels: Vec<(u32, u32)>,
    pub(super) mobius: u64,
    pub(super) triangles: u64,
}

release!(OrientedInside: relations, crossing; weighed);

/// Evidence for the orientation of each block's labels, by block.
#[derive(Debug)]
pub(super) struct Weighed {
    /// Sums of pairs of global labels.
    pub pairs: Table<PairSum>,
    /// Evidence that global labels face up.
    pub ups: Table<Upward>,
    /// See [`OrientedSurface::seams`].
    pub seams: Table<Seam>,
    /// Unit normals of the crossing triangles, in their order.
    pub normals: Table<Normal>,
    /// See [`Division::gain`].
    pub gain: i64,
}

release!(Weighed: pairs, ups, normals);

impl Weighed {
    fn new(name: &str, count: usize, division: Division) -> Self {
        let table = |part: &str| format!("{name}.{part}");
        Self {
            pairs: Table::new(&table("pairs"), count),
            ups: Table::new(&table("ups"), count),
            seams: Table::new(&table("seams"), count),
            normals: Table::new(&table("normals"), count),
            gain: division.gain,
        }
    }
}

/// The triangles around a block, and additional results.
pub struct BlockTriangles<T> {
    /// All triangles that touch the block, ascending.
    pub triangles: Vec<Triangle>,
    /// Evidence for their orientation; without it, they are oriented in their order.
    pub evidence: Option<Evidence>,
    /// Additional results for the caller.
    pub found: T,
}

/// The result for a block: the numbers of its global labels and of all its labels, of triangles removed and
/// kept, and the additional results.
type Done<T> = ((u32, u32), (u64, usize), T);

/// Orients a surface: first the interior triangles of every block on its own, ascending; the crossing ones
/// follow in [`OrientedInside::join`]. A triangle that would make the surface non-orientable is removed.
///
/// `around(unit)` returns all triangles that touch the block of a unit, ascending; `bytes(block)` estimates
/// the memory for that; `each` receives the additional results of each block.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn orient_inside<T: Serialize + DeserializeOwned + Send>(
    name: &str,
    around: impl Fn(&Unit<'_>) -> Result<BlockTriangles<T>> + Sync,
    mut each: impl FnMut(usize, T) + Send,
    bytes: impl Fn(usize) -> u64 + Sync,
    blocks: Blocks,
    division: Option<Division>,
    workspace: &Workspace,
) -> Result<OrientedInside> {
    let count = blocks.count();
    let table = |part: &str| format!("{name}.{part}");
    let interior = Table::new(&table("interior"), count);
    let first = Table::new(&table("border"), count);
    let relations = Shuffle::new(&table("relations"));
    let weighed = division.map(|division| Weighed::new(name, count, division));
    let work = |unit: &Unit<'_>| {
        let block = unit.number();
        let BlockTriangles {
            triangles: mut inner,
            evidence,
            found,
        } = around(unit)?;
        let crossing: Vec<Triangle> = inner.extract_if(.., |t| blocks.crossing(*t)).collect();
        let of_evidence = evidence.as_ref().map_or(0, Evidence::bytes);
        let _held = unit.hold(bytes_of(&inner) + bytes_of(&crossing) + of_evidence);
        let done = match &evidence {
            Some(evidence) => weigh_block(&inner, &crossing, evidence, blocks, block),
            None => orient_block(&inner, &crossing, blocks, block),
        };
        drop(unit.hold(done.most));
        let _done = unit.hold(done.bytes());
        interior.put(unit, block, &done.interior)?;
        relations.send(unit, block, done.relations)?;
        let mine = |t: &Triangle| blocks.of(t[0]) == Block::at(block);
        let mine: Vec<Triangle> = crossing.iter().copied().filter(mine).collect();
        first.put(unit, block, bytemuck::cast_slice(&mine))?;
        if let (Some(weighed), Some(evidence)) = (&weighed, &evidence) {
            weighed.pairs.put(unit, block, &done.pairs)?;
            weighed.ups.put(unit, block, &done.ups)?;
            weighed.seams.put(unit, block, &done.seams)?;
            let normal = |t: &Triangle| Normal {
                normal: evidence.normal(*t).map(|x| x as f32),
            };
            let normals: Vec<_> = mine.iter().map(normal).collect();
            weighed.normals.put(unit, block, &normals)?;
        }
        unit.advance(1);
        let own = (done.global, done.labels);
        Ok((own, (done.mobius, done.interior.len()), found))
    };
    let mut labels = vec![(0u32, 0u32); count];
    let (mut mobius, mut triangles) = (0, 0);
    let each = |block: usize, (own, more, found): Done<T>| {
        labels[block] = own;
        mobius += more.0;
        triangles += more.1 as u64;
        each(block, found);
        Ok(())
    };
    workspace.units("orient: block", count, &bytes, work, each)?;
    Ok(OrientedInside {
        interior,
        relations,
        weighed,
        crossing: first,
        labels,
        mobius,
        triangles,
    })
}

impl OrientedSurface {
    /// Opens it for reading.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`].
    pub fn open(self, workspace: &Workspace, blocks: Blocks) -> Result<Oriented> {
        Ok(Oriented {
            crossing: self.sent.open(workspace, blocks.count())?,
            _held: workspace.reserve("labels", label_bytes(self.sets.len()))?,
            surface: self,
        })
    }

    /// The interior triangles of a block without those that are cut where labels are not oriented alike, and
    /// the number of the latter.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn inside(&self, unit: &Unit<'_>, block: usize) -> Result<(Vec<LabelledTriangle>, u64)> {
        let mut interior = self.interior.get(unit, block)?;
        let Some(seams) = &self.seams else {
            return Ok((interior, 0));
        };
        let (first, globals) = self.globals[block];
        // Labels at seams are global.
        let turned = |t: &LabelledTriangle| {
            let (label, flip) = constraint(t.label_flip);
            debug_assert!(
                label.get() < globals,
                "a seam at a label of the block alone"
            );
            self.sets.look(first.of(label)).1 ^ flip
        };
        let mut gone = 0;
        let mut cut = vec![false; interior.len()];
        for Seam { a, b_flip } in seams.get(unit, block)? {
            let (b, flip) = constraint(b_flip);
            let (a, b) = (a.index(), b.index());
            if !cut[a] && !cut[b] && turned(&interior[a]) ^ turned(&interior[b]) != flip {
                cut[b] = true;
                gone += 1;
            }
        }
        let mut cut = cut.into_iter();
        interior.retain(|_| cut.next() == Some(false));
        Ok((interior, gone))
    }
}

/// Bytes for this number of global labels.
pub(super) fn label_bytes(labels: usize) -> u64 {
    labels as u64 * 16 + 1024
}
