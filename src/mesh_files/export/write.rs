//! Encodes the parts of a mesh, and writes them at their offsets.

use super::coordinates::Coordinates;
use super::corners::Corners;
use super::file::{Edge, HEADER, MeshFile};
use super::parts::Parts;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_stages::attributes::StoredColumns;
use outcrop_stages::ids::{Id, Ids};
use outcrop_stages::order::PointStore;

/// Writes the parts of a mesh: of each its vertices, its copies of vertices, and its triangles. In the file the
/// slices of one kind follow each other.
pub struct Writer<'a, P> {
    /// Positions.
    pub store: &'a PointStore,
    /// The parts.
    pub parts: P,
    /// Columns of the points, and true for each of them that the file holds; behind the normals.
    pub columns: Option<(&'a StoredColumns, Vec<bool>)>,
    /// Normals are among the columns, as the first; those of a compressed mesh come from scratch.
    pub normals: bool,
    /// The coordinates in the file.
    pub coordinates: Coordinates<'a>,
    /// Lowest and highest positions of the vertices, if the format wants them.
    pub bounds: Option<[Point; 2]>,
    /// The file.
    pub file: MeshFile<'a>,
}

/// Number of slices of a part.
pub const KINDS: usize = 3;

impl<P: Parts> Writer<'_, P> {
    /// Writes the file, every slice at its offset.
    pub fn write(&self, workspace: &Workspace) -> Result<()> {
        let file = &self.file;
        workspace.once("header", |unit| self.write_header(unit).map(drop))?;
        let memory = |part| self.memory(workspace, part);
        let work = |unit: &Unit<'_>| {
            let edges = self.write_part(unit, unit.number())?;
            unit.advance(1);
            Ok(edges)
        };
        let each = |_, edges: Vec<Edge>| file.write_edges(&edges);
        workspace.units("export: block", self.parts.count(), memory, work, each)
    }

    /// Writes the header.
    pub fn write_header(&self, unit: &Unit<'_>) -> Result<Vec<Edge>> {
        self.file.write(unit, HEADER, &self.file.layout.header, 0)
    }

    /// Writes the slices of a part; returns the edges that a task leaves.
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
        let [points, records] = self.parts.sizes(workspace, part);
        let layout = &self.file.layout;
        let of_triangles = (47 + layout.triangles.bytes) * records;
        let of_points = (36 + layout.vertices.bytes + self.file.value_bytes() as u64) * points;
        let mut bytes = of_triangles + of_points + (1 << 20);
        if self.file.wants_positions() {
            bytes += Corners::estimate(points, records);
        }
        if let Some((columns, _)) = &self.columns {
            bytes += columns.bytes(points as usize);
        }
        if self.normals {
            bytes += P::normals_estimate(points, records);
        }
        bytes
    }

    /// Offset in the uncompressed file at which a slice begins: the end of the slice before it.
    pub fn start(&self, slice: usize) -> u64 {
        let (layout, count) = (&self.file.layout, self.parts.count());
        let first = |kind: usize| self.parts.firsts(slice % count)[kind];
        match slice / count {
            0 => layout.vertices.offset(first(0)),
            1 => layout.vertices.offset(first(1)),
            2 => layout.triangles.offset(first(2)),
            _ => layout.bytes,
        }
    }

    /// Number of a part's first triangle.
    pub fn first_triangle(&self, part: usize) -> u64 {
        match part < self.parts.count() {
            true => self.parts.firsts(part)[2],
            false => self.parts.stats().triangles,
        }
    }

    /// Encodes a slice.
    pub fn encode(&self, unit: &Unit<'_>, slice: usize, bytes: &mut Vec<u8>) -> Result<()> {
        let (kind, part) = (slice / self.parts.count(), slice % self.parts.count());
        bytes.clear();
        let size = (self.start(slice + 1) - self.start(slice)) as usize;
        if size == 0 {
            return Ok(());
        }
        bytes.reserve_exact(size);
        if kind == 2 {
            return self.triangles(unit, part, bytes);
        }
        let ids = self.parts.vertices(unit, part, kind == 1)?;
        let normals = self
            .normals
            .then(|| self.parts.normals(unit, part, kind == 1, &ids));
        self.vertices(unit, &ids, normals.transpose()?, bytes)
    }

    /// Encodes the points with ascending `ids`, with the normals of each, if any.
    fn vertices(
        &self,
        unit: &Unit<'_>,
        ids: &[Id],
        normals: Option<Vec<[f32; 3]>>,
        bytes: &mut Vec<u8>,
    ) -> Result<()> {
        let [Some(first), Some(last)] = [ids.first(), ids.last()] else {
            return Ok(());
        };
        let range = Ids {
            start: *first,
            end: last.behind(1),
        };
        let mut points: Vec<Point> = Vec::with_capacity(ids.len());
        // Where many points of a range are wanted, it is read at once.
        if range.len() / 4 <= ids.len() {
            let all = self.store.slice(range.indices())?;
            points.extend(ids.iter().map(|id| all[range.place(*id)]));
        } else {
            self.store.fetch(ids, &mut points)?;
        }
        let values = self.values(unit, ids, normals.as_deref())?;
        let lists = bytes_of(&points) + bytes_of(&values) + 4 * ids.len() as u64;
        let _held = unit.hold(lists + bytes_of(bytes));
        let at = |p: &Point| self.coordinates.of(*p);
        self.file
            .encode_vertices(points.iter().map(at), &values, bytes);
        Ok(())
    }

    /// The values of points with ascending `ids`: their normals, if any, and their columns.
    pub fn values(
        &self,
        unit: &Unit<'_>,
        ids: &[Id],
        normals: Option<&[[f32; 3]]>,
    ) -> Result<Vec<u8>> {
        let columns = self.columns.as_ref();
        let opened = columns.map(|(columns, held)| {
            let values = columns.open(unit, ids)?;
            Ok((values, held))
        });
        let opened = opened.transpose()?;
        let _held = unit.hold(opened.as_ref().map_or(0, |(values, _)| values.bytes()));
        let mut bytes = Vec::with_capacity(ids.len() * self.file.value_bytes());
        for number in 0..ids.len() {
            if let Some(normals) = normals {
                bytes.extend(normals[number].iter().flat_map(|x| x.to_le_bytes()));
            }
            if let Some((values, held)) = &opened {
                values.put(number, held, &mut bytes);
            }
        }
        Ok(bytes)
    }

    /// Encodes the triangles of a part.
    fn triangles(&self, unit: &Unit<'_>, part: usize, bytes: &mut Vec<u8>) -> Result<()> {
        let faces = self.parts.faces(unit, part)?;
        let _held = unit.hold(faces.bytes() + bytes_of(bytes));
        if !self.file.wants_positions() {
            let mut batch = self.file.triangles(bytes);
            faces.for_each(|t, _| batch.push(t));
            batch.finish();
            return Ok(());
        }
        let corners = faces.corners(self.store)?;
        let _corners = unit.hold(corners.bytes());
        let mut batch = self.file.placed_triangles(bytes);
        faces.for_each(|t, ids| batch.push((t, ids.map(|v| self.coordinates.of(corners.at(v))))));
        batch.finish();
        Ok(())
    }
}
