//! A mesh as pages of triangles in curve order, and a choice of its vertices.
//!
//! The vertices stay in memory while the triangles obtain their positions, if they fit a quarter of the free
//! memory. Otherwise corners are sorted by vertex and back by triangle, on disk. Both ways give the same
//! pages and the same choice.

use super::Options;
use super::corners::Joined;
use super::shape::{Shape, usable};
use super::triangles::{KeyedTriangle, Reading};
use outcrop_codecs::ply_mesh::{PlyMesh, Sink};
use outcrop_disk::error::Result;
use outcrop_disk::spill::Sorter;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::vector::V3;
use std::path::Path;

/// Bytes of a vertex in memory, with a bit for its use.
const VERTEX: u64 = 25;

/// Reads a mesh. If there is a unit, the pages survive the attempt.
pub(super) fn read(
    path: &Path,
    name: &'static str,
    options: &Options,
    unit: Option<&Unit<'_>>,
    workspace: &Workspace,
) -> Result<Shape> {
    let mesh = PlyMesh::open_any(path, workspace)?;
    let reading = Reading {
        unit,
        ..Reading::of(&mesh, path, name, options, workspace)
    };
    read_with(mesh, reading, None)
}

fn read_with(mesh: PlyMesh, reading: Reading<'_>, sound: Option<Sound>) -> Result<Shape> {
    let workspace = reading.workspace;
    let observer = &workspace.observer;
    let bytes = reading.vertices * VERTEX;
    let small = bytes <= workspace.memory.available() / 4;
    let total = reading.vertices + reading.faces;
    observer.begin("read mesh", "vertices and faces", total);
    if small {
        let _held = workspace.reserve("compare: vertices", bytes)?;
        let mut direct = Direct::new(reading)?;
        mesh.read_in_place(&mut Sieve(&mut direct, sound))?;
        observer.end();
        direct.finish()
    } else {
        let mut joined = Joined::new(reading)?;
        mesh.read_in_place(&mut Sieve(&mut joined, sound))?;
        observer.end();
        joined.finish()
    }
}

/// Reads a mesh without the faces that cannot be drawn: those with corners that do not
/// exist or are not finite.
#[cfg(feature = "pictures")]
pub(super) fn read_sound(
    path: &Path,
    name: &'static str,
    options: &Options,
    workspace: &Workspace,
) -> Result<Shape> {
    let mesh = PlyMesh::open_any(path, workspace)?;
    let vertices = mesh.vertices();
    let _held = workspace.reserve("draw: vertices", vertices.div_ceil(64) * 8)?;
    let sound = Sound {
        bad: vec![0; vertices.div_ceil(64) as usize],
        vertices,
        seen: 0,
        batch: Vec::new(),
    };
    let reading = Reading::of(&mesh, path, name, options, workspace);
    read_with(mesh, reading, Some(sound))
}

/// Leaves out faces that cannot be drawn.
struct Sound {
    /// One bit for each vertex, set if its position cannot be used.
    bad: Vec<u64>,
    vertices: u64,
    seen: usize,
    batch: Vec<[u32; 3]>,
}

/// Passes on what is sound.
struct Sieve<'s, S>(&'s mut S, Option<Sound>);

impl<S: Sink> Sink for Sieve<'_, S> {
    fn vertices(&mut self, positions: &[V3]) -> Result<()> {
        if let Some(sound) = &mut self.1 {
            for p in positions {
                if !usable(*p) {
                    sound.bad[sound.seen / 64] |= 1 << (sound.seen % 64);
                }
                sound.seen += 1;
            }
        }
        self.0.vertices(positions)
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        let Some(sound) = &mut self.1 else {
            return self.0.triangles(triangles);
        };
        let good = |v: &u32| {
            let v = *v as usize;
            (v as u64) < sound.vertices && sound.bad[v / 64] >> (v % 64) & 1 == 0
        };
        sound.batch.clear();
        let all = triangles.iter().filter(|t| t.iter().all(good));
        sound.batch.extend(all);
        self.0.triangles(&sound.batch)
    }
}

/// Reads a mesh whose vertices fit into memory.
struct Direct<'a> {
    reading: Reading<'a>,
    sorter: Sorter<KeyedTriangle>,
    _held: Reservation,
    vertices: Vec<V3>,
    referenced: Vec<u64>,
    batch: Vec<KeyedTriangle>,
}

impl<'a> Direct<'a> {
    fn new(reading: Reading<'a>) -> Result<Self> {
        let wanted = reading.faces * size_of::<KeyedTriangle>() as u64;
        let buffer = wanted.min(reading.workspace.memory.available() / 3) + (1 << 20);
        let (sorter, held) = reading.sorter("order", buffer)?;
        Ok(Self {
            sorter,
            _held: held,
            vertices: Vec::with_capacity(reading.vertices as usize),
            referenced: vec![0; reading.vertices.div_ceil(64) as usize],
            batch: Vec::new(),
            reading,
        })
    }

    fn finish(self) -> Result<Shape> {
        let triangles = self.reading.pages(self.sorter)?;
        let used = self.referenced.iter().map(|w| u64::from(w.count_ones()));
        self.reading.shape(triangles, used.sum(), |chooser| {
            let mut all = self.vertices.iter().enumerate();
            let used = |v: usize| self.referenced[v / 64] >> (v % 64) & 1 == 1;
            all.try_for_each(|(v, p)| if used(v) { chooser.offer(*p) } else { Ok(()) })
        })
    }
}

impl Sink for Direct<'_> {
    fn vertices(&mut self, positions: &[V3]) -> Result<()> {
        self.vertices.extend_from_slice(positions);
        self.reading.see(positions)
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.batch.clear();
        for corners in triangles {
            let mut triangle = [[0.0; 3]; 3];
            for (at, &v) in triangle.iter_mut().zip(corners) {
                let p = self.vertices.get(v as usize);
                *at = *p.ok_or_else(|| self.reading.no_vertex())?;
                self.reading.check(v, *at)?;
                self.referenced[v as usize / 64] |= 1 << (v % 64);
            }
            self.batch.push(self.reading.keyed(triangle));
        }
        self.sorter.push(&self.batch)?;
        self.reading.advance(triangles.len())
    }
}
