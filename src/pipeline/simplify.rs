//! A run that makes a mesh with fewer triangles, and that can be resumed.

use super::close::{check_output, closed};
use super::compare;
use super::hidden::open_of;
use super::like::Like;
use super::mesh_job::MeshJob;
use super::resources::{Resources, resource_setters};
use super::{Start, start::scratch_folder};
use crate::deliver::{Delivery, Kind};
use crate::params::Close;
use crate::report::{Crossings, SimplifyReport};
use crate::write::{Bounds, write};
use outcrop_codecs::ply_mesh::PlyMesh;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_disk::workspace::{Storage, Workspace};
use outcrop_levels::crossed;
use outcrop_levels::single::{self, Goal, Options, Simplified};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The making of a mesh with fewer triangles.
#[derive(Clone)]
pub struct Simplification {
    mesh: PathBuf,
    output: PathBuf,
    options: Options,
    samples: u64,
    close: Option<Close>,
    resources: Resources,
}

impl Simplification {
    /// Makes `output`, a mesh in any format that is written, of `mesh`, in any that is read.
    pub fn new(mesh: impl Into<PathBuf>, output: impl Into<PathBuf>, goal: Goal) -> Self {
        Self {
            mesh: mesh.into(),
            output: output.into(),
            options: Options::of(goal),
            samples: compare::Options::default().samples,
            close: None,
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

    /// Sets the number of samples by which the distance between both meshes is measured, and the most triangles by which
    /// crossings are counted; 0: neither is done.
    #[must_use]
    pub fn samples(mut self, samples: u64) -> Self {
        self.samples = samples;
        self
    }

    /// Closes the boundary of what is left, if it says how.
    #[must_use]
    pub fn close(mut self, close: Option<Close>) -> Self {
        self.close = close;
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
    /// [`Error::Input`] for a file that is no mesh; [`Error::Parameter`] for a goal or an output
    /// that makes no sense; [`Error::Memory`] if the budget is too small; [`Error::Io`], [`Error::Disk`],
    /// [`Error::Corrupt`], [`Error::Cancelled`]; those of an unfinished run, as of [`crate::Reconstruction::run`].
    pub fn run(&self) -> Result<SimplifyReport> {
        let scratch = self.resources.scratch.as_deref();
        match Delivery::of(&self.output, Kind::Mesh, scratch, None)? {
            None => self.run_to(None),
            Some(delivery) => {
                let mut local = self.clone();
                local.output = delivery.local().to_path_buf();
                local.run_to(Some(&delivery))
            }
        }
    }

    fn run_to(&self, delivery: Option<&Delivery>) -> Result<SimplifyReport> {
        self.check()?;
        let job = MeshJob {
            kind: "simplify",
            inputs: std::slice::from_ref(&self.mesh),
            output: &self.output,
            options: &(self.options.clone(), self.close),
            resources: &self.resources,
            delivery,
        };
        let clean = || {
            if self.close.is_some() {
                let _ = std::fs::remove_file(self.open());
            }
        };
        job.run(|workspace| self.make(workspace), clean)
    }

    fn check(&self) -> Result<()> {
        check_output(&self.mesh, &self.output)?;
        let refuse = |name, found: String, expected: &str| {
            Err(Error::Parameter {
                name,
                found,
                expected: expected.into(),
            })
        };
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

    /// The mesh that is closed, or the output if none is.
    fn open(&self) -> PathBuf {
        match self.close {
            Some(_) => open_of(&self.output),
            None => self.output.clone(),
        }
    }

    /// Makes the mesh in a workspace.
    pub(super) fn make(&self, workspace: &Workspace) -> Result<SimplifyReport> {
        let made = single::simplify(&self.mesh, &self.options, workspace)?;
        let observer = &workspace.observer;
        observer.begin("write", "triangles", made.triangles());
        let open = self.open();
        workspace.once("write", |_| self.write(&open, &made, workspace))?;
        observer.end();
        let closed = self
            .close
            .map(|kind| closed(&open, &self.output, kind.into(), workspace));
        let closed = closed.transpose()?;
        let is_measured = self.samples > 0 && tells_the_mesh(&open);
        let measure = || {
            let options = compare::Options {
                samples: self.samples,
                seed: 0,
            };
            compare::compare(&self.mesh, &open, &options, workspace)
        };
        let cross = || {
            let count = |mesh, name| crossed::count(mesh, name, self.samples, workspace);
            let before = count(&self.mesh, "crossings before")?;
            let after = count(&open, "crossings after")?;
            Ok(Crossings { before, after })
        };
        let crossings = is_measured.then(cross).transpose()?;
        let measured = is_measured.then(measure).transpose()?;
        Ok(SimplifyReport {
            vertices_before: made.before[0],
            triangles_before: made.before[1],
            vertices: made.vertices(),
            triangles: made.triangles(),
            degenerate: made.degenerate,
            goal: self.options.goal,
            error: made.error,
            passes: made.passes,
            crossings,
            measured,
            closed,
        })
    }

    fn write(&self, output: &Path, made: &Simplified, workspace: &Workspace) -> Result<()> {
        let source = PlyMesh::open_any(&self.mesh, workspace)?;
        let mut bounds = Bounds::new(output, made.vertices(), workspace);
        made.read(&mut bounds, workspace)?;
        let like = Like {
            mesh: &self.mesh,
            source: &source,
            output,
        };
        let counts = [made.vertices(), made.triangles()];
        let (about, shift) = like.about(counts, bounds.corners(), workspace)?;
        like.warn_of_left_out(&about, workspace)?;
        write(output, (about, shift), workspace, |writer| {
            made.read(writer, workspace)
        })
    }
}

/// True for a mesh in a format that has its vertices as they are.
fn tells_the_mesh(path: &Path) -> bool {
    path.extension().is_some_and(|name| {
        ["ply", "obj"]
            .iter()
            .any(|known| name.eq_ignore_ascii_case(known))
    })
}
