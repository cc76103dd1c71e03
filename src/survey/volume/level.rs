//! The volumes between a surface and a level.

use super::components::rim;
use super::crop::Cutter;
use super::report::Earth;
use super::sums::{Layers, Scales, plan_area};
use crate::pieces::{Pass, Piece, Surface};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::{Workspace, lock};
use outcrop_geom::vector::V3;
use std::sync::Mutex;

/// Share of the area in plan up to which what faces up and what faces down are the same: those of a closed body
/// differ by rounding alone, below 2^-40.
const SAME: f64 = 1e-9;

/// Sums over triangles.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Found {
    pub layers: Layers,
    /// 0 if the surface has no boundary.
    pub rim: i128,
}

impl Found {
    /// Adds a piece, the part inside a region if there is one.
    pub fn add(&mut self, piece: &Piece, scales: &Scales, crop: Option<&Cutter>) {
        for (corners, triangle) in piece.corners.iter().zip(&piece.triangles) {
            self.rim = self.rim.wrapping_add(rim(*corners));
            match crop {
                None => {
                    let heights = triangle.map(|corner| corner[2]);
                    self.layers.add(scales, plan_area(triangle), heights);
                }
                Some(crop) => crop.cut(triangle, |part| {
                    part.add_to(&mut self.layers, scales, 1.0);
                }),
            }
        }
    }

    pub fn join(&mut self, other: &Self) {
        self.layers.join(&other.layers);
        self.rim = self.rim.wrapping_add(other.rim);
    }

    /// The layers as they are seen from the side that most of the surface faces; true if that is from below.
    pub fn upward(&self, scales: &Scales) -> (Layers, bool) {
        let [up, down] = self.layers.facing.map(|sum| scales.area.value(sum));
        let turned = up - down < -SAME * (up + down);
        match turned {
            true => (self.layers.turned(), true),
            false => (self.layers, false),
        }
    }
}

/// The largest height from a level on, and the extent in plan, of a surface.
pub(crate) fn scales(surface: &Surface, level: f64) -> Scales {
    let (low, high) = (surface.bounds().min, surface.bounds().max);
    let height = (high[2] - level).abs().max((low[2] - level).abs());
    Scales::of([high[0] - low[0], high[1] - low[1]], height)
}

/// Measures what lies above and below `level`.
pub(crate) fn measure(
    surface: &Surface,
    (origin, level): (V3, f64),
    crop: Option<&Cutter>,
    workspace: &Workspace,
) -> Result<Earth> {
    let scales = scales(surface, level);
    let all = Mutex::new(Found::default());
    let pass = Pass {
        step: "volumes",
        name: "volume: triangles",
        origin: Some([origin[0], origin[1], level]),
        more: 0,
    };
    surface.for_each_piece(pass, workspace, |_, piece| {
        let mut found = Found::default();
        found.add(piece, &scales, crop);
        lock(&all).join(&found);
        Ok(())
    })?;
    let all = *lock(&all);
    let (layers, is_turned) = all.upward(&scales);
    let is_closed = all.rim == 0;
    let covered = scales.area.value(layers.cover());
    Ok(Earth {
        covered: (!is_closed).then_some(covered),
        is_closed,
        is_turned,
        ..Earth::of(&layers, &scales)
    })
}
