//! Writes the parts of a mesh. In the file the parts of one kind follow each other: vertices, copies of pinched
//! vertices, triangles.

use super::file::{Edge, HEADER, MeshFile};
use super::parts::Parts;
use crate::error::Result;
use crate::geom::Point;
use crate::geom::lattice::Lattice;
use crate::stages::order::PointStore;
use crate::workspace::memory::bytes_of;
use crate::workspace::{Unit, Workspace};

/// Writes the parts of a mesh to its file.
pub struct Writer<'a, P> {
    pub store: &'a PointStore,
    pub lattice: &'a Lattice,
    pub parts: P,
    pub file: MeshFile<'a>,
}

/// Number of kinds of records.
pub const KINDS: usize = 3;

impl<P: Parts> Writer<'_, P> {
    /// Writes the file, every part at its offset.
    pub fn write(&self, workspace: &Workspace) -> Result<()> {
        let file = &self.file;
        workspace.once("header", |unit| {
            file.write(unit, HEADER, &file.layout.header, 0)
        })?;
        let memory = |part| self.memory(workspace, part);
        let work = |unit: &Unit<'_>| {
            let edges = self.write_part(unit, unit.number())?;
            unit.advance(1);
            Ok(edges)
        };
        let each = |_, edges: Vec<Edge>| file.write_edges(&edges);
        workspace.units("export: block", self.parts.count(), memory, work, each)
    }

    /// Writes all kinds of records of a part; returns the edges that a task leaves.
    pub fn write_part(&self, unit: &Unit<'_>, part: usize) -> Result<Vec<Edge>> {
        let (mut bytes, mut edges) = (Vec::new(), Vec::new());
        for kind in 0..KINDS {
            let slice = kind * self.parts.count() + part;
            self.encode(unit, slice, &mut bytes)?;
            let start = self.start(slice);
            edges.extend(self.file.write(unit, slice as u32, &bytes, start)?);
        }
        Ok(edges)
    }

    /// Bytes of memory for a part.
    pub fn memory(&self, workspace: &Workspace, part: usize) -> u64 {
        self.parts.memory(workspace, part)
    }

    /// Offset in the uncompressed file at which a slice begins: the end of the slice before it.
    pub fn start(&self, slice: usize) -> u64 {
        let (layout, count) = (&self.file.layout, self.parts.count());
        let firsts = || self.parts.firsts(slice % count);
        match slice / count {
            0 => layout.vertices.offset(firsts()[0]),
            1 => layout.vertices.offset(firsts()[1]),
            2 => layout.triangles.offset(firsts()[2]),
            _ => layout.bytes,
        }
    }

    /// Encodes a slice: one kind of records of a part.
    pub fn encode(&self, unit: &Unit<'_>, slice: usize, bytes: &mut Vec<u8>) -> Result<()> {
        let (kind, part) = (slice / self.parts.count(), slice % self.parts.count());
        bytes.clear();
        bytes.reserve_exact((self.start(slice + 1) - self.start(slice)) as usize);
        if kind < 2 {
            let ids = self.parts.vertices(unit, part, kind == 1)?;
            return self.vertices(unit, &ids, bytes);
        }
        let _held = unit.hold(bytes_of(bytes));
        let mut batch = self.file.triangles(bytes);
        self.parts.triangles(unit, part, |t| batch.push(t))?;
        batch.finish();
        Ok(())
    }

    /// Encodes the positions of points with ascending ids.
    fn vertices(&self, unit: &Unit<'_>, ids: &[u32], bytes: &mut Vec<u8>) -> Result<()> {
        let [Some(first), Some(last)] = [ids.first(), ids.last()] else {
            return Ok(());
        };
        let (start, end) = (*first as usize, *last as usize + 1);
        let (mut points, mut first): (Vec<Point>, usize) = (Vec::with_capacity(ids.len()), 0);
        // Where most points of a range are wanted, it is read at once.
        let dense = (end - start) / 4 <= ids.len();
        if dense {
            (points, first) = (self.store.slice(start..end)?, start);
        } else {
            self.store.fetch(ids, &mut points)?;
        }
        let _held = unit.hold(bytes_of(&points) + bytes_of(bytes) + size_of_val(ids) as u64);
        let at = |(n, v): (usize, &u32)| {
            let n = if dense { *v as usize - first } else { n };
            self.lattice.position(points[n])
        };
        self.file
            .encode_vertices(ids.iter().enumerate().map(at), &[], bytes);
        Ok(())
    }
}
