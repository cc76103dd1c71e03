//! The mesh to be closed, read at any place by all threads.

use outcrop_codecs::ply_mesh::{AnyPlace, PlyMesh};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::vector::V3;
use std::path::{Path, PathBuf};

/// Triangles that a unit reads.
pub(crate) const RANGE: u64 = 1 << 18;

/// Triangles that are read at a time.
const SLICE: u64 = 1 << 15;

/// Vertices of a page, which is read as a whole.
pub(crate) const PAGE: usize = 1 << 10;

/// Pages that a reader of positions holds.
const PAGES: usize = 256;

/// Bytes of memory of a reader of triangles and positions.
pub(crate) const READER: u64 = ((PAGES + 1) * PAGE * 48 + (SLICE as usize) * 96) as u64;

/// A mesh.
pub(crate) struct Source {
    path: PathBuf,
    mesh: PlyMesh,
    pub vertices: u64,
    pub triangles: u64,
}

impl Source {
    /// Opens a mesh.
    pub fn open(path: &Path, workspace: &Workspace) -> Result<Self> {
        let mesh = PlyMesh::open_any(path, workspace)?;
        Ok(Self {
            path: path.to_path_buf(),
            vertices: mesh.vertices(),
            triangles: mesh.faces(),
            mesh,
        })
    }

    /// Number of ranges of triangles.
    pub fn ranges(&self) -> usize {
        self.triangles.div_ceil(RANGE) as usize
    }

    /// Calls `each` with the triangles of a range; with their positions, if the reader has them looked up.
    pub fn read(
        &self,
        unit: &Unit<'_>,
        mut each: impl FnMut(&[[u32; 3]], &mut Positions<'_>) -> Result<()>,
    ) -> Result<()> {
        let fixed = self.fixed()?;
        let mut positions = Positions::of(self, &fixed);
        let first = unit.number() as u64 * RANGE;
        let end = (first + RANGE).min(self.triangles);
        let (mut bytes, mut triangles) = (Vec::new(), Vec::new());
        for from in (first..end).step_by(SLICE as usize) {
            let count = SLICE.min(end - from) as usize;
            if !fixed.triangles((from, count), &mut bytes, &mut triangles)? {
                let expected = "triangles; split them first";
                return Err(Error::input(
                    &self.path,
                    "faces",
                    "other polygons",
                    expected,
                ));
            }
            let largest = triangles.as_flattened().iter().copied().max().unwrap_or(0);
            if u64::from(largest) >= self.vertices {
                let expected = format!("vertices below {}", self.vertices);
                let found = format!("a triangle with the corner {largest}");
                return Err(Error::input(&self.path, "faces", found, expected));
            }
            each(&triangles, &mut positions)?;
            unit.advance(count as u64);
            unit.check_cancel()?;
        }
        Ok(())
    }

    /// The mesh at any place.
    pub fn fixed(&self) -> Result<AnyPlace> {
        let fixed = self.mesh.fixed()?;
        fixed.ok_or_else(|| Error::input(&self.path, "mesh", "a changed file", "the same mesh"))
    }
}

/// Positions of vertices, through pages that were read last.
pub(crate) struct Positions<'a> {
    fixed: &'a AnyPlace,
    source: &'a Source,
    pages: Vec<(u64, Vec<V3>)>,
    bytes: Vec<u8>,
}

impl<'a> Positions<'a> {
    pub fn of(source: &'a Source, fixed: &'a AnyPlace) -> Self {
        Self {
            fixed,
            source,
            pages: vec![(u64::MAX, Vec::new()); PAGES],
            bytes: Vec::new(),
        }
    }

    /// The position of a vertex of the mesh.
    pub fn at(&mut self, vertex: u32) -> Result<V3> {
        let (page, place) = (u64::from(vertex) / PAGE as u64, vertex as usize % PAGE);
        let slot = &mut self.pages[page as usize % PAGES];
        if slot.0 != page {
            let first = page * PAGE as u64;
            let count = (self.source.vertices - first).min(PAGE as u64) as usize;
            slot.1.clear();
            self.fixed
                .positions((first, count), &mut self.bytes, &mut slot.1)?;
            slot.0 = page;
        }
        let position = slot.1[place];
        if position.iter().all(|x| x.is_finite()) {
            return Ok(position);
        }
        let [x, y, z] = position;
        let found = format!("a position {x} {y} {z}");
        let place = format!("vertex {vertex}");
        Err(Error::input(
            &self.source.path,
            place,
            found,
            "finite numbers",
        ))
    }

    /// The corners of a triangle.
    pub fn corners(&mut self, [a, b, c]: [u32; 3]) -> Result<[V3; 3]> {
        Ok([self.at(a)?, self.at(b)?, self.at(c)?])
    }
}
