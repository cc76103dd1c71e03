//! A loop closed smoothly: its lid, refined and faired from coarse to fine.

use super::fair::{Ring, fair};
use super::lid::{Loop, Patch, lid, norm};
use super::refine::Net;
use outcrop_geom::vector::{cross, sub};

/// Longest loop that is closed smoothly: the time grows with the square of the length.
pub(super) const LONGEST: usize = 1 << 13;

/// Most vertices with the spacing of the rim everywhere; with more, triangles grow towards the middle.
const FINE: f64 = 20_000.0;

/// How spacings grow then, from triangle to triangle.
const GROWTH: f64 = 1.3;

/// Most new vertices of a loop.
pub(super) const MOST: usize = 1 << 16;

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
    loop {
        let split = net.split(n + MOST);
        net.relax();
        let rounds = if split { ROUNDS } else { LAST };
        let Net {
            points, triangles, ..
        } = &mut net;
        fair(around, ring, points, triangles, rounds);
        if !split {
            break;
        }
    }
    net.relax();
    let Net {
        points, triangles, ..
    } = &mut net;
    fair(around, ring, points, triangles, LAST);
    net.finish()
}
