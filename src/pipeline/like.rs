//! The properties of a file for a mesh that was made of another one.

use outcrop_codecs::ply_mesh::{PlyMesh, system};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_mesh_files::export::{self, CoordinateType, Mesh, VertexColumn};
use outcrop_ply::Place;
use std::path::Path;

/// True if the output is one of the files that are read, by whatever name.
pub(super) fn is_one_of(output: &Path, read: &[&Path]) -> bool {
    let whole = |path: &Path| outcrop_platform::canonical(path).ok();
    let own = whole(output);
    own.is_some() && read.iter().any(|path| whole(path) == own)
}

/// A mesh, and the file of one that is made of it.
pub(super) struct Like<'a> {
    pub mesh: &'a Path,
    pub source: &'a PlyMesh,
    pub output: &'a Path,
}

impl Like<'_> {
    /// The properties of the file, and what its coordinates are less than those of the mesh.
    pub fn about(
        &self,
        [vertices, triangles]: [u64; 2],
        corners: Option<[[f64; 3]; 2]>,
        workspace: &Workspace,
    ) -> Result<(Mesh, [f64; 3])> {
        let format = export::format_of(self.output)?;
        let source = self.source;
        let [low, high] = corners.unwrap_or_default();
        // Coordinates of a format without doubles are told from the corner of the mesh, if those of the file are doubles.
        let is_moved = !source.has_floats() && !format.holds_doubles();
        let shift = match is_moved {
            true => low.map(f64::floor),
            false => [0.0; 3],
        };
        if shift != [0.0; 3] {
            let ([x, y, z], name) = (shift, format.name());
            workspace.observer.warn(&format!(
                "{name} holds 32-bit floats: its coordinates are those of the mesh less {x} {y} {z}"
            ));
        }
        let mut comments = system(self.mesh)?.comments();
        if source.origin().is_some() || is_moved {
            let origin = source.origin().unwrap_or_default();
            let place = [0, 1, 2].map(|k| origin[k] + shift[k]);
            comments.extend(Place::new(place, None).comments());
        }
        let columns = source.columns().into_iter();
        let columns = columns.map(|(_, name, scalar)| VertexColumn {
            name: name.to_owned(),
            scalar,
        });
        let moved = |corner: [f64; 3]| [0, 1, 2].map(|k| corner[k] - shift[k]);
        let span = (0..3).fold(1e-9, |most: f64, k| most.max(high[k] - low[k]));
        let about = Mesh {
            vertices,
            triangles,
            coordinates: match source.has_floats() {
                true => CoordinateType::Float,
                false => CoordinateType::Double,
            },
            columns: columns.collect(),
            comments,
            bounds: corners.map(|corners| corners.map(moved)),
            // A hundred-millionth of the span, about.
            decimals: (8.0 - libm::log10(span).ceil()).clamp(0.0, 17.0) as usize,
            ..Mesh::default()
        };
        Ok((about, shift))
    }

    /// Says what of the mesh the format of the output does not hold.
    pub fn warn_of_left_out(&self, about: &Mesh, workspace: &Workspace) -> Result<()> {
        let all = about.bounds.unwrap_or_default();
        let largest = all.as_flattened().iter();
        let largest = largest.fold(0.0, |most: f64, x| most.max(x.abs()));
        let observer = &workspace.observer;
        for warning in export::left_out(self.output, about, largest, &**observer)? {
            observer.warn(&warning);
        }
        Ok(())
    }
}
