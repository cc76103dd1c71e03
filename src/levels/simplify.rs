//! Simplification, behind a trait so that the library can be changed.

use meshoptimizer_rs::{Positions, SimplifyOptions, SimplifySettings, VertexFlags};
use outcrop_disk::error::{Error, Result};
use std::path::Path;

/// A mesh to simplify.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Positions of the vertices.
    pub points: &'a [[f32; 3]],
    /// Corners of the triangles.
    pub triangles: &'a [[u32; 3]],
    /// For each vertex whether it must stay; none are locked if the list is empty.
    pub locked: &'a [bool],
}

/// Ways to simplify.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Manner {
    /// Edges are contracted; the surface stays connected as it is.
    Careful,
    /// As `Careful`, but small components may go.
    Pruning,
    /// Vertices are joined by a grid; parts may grow together, and small ones go.
    Coarse,
}

/// Simplifies meshes. The result is a subset of the vertices, the same on every machine.
pub trait Simplifier: Sync {
    /// Triangles, about `target` or as few as can be, whose corners are corners of the given ones.
    ///
    /// # Errors
    /// [`Error::Io`] if the method fails.
    fn simplify(
        &self,
        surface: Surface<'_>,
        target: usize,
        manner: Manner,
    ) -> Result<Vec<[u32; 3]>>;
}

/// Contracts edges by quadrics, as the library meshoptimizer does.
#[derive(Debug, Clone, Copy, Default)]
pub struct Quadrics;

/// The error of the library, which cannot be caused by a mesh.
pub(super) fn failed(action: &str, error: meshoptimizer_rs::Error) -> Error {
    let error = std::io::Error::other(error.to_string());
    Error::io(Path::new("tile"), action, error)
}

impl Simplifier for Quadrics {
    fn simplify(
        &self,
        surface: Surface<'_>,
        target: usize,
        manner: Manner,
    ) -> Result<Vec<[u32; 3]>> {
        let mut workspace = meshoptimizer_rs::Workspace::default();
        let indices = surface.triangles.as_flattened();
        let positions = Positions::from_packed(surface.points);
        let flag = |locked: &bool| match locked {
            true => VertexFlags::LOCK,
            false => VertexFlags::EMPTY,
        };
        let flags: Vec<VertexFlags> = surface.locked.iter().map(flag).collect();
        let flags = Some(&*flags).filter(|flags| !flags.is_empty());
        let all = target.min(surface.triangles.len()) * 3;
        let indices = if manner == Manner::Coarse {
            let most = f32::MAX;
            meshoptimizer_rs::simplify_sloppy(indices, positions, flags, all, most, &mut workspace)
        } else {
            let settings = SimplifySettings {
                target_index_count: all,
                target_error: 1e15,
                options: match manner {
                    Manner::Pruning => SimplifyOptions::ERROR_ABSOLUTE | SimplifyOptions::PRUNE,
                    _ => SimplifyOptions::ERROR_ABSOLUTE,
                },
            };
            let none =
                meshoptimizer_rs::Attributes::from_interleaved(&[], surface.points.len(), 0, 0, 0);
            let none = none.map_err(|e| failed("simplify", e))?;
            meshoptimizer_rs::simplify_with_attributes(
                indices,
                positions,
                none,
                &[],
                flags,
                settings,
                &mut workspace,
            )
        };
        let simple = indices.map_err(|e| failed("simplify", e))?;
        checked(surface, simple.indices)
    }
}

/// The triangles, if their corners are vertices.
fn checked(surface: Surface<'_>, indices: Vec<u32>) -> Result<Vec<[u32; 3]>> {
    let (triangles, rest) = indices.as_chunks::<3>();
    let count = surface.points.len();
    if !rest.is_empty()
        || triangles
            .as_flattened()
            .iter()
            .any(|v| *v as usize >= count)
    {
        let error = std::io::Error::other("the simplifier returned a corner that does not exist");
        return Err(Error::io(Path::new("tile"), "simplify", error));
    }
    Ok(triangles.to_vec())
}
