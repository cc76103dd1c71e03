//! Pictures of a mesh with the places of its defects.

use super::places::{KINDS, Kind, Places};
use super::verdict::Verdict;
use crate::compare::marked;
use outcrop_codecs::ply_mesh::{PlyMesh, Sink};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_draw::picture::Picture;
use serde::Serialize;
use std::path::Path;

/// The place of a defect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Place {
    /// The defect.
    pub kind: Kind,
    /// A vertex at which it is; of an edge the higher one.
    pub vertex: u32,
    /// The position of the vertex, in the coordinates of the cloud.
    pub position: [f64; 3],
}

/// Pictures of a mesh with its defects, for the page of the verdict.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Illustration {
    /// Pictures of the mesh with marks where defects are.
    pub pictures: Vec<Picture>,
    /// Places of defects: at most 256 of each kind, those with the lowest vertices.
    pub places: Vec<Place>,
    /// The reason why there is no picture, if there is none.
    pub reason: Option<String>,
}

/// Reads the positions of some vertices.
struct Pick<'a> {
    workspace: &'a Workspace,
    /// Kinds and vertices, ascending by vertex.
    wanted: Vec<(u32, Kind)>,
    next: u64,
    found: Vec<Place>,
}

impl Sink for Pick<'_> {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        self.workspace.check_cancel()?;
        let end = self.next + positions.len() as u64;
        while let Some(&(vertex, kind)) = self.wanted.get(self.found.len()) {
            if u64::from(vertex) >= end {
                break;
            }
            self.found.push(Place {
                kind,
                vertex,
                position: positions[(u64::from(vertex) - self.next) as usize],
            });
        }
        self.next = end;
        Ok(())
    }

    fn triangles(&mut self, _: &[[u32; 3]]) -> Result<()> {
        self.workspace.check_cancel()
    }
}

/// Draws the mesh with the places of its defects.
pub(super) fn illustrate(
    mesh: &Path,
    places: Places,
    verdict: &Verdict,
    workspace: &Workspace,
) -> Result<Illustration> {
    let kinds = KINDS.into_iter().zip(places.0);
    let mut wanted: Vec<(u32, Kind)> = kinds
        .flat_map(|(kind, list)| list.into_iter().map(move |vertex| (vertex, kind)))
        .collect();
    wanted.sort_unstable_by_key(|(vertex, kind)| (*vertex, *kind as usize));
    let mut pick = Pick {
        workspace,
        wanted,
        next: 0,
        found: Vec::new(),
    };
    if !pick.wanted.is_empty() {
        PlyMesh::open_any(mesh, workspace)?.read_in_place(&mut pick)?;
    }
    let mut places = pick.found;
    places.sort_by_key(|place| place.kind as usize);
    let marks: Vec<_> = places.iter().map(|place| place.position).collect();
    let sound = verdict.triangles > verdict.index_out_of_range + verdict.degenerate_triangles;
    let drawn = match sound {
        true => marked(mesh, &marks, workspace),
        false => {
            return Ok(Illustration {
                places,
                reason: Some("the mesh has no sound triangle".into()),
                ..Illustration::default()
            });
        }
    };
    match drawn {
        Ok(pictures) => Ok(Illustration {
            pictures,
            places,
            reason: None,
        }),
        Err(error @ outcrop_disk::error::Error::Input { .. }) => Ok(Illustration {
            places,
            reason: Some(error.to_string()),
            ..Illustration::default()
        }),
        Err(error) => Err(error),
    }
}
