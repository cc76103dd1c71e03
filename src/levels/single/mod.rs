//! One mesh with fewer triangles, of a mesh of any size, in bounded memory.
//!
//! The triangles are divided into the cells of an octree, and in each cell edges are contracted, the cheapest first
//! (`collapse`, and `patch` and `quadric`, which tiles have as well). A vertex that several cells have stays. What is left is put together and is the
//! mesh of the next pass (`kept`), whose octree is moved, so that the borders of the former cells lie inside of cells.
//! Quadrics go with the vertices from pass to pass: the mesh is about the one that a single pass over all triangles
//! would make. `passes` decides how far each pass goes. The cells do not depend on memory or threads, so neither does
//! the mesh.

mod collapse;
mod kept;
mod pass;
mod passes;

use crate::intake::{self, About, Reader, Stored};
use crate::quadric::NUMBERS;
use kept::Kept;
use outcrop_codecs::ply_mesh::{PlyMesh, Sink};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_ply::Scalar;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Most triangles of a cell.
pub const MOST: u32 = 1 << 17;

/// How far a mesh is simplified.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Goal {
    /// To this number of triangles, or fewer by 1 %.
    Triangles(u64),
    /// To this part of its triangles.
    Ratio(f64),
    /// As long as the mean distance of a vertex from the planes of the triangles that it stands for is at most this.
    Error(f64),
}

/// Options that decide the mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// How far the mesh is simplified.
    pub goal: Goal,
    /// Leave the boundary as it is.
    pub keep_boundary: bool,
    /// Most triangles of a cell: for tests.
    #[doc(hidden)]
    pub most_triangles: u32,
}

impl Options {
    /// The options for a goal.
    #[must_use]
    pub fn of(goal: Goal) -> Self {
        Self {
            goal,
            keep_boundary: false,
            most_triangles: MOST,
        }
    }
}

/// Columns of a mesh, and quadrics after the first pass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Columns {
    /// Indices in the file and types.
    wanted: Vec<(usize, Scalar)>,
    /// True for columns whose values lie between those of both ends of an edge: floats and colours. Of others, such as
    /// classes, a vertex has the value of the nearer end.
    blended: Vec<bool>,
    with_quadrics: bool,
}

impl Stored for Columns {
    fn words(&self) -> usize {
        2 * self.values()
    }

    fn values(&self) -> usize {
        self.wanted.len() + if self.with_quadrics { NUMBERS } else { 0 }
    }

    fn store(&mut self, values: &[f64], mut put: impl FnMut(u32)) {
        for value in values {
            let bits = value.to_bits();
            put(bits as u32);
            put((bits >> 32) as u32);
        }
    }
}

/// Names of columns of integers that are quantities.
const BLENDED: [&str; 5] = ["red", "green", "blue", "alpha", "intensity"];

/// True if a vertex between others has a mean of their values in the column with this name and type.
#[must_use]
pub fn is_blended(name: &str, scalar: Scalar) -> bool {
    matches!(scalar, Scalar::F32 | Scalar::F64) || BLENDED.contains(&name)
}

type Intake = intake::Intake<Columns>;

/// A mesh that was simplified; it lies in the scratch folder.
#[derive(Debug)]
pub struct Simplified {
    kept: Kept,
    /// Vertices and triangles of the mesh that was read.
    pub before: [u64; 2],
    /// Triangles of the mesh that was read with two equal corners, which are left out.
    pub degenerate: u64,
    /// The largest mean distance of a vertex from the planes of the triangles that it stands for; 0 if no edge was
    /// contracted.
    pub error: f64,
    /// How often all triangles were looked at.
    pub passes: u32,
}

impl Simplified {
    /// Number of vertices.
    #[must_use]
    pub fn vertices(&self) -> u64 {
        self.kept.vertices
    }

    /// Number of triangles.
    #[must_use]
    pub fn triangles(&self) -> u64 {
        self.kept.triangles
    }

    /// Reads the mesh: vertices, with the values of all columns, then triangles.
    ///
    /// # Errors
    /// Errors of the sink; [`Error::Memory`], [`Error::Io`], [`Error::Corrupt`].
    pub fn read(&self, sink: &mut impl Sink, workspace: &Workspace) -> Result<()> {
        self.kept.read(sink, false, &workspace.unit())
    }
}

/// Leaves out triangles with two equal corners.
struct Whole<S> {
    sink: S,
    left_out: u64,
    batch: Vec<[u32; 3]>,
}

impl<S: Sink> Sink for Whole<S> {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        self.sink.vertices(positions)
    }

    fn values(&mut self, values: &[f64]) -> Result<()> {
        self.sink.values(values)
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        let is_whole = |[a, b, c]: &&[u32; 3]| a != b && b != c && c != a;
        self.batch.clear();
        self.batch.extend(triangles.iter().filter(is_whole));
        self.left_out += (triangles.len() - self.batch.len()) as u64;
        self.sink.triangles(&self.batch)
    }
}

/// Reads the mesh, with the coordinates of the file; returns also how many triangles were left out.
fn read(path: &Path, workspace: &Workspace) -> Result<(Intake, u64)> {
    workspace.once("read", |unit| {
        let mesh = PlyMesh::open_any(path, workspace)?;
        let all = mesh.columns();
        let columns = Columns {
            wanted: all.iter().map(|c| (c.0, c.2)).collect(),
            blended: all.iter().map(|c| is_blended(c.1, c.2)).collect(),
            with_quadrics: false,
        };
        let bytes = intake::bytes(&columns, mesh.vertices());
        let _held = workspace.reserve("simplify: reading", bytes)?;
        let total = mesh.vertices() + mesh.faces();
        let observer = &workspace.observer;
        observer.begin("read mesh", "vertices and faces", total);
        let wanted = columns.wanted.clone();
        let about = About {
            path,
            vertices: mesh.vertices(),
            floats: mesh.has_floats(),
            columns,
            names: ["single.vertices 0", "single.triangles 0"],
        };
        let mut whole = Whole {
            sink: Reader::new(about, unit),
            left_out: 0,
            batch: Vec::new(),
        };
        mesh.wanting(wanted).read(&mut whole)?;
        observer.end();
        Ok((whole.sink.finish()?, whole.left_out))
    })
}

/// Simplifies a mesh.
///
/// # Errors
/// [`Error::Input`] for a file that is no mesh; [`Error::Memory`], [`Error::Io`],
/// [`Error::Disk`], [`Error::Corrupt`], [`Error::Cancelled`].
pub fn simplify(path: &Path, options: &Options, workspace: &Workspace) -> Result<Simplified> {
    let (intake, degenerate) = read(path, workspace)?;
    if intake.triangles == 0 {
        let expected = "a mesh with triangles";
        return Err(Error::input(path, "faces", "no triangle", expected));
    }
    passes::run(path, intake, degenerate, options, workspace)
}
