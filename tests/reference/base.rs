//! Section 1.4: the base, from the triples that all three cells see.

use super::surface::{Surface, Triangle, fans};
use std::collections::BTreeSet;

/// What became of the T3.
pub struct Base {
    pub surface: Surface,
    /// Flagged by one of their vertices: candidates of 1.5.
    pub flagged: BTreeSet<Triangle>,
    /// They would close a Möbius band: gone for good.
    pub one_sided: BTreeSet<Triangle>,
}

/// The triangles at `v`, among the given ones, that `v` flags.
fn flagged_at(v: u32, triangles: &BTreeSet<Triangle>) -> BTreeSet<Triangle> {
    let degree = |node: u32| triangles.iter().filter(|t| t.contains(&node)).count();
    let crowded = |t: &&Triangle| t.iter().any(|&node| node != v && degree(node) >= 3);
    let mut flagged: BTreeSet<Triangle> = triangles.iter().filter(crowded).copied().collect();

    let rest: BTreeSet<Triangle> = triangles.difference(&flagged).copied().collect();
    let fans = fans(v, &rest);
    // Fans come in order of their smallest triangles.
    let kept = fans.iter().position(|fan| fan.closed);
    if let (Some(kept), true) = (kept, fans.len() > 1) {
        for (which, fan) in fans.iter().enumerate() {
            if which != kept {
                flagged.extend(&fan.triangles);
            }
        }
    }
    flagged
}

/// True if all vertices of `t` are in one block.
pub fn is_interior(t: Triangle, block: u32) -> bool {
    t[0] / block == t[2] / block
}

pub fn base(t3: &BTreeSet<Triangle>, block: u32) -> Base {
    let all = Surface::of(t3.iter().copied());
    let mut flagged = BTreeSet::new();
    for v in all.vertices() {
        flagged.extend(flagged_at(v, &all.at_vertex(v)));
    }
    let kept: Vec<Triangle> = t3.difference(&flagged).copied().collect();
    let (surface, one_sided) = without_moebius_bands(&kept, block);
    Base {
        surface,
        flagged,
        one_sided,
    }
}

/// Adds triangles one after the other and leaves out those that make the surface one-sided.
fn without_moebius_bands(kept: &[Triangle], block: u32) -> (Surface, BTreeSet<Triangle>) {
    let whole = Surface::of(kept.iter().copied());
    if whole.components().is_some() {
        // If the whole can be oriented, every part of it can.
        return (whole, BTreeSet::new());
    }
    let mut order = kept.to_vec();
    order.sort_by_key(|&t| (!is_interior(t, block), t));
    let mut surface = Surface::default();
    let mut one_sided = BTreeSet::new();
    for t in order {
        surface.insert(t);
        if surface.component(t).is_none() {
            surface.remove(t);
            one_sided.insert(t);
        }
    }
    (surface, one_sided)
}
