//! The disk: a regular decagon, before any bisector clips it.

use super::Link;
use crate::kernels::{CornerGroup, LANES, SLACK};

/// Number of corners of the disk.
pub(super) const RIM_CORNERS: usize = 10;

/// Unit normals of the disk's sides, at odd multiples of 18 degrees, and their distance from the centre, cos
/// 18°, for a disk of radius 1. They are literals, so that no library function affects the result.
pub(super) const RIM_SIDES: [[f64; 2]; RIM_CORNERS] = [
    [0.951_056_516_295_153_5, 0.309_016_994_374_947_45],
    [0.587_785_252_292_473_1, 0.809_016_994_374_947_5],
    [0.0, 1.0],
    [-0.587_785_252_292_473_1, 0.809_016_994_374_947_5],
    [-0.951_056_516_295_153_5, 0.309_016_994_374_947_45],
    [-0.951_056_516_295_153_5, -0.309_016_994_374_947_45],
    [-0.587_785_252_292_473_1, -0.809_016_994_374_947_5],
    [0.0, -1.0],
    [0.587_785_252_292_473_1, -0.809_016_994_374_947_5],
    [0.951_056_516_295_153_5, -0.309_016_994_374_947_45],
];
pub(super) const RIM_DISTANCE: f64 = 0.951_056_516_295_153_5;

/// Initial number of places for corners.
pub(super) const RIM_PLACES: usize = RIM_CORNERS.next_multiple_of(LANES);

/// The disk of radius 1.
pub(super) struct Rim {
    pub corners: [CornerGroup; RIM_PLACES / LANES],
    pub links: [Link; RIM_PLACES],
}

pub(super) static RIM: Rim = rim();

/// Corner `k` is between sides `k` and `k + 1`, halfway between their normals.
const fn rim() -> Rim {
    const NONE: [f64; LANES] = [0.0; LANES];
    let group = CornerGroup {
        x: NONE,
        y: NONE,
        error: NONE,
        reach2: NONE,
    };
    let link = Link {
        next: 0,
        before: 0,
        side: 0,
    };
    let mut rim = Rim {
        corners: [group; RIM_PLACES / LANES],
        links: [link; RIM_PLACES],
    };
    let half = 0.5 / RIM_DISTANCE;
    let mut k = 0;
    while k < RIM_CORNERS {
        let next = (k + 1) % RIM_CORNERS;
        let group = &mut rim.corners[k / LANES];
        group.x[k % LANES] = half * (RIM_SIDES[k][0] + RIM_SIDES[next][0]);
        group.y[k % LANES] = half * (RIM_SIDES[k][1] + RIM_SIDES[next][1]);
        group.error[k % LANES] = 4.0 * SLACK;
        group.reach2[k % LANES] = 1.0 + 16.0 * SLACK;
        rim.links[k] = Link {
            next: next as u32,
            before: ((k + RIM_CORNERS - 1) % RIM_CORNERS) as u32,
            side: k as u32,
        };
        k += 1;
    }
    rim
}
