//! Patches: small flat parts of a block, the nodes that its orientation is decided between.

use super::evidence::{Evidence, FLAT, cosine, weight};
use super::parity::ParitySets;
use super::sides::{NONE, across, parts};
use super::star::{EDGES, Triangle, opposed};
use crate::workspace::memory::{Holding, bytes_of, hold};
use std::ops::Range;

/// An edge between two triangles inside a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Joint {
    /// The earlier triangle.
    pub a: u32,
    /// The later one.
    pub b: u32,
    /// One of the two must be turned for both to run alike.
    pub flip: bool,
    /// Of the edge, see [`weight`].
    pub weight: u8,
}

/// The triangles of a block by patches.
#[derive(Debug)]
pub struct Patches {
    /// The triangles that are joined, with their orientation relative to each other.
    pub sets: ParitySets,
    /// The patch of each triangle.
    pub of: Vec<u32>,
    /// For each patch its smallest triangle, which its orientation is relative to, and the number of
    /// triangles.
    pub roots: Vec<(u32, u32)>,
    /// Edges between patches, and those in a patch whose triangles run against each other, by
    /// ascending triangles.
    pub joints: Vec<Joint>,
    _held: Holding,
}

impl Patches {
    /// Joins the `triangles` of the block of `ids`, all inside it, ascending, across their flat edges if
    /// their smallest ids share a run of `patch` ids.
    #[must_use]
    pub fn of(ids: Range<u32>, triangles: &[Triangle], evidence: &Evidence, patch: u32) -> Self {
        let across = across(ids, triangles);
        let normals: Vec<_> = triangles.iter().map(|t| evidence.normal(*t)).collect();
        let mut held = hold(bytes_of(&across) + bytes_of(&normals) + 8 * triangles.len() as u64);
        let mut sets = ParitySets::new(triangles.len());
        let mut joints = Vec::new();
        for (n, t) in triangles.iter().enumerate() {
            for (a, b, opposite, _) in EDGES {
                let (m, _) = parts(across[n][opposite]);
                if across[n][opposite] == NONE || m < n {
                    continue;
                }
                let other = triangles[m];
                let flip = opposed(*t, other, t[a], t[b]);
                let cosine = cosine(normals[n], normals[m], flip);
                let near = t[0] / patch == other[0] / patch;
                if !(near && cosine > FLAT && join(&mut sets, n as u32, m as u32, flip)) {
                    joints.push(Joint {
                        a: n as u32,
                        b: m as u32,
                        flip,
                        weight: weight(cosine) as u8,
                    });
                }
            }
        }
        drop((across, normals));
        let (of, roots) = number(&mut sets);
        joints.retain(|j| sets.relation(j.a, j.b) != Some(j.flip));
        held.set(bytes_of(&joints) + bytes_of(&of) + bytes_of(&roots) + 4 * of.len() as u64);
        Self {
            sets,
            of,
            roots,
            joints,
            _held: held,
        }
    }
}

/// Joins two triangles if that contradicts no join before. The smallest triangle of a set is its root:
/// the set runs as that one does.
fn join(sets: &mut ParitySets, a: u32, b: u32, flip: bool) -> bool {
    if sets.find(b).0 < sets.find(a).0 {
        sets.join(b, a, flip)
    } else {
        sets.join(a, b, flip)
    }
}

/// Numbers sets in the order of their first triangles.
fn number(sets: &mut ParitySets) -> (Vec<u32>, Vec<(u32, u32)>) {
    let mut number = vec![NONE; sets.len()];
    let mut of = Vec::with_capacity(sets.len());
    let mut roots: Vec<(u32, u32)> = Vec::new();
    for triangle in 0..sets.len() as u32 {
        let (root, _) = sets.find(triangle);
        let number = &mut number[root as usize];
        if *number == NONE {
            *number = roots.len() as u32;
            roots.push((root, 0));
        }
        roots[*number as usize].1 += 1;
        of.push(*number);
    }
    (of, roots)
}

#[cfg(test)]
pub(super) mod tests;
