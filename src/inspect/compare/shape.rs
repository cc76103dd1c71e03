//! One side of a comparison, as pages.

use super::pages::{KeptPages, Pages};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::LocalTable;
use outcrop_disk::workspace::Workspace;
use outcrop_geom::vector::{Box3, V3};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Largest coordinate for which no product of four lengths overflows.
const LARGEST: f64 = 1e70;

/// Description of one side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Side {
    /// The file or folder.
    pub path: PathBuf,
    /// Mesh or cloud.
    pub kind: Kind,
    /// Points of a cloud without repetition; vertices of a mesh that a triangle uses.
    pub points: u64,
    /// Triangles; 0 for a cloud.
    pub triangles: u64,
    /// Sum of their areas.
    pub area: f64,
    /// Lowest corner of the box around the shape.
    pub min: [f64; 3],
    /// Highest corner.
    pub max: [f64; 3],
    /// True if all positions are exact. Only a cloud that spans more than 2^30 of its own steps is rounded,
    /// to 2^-30 of its extent.
    pub exact: bool,
}

impl Side {
    /// The box around the shape.
    pub(crate) fn bounds(&self) -> Box3 {
        Box3 {
            min: self.min,
            max: self.max,
        }
    }
}

/// Mesh or cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Triangles: distances are to the nearest point of the surface.
    Mesh,
    /// Points: distances are to the nearest point.
    Cloud,
}

/// One side, ready for sampling and measuring.
pub(crate) struct Shape {
    /// Begins the names of its scratch files.
    pub(crate) name: &'static str,
    pub(crate) side: Side,
    pub(crate) items: Items,
}

pub(crate) enum Items {
    Mesh {
        triangles: Pages<[V3; 3]>,
        /// Vertices chosen as samples.
        vertices: LocalTable<V3>,
    },
    Cloud(Pages<V3>),
}

/// One side as an attempt leaves it to a later one: without the choice of vertices.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct KeptShape {
    /// Without its path, which the later attempt knows.
    side: Side,
    items: KeptItems,
}

#[derive(Debug, Serialize, Deserialize)]
enum KeptItems {
    Mesh(KeptPages<[V3; 3]>),
    Cloud(KeptPages<V3>),
}

impl Shape {
    /// Its description, without the pages.
    pub(crate) fn into_side(self) -> Side {
        self.side
    }

    pub(super) fn kept(&self) -> KeptShape {
        let path = PathBuf::new();
        KeptShape {
            side: Side {
                path,
                ..self.side.clone()
            },
            items: match &self.items {
                Items::Mesh { triangles, .. } => KeptItems::Mesh(triangles.kept()),
                Items::Cloud(points) => KeptItems::Cloud(points.kept()),
            },
        }
    }
}

impl KeptShape {
    pub(super) fn open(
        self,
        path: &Path,
        name: &'static str,
        workspace: &Workspace,
    ) -> Result<Shape> {
        let path = path.to_path_buf();
        Ok(Shape {
            name,
            side: Side { path, ..self.side },
            items: match self.items {
                KeptItems::Mesh(triangles) => Items::Mesh {
                    triangles: triangles.open(workspace)?,
                    vertices: LocalTable::create(workspace, &format!("{name}.vertices"))?,
                },
                KeptItems::Cloud(points) => Items::Cloud(points.open(workspace)?),
            },
        })
    }
}

/// The description of a side with these numbers.
pub(super) fn side(path: &Path, kind: Kind, bounds: Box3) -> Side {
    Side {
        path: path.to_path_buf(),
        kind,
        points: 0,
        triangles: 0,
        area: 0.0,
        min: bounds.min,
        max: bounds.max,
        exact: true,
    }
}

/// True if distances from this position can be computed.
pub(crate) fn usable(p: V3) -> bool {
    p.iter().all(|c| c.abs() <= LARGEST)
}

/// The error for a position that is not [`usable`].
pub(super) fn unusable(path: &Path, place: &str, p: V3) -> Error {
    let found = format!("a position {} {} {}", p[0], p[1], p[2]);
    Error::input(path, place, found, format!("coordinates up to {LARGEST:e}"))
}
