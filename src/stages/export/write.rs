//! Encodes the parts of a mesh, and writes them at their offsets.

use super::corners::Corners;
use super::faces::Faces;
use super::file::{Edge, HEADER, MeshFile};
use super::normals::{Normals, Sources};
use super::number::Numbering;
use crate::error::Result;
use crate::geom::Point;
use crate::geom::lattice::Lattice;
use crate::spill::{Id, Inbox, Table};
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::repair::{FilledTriangle, Surface};
use crate::workspace::memory::bytes_of;
use crate::workspace::{Unit, Workspace};
use std::ops::Range;

/// Writes the parts of a mesh: for each block its vertices, its copies of vertices, and its triangles. In the
/// file the parts of one kind follow each other.
pub struct Writer<'a> {
    /// Positions.
    pub store: &'a PointStore,
    /// Triangles, except those that fill holes.
    pub surface: Surface<'a>,
    /// Triangles that fill holes.
    pub filled: Inbox<FilledTriangle>,
    /// Vertices that may have copies.
    pub pinches: &'a Table<Id>,
    /// Normals are among the columns, as the first.
    pub normals: bool,
    /// Numbers of vertices and triangles.
    pub numbering: Numbering,
    /// Division into blocks.
    pub blocks: Blocks,
    /// The map from the store's positions to those of the mesh.
    pub frame: Frame<'a>,
    /// The file.
    pub file: MeshFile<'a>,
}

/// Number of parts of a block.
pub const KINDS: usize = 3;

impl Writer<'_> {
    /// Writes the file, every part at its offset.
    pub fn write(&self, workspace: &Workspace) -> Result<()> {
        let (file, count) = (&self.file, self.blocks.count());
        workspace.once("header", |unit| {
            file.write(unit, HEADER, &file.layout.header, 0)
        })?;
        let memory = |block| self.memory(workspace, block);
        let work = |unit: &Unit<'_>| {
            let (mut bytes, mut edges) = (Vec::new(), Vec::new());
            for kind in 0..KINDS {
                let part = kind * count + unit.number();
                self.encode(unit, part, &mut bytes)?;
                edges.extend(file.write(unit, part as u32, &bytes, self.start(part))?);
            }
            unit.advance(1);
            Ok(edges)
        };
        let each = |_, edges: Vec<Edge>| file.write_edges(&edges);
        workspace.units("export: block", count, memory, work, each)
    }

    /// Bytes of memory for a part of a block.
    pub fn memory(&self, workspace: &Workspace, block: usize) -> u64 {
        let records = self.surface.records(workspace, block) + self.filled.rows(block);
        let (records, points) = (records as u64, self.blocks.ids(block).len() as u64);
        let layout = &self.file.layout;
        let of_triangles = (47 + layout.triangles.bytes) * records;
        let of_points = (36 + layout.vertices.bytes + self.file.value_bytes() as u64) * points;
        let mut bytes = of_triangles + of_points + (1 << 20);
        if self.file.wants_positions() {
            bytes += Corners::estimate(points, records);
        }
        if self.normals {
            bytes += Normals::estimate(points, records);
        }
        bytes
    }

    /// Offset in the uncompressed file at which a part begins: the end of the part before it.
    pub fn start(&self, part: usize) -> u64 {
        let (layout, numbering) = (&self.file.layout, &self.numbering);
        let block = part % self.blocks.count();
        match part / self.blocks.count() {
            0 => {
                let first = numbering.vertex(self.blocks.ids(block).start);
                layout.vertices.offset(first.into())
            }
            1 => layout.vertices.offset(numbering.first_copy(block)),
            2 => layout.triangles.offset(numbering.first_face(block)),
            _ => layout.bytes,
        }
    }

    /// Encodes a part.
    pub fn encode(&self, unit: &Unit<'_>, part: usize, bytes: &mut Vec<u8>) -> Result<()> {
        let (numbering, block) = (&self.numbering, part % self.blocks.count());
        let ids = self.blocks.ids(block);
        bytes.clear();
        let size = (self.start(part + 1) - self.start(part)) as usize;
        if size == 0 {
            return Ok(());
        }
        bytes.reserve_exact(size);
        let normals = |unit| {
            self.normals
                .then(|| self.normals_of(unit, block))
                .transpose()
        };
        match part / self.blocks.count() {
            0 => {
                let used: Vec<u32> = ids.clone().filter(|v| numbering.used(*v)).collect();
                let normals = normals(unit)?.map(|normals| {
                    let _held = unit.hold(normals.bytes());
                    let own = |v: &u32| normals.points[(v - ids.start) as usize];
                    used.iter().map(own).collect::<Vec<_>>()
                });
                self.vertices(unit, ids, &used, normals, bytes)
            }
            1 => {
                let copies = numbering.copies.get(unit, block)?;
                let copies: Vec<u32> = copies.iter().map(|c| c.id).collect();
                let normals = normals(unit)?.map(|normals| normals.copies);
                self.vertices(unit, ids, &copies, normals, bytes)
            }
            _ => self.triangles(unit, block, bytes),
        }
    }

    /// The normals of a block.
    fn normals_of(&self, unit: &Unit<'_>, block: usize) -> Result<Normals> {
        let sources = Sources {
            store: self.store,
            surface: &self.surface,
            filled: &self.filled,
            pinches: self.pinches,
            blocks: self.blocks,
        };
        Normals::of(unit, &sources, block)
    }

    /// Encodes the `chosen` points of the block with the ids `ids`, with the normals of each, if any.
    fn vertices(
        &self,
        unit: &Unit<'_>,
        ids: Range<u32>,
        chosen: &[u32],
        normals: Option<Vec<[f32; 3]>>,
        bytes: &mut Vec<u8>,
    ) -> Result<()> {
        let points = self.store.slice(ids.start as usize..ids.end as usize)?;
        let values = normals.as_deref().map_or_else(Vec::new, values);
        let lists = bytes_of(&points) + bytes_of(&values) + 4 * chosen.len() as u64;
        let _held = unit.hold(lists + bytes_of(bytes));
        let at = |v: &u32| self.frame.position(points[(v - ids.start) as usize]);
        self.file
            .encode_vertices(chosen.iter().map(at), &values, bytes);
        Ok(())
    }

    /// Encodes the triangles of a block.
    fn triangles(&self, unit: &Unit<'_>, block: usize, bytes: &mut Vec<u8>) -> Result<()> {
        let ids = self.blocks.ids(block);
        let numbering = &self.numbering;
        let faces = Faces::load(
            unit,
            block,
            &self.surface,
            &self.filled,
            numbering,
            ids.clone(),
        )?;
        let _held = unit.hold(faces.bytes() + bytes_of(bytes));
        if !self.file.wants_positions() {
            let mut batch = self.file.triangles(bytes);
            faces.for_each(|t, _| batch.push(t));
            batch.finish();
            return Ok(());
        }
        let corners = Corners::load(self.store, ids, faces.ids())?;
        let _corners = unit.hold(corners.bytes());
        let mut batch = self.file.placed_triangles(bytes);
        faces.for_each(|t, ids| batch.push((t, ids.map(|v| self.frame.position(corners.at(v))))));
        batch.finish();
        Ok(())
    }
}

/// The map from positions on the lattice to those in the mesh.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    /// The lattice.
    pub lattice: &'a Lattice,
}

impl Frame<'_> {
    /// The position of a point in the mesh; it ascends with the point.
    pub fn position(&self, point: Point) -> [f64; 3] {
        self.lattice.position(point)
    }
}

/// The bytes of normals.
fn values(normals: &[[f32; 3]]) -> Vec<u8> {
    let words = normals.as_flattened().iter();
    words.flat_map(|x| x.to_le_bytes()).collect()
}
