//! A run that makes a mesh with fewer triangles, and that can be resumed.

use super::mesh_job::MeshJob;
use super::resources::{Resources, resource_setters};
use super::{Start, start::scratch_folder};
use crate::write::{Bounds, write};
use outcrop_codecs::ply_mesh::{PlyMesh, system};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_disk::workspace::{Storage, Workspace};
use outcrop_inspect::compare::{self, Comparison};
use outcrop_levels::single::{self, Goal, Options, Simplified};
use outcrop_mesh_files::export::{self, CoordinateType, Mesh, VertexColumn};
use outcrop_ply::Place;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The version of what a resumed run reads.
const FORMAT: &str = "simplify 1";

/// The making of a mesh with fewer triangles.
pub struct Simplification {
    mesh: PathBuf,
    output: PathBuf,
    options: Options,
    samples: u64,
    resources: Resources,
}

/// What became of a mesh that was simplified.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimplifyReport {
    /// Vertices of the mesh that was read.
    pub vertices_before: u64,
    /// Triangles of the mesh that was read.
    pub triangles_before: u64,
    /// Vertices of the mesh that was made.
    pub vertices: u64,
    /// Triangles of the mesh that was made.
    pub triangles: u64,
    /// Triangles of the mesh that was read with two equal corners, which were left out.
    pub degenerate: u64,
    /// What was asked for.
    pub goal: Goal,
    /// The largest mean distance of a vertex from the planes of the triangles that it stands for.
    pub error: f64,
    /// How often all triangles were looked at.
    pub passes: u32,
    /// Distances between both meshes, as `compare` measures them: the first is the mesh that was read.
    pub measured: Option<Comparison>,
}

impl std::fmt::Display for SimplifyReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let part = 100.0 * self.triangles as f64 / self.triangles_before.max(1) as f64;
        write!(
            f,
            "{} of {} triangles ({part:.2} %), {} vertices",
            self.triangles, self.triangles_before, self.vertices
        )?;
        if let Goal::Triangles(wanted) = self.goal
            && self.triangles > wanted + wanted / 100
        {
            write!(
                f,
                "\nnot {wanted}: fewer would change the shape or turn triangles over"
            )?;
        }
        if self.degenerate > 0 {
            write!(
                f,
                "\nleft out: {} triangles with two equal corners",
                self.degenerate
            )?;
        }
        if let Some(measured) = &self.measured {
            let figures = &measured.symmetric.figures;
            write!(
                f,
                "\ndistance between both meshes: mean {:.6}, 99.9 % at most {:.6}, largest {:.6}",
                figures.mean, figures.p99_9, figures.max
            )?;
        }
        Ok(())
    }
}

impl Simplification {
    /// Makes `output`, a mesh in any format that is written, of `mesh`, a PLY file.
    pub fn new(mesh: impl Into<PathBuf>, output: impl Into<PathBuf>, goal: Goal) -> Self {
        Self {
            mesh: mesh.into(),
            output: output.into(),
            options: Options::of(goal),
            samples: compare::Options::default().samples,
            resources: Resources::default(),
        }
    }

    resource_setters!();

    /// Sets the options that decide the mesh.
    #[must_use]
    pub fn options(mut self, options: Options) -> Self {
        self.options = options;
        self
    }

    /// Sets the number of samples by which the distance between both meshes is measured; 0: it is not measured.
    #[must_use]
    pub fn samples(mut self, samples: u64) -> Self {
        self.samples = samples;
        self
    }

    /// The scratch folder of the run.
    #[must_use]
    pub fn scratch_folder(&self) -> PathBuf {
        scratch_folder(&self.output, self.resources.scratch.as_deref())
    }

    /// Makes the mesh.
    ///
    /// # Errors
    /// [`Error::Input`] for a file that is no mesh of triangles in PLY; [`Error::Parameter`] for a goal or an output
    /// that makes no sense; [`Error::Memory`] if the budget is too small; [`Error::Io`], [`Error::Disk`],
    /// [`Error::Corrupt`], [`Error::Cancelled`]; those of an unfinished run, as of [`crate::Reconstruction::run`].
    pub fn run(&self) -> Result<SimplifyReport> {
        self.check()?;
        let job = MeshJob {
            format: FORMAT,
            mesh: &self.mesh,
            output: &self.output,
            options: &self.options,
            resources: &self.resources,
        };
        job.run(|workspace| self.make(workspace), || ())
    }

    fn check(&self) -> Result<()> {
        export::format_of(&self.output)?;
        let refuse = |name, found: String, expected: &str| {
            Err(Error::Parameter {
                name,
                found,
                expected: expected.into(),
            })
        };
        let output = self.output.display().to_string();
        if export::is_compressed(&self.output) {
            return refuse("output", output, "a name that does not end with .zst");
        }
        let whole = |path: &Path| path.canonicalize().ok();
        if whole(&self.mesh).is_some_and(|mesh| whole(&self.output) == Some(mesh)) {
            return refuse("output", output, "another file than the mesh");
        }
        match self.options.goal {
            Goal::Triangles(0) => refuse("triangles", "0".into(), "1 or more"),
            Goal::Ratio(ratio) if !(ratio > 0.0 && ratio <= 1.0) => {
                refuse("ratio", ratio.to_string(), "more than 0, at most 1")
            }
            Goal::Error(length) if !(length > 0.0 && length.is_finite()) => {
                refuse("error", length.to_string(), "a length of more than 0")
            }
            _ => Ok(()),
        }
    }

    fn make(&self, workspace: &Workspace) -> Result<SimplifyReport> {
        let made = single::simplify(&self.mesh, &self.options, workspace)?;
        let observer = &workspace.observer;
        observer.begin("write", "triangles", made.triangles());
        workspace.once("write", |_| self.write(&made, workspace))?;
        observer.end();
        let measured = match self.samples {
            0 => None,
            samples
                if self
                    .output
                    .extension()
                    .is_some_and(|e| e.eq_ignore_ascii_case("ply")) =>
            {
                let options = compare::Options { samples, seed: 0 };
                Some(compare::compare(
                    &self.mesh,
                    &self.output,
                    &options,
                    workspace,
                )?)
            }
            _ => None,
        };
        Ok(SimplifyReport {
            vertices_before: made.before[0],
            triangles_before: made.before[1],
            vertices: made.vertices(),
            triangles: made.triangles(),
            degenerate: made.degenerate,
            goal: self.options.goal,
            error: made.error,
            passes: made.passes,
            measured,
        })
    }

    fn write(&self, made: &Simplified, workspace: &Workspace) -> Result<()> {
        let source = PlyMesh::open_any(&self.mesh, workspace)?;
        let mut bounds = Bounds::new(&self.output, made.vertices(), workspace);
        made.read(&mut bounds, workspace)?;
        let format = export::format_of(&self.output)?;
        let columns = source.columns().into_iter();
        let columns = columns.map(|(_, name, scalar)| VertexColumn {
            name: name.to_owned(),
            scalar,
        });
        let mut about = Mesh {
            vertices: made.vertices(),
            triangles: made.triangles(),
            coordinates: match source.has_floats() {
                true => CoordinateType::Float,
                false => CoordinateType::Double,
            },
            columns: columns.collect(),
            comments: system(&self.mesh)?.comments(),
            bounds: bounds.corners(),
            ..Mesh::default()
        };
        let origin = source.origin().unwrap_or_default();
        // Coordinates of a format without doubles are told from the corner of the mesh, if those of the file are doubles.
        let [low, high] = bounds.corners().unwrap_or_default();
        let is_moved = !source.has_floats() && !format.holds_doubles();
        let shift = if is_moved {
            low.map(f64::floor)
        } else {
            [0.0; 3]
        };
        let place = [0, 1, 2].map(|k| origin[k] + shift[k]);
        if source.origin().is_some() || is_moved {
            about.comments.extend(Place::new(place, None).comments());
        }
        about.bounds = bounds
            .corners()
            .map(|corners| corners.map(|corner| [0, 1, 2].map(|k| corner[k] - shift[k])));
        let span = (0..3).fold(0.0, |most: f64, k| most.max(high[k] - low[k]));
        about.decimals = (8.0 - span.max(1e-9).log10().ceil()).clamp(0.0, 17.0) as usize;
        let largest = low
            .iter()
            .chain(&high)
            .fold(0.0, |most: f64, x| most.max(x.abs()));
        for warning in export::left_out(&self.output, &about, largest, &*workspace.observer)? {
            workspace.observer.warn(&warning);
        }
        write(&self.output, (about, shift), workspace, |writer| {
            made.read(writer, workspace)
        })
    }
}
