//! Components and orientation of a surface given block by block.

use super::across::settle;
use super::border::Border;
use super::evidence::Evidence;
use super::parity::ParitySets;
use super::patches::Joint;
use super::star::{EDGES, Edges, Triangle, opposed};
use super::weigh::weigh_block;
use crate::error::Result;
use crate::spill::layouts::{LABELLED, SENT_LABELLED, TRIANGLE};
use crate::spill::{Exchange, Sections, Word};
use crate::stages::blocks::Blocks;
use crate::workspace::Workspace;
use crate::workspace::memory::{Holding, bytes_of, hold};
use crate::workspace::persist::{Persist, Saved};

const EXCHANGE_BUFFER: u64 = 8 << 20;

/// An oriented surface: every triangle has a label and an orientation relative to it.
#[derive(Debug)]
pub struct Oriented {
    /// `[i, j, k, label << 1 | flip]` of interior triangles by block; labels are the block's own.
    pub interior: Sections<4>,
    /// `[block, i, j, k, label << 1 | flip]` of crossing triangles for each block they touch;
    /// labels are global.
    pub crossing: Sections<5>,
    /// For each block, the global label of its label 0 and the number of labels that are global.
    pub globals: Vec<(u32, u32)>,
    /// For each block, the number of its labels.
    pub labels: Vec<u32>,
    /// Relations of the global labels.
    pub sets: ParitySets,
    /// Which roots have a crossing triangle.
    pub crosses: Vec<bool>,
    /// For each block the edges between triangles of different labels, `[a, b << 1 | flip]` by places in
    /// `interior`, if there is evidence: where the two run against each other in the end, `b` goes.
    pub seams: Option<Sections<2>>,
    /// Triangles removed because they close a Möbius band.
    pub mobius: u64,
    /// Triangles that are left.
    pub triangles: u64,
    _held: crate::workspace::memory::Reservation,
}

/// A surface whose blocks are oriented, but not yet what lies between them.
#[derive(Debug)]
pub struct OrientedInside {
    interior: Sections<4>,
    relations: Sections<7>,
    weighed: Option<Weighed>,
    /// Crossing triangles by the block of their smallest vertex.
    crossing: Sections<3>,
    /// For each block, the number of labels that are global, and of all.
    labels: Vec<(u32, u32)>,
    mobius: u64,
    triangles: u64,
}

/// Evidence on the orientation of each block's labels, by block.
#[derive(Debug)]
pub(super) struct Weighed {
    /// Sums of pairs of global labels, `[a, b, sum]`, the sum in two words.
    pub pairs: Sections<4>,
    /// Evidence that global labels face up, `[label, up]`, the evidence in two words.
    pub ups: Sections<3>,
    /// See [`Oriented::seams`].
    seams: Sections<2>,
    /// Unit normals of the crossing triangles, in their order, as `f32`.
    pub normals: Sections<3>,
}

impl Weighed {
    fn create(workspace: &Workspace, name: &str, count: usize) -> Result<Self> {
        let sections = |part: &str| format!("{name}.{part}");
        Ok(Self {
            pairs: Sections::create(workspace, &sections("pairs"), count)?,
            ups: Sections::create(workspace, &sections("ups"), count)?,
            seams: Sections::create(workspace, &sections("seams"), count)?,
            normals: Sections::unpacked(workspace, &sections("normals"), count)?,
        })
    }
}

/// The triangles around a block, and what else was found there.
pub struct Around<T> {
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
    around: impl Fn(usize) -> Result<Around<T>> + Sync,
    mut each: impl FnMut(usize, T) + Send,
    bytes: impl Fn(usize) -> u64 + Sync,
    blocks: Blocks,
    evidence: bool,
    workspace: &Workspace,
) -> Result<OrientedInside> {
    let count = blocks.count();
    let sections = |part: &str| format!("{name}.{part}");
    let interior = Sections::with_layout(workspace, &sections("interior"), count, LABELLED)?;
    let border = Sections::with_layout(workspace, &sections("border"), count, TRIANGLE)?;
    let letters = sections("relations");
    let above = [Word::Above; 7];
    let exchange = Exchange::between(workspace, &letters, EXCHANGE_BUFFER, count, above)?;
    let weighed = evidence
        .then(|| Weighed::create(workspace, name, count))
        .transpose()?;
    let work = |block| {
        let Around {
            triangles: mut inner,
            evidence,
            found,
            held: _held,
        } = around(block)?;
        let crossing: Vec<Triangle> = inner.extract_if(.., |t| blocks.crossing(*t)).collect();
        let _crossing = hold(bytes_of(&crossing));
        let done = orient_block(&inner, &crossing, evidence.as_ref(), blocks, block);
        interior.put(block, &done.interior)?;
        exchange.send_from(block, &done.relations)?;
        let mine = |t: &Triangle| blocks.of(t[0]) == block as u32;
        let mine: Vec<Triangle> = crossing.iter().copied().filter(mine).collect();
        border.put(block, &mine)?;
        if let (Some(weighed), Some(evidence)) = (&weighed, &evidence) {
            weighed.pairs.put(block, &done.pairs)?;
            weighed.ups.put(block, &done.ups)?;
            weighed.seams.put(block, &done.seams)?;
            let normal = |t: &Triangle| evidence.normal(*t).map(|x| (x as f32).to_bits());
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
        relations: exchange.deliver(workspace, count)?,
        weighed,
        crossing: border,
        labels,
        mobius,
        triangles,
    })
}

impl Oriented {
    /// The interior triangles of a block, `[i, j, k, label << 1 | flip]`, without those that are cut where
    /// labels run against each other; and how many these are.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn inside(&self, block: usize) -> Result<(Vec<[u32; 4]>, u64)> {
        let mut interior = self.interior.get(block)?;
        let Some(seams) = &self.seams else {
            return Ok((interior, 0));
        };
        let (first, globals) = self.globals[block];
        // Labels at seams are global.
        let turned = |r: &[u32; 4]| {
            let label = r[3] >> 1;
            debug_assert!(label < globals, "a seam at a label of the block alone");
            self.sets.look(first + label).1 ^ (r[3] & 1 == 1)
        };
        let mut gone = 0;
        let mut cut = vec![false; interior.len()];
        for [a, b] in seams.get(block)? {
            let (a, b, flip) = (a as usize, (b >> 1) as usize, b & 1 == 1);
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

/// Bytes that so many global labels take.
fn label_bytes(labels: usize) -> u64 {
    labels as u64 * 16 + 1024
}

impl OrientedInside {
    /// The second half of [`orient_inside`]: the crossing triangles, ascending, without those in
    /// `removed`, `[block, i, j, k]` by the block of their smallest vertex.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
    /// [`crate::Error::Cancelled`].
    pub fn join(
        self,
        name: &str,
        removed: &Sections<4>,
        blocks: Blocks,
        workspace: &Workspace,
    ) -> Result<Oriented> {
        let mut globals = Vec::with_capacity(self.labels.len());
        let mut next = 0u32;
        for (global, _) in &self.labels {
            globals.push((next, *global));
            next += global;
        }
        let held = workspace.reserve("labels", label_bytes(next as usize))?;
        let mut surface = Oriented {
            interior: self.interior,
            crossing: Sections::create(workspace, &format!("{name}.none"), 0)?,
            globals,
            labels: self.labels.into_iter().map(|(_, all)| all).collect(),
            sets: ParitySets::new(next as usize),
            crosses: vec![false; next as usize],
            seams: None,
            mobius: self.mobius,
            triangles: self.triangles,
            _held: held,
        };
        let present = |block: usize, t: &Triangle, removed: &[[u32; 4]]| {
            removed
                .binary_search(&[block as u32, t[0], t[1], t[2]])
                .is_err()
        };
        if let Some(weighed) = &self.weighed {
            let border = |block: usize| {
                let (triangles, removed) = (self.crossing.get(block)?, removed.get(block)?);
                let normals = weighed.normals.get(block)?;
                let with_normals = triangles.into_iter().zip(normals);
                let with_normals = with_normals
                    .map(|(t, normal)| (t, normal.map(|x| f64::from(f32::from_bits(x)))));
                Ok(with_normals
                    .filter(|(t, _)| present(block, t, &removed))
                    .collect())
            };
            settle(
                &mut surface,
                border,
                &self.relations,
                weighed,
                blocks,
                workspace,
            )?;
        }
        let border = |block: usize| {
            let mut triangles = self.crossing.get(block)?;
            let removed = removed.get(block)?;
            triangles.retain(|t| present(block, t, &removed));
            Ok(triangles)
        };
        orient_crossing(
            &mut surface,
            name,
            border,
            &self.relations,
            blocks,
            workspace,
        )?;
        // Not before: what is dropped while a step is at work may be gone when it is done again.
        surface.seams = self.weighed.map(|weighed| weighed.seams);
        Ok(surface)
    }
}

pub(super) struct OrientedBlock {
    interior: Vec<[u32; 4]>,
    /// `[owner block, i, j, k, this block, label << 1 | flip, weight]`: what an interior triangle of
    /// this block asks of the crossing triangle `i, j, k`.
    relations: Vec<[u32; 7]>,
    pairs: Vec<[u32; 4]>,
    ups: Vec<[u32; 3]>,
    seams: Vec<[u32; 2]>,
    /// Number of labels that occur in relations or pairs; they come first.
    global: u32,
    labels: u32,
    mobius: u64,
    _held: Holding,
}

/// What the triangles adjacent to one ask for: their label, and if the triangle must be turned
/// against it. At most two at each edge.
#[derive(Debug, Default)]
pub struct Asks {
    list: [(u32, bool); 6],
    len: usize,
}

impl Asks {
    /// Adds one.
    pub fn push(&mut self, ask: (u32, bool)) {
        // A third triangle at an edge would be no surface; it is not looked at.
        if self.len < 6 {
            self.list[self.len] = ask;
            self.len += 1;
        }
    }

    /// All of them in order.
    #[must_use]
    pub fn all(&self) -> &[(u32, bool)] {
        &self.list[..self.len]
    }
}

fn orient_block(
    inner: &[Triangle],
    crossing: &[Triangle],
    evidence: Option<&Evidence>,
    blocks: Blocks,
    block: usize,
) -> OrientedBlock {
    if let Some(evidence) = evidence {
        return weigh_block(inner, crossing, evidence, blocks, block);
    }
    let ids = blocks.ids(block);
    let mut edges = Edges::with_room(ids.clone(), inner);
    let mut sets = ParitySets::new(inner.len());
    let mut kept = Vec::with_capacity(inner.len());
    let (_held, mut mobius) = (hold(8 * inner.len() as u64), 0);
    for (number, &t) in inner.iter().enumerate() {
        let number = number as u32;
        // Either all adjacent triangles agree and are joined, or the triangle goes.
        let mut asks = Asks::default();
        adjacent(t, &edges, inner, &ids, |other, flip| {
            asks.push((other, flip))
        });
        if !consistent(&mut sets, asks.all()) {
            mobius += 1;
            continue;
        }
        for &(other, flip) in asks.all() {
            sets.join(other, number, flip);
        }
        edges.add(t, number);
        kept.push(number);
    }
    let mut bonds = Bonds::default();
    for &c in crossing {
        adjacent(c, &edges, inner, &ids, |other, flip| {
            bonds.first.push(other);
            bonds.relations.push((c, other, flip, 1));
        });
    }
    number_labels(inner, &kept, bonds, &mut sets, blocks, block, mobius)
}

/// What speaks for how the sets of a block run.
#[derive(Default)]
pub(super) struct Bonds {
    /// A triangle of each set that the rest of the cloud may be connected with, in the order of labels.
    pub first: Vec<u32>,
    /// A crossing triangle, an interior one at an edge of it, whether one must be turned against the
    /// other, and the weight of that.
    pub relations: Vec<(Triangle, u32, bool, i64)>,
    /// A triangle of each of two sets, and the sum of weights for running alike.
    pub pairs: Vec<(u32, u32, i64)>,
    /// A triangle of a set, and the evidence that the set faces up as this triangle runs.
    pub ups: Vec<(u32, i64)>,
    /// Edges between sets.
    pub seams: Vec<Joint>,
}

/// Gives labels to the sets: first those that the rest of the cloud may be connected with.
pub(super) fn number_labels(
    inner: &[Triangle],
    kept: &[u32],
    bonds: Bonds,
    sets: &mut ParitySets,
    blocks: Blocks,
    block: usize,
    mobius: u64,
) -> OrientedBlock {
    const NONE: u32 = u32::MAX;
    let mut label_of = vec![NONE; inner.len()];
    let mut labels = 0;
    let mut find = |triangle: u32| {
        let (root, turned) = sets.find(triangle);
        let label = &mut label_of[root as usize];
        if *label == NONE {
            *label = labels;
            labels += 1;
        }
        (*label, turned, labels)
    };
    let mut global = 0;
    for triangle in bonds.first {
        global = find(triangle).2;
    }
    let mut sent = Vec::with_capacity(bonds.relations.len());
    for (c, other, flip, weight) in bonds.relations {
        let (label, turned, _) = find(other);
        let word = label << 1 | u32::from(flip ^ turned);
        let owner = blocks.of(c[0]);
        sent.push([owner, c[0], c[1], c[2], block as u32, word, weight as u32]);
    }
    let mut pairs = Vec::with_capacity(bonds.pairs.len());
    for (a, b, sum) in bonds.pairs {
        let ((a, turned_a, _), (b, turned_b, _)) = (find(a), find(b));
        let sum = if turned_a ^ turned_b { -sum } else { sum };
        pairs.push([a, b, sum as u32, (sum >> 32) as u32]);
    }
    let mut ups = Vec::with_capacity(bonds.ups.len());
    for (a, up) in bonds.ups {
        let (label, turned, _) = find(a);
        if label < global {
            let up = if turned { -up } else { up };
            ups.push([label, up as u32, (up >> 32) as u32]);
        }
    }
    let mut interior = Vec::with_capacity(kept.len());
    for &number in kept {
        let (label, turned, _) = find(number);
        let t = inner[number as usize];
        interior.push([t[0], t[1], t[2], label << 1 | u32::from(turned)]);
    }
    let place = |n: u32| kept.partition_point(|k| *k < n) as u32;
    let seam = |j: &Joint| [place(j.a), place(j.b) << 1 | u32::from(j.flip)];
    let seams: Vec<_> = bonds.seams.iter().map(seam).collect();
    let held = bytes_of(&interior) + bytes_of(&sent) + bytes_of(&pairs) + bytes_of(&seams);
    OrientedBlock {
        _held: hold(held),
        interior,
        relations: sent,
        pairs,
        ups,
        seams,
        global,
        labels,
        mobius,
    }
}

/// Calls `each` with the triangles that share an edge inside the block with `t`, and whether `t`
/// must be turned against them.
pub(super) fn adjacent(
    t: Triangle,
    edges: &Edges,
    triangles: &[Triangle],
    ids: &std::ops::Range<u32>,
    mut each: impl FnMut(u32, bool),
) {
    for (a, b, ..) in EDGES {
        let (low, high) = (t[a], t[b]);
        if ids.contains(&high) {
            for n in edges.at(low, high) {
                each(n, opposed(t, triangles[n as usize], low, high));
            }
        }
    }
}

/// True if no two of `asks`, taken together with what is joined already, contradict each other.
#[must_use]
pub fn consistent(sets: &mut ParitySets, asks: &[(u32, bool)]) -> bool {
    asks.iter().enumerate().all(|(x, &(a, flip_a))| {
        asks[..x].iter().all(|&(b, flip_b)| {
            sets.relation(a, b)
                .is_none_or(|turned| turned == (flip_a ^ flip_b))
        })
    })
}

/// The crossing triangles in ascending order, each against those before it.
fn orient_crossing(
    base: &mut Oriented,
    name: &str,
    border: impl Fn(usize) -> Result<Vec<Triangle>>,
    relations: &Sections<7>,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<()> {
    let exchange = Exchange::<5>::new(workspace, &format!("{name}.crossing"), EXCHANGE_BUFFER)?
        .packed(SENT_LABELLED);
    let mut edges = Border::new(workspace)?;
    for group in 0..blocks.count() {
        workspace.check_cancel()?;
        let relations = relations.get(group)?;
        let mut sent = Vec::new();
        let triangles = border(group)?;
        edges.make_room(triangles.len())?;
        for t in triangles {
            let Some(word) = orient_one(base, t, &relations, group as u32, &edges) else {
                base.mobius += 1;
                continue;
            };
            base.triangles += 1;
            edges.put(t, word, [0.0; 3]);
            sent.push([blocks.of(t[0]), t[0], t[1], t[2], word]);
            sent.extend(blocks.visited(t).map(|b| [b, t[0], t[1], t[2], word]));
        }
        exchange.send(&sent)?;
        edges.end(group, blocks);
    }
    base.crossing = exchange.deliver(workspace, blocks.count())?;
    base.sets.flatten();
    // Crossing marks were set on labels; what counts is the set.
    for label in 0..base.sets.len() as u32 {
        if base.crosses[label as usize] {
            let (root, _) = base.sets.find(label);
            base.crosses[root as usize] = true;
        }
    }
    Ok(())
}

/// Joins one crossing triangle; its label and flip, or `None` if it closes a Möbius band.
fn orient_one(
    base: &mut Oriented,
    t: Triangle,
    relations: &[[u32; 7]],
    group: u32,
    edges: &Border,
) -> Option<u32> {
    let key = [group, t[0], t[1], t[2]];
    let start = relations.partition_point(|r| r[..4] < key[..]);
    let mut asks: Vec<(u32, bool)> = relations[start..]
        .iter()
        .take_while(|r| r[..4] == key[..])
        .map(|r| (base.globals[r[4] as usize].0 + (r[5] >> 1), r[5] & 1 == 1))
        .collect();
    asks.extend(edges.asks(t));
    if !consistent(&mut base.sets, &asks) {
        return None;
    }
    let (label, flip) = match asks.first() {
        Some(&first) => first,
        None => {
            base.crosses.push(false);
            (base.sets.push(), false)
        }
    };
    for &(other, turned) in &asks {
        base.sets.join(label, other, flip ^ turned);
    }
    base.crosses[label as usize] = true;
    Some(label << 1 | u32::from(flip))
}
