//! The orientation of the crossing triangles, which merges the labels of blocks.

use super::crossing_edges::CrossingEdges;
use super::orient::{OrientedInside, OrientedSurface, label_bytes};
use super::parity::{ParitySets, Turned, word};
use super::rows::{LabelledTo, Relation, TriangleTo, interior_constraints};
use super::settle::settle;
use super::star::Triangle;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Shuffle};
use outcrop_disk::workspace::Unit;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Block, GlobalLabel};

impl OrientedInside {
    /// The second part of `orient_inside`: orients the crossing triangles, ascending, given by the block of
    /// their smallest vertex, without those in `removed`.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
    /// [`outcrop_disk::error::Error::Cancelled`].
    pub fn join(
        &self,
        name: &str,
        removed: &Inbox<TriangleTo>,
        blocks: Blocks,
        unit: &Unit<'_>,
    ) -> Result<OrientedSurface> {
        let mut globals = Vec::with_capacity(self.labels.len());
        let mut next = 0u32;
        for (global, _) in &self.labels {
            globals.push((GlobalLabel::new(next), *global));
            next += global;
        }
        let _held = unit.reserve("labels", label_bytes(next as usize))?;
        let relations = self.relations.open(unit, blocks.count())?;
        let mut surface = OrientedSurface {
            interior: self.interior.clone(),
            sent: Shuffle::new(&format!("{name}.crossing")),
            globals,
            labels: self.labels.iter().map(|(_, all)| *all).collect(),
            sets: ParitySets::new(next as usize),
            crosses: vec![false; next as usize],
            seams: self.weighed.as_ref().map(|weighed| weighed.seams.clone()),
            mobius: self.mobius,
            triangles: self.triangles,
        };
        let crossing = |block: usize| {
            let mut triangles: Vec<Triangle> = bytemuck::cast_vec(self.crossing.get(unit, block)?);
            let removed = removed.get(unit, block)?;
            triangles.retain(|t| is_present(block, t, &removed));
            Ok(triangles)
        };
        if let Some(weighed) = &self.weighed {
            let crossing = |block: usize| {
                let triangles = self.crossing.get(unit, block)?;
                let removed = removed.get(unit, block)?;
                let normals = weighed.normals.get(unit, block)?.into_iter();
                let normals = normals.map(|n| n.normal.map(f64::from));
                let all = triangles.into_iter().map(|t| t.triangle).zip(normals);
                let present = all.filter(|(t, _)| is_present(block, t, &removed));
                Ok(present.collect())
            };
            settle(&mut surface, crossing, &relations, weighed, blocks, unit)?;
        }
        orient_crossing(&mut surface, crossing, &relations, blocks, unit)?;
        Ok(surface)
    }
}

/// True if a triangle is not in `removed`, the triangles removed from the block, ascending.
fn is_present(block: usize, t: &Triangle, removed: &[TriangleTo]) -> bool {
    let (to, triangle) = (Block::at(block), *t);
    let key = TriangleTo { to, triangle };
    removed.binary_search(&key).is_err()
}

/// Orients the crossing triangles in ascending order, each relative to those before it.
fn orient_crossing(
    base: &mut OrientedSurface,
    crossing: impl Fn(usize) -> Result<Vec<Triangle>>,
    relations: &Inbox<Relation>,
    blocks: Blocks,
    unit: &Unit<'_>,
) -> Result<()> {
    let mut edges = CrossingEdges::new(unit)?;
    for group in 0..blocks.count() {
        unit.check_cancel()?;
        let relations = relations.get(unit, group)?;
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
        base.sent.send(unit, group, sent)?;
        edges.end(group, blocks);
    }
    base.sets.flatten();
    // The marks were set on labels; they apply to whole sets.
    for label in 0..base.sets.len() {
        if base.crosses[label] {
            let (root, _) = base.sets.find(GlobalLabel::at(label));
            base.crosses[root.index()] = true;
        }
    }
    Ok(())
}

/// Orients one crossing triangle; returns its label and flip, or `None` if it closes a Möbius band.
fn orient_one(
    base: &mut OrientedSurface,
    t: Triangle,
    relations: &[Relation],
    group: usize,
    edges: &CrossingEdges,
) -> Option<Turned<GlobalLabel>> {
    let interior = interior_constraints(&base.globals, relations, group, t);
    let before = edges.adjacent(t).map(|(constraint, ..)| constraint);
    let constraints: Vec<_> = interior.map(|(c, _)| c).chain(before).collect();
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
    base.crosses[label.index()] = true;
    Some(word((label, flip)))
}
