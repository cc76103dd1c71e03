//! Section 6: the base, from the triples with count three.

use super::evidence::{self, Known};
use super::homes::Side;
use super::outside::Known as Out;
use super::surface::{Surface, Triangle, fans};
use super::{Settings, Weighing};
use outcrop_geom::Point;
use std::collections::{BTreeMap, BTreeSet};

/// The T3 after the orientation.
pub struct Base {
    pub surface: Surface,
    /// Flagged by one of their vertices: candidates in section 7.
    pub flagged: BTreeSet<Triangle>,
    /// Removed because they would close a Möbius band.
    pub one_sided: BTreeSet<Triangle>,
    /// The component of each triangle, and its orientation in it.
    pub sides: BTreeMap<Triangle, Side>,
    /// For each component: it has a crossing triangle.
    pub global: Vec<bool>,
    /// Robust: counts of the orientation.
    pub met: Weighing,
}

/// The triangles at `v`, of the given ones, that `v` flags.
fn flagged_at(v: u32, triangles: &BTreeSet<Triangle>) -> BTreeSet<Triangle> {
    let degree = |node: u32| triangles.iter().filter(|t| t.contains(&node)).count();
    let crowded = |t: &&Triangle| t.iter().any(|&node| node != v && degree(node) >= 3);
    let mut flagged: BTreeSet<Triangle> = triangles.iter().filter(crowded).copied().collect();

    let rest: BTreeSet<Triangle> = triangles.difference(&flagged).copied().collect();
    let fans = fans(v, &rest);
    // Fans are in order of their smallest triangles.
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

/// By block, the triangles flagged by a vertex of it.
fn flagged_by(t3: &BTreeSet<Triangle>, block: u32) -> BTreeMap<u32, BTreeSet<Triangle>> {
    let all = Surface::of(t3.iter().copied());
    let mut flagged: BTreeMap<u32, BTreeSet<Triangle>> = BTreeMap::new();
    for v in all.vertices() {
        let by = flagged.entry(v / block).or_default();
        by.extend(flagged_at(v, &all.at_vertex(v)));
    }
    flagged
}

/// The base of the paper's method.
pub fn base(t3: &BTreeSet<Triangle>, block: u32) -> Base {
    let flagged: BTreeSet<Triangle> = flagged_by(t3, block).into_values().flatten().collect();
    let kept: Vec<Triangle> = t3.difference(&flagged).copied().collect();
    let (surface, one_sided) = without_moebius_bands(&kept, block);
    let components = surface.components().expect("the base is orientable");
    let mut global = Vec::new();
    let mut sides = BTreeMap::new();
    for (home, component) in components.iter().enumerate() {
        global.push(component.keys().any(|&t| !is_interior(t, block)));
        let side = |(&t, &turned)| (t, Side { home, turned });
        sides.extend(component.iter().map(side));
    }
    Base {
        surface,
        flagged,
        one_sided,
        sides,
        global,
        met: Weighing::default(),
    }
}

/// The base of the robust method. `open` are the T2 and T1.
pub fn weighed(
    points: &[Point],
    t3: &BTreeSet<Triangle>,
    open: &BTreeSet<Triangle>,
    out: &[Option<Out>],
    settings: &Settings,
) -> Base {
    let block = settings.block;
    let by = flagged_by(t3, block);
    let flagged: BTreeSet<Triangle> = by.values().flatten().copied().collect();
    let kept: BTreeSet<Triangle> = t3.difference(&flagged).copied().collect();
    let touches = |t: &Triangle, g: u32| t.iter().any(|v| v / block == g);
    let crossing: BTreeSet<Triangle> = t3
        .iter()
        .copied()
        .filter(|&t| !is_interior(t, block))
        .collect();
    let seen = |(&g, flags): (&u32, &BTreeSet<Triangle>)| {
        let here = crossing.difference(flags).copied();
        (g, here.filter(|t| touches(t, g)).collect())
    };
    let candidates = open.union(&flagged).copied();
    let weighed = evidence::orient(Known {
        points,
        settings,
        out,
        kept: &kept,
        seen: by.iter().map(seen).collect(),
        candidates: candidates.filter(|&t| is_interior(t, block)).collect(),
    });
    Base {
        surface: weighed.surface,
        flagged,
        one_sided: weighed.one_sided,
        sides: weighed.sides,
        global: weighed.global,
        met: weighed.met,
    }
}

/// Adds triangles in order and leaves out those that would make the surface non-orientable.
fn without_moebius_bands(kept: &[Triangle], block: u32) -> (Surface, BTreeSet<Triangle>) {
    let whole = Surface::of(kept.iter().copied());
    if whole.components().is_some() {
        // If the whole can be oriented, so can every part of it.
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
