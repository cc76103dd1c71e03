//! Smoothing: every point is projected on the plane of its neighbours (paper, section 3.2), or on a
//! curved surface ([`Smoothing::Edges`]).
//!
//! Ids are kept; only positions and bounding boxes change.

mod first;
mod fit;
mod followers;
mod foot;
mod level;
mod mover;
mod moves;
mod noise;
mod pass;
mod relax;
#[cfg(test)]
mod tests;

pub use level::Gauge;
pub use moves::RelaxStats;
pub use relax::{Relaxed, relax};

use crate::cells::{Among, Fit, TileRanges, Widen, each_around, each_plane};
use crate::order::{PointStore, StoredPoints};
use foot::{Feet, Foot};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_geom::lattice::COORDINATE_LIMIT;
use outcrop_geom::round::rounded;
use outcrop_paper::method::METHOD;
use pass::Pass;
use std::ops::Range;

/// The kind of smoothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Smoothing {
    /// A point moves to the plane of its neighbours (paper, section 3.2).
    Plain,
    /// A point moves to the plane of its neighbours, or to a curved surface through those that lie on one
    /// surface with it: keeps edges, shrinks little.
    Edges,
}

impl std::str::FromStr for Smoothing {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "plain" => Ok(Smoothing::Plain),
            "edges" => Ok(Smoothing::Edges),
            _ => Err(format!("{text:?} is not plain or edges")),
        }
    }
}

/// The parameters of smoothing where points are noisy.
#[derive(Debug, Clone, Copy)]
pub struct Relaxing {
    /// Number of neighbours for a plane.
    pub neighbors: usize,
    /// Largest number of rounds.
    pub rounds: u32,
    /// Length of a step of the lattice, in the cloud's unit; for the counts only.
    pub step: f64,
}

impl Relaxing {
    /// The number of neighbours by which a point moves.
    fn most(&self) -> usize {
        self.neighbors * METHOD.smoothing.neighbors
    }

    /// The number of neighbours in layers: those of a plane, but enough for a surface of second order.
    fn fewer(&self) -> usize {
        self.neighbors.max(METHOD.plane.neighbors)
    }
}

/// The ids of the run of a point, before `end`.
fn run_of(id: usize, end: usize) -> Range<usize> {
    let first = id - id % METHOD.curve.run;
    first..(first + METHOD.curve.run).min(end)
}

/// One round of smoothing: every point moves to the plane of its `neighbors` nearest, or, with
/// [`Smoothing::Edges`], to a surface through twice as many neighbours.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn smooth(
    store: &PointStore,
    tiles: TileRanges,
    neighbors: usize,
    smoothing: Smoothing,
    round: u32,
    workspace: &Workspace,
) -> Result<StoredPoints> {
    let file = format!("points{round}");
    let pass = Pass::new(&file, "smooth: tile", tiles);
    let work = |unit: &Unit<'_>, ids: Range<usize>, points: &mut [Point]| match smoothing {
        Smoothing::Plain => {
            let all = |_| true;
            let each = |id: usize, point: Point, fit: &Fit| {
                points[id - ids.start] = project(point, fit);
            };
            let (ids, count) = (ids.clone(), neighbors);
            each_plane(unit, store, ids, count, Widen::Never, all, each)
        }
        Smoothing::Edges => {
            let count = neighbors * METHOD.smoothing.neighbors;
            let mut feet = Feet::default();
            let mut put = |(id, point): (usize, Point), foot: Foot| {
                points[id - ids.start] = moved(point, foot.offset);
            };
            let among = Among {
                wanted: &|_| true,
                count: &|_| count,
                most: count,
                chosen: None,
            };
            each_around(unit, store, ids.clone(), &among, |id, point, around| {
                feet.add((id, point), around, &mut put);
            })?;
            feet.finish(&mut put);
            Ok(())
        }
    };
    pass.over(store, workspace, work, |()| ())
}

/// The foot of a point on its plane, on the lattice; the point itself if it has no plane.
fn project(point: Point, fit: &Fit) -> Point {
    let Some(normal) = fit.plane.normal else {
        return point;
    };
    moved(point, fit.moments.project(normal))
}

fn moved(point: Point, offset: [f64; 3]) -> Point {
    std::array::from_fn(|axis| {
        let moved = i64::from(point[axis]).saturating_add(rounded(offset[axis]));
        moved.clamp(0, COORDINATE_LIMIT - 1) as i32
    })
}
