//! A measurement of change: the new mesh with the distance from the old surface as columns of its vertices.

use super::Start;
use super::compare::clouds;
use super::like::{Like, is_one_of};
use super::mesh_job::MeshJob;
use super::resources::{Resources, resource_setters};
use crate::write::{Bounds, Writer, write};
use outcrop_codecs::ply_mesh::{PlyMesh, Sink};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_disk::workspace::{Storage, Workspace};
use outcrop_inspect::change::{self, Change, ChangeRow, Changes, Options, ROWS, State};
use outcrop_mesh_files::export::{self, VertexColumn};
use outcrop_ply::Scalar;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The columns of a map: lengths in the unit of the files, and a [`State`] as a number.
const COLUMNS: [(&str, Scalar); 3] = [
    ("change", Scalar::F32),
    ("uncertainty", Scalar::F32),
    ("significant", Scalar::U8),
];

/// The measurement of what changed between two surfaces. With a map it can be resumed.
#[derive(Clone)]
pub struct ChangeDetection {
    /// The old surface and the new one.
    surfaces: [PathBuf; 2],
    output: Option<PathBuf>,
    options: Options,
    resources: Resources,
}

impl ChangeDetection {
    /// Measures what changed from `old`, a mesh or a cloud, to the mesh `new`.
    pub fn new(old: impl Into<PathBuf>, new: impl Into<PathBuf>, options: Options) -> Self {
        Self {
            surfaces: [old.into(), new.into()],
            output: None,
            options,
            resources: Resources::default(),
        }
    }

    /// Writes the new mesh to a PLY file, with what changed as columns of its vertices.
    #[must_use]
    pub fn output(mut self, path: impl Into<PathBuf>) -> Self {
        self.output = Some(path.into());
        self
    }

    resource_setters!();

    /// Measures what changed.
    ///
    /// # Errors
    /// See [`change::change`]; [`Error::Parameter`] for an output that is not PLY, or one of the surfaces, and for an
    /// unfinished run without an output; those of an unfinished run, as of [`crate::Reconstruction::run`].
    pub fn run(&self) -> Result<Change> {
        let measure = |[old, new]: [&Path; 2], workspace: &Workspace| {
            let (found, changes) = change::change(old, new, &self.options, clouds, workspace)?;
            Ok((found, changes, ()))
        };
        self.mapped(measure, |_, ()| Ok(()))
    }

    /// As [`ChangeDetection::run`]; `show` gets what [`crate::page::change`] puts into a page, before the run ends.
    ///
    /// # Errors
    /// See [`ChangeDetection::run`]; errors of `show`.
    #[cfg(feature = "pages")]
    pub fn run_illustrated(
        &self,
        show: impl FnOnce(&Change, &change::Illustration) -> Result<()>,
    ) -> Result<Change> {
        let measure = |[old, new]: [&Path; 2], workspace: &Workspace| {
            change::illustrated(old, new, &self.options, clouds, workspace)
        };
        self.mapped(measure, |found, drawn| show(found, &drawn))
    }

    /// Measures, writes the map, and shows what was found.
    fn mapped<T>(
        &self,
        measure: impl FnOnce([&Path; 2], &Workspace) -> Result<(Change, Changes, T)>,
        show: impl FnOnce(&Change, T) -> Result<()>,
    ) -> Result<Change> {
        let surfaces = [&*self.surfaces[0], &*self.surfaces[1]];
        let Some(output) = &self.output else {
            if self.resources.start != Start::New {
                return Err(Error::Parameter {
                    name: "output",
                    found: "none".into(),
                    expected: "a map: only a run that writes one can be resumed".into(),
                });
            }
            let workspace = self.resources.workspace()?;
            let (found, _, more) = measure(surfaces, &workspace)?;
            show(&found, more)?;
            return Ok(found);
        };
        check_output(surfaces, output)?;
        let job = MeshJob {
            kind: "change",
            inputs: &self.surfaces,
            output,
            options: &self.options,
            resources: &self.resources,
            delivery: None,
        };
        let make = |workspace: &Workspace| {
            let (found, changes, more) = measure(surfaces, workspace)?;
            let observer = &workspace.observer;
            observer.begin("write", "triangles", found.new.triangles);
            written(surfaces[1], output, &changes, workspace)?;
            observer.end();
            show(&found, more)?;
            Ok(found)
        };
        // When all is done, the files of the steps inside may be gone.
        job.run(
            |workspace| workspace.once("change", |_| make(workspace)),
            || (),
        )
    }
}

/// Refuses an output that is no plain PLY, or a surface itself.
fn check_output(surfaces: [&Path; 2], output: &Path) -> Result<()> {
    let refuse = |expected: &str| {
        Err(Error::Parameter {
            name: "output",
            found: output.display().to_string(),
            expected: expected.into(),
        })
    };
    let is_ply = export::format_of(output)?.name() == "PLY";
    if !is_ply || export::is_compressed(output) || outcrop_points::is_remote(output) {
        return refuse("a file whose name ends with .ply: others do not hold values");
    }
    match is_one_of(output, &surfaces) {
        true => refuse("another file than the surfaces"),
        false => Ok(()),
    }
}

fn written(mesh: &Path, output: &Path, changes: &Changes, workspace: &Workspace) -> Result<()> {
    let source = PlyMesh::open_any(mesh, workspace)?;
    let mut bounds = Bounds::new(mesh, source.vertices(), workspace);
    PlyMesh::open_any(mesh, workspace)?.read(&mut bounds)?;
    let like = Like {
        mesh,
        source: &source,
        output,
    };
    let counts = [source.vertices(), source.faces()];
    let (mut about, shift) = like.about(counts, bounds.corners(), workspace)?;
    // A map of an earlier comparison gets new values.
    let is_own = |name: &str| COLUMNS.iter().any(|column| column.0 == name);
    let columns = source.columns();
    let kept = columns.iter().filter(|column| !is_own(column.1));
    let wanted: Vec<_> = kept.map(|(index, _, scalar)| (*index, *scalar)).collect();
    about.columns.retain(|column| !is_own(&column.name));
    about
        .columns
        .extend(COLUMNS.map(|(name, scalar)| VertexColumn {
            name: name.into(),
            scalar,
        }));
    like.warn_of_left_out(&about, workspace)?;
    let bytes = (ROWS * size_of::<ChangeRow>()) as u64;
    let _held = workspace.reserve("change: values", bytes)?;
    let width = wanted.len();
    write(output, (about, shift), workspace, |writer| {
        let mut adding = Adding {
            writer,
            changes,
            width,
            section: (usize::MAX, Vec::new()),
            next: 0,
            values: Vec::new(),
        };
        let source = PlyMesh::open_any(mesh, workspace)?;
        source.wanting(wanted).read(&mut adding)
    })
}

/// Passes on a mesh with more values at its vertices.
struct Adding<'a, 'w> {
    writer: &'a mut Writer<'w>,
    changes: &'a Changes,
    /// Values of a vertex in the mesh.
    width: usize,
    /// Number and rows of a section of the changes.
    section: (usize, Vec<ChangeRow>),
    /// The vertex that comes next.
    next: usize,
    values: Vec<f64>,
}

impl Adding<'_, '_> {
    /// Passes on the values of `count` vertices, of which these are known.
    fn add(&mut self, known: &[f64], count: usize) -> Result<()> {
        self.values.clear();
        for vertex in 0..count {
            let section = self.next / ROWS;
            if self.section.0 != section {
                self.changes.get_into(section, &mut self.section.1)?;
                self.section.0 = section;
            }
            let own = &known[vertex * self.width..][..self.width];
            self.values.extend_from_slice(own);
            let row = self.section.1.get(self.next % ROWS);
            let [change, uncertainty] = row.map_or([f32::NAN; 2], ChangeRow::changes);
            let state = row.map_or(State::Unused, ChangeRow::state);
            let values = [change.into(), uncertainty.into(), f64::from(state as u32)];
            self.values.extend_from_slice(&values);
            self.next += 1;
        }
        self.writer.values(&self.values)
    }
}

impl Sink for Adding<'_, '_> {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        self.writer.vertices(positions)?;
        match self.width {
            0 => self.add(&[], positions.len()),
            _ => Ok(()),
        }
    }

    fn values(&mut self, values: &[f64]) -> Result<()> {
        self.add(values, values.len() / self.width.max(1))
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.writer.triangles(triangles)
    }
}
