//! Heights of a mesh: those of its triangles at the middles of cells.
//!
//! Whether a triangle covers a middle is decided exactly, its sides included. So a surface without holes leaves no
//! cell without a height, wherever the sides of triangles run.

use super::samples::{BATCH, BATCH_BYTES, Sample, Samples};
use crate::pieces::{Marks, Pass, Piece, Surface};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::vector::V3;
use robust::{Coord, orient2d};

/// The class of ground in LAS files.
pub(super) const GROUND: u8 = 2;

/// The columns that are read with the positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Columns {
    /// None is read.
    None,
    /// Colours.
    Colours,
    /// Classes: only ground counts.
    Ground,
}

impl Columns {
    /// Their names.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Self::None => &[],
            Self::Colours => &["red", "green", "blue"],
            Self::Ground => &["classification"],
        }
    }
}

/// Samples all triangles.
pub(super) fn sample(
    surface: &Surface,
    columns: Columns,
    samples: &Samples<'_>,
    workspace: &Workspace,
) -> Result<()> {
    let origin = surface.bounds().min;
    let pass = Pass {
        step: "sample triangles",
        name: "raster: triangles",
        origin: Some(origin),
        more: 2 * BATCH_BYTES,
    };
    surface.for_each_piece(pass, workspace, |unit, piece| {
        let mut batch = Vec::with_capacity(BATCH);
        let sampling = Sampling { samples, origin };
        sampling.piece(piece, columns, unit, &mut batch)?;
        samples.take(&mut batch)
    })
}

struct Sampling<'a> {
    samples: &'a Samples<'a>,
    origin: V3,
}

impl Sampling<'_> {
    fn piece(
        &self,
        piece: &Piece,
        columns: Columns,
        unit: &Unit<'_>,
        batch: &mut Vec<Sample>,
    ) -> Result<()> {
        for (number, triangle) in piece.triangles.iter().enumerate() {
            let marks = piece.marks.get(number).copied().unwrap_or_default();
            if columns == Columns::Ground && marks.iter().any(|mark| mark[0] != GROUND) {
                continue;
            }
            self.triangle(triangle, marks, unit, batch)?;
        }
        Ok(())
    }

    fn triangle(
        &self,
        triangle: &[V3; 3],
        marks: [Marks; 3],
        unit: &Unit<'_>,
        batch: &mut Vec<Sample>,
    ) -> Result<()> {
        let [a, b, c] = triangle;
        let low = [0, 1].map(|k| a[k].min(b[k]).min(c[k]));
        let high = [0, 1].map(|k| a[k].max(b[k]).max(c[k]));
        let grid = &self.samples.grid;
        let [columns, rows] = grid.middles_in([low, high], self.origin);
        if columns.is_empty() || rows.is_empty() {
            return Ok(());
        }
        let Some(plane) = Plane::of(triangle) else {
            return Ok(());
        };
        for row in rows {
            for column in columns.clone() {
                let middle = grid.middle([column, row]);
                let at = [middle[0] - self.origin[0], middle[1] - self.origin[1]];
                let Some(weights) = plane.weights(at) else {
                    continue;
                };
                let height = self.origin[2] + plane.height(weights);
                let colour = colour(weights, &marks);
                batch.extend(self.samples.of([column, row], height, colour));
                if batch.len() >= BATCH {
                    self.samples.take(batch)?;
                    unit.check_cancel()?;
                }
            }
        }
        Ok(())
    }
}

/// A triangle that is not upright.
struct Plane<'a> {
    corners: &'a [V3; 3],
    sign: f64,
}

impl<'a> Plane<'a> {
    fn of(corners: &'a [V3; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|p| Coord { x: p[0], y: p[1] });
        let area = orient2d(a, b, c);
        let sign = area.signum();
        (area != 0.0).then_some(Self { corners, sign })
    }

    /// The weights of the corners at a place; none outside.
    fn weights(&self, [x, y]: [f64; 2]) -> Option<[f64; 3]> {
        let at = Coord { x, y };
        let [a, b, c] = self.corners.map(|p| Coord { x: p[0], y: p[1] });
        let areas = [orient2d(b, c, at), orient2d(c, a, at), orient2d(a, b, at)];
        let weights = areas.map(|area| area * self.sign);
        let sum: f64 = weights.iter().sum();
        let is_in = weights.iter().all(|weight| *weight >= 0.0) && sum > 0.0;
        is_in.then(|| weights.map(|weight| weight / sum))
    }

    fn height(&self, weights: [f64; 3]) -> f64 {
        let heights = self.corners.map(|p| p[2]);
        let [lowest, highest] = [f64::min, f64::max].map(|of| heights.into_iter().reduce(of));
        let height: f64 = heights.iter().zip(weights).map(|(h, w)| h * w).sum();
        // Rounding must not lead out of the triangle.
        height.clamp(lowest.unwrap_or(height), highest.unwrap_or(height))
    }
}

fn colour(weights: [f64; 3], marks: &[Marks; 3]) -> u32 {
    let part = |k: usize| {
        let parts = marks.iter().zip(weights);
        let sum: f64 = parts
            .map(|(mark, weight)| f64::from(mark[k]) * weight)
            .sum();
        sum.round() as u8
    };
    Sample::colour([part(0), part(1), part(2)])
}
