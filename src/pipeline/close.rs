//! A run that closes a mesh, and that can be resumed.

use super::like::{Like, is_one_of};
use super::mesh_job::MeshJob;
use super::resources::{Resources, resource_setters};
use super::{Start, start::scratch_folder};
use crate::deliver::{self, Delivery};
use crate::params::Close;
use crate::report::CloseReport;
use crate::write::{Bounds, Writer, write};
use outcrop_codecs::ply_mesh::{PlyMesh, SLICE, Sink};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_disk::workspace::{Storage, Workspace};
use outcrop_levels::close::{self, Closure, Kind, Part};
use outcrop_levels::single::is_blended;
use outcrop_mesh_files::export;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The making of a mesh without a boundary.
#[derive(Clone)]
pub struct Closing {
    mesh: PathBuf,
    output: PathBuf,
    kind: Kind,
    resources: Resources,
}

impl Closing {
    /// Makes `output`, a mesh in any format that is written, of `mesh`, in any that is read.
    pub fn new(mesh: impl Into<PathBuf>, output: impl Into<PathBuf>) -> Self {
        Self {
            mesh: mesh.into(),
            output: output.into(),
            kind: Kind::default(),
            resources: Resources::default(),
        }
    }

    resource_setters!();

    /// Sets how loops are closed.
    #[must_use]
    pub fn kind(mut self, kind: Close) -> Self {
        self.kind = kind.into();
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
    /// [`Error::Input`] for a file that is no mesh; [`Error::Parameter`] for an output that makes
    /// no sense, and for a floor that is not below the mesh; [`Error::Memory`] if the budget is too small;
    /// [`Error::Io`], [`Error::Disk`], [`Error::Corrupt`], [`Error::Cancelled`]; those of an unfinished run, as of
    /// [`crate::Reconstruction::run`].
    pub fn run(&self) -> Result<CloseReport> {
        let scratch = self.resources.scratch.as_deref();
        match Delivery::of(&self.output, deliver::Kind::Mesh, scratch, None)? {
            None => self.run_to(None),
            Some(delivery) => {
                let mut local = self.clone();
                local.output = delivery.local().to_path_buf();
                local.run_to(Some(&delivery))
            }
        }
    }

    fn run_to(&self, delivery: Option<&Delivery>) -> Result<CloseReport> {
        check_output(&self.mesh, &self.output)?;
        let job = MeshJob {
            kind: "close",
            inputs: std::slice::from_ref(&self.mesh),
            output: &self.output,
            options: &self.kind,
            resources: &self.resources,
            delivery,
        };
        job.run(
            |workspace| closed(&self.mesh, &self.output, self.kind, workspace),
            || (),
        )
    }
}

/// Refuses an output that is compressed, or the mesh itself.
pub(super) fn check_output(mesh: &Path, output: &Path) -> Result<()> {
    export::format_of(output)?;
    let refuse = |expected: &str| {
        Err(Error::Parameter {
            name: "output",
            found: output.display().to_string(),
            expected: expected.into(),
        })
    };
    if export::is_compressed(output) {
        return refuse("a name that does not end with .zst");
    }
    match is_one_of(output, &[mesh]) {
        true => refuse("another file than the mesh"),
        false => Ok(()),
    }
}

/// Closes a mesh and writes it to `output`.
pub(super) fn closed(
    mesh: &Path,
    output: &Path,
    kind: Kind,
    workspace: &Workspace,
) -> Result<CloseReport> {
    // When all is done, the files of the steps inside may be gone.
    workspace.once("close", |_| make(mesh, output, kind, workspace))
}

fn make(mesh: &Path, output: &Path, kind: Kind, workspace: &Workspace) -> Result<CloseReport> {
    let closure = close::close(mesh, kind, workspace)?;
    let all = closure.stats.all();
    let report = CloseReport {
        vertices_before: closure.before[0],
        triangles_before: closure.before[1],
        vertices: closure.before[0] + closure.stats.vertices,
        triangles: closure.before[1] + all.triangles,
        kind,
        closed: closure.stats.clone(),
    };
    let observer = &workspace.observer;
    observer.begin("write", "triangles", report.triangles);
    let files = (mesh, output);
    workspace.once("write", |_| written(files, &closure, &report, workspace))?;
    observer.end();
    Ok(report)
}

fn written(
    (mesh, output): (&Path, &Path),
    closure: &Closure,
    report: &CloseReport,
    workspace: &Workspace,
) -> Result<()> {
    let most = u64::from(u32::MAX);
    if report.vertices > most {
        let found = report.vertices;
        let expected = format!("at most {most}: numbers of vertices have 32 bits");
        return Err(Error::input(
            mesh,
            "closed mesh",
            format!("{found} vertices"),
            expected,
        ));
    }
    let source = PlyMesh::open_any(mesh, workspace)?;
    let mut bounds = Bounds::new(output, report.vertices, workspace);
    Appending::of(closure, &source, &mut bounds, workspace)?.read(mesh, workspace)?;
    let like = Like {
        mesh,
        source: &source,
        output,
    };
    let counts = [report.vertices, report.triangles];
    let (mut about, shift) = like.about(counts, bounds.corners(), workspace)?;
    let format = export::format_of(output)?;
    let observer = &workspace.observer;
    match format.holds_filled() {
        true => about.filled = Some(false),
        false if report.triangles > report.triangles_before => observer.warn(&format!(
            "{} does not tell which triangles close the mesh: they are the last {}",
            format.name(),
            report.triangles - report.triangles_before
        )),
        false => {}
    }
    like.warn_of_left_out(&about, workspace)?;
    write(output, (about, shift), workspace, |writer| {
        Appending::of(closure, &source, writer, workspace)?.read(mesh, workspace)
    })
}

/// Receives triangles that close the mesh after others.
trait Fills: Sink {
    /// The triangles that come next close the mesh.
    fn fills(&mut self);
}

impl Fills for Bounds<'_> {
    fn fills(&mut self) {}
}

impl Fills for Writer<'_> {
    fn fills(&mut self) {
        self.fill(true);
    }
}

/// Passes on a mesh, with new vertices after its own and new triangles after its own.
struct Appending<'a, S> {
    sink: &'a mut S,
    closure: &'a Closure,
    workspace: &'a Workspace,
    /// Vertices of the mesh that are to come.
    left: u64,
    /// Number of the vertices that come next.
    next: u64,
    /// For each column whether its values are means.
    blended: Vec<bool>,
    wanted: Vec<(usize, outcrop_ply::Scalar)>,
    /// Vertices of the mesh whose values new ones have, ascending, and their values.
    parents: Vec<u32>,
    values: Vec<f64>,
    pending: usize,
    _held: outcrop_disk::workspace::memory::Reservation,
}

impl<'a, S: Fills> Appending<'a, S> {
    fn of(
        closure: &'a Closure,
        source: &PlyMesh,
        sink: &'a mut S,
        workspace: &'a Workspace,
    ) -> Result<Self> {
        let columns = source.columns();
        let wanted: Vec<_> = columns.iter().map(|c| (c.0, c.2)).collect();
        let mut held = workspace.reserve("close: values", 0)?;
        let mut parents = Vec::new();
        if !wanted.is_empty() {
            for number in 0..closure.parts() {
                let part = closure.part(number, closure.before[0], workspace)?;
                let own = part.parents.as_flattened().iter().copied();
                parents.extend(own.filter(|v| u64::from(*v) < closure.before[0]));
                parents.sort_unstable();
                parents.dedup();
                held.at_least(2 * parents.capacity() as u64 * 4)?;
            }
            let values = (parents.len() * wanted.len() * 8) as u64;
            held.at_least(2 * parents.capacity() as u64 * 4 + values)?;
        }
        Ok(Self {
            sink,
            closure,
            workspace,
            left: closure.before[0],
            next: 0,
            blended: columns.iter().map(|c| is_blended(c.1, c.2)).collect(),
            values: Vec::with_capacity(parents.len() * wanted.len()),
            wanted,
            parents,
            pending: 0,
            _held: held,
        })
    }

    /// Reads the mesh.
    fn read(mut self, mesh: &Path, workspace: &Workspace) -> Result<()> {
        let source = PlyMesh::open_any(mesh, workspace)?;
        let source = source.wanting(self.wanted.clone());
        if self.left == 0 {
            self.append()?;
        }
        source.read(&mut self)?;
        self.sink.fills();
        let mut first = self.closure.before[0];
        for number in 0..self.closure.parts() {
            let part = self.part(number, first)?;
            first += part.positions.len() as u64;
            for triangles in part.triangles.chunks(SLICE) {
                self.sink.triangles(triangles)?;
            }
        }
        Ok(())
    }

    fn part(&self, number: usize, first: u64) -> Result<Part> {
        let bytes = self.closure.bytes(number, self.workspace);
        let _held = self.workspace.reserve("close: parts", bytes)?;
        self.closure.part(number, first, self.workspace)
    }

    /// Passes on the new vertices.
    fn append(&mut self) -> Result<()> {
        let mut first = self.closure.before[0];
        for number in 0..self.closure.parts() {
            let part = self.part(number, first)?;
            let values = self.new_values(&part, first);
            first += part.positions.len() as u64;
            let width = self.wanted.len();
            for at in (0..part.positions.len()).step_by(SLICE) {
                let end = (at + SLICE).min(part.positions.len());
                self.sink.vertices(&part.positions[at..end])?;
                if width > 0 {
                    self.sink.values(&values[at * width..end * width])?;
                }
            }
        }
        Ok(())
    }

    /// The values of the new vertices of a part.
    fn new_values(&self, part: &Part, first: u64) -> Vec<f64> {
        let width = self.wanted.len();
        let mut values: Vec<f64> = Vec::with_capacity(width * part.positions.len());
        if width == 0 {
            return values;
        }
        for parents in &part.parents {
            for column in 0..width {
                let of = |v: u32| match u64::from(v).checked_sub(first) {
                    Some(new) => values[new as usize * width + column],
                    None => {
                        let at = self.parents.partition_point(|known| *known < v);
                        self.values[at * width + column]
                    }
                };
                let [a, b, c] = parents.map(of);
                let is_float = matches!(
                    self.wanted[column].1,
                    outcrop_ply::Scalar::F32 | outcrop_ply::Scalar::F64
                );
                values.push(match self.blended[column] {
                    _ if a == b && b == c => a,
                    true if is_float => (a + b + c) / 3.0,
                    true => ((a + b + c) / 3.0).round(),
                    false => a,
                });
            }
        }
        values
    }
}

impl<S: Fills> Sink for Appending<'_, S> {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        self.sink.vertices(positions)?;
        self.pending = positions.len();
        self.left -= (positions.len() as u64).min(self.left);
        match self.wanted.is_empty() && self.left == 0 {
            true => self.append(),
            false => Ok(()),
        }
    }

    fn values(&mut self, values: &[f64]) -> Result<()> {
        self.sink.values(values)?;
        let width = self.wanted.len();
        let end = self.next + self.pending as u64;
        let from = self.parents.partition_point(|v| u64::from(*v) < self.next);
        for v in &self.parents[from..] {
            if u64::from(*v) >= end {
                break;
            }
            let at = (u64::from(*v) - self.next) as usize * width;
            self.values.extend_from_slice(&values[at..at + width]);
        }
        self.next = end;
        match self.left {
            0 => self.append(),
            _ => Ok(()),
        }
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.workspace.observer.advance(triangles.len() as u64);
        self.sink.triangles(triangles)
    }
}
