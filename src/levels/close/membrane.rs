//! A loop closed smoothly: its lid, refined and faired from coarse to fine.

use super::fair::{Ring, fair};
use super::lid::{Loop, Patch, lid};
use super::refine::Net;
use crate::meet::norm;
use outcrop_geom::vector::{cross, sub};

/// Longest loop that is closed smoothly: the time grows with the square of the length.
pub(super) const LONGEST: usize = 1 << 13;

/// Most vertices with the spacing of the rim everywhere; with more, triangles grow towards the middle.
const FINE: f64 = 20_000.0;

/// How spacings grow then, from triangle to triangle.
const GROWTH: f64 = 1.3;

/// Most new vertices of a loop.
pub(super) const MOST: usize = 1 << 16;

/// How often the patch is refined, flipped and faired as it lies: its triangles then have the shapes by which its
/// curvature is measured.
const AGAIN: usize = 3;

/// Largest number of new vertices as a multiple of those of a flat patch: half a sphere has twice the area.
const BULGE: f64 = 3.0;

/// Rounds of conjugate gradients after each refinement, and after the last: more move no vertex by a hundredth of its
/// spacing.
const ROUNDS: usize = 150;
const LAST: usize = 600;

/// Closes a loop by a thin plate that runs on from the triangles around it.
pub(super) fn membrane(around: &Loop, ring: &Ring) -> Patch {
    let patch = lid(around);
    let n = around.len();
    let lengths: f64 = (0..n)
        .map(|k| norm(sub(around.points[(k + 1) % n], around.points[k])))
        .sum();
    let spacing = lengths / n as f64;
    let corner = |v: u32| match (v as usize).checked_sub(n) {
        None => around.points[v as usize],
        Some(new) => patch.new[new],
    };
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(corner);
        norm(cross(sub(b, a), sub(c, a))) / 2.0
    };
    let all: f64 = patch.triangles.iter().map(area).sum();
    // Two equilateral triangles for each vertex.
    let wanted = all / (0.866 * spacing * spacing);
    let growth = if wanted > FINE { GROWTH } else { 1.0 };
    let mut net = Net::of(around, patch, growth);
    net.relax();
    while net.split(n + MOST) {
        net.relax();
        faired(&mut net, ring, ROUNDS);
    }
    net.on_lid = false;
    let most = n + (BULGE * wanted).min(MOST as f64) as usize;
    for _ in 0..AGAIN {
        net.split(most);
        net.relax();
        faired(&mut net, ring, LAST);
    }
    net.finish()
}

fn faired(net: &mut Net<'_>, ring: &Ring, rounds: usize) {
    let Net {
        around,
        points,
        triangles,
        ..
    } = net;
    fair(around, ring, points, triangles, rounds);
}
