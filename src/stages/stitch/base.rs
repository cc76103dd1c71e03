//! The base: T3 triangles without non-manifold edges and vertices by excess (paper, section 3.5,
//! first part).

use crate::error::Result;
use crate::spill::layouts::SENT;
use crate::spill::{Exchange, Sections};
use crate::stages::blocks::Blocks;
use crate::stages::surface::star::{Link, Star, Triangle, has, others};
use crate::stages::triples::Triples;
use crate::workspace::Workspace;

const EXCHANGE_BUFFER: u64 = 8 << 20;

/// T3 triples that touch a block: its own and those of lower blocks, ascending.
fn t3_around(triples: &Triples, block: usize) -> Result<Vec<Triangle>> {
    let own = triples.own.get(block)?;
    let visiting = triples.visiting.get(block)?;
    let visiting = visiting
        .iter()
        .filter(|r| r[4] == 3)
        .map(|r| [r[1], r[2], r[3]]);
    // Visitors have their smallest vertex in a lower block, so they come first.
    Ok(visiting
        .chain(own.iter().filter(|r| r[3] == 3).map(|r| [r[0], r[1], r[2]]))
        .collect())
}

/// Bytes that working on a block takes.
pub(super) fn block_bytes(triples: &Triples, block: usize) -> u64 {
    90 * (triples.own.records(block) + triples.visiting.records(block)) as u64 + (2 << 20)
}

/// Lets every vertex flag the T3 triangles that it refuses; `[block, i, j, k]` for each block that
/// the triangle touches. Also counts the flagged triangles.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn flag(triples: &Triples, blocks: Blocks, workspace: &Workspace) -> Result<Sections<4>> {
    let _held = workspace.reserve("stitch: exchange", EXCHANGE_BUFFER)?;
    let exchange = Exchange::new(workspace, "stitch.flags", EXCHANGE_BUFFER).packed(SENT);
    let bytes = |block| block_bytes(triples, block);
    workspace.for_each_unit("stitch: block", blocks.count(), bytes, |block| {
        let triangles = t3_around(triples, block)?;
        let star = Star::of(blocks.ids(block), &triangles);
        let mut flagged = Vec::new();
        let mut link = Link::default();
        for v in star.ids() {
            refused(v, &star, &triangles, &mut link, &mut flagged);
        }
        flagged.sort_unstable();
        flagged.dedup();
        let mut sent = Vec::new();
        for number in flagged {
            let t = triangles[number as usize];
            sent.push([blocks.of(t[0]), t[0], t[1], t[2]]);
            sent.extend(blocks.visited(t).map(|b| [b, t[0], t[1], t[2]]));
        }
        exchange.send(&sent)?;
        workspace.observer.advance(1);
        Ok(())
    })?;
    // Several blocks may flag a crossing triangle.
    exchange.deliver_unique(workspace, blocks.count())
}

/// The triangles around `v` that it flags: at edges with more than two, and beside a closed fan.
fn refused(v: u32, star: &Star, triangles: &[Triangle], link: &mut Link, flagged: &mut Vec<u32>) {
    let around = star.at(v);
    let degree = |node: u32| {
        around
            .iter()
            .filter(|&&n| has(triangles[n as usize], node))
            .count()
    };
    let crowded = |n: u32| {
        others(triangles[n as usize], v)
            .into_iter()
            .any(|node| degree(node) > 2)
    };
    let any_crowded = around.len() > 2 && around.iter().any(|&n| crowded(n));
    let kept: Vec<u32> = if any_crowded {
        flagged.extend(around.iter().copied().filter(|&n| crowded(n)));
        around.iter().copied().filter(|&n| !crowded(n)).collect()
    } else {
        around.to_vec()
    };
    link.set(v, kept.iter().map(|&n| triangles[n as usize]));
    if link.groups() < 2 {
        return;
    }
    // Triangles are numbered ascending, so the first in a cycle is the smallest in any cycle.
    let Some(first) = (0..kept.len()).find(|&i| link.is_closed(link.group(i))) else {
        return;
    };
    let keep = link.group(first);
    flagged.extend(
        (0..kept.len())
            .filter(|&i| link.group(i) != keep)
            .map(|i| kept[i]),
    );
}

/// The base triangles that touch a block: crossing ones of lower blocks first, then its own.
pub(super) fn base_around(
    triples: &Triples,
    flags: &Sections<4>,
    block: usize,
) -> Result<Vec<Triangle>> {
    let mut triangles = t3_around(triples, block)?;
    let flags = flags.get(block)?;
    if !flags.is_empty() {
        triangles.retain(|t| {
            flags
                .binary_search(&[block as u32, t[0], t[1], t[2]])
                .is_err()
        });
    }
    Ok(triangles)
}
