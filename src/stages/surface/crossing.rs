//! The orientation of the crossing triangles, which joins the labels of blocks.

use super::crossing_edges::CrossingEdges;
use super::orient::{Oriented, OrientedInside, label_bytes};
use super::parity::{OrientationConstraint, ParitySets, word};
use super::rows::{LabelledTo, Relation, TriangleTo, interior_constraints};
use super::settle::settle;
use super::star::Triangle;
use crate::error::Result;
use crate::spill::{Shuffle, Table};
use crate::stages::blocks::Blocks;
use crate::workspace::Workspace;

const SHUFFLE_BUFFER: u64 = 8 << 20;

impl OrientedInside {
    /// The second half of [`orient_inside`]: the crossing triangles, ascending, without those in
    /// `removed`, by the block of their smallest vertex.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
    /// [`crate::Error::Cancelled`].
    pub fn join(
        self,
        name: &str,
        removed: &Table<TriangleTo>,
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
            crossing: Table::create(workspace, &format!("{name}.none"), 0)?,
            globals,
            labels: self.labels.into_iter().map(|(_, all)| all).collect(),
            sets: ParitySets::new(next as usize),
            crosses: vec![false; next as usize],
            seams: None,
            mobius: self.mobius,
            triangles: self.triangles,
            _held: held,
        };
        let crossing = |block: usize| {
            let mut triangles: Vec<Triangle> = bytemuck::cast_vec(self.crossing.get(block)?);
            let removed = removed.get(block)?;
            triangles.retain(|t| is_present(block, t, &removed));
            Ok(triangles)
        };
        if let Some(weighed) = &self.weighed {
            let with_normals = |block: usize| {
                let (triangles, removed) = (self.crossing.get(block)?, removed.get(block)?);
                let normals = weighed.normals.get(block)?.into_iter();
                let normals = normals.map(|n| n.normal.map(f64::from));
                let all = triangles.into_iter().map(|t| t.triangle).zip(normals);
                Ok(all
                    .filter(|(t, _)| is_present(block, t, &removed))
                    .collect())
            };
            let relations = &self.relations;
            settle(
                &mut surface,
                with_normals,
                relations,
                weighed,
                blocks,
                workspace,
            )?;
        }
        let relations = &self.relations;
        orient_crossing(&mut surface, name, crossing, relations, blocks, workspace)?;
        // Not before: what is dropped while a step is at work may be gone when it is done again.
        surface.seams = self.weighed.map(|weighed| weighed.seams);
        Ok(surface)
    }
}

/// True if a triangle is not among those removed from a block, ascending.
fn is_present(block: usize, t: &Triangle, removed: &[TriangleTo]) -> bool {
    let (to, triangle) = (block as u32, *t);
    let key = TriangleTo { to, triangle };
    removed.binary_search(&key).is_err()
}

/// The crossing triangles in ascending order, each against those before it.
fn orient_crossing(
    base: &mut Oriented,
    name: &str,
    crossing: impl Fn(usize) -> Result<Vec<Triangle>>,
    relations: &Table<Relation>,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<()> {
    let shuffle = Shuffle::new(workspace, &format!("{name}.crossing"), SHUFFLE_BUFFER)?;
    let mut edges = CrossingEdges::new(workspace)?;
    for group in 0..blocks.count() {
        workspace.check_cancel()?;
        let relations = relations.get(group)?;
        let mut sent = Vec::new();
        let triangles = crossing(group)?;
        edges.make_room(triangles.len())?;
        for t in triangles {
            let Some(word) = orient_one(base, t, &relations, group, &edges) else {
                base.mobius += 1;
                continue;
            };
            base.triangles += 1;
            edges.put(t, word, [0.0; 3]);
            let to = |to| LabelledTo {
                to,
                triangle: t,
                label_flip: word,
            };
            sent.push(to(blocks.of(t[0])));
            sent.extend(blocks.visited(t).map(to));
        }
        shuffle.send(&sent)?;
        edges.end(group, blocks);
    }
    base.crossing = shuffle.deliver(workspace, blocks.count())?;
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
    relations: &[Relation],
    group: usize,
    edges: &CrossingEdges,
) -> Option<u32> {
    let interior = interior_constraints(&base.globals, relations, group, t);
    let mut constraints: Vec<OrientationConstraint> =
        interior.map(|(constraint, _)| constraint).collect();
    constraints.extend(edges.adjacent(t).map(|(constraint, ..)| constraint));
    if !base.sets.merge(&constraints) {
        return None;
    }
    let (label, flip) = match constraints.first() {
        Some(&first) => first,
        None => {
            base.crosses.push(false);
            (base.sets.push(), false)
        }
    };
    base.crosses[label as usize] = true;
    Some(word((label, flip)))
}
