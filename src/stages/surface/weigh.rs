//! Orientation by evidence: inside a block, and between blocks.

use super::border::Border;
use super::evidence::{Evidence, Votes, cosine, join_inside, weight};
use super::orient::{Bonds, Oriented, OrientedBlock, adjacent, number_labels};
use super::parity::ParitySets;
use super::star::{Edges, Triangle};
use crate::error::Result;
use crate::spill::Sections;
use crate::stages::blocks::Blocks;
use crate::workspace::Workspace;
use crate::workspace::memory::{bytes_of, hold};

/// Orients a block by what the evidence says; a triangle that would have to run both ways is removed.
pub(super) fn weigh_block(
    inner: &[Triangle],
    crossing: &[Triangle],
    evidence: &Evidence,
    blocks: Blocks,
    block: usize,
) -> OrientedBlock {
    let ids = blocks.ids(block);
    let mut edges = Edges::with_room(ids.clone(), inner);
    for (number, &t) in inner.iter().enumerate() {
        edges.add(t, number as u32);
    }
    let mut sets = ParitySets::new(inner.len());
    let mut held = hold(5 * inner.len() as u64);
    let dead = join_inside(ids.clone(), inner, evidence, &mut sets);
    let kept: Vec<u32> = (0..inner.len() as u32)
        .filter(|n| !dead[*n as usize])
        .collect();
    held.set(5 * inner.len() as u64 + bytes_of(&kept));
    let mut bonds = Bonds::default();
    for &c in crossing {
        let normal = evidence.normal(c);
        adjacent(c, &edges, inner, &ids, |other, flip| {
            if !dead[other as usize] {
                let cosine = cosine(normal, evidence.normal(inner[other as usize]), flip);
                bonds.relations.push((c, other, flip, weight(cosine)));
            }
        });
    }
    for &c in &evidence.candidates {
        let mut asks = [(0, false); 3];
        let mut count = 0;
        adjacent(c, &edges, inner, &ids, |other, flip| {
            if !dead[other as usize] && count < 3 {
                asks[count] = (other, flip);
                count += 1;
            }
        });
        for x in 1..count {
            for y in 0..x {
                let ((a, flip_a), (b, flip_b)) = (asks[x], asks[y]);
                if sets.find(a).0 != sets.find(b).0 {
                    let normal = evidence.normal(c);
                    let flat = |(other, flip): (u32, bool)| {
                        cosine(normal, evidence.normal(inner[other as usize]), flip)
                    };
                    let weight = weight(flat(asks[x]).min(flat(asks[y])));
                    bonds.votes.push((a, b, flip_a ^ flip_b, weight));
                }
            }
        }
    }
    let bonded = bytes_of(&bonds.relations) + bytes_of(&bonds.votes);
    held.set(5 * inner.len() as u64 + bytes_of(&kept) + bonded);
    let mobius = (inner.len() - kept.len()) as u64;
    number_labels(inner, &kept, bonds, &mut sets, blocks, block, mobius)
}

/// Joins the global labels by the votes of all crossing triangles and candidates.
pub(super) fn vote(
    surface: &mut Oriented,
    border: impl Fn(usize) -> Result<Vec<Triangle>>,
    relations: &Sections<7>,
    candidates: &Sections<3>,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<()> {
    let mut votes = Votes::default();
    let mut reserved = workspace.promise("votes", 0)?;
    for block in 0..blocks.count() {
        let first = surface.globals[block].0;
        for [a, b, count] in candidates.get(block)? {
            votes.add(first + a, first + b, false, i64::from(count as i32));
        }
        reserved.at_least(votes.bytes())?;
    }
    let mut edges = Border::new(workspace)?;
    for group in 0..blocks.count() {
        workspace.check_cancel()?;
        let relations = relations.get(group)?;
        let triangles = border(group)?;
        edges.make_room(triangles.len())?;
        for t in triangles {
            let key = [group as u32, t[0], t[1], t[2]];
            let start = relations.partition_point(|r| r[..4] < key[..]);
            let mut asks: Vec<(u32, bool, i64)> = relations[start..]
                .iter()
                .take_while(|r| r[..4] == key[..])
                .map(|r| {
                    let label = surface.globals[r[4] as usize].0 + (r[5] >> 1);
                    (label, r[5] & 1 == 1, CROSSING * i64::from(r[6]))
                })
                .collect();
            let crossing = edges.asks(t);
            asks.extend(crossing.map(|(label, flip)| (label, flip, CROSSING * weight(0.0))));
            // It runs as its strongest neighbour asks; the others are votes.
            let Some(&(label, flip, _)) = asks.iter().rev().max_by_key(|ask| ask.2) else {
                continue;
            };
            for &(other, turned, weight) in &asks {
                votes.add(label, other, flip ^ turned, weight);
            }
            edges.put(t, label << 1 | u32::from(flip));
        }
        edges.end(group, blocks);
        reserved.at_least(votes.bytes())?;
    }
    drop(edges);
    reserved.set_held(votes.bytes());
    votes.join(&mut surface.sets);
    Ok(())
}

/// A crossing triangle of the surface counts for so many candidates.
const CROSSING: i64 = 8;
