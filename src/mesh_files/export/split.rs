//! Writes one mesh for each square of a cut surface, and an index of them.
//!
//! The meshes are written under temporary names, all pieces in parallel. When all are complete they get their
//! names, the index last: if it is there, everything is.

use super::file::{MeshFile, folder_of, temporary, temporary_of};
use super::formats::{check_size, format_of};
use super::parts::{OfTile, Parts};
use super::write::Writer;
use super::{ExportOptions, MeshStats, in_order, no_triangles};
use crate::cut::{Pieces, Square, StoredPieces, Tile};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::fault::{self, Event};
use outcrop_disk::workspace::open::open_existing;
use outcrop_disk::workspace::place::{Place, Put};
use outcrop_disk::workspace::{RENAMED, Unit, Workspace, limits, output_of, square_path};
use outcrop_geom::lattice::Lattice;
use outcrop_stages::order::PointStore;
use serde::Serialize;
use std::fs::File;
use std::io::ErrorKind::NotFound;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The division of a mesh.
#[derive(Debug, Clone, Copy)]
pub struct SplitOptions {
    /// Side of the squares, in the input's unit.
    pub side: f64,
}

/// The name of a square in the names of files.
fn name_of([x, y]: Square) -> String {
    format!("{x}_{y}")
}

/// The path of the index of the meshes that are named after `output`.
fn index_path(output: &Path) -> PathBuf {
    let plain = outcrop_disk::workspace::compressed::plain_name(output);
    let mut name = plain.file_stem().unwrap_or_default().to_os_string();
    name.push(".index.json");
    output.with_file_name(name)
}

/// True if the meshes named after `output` could have this path, or their index has it.
pub fn is_square_of(output: &Path, path: &Path) -> bool {
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
        return false;
    };
    if folder_of(path) != folder_of(output) {
        return false;
    }
    // The square is where a name with an empty one would have it.
    let empty = square_path(output, "");
    let Some(empty) = empty.file_name().and_then(|name| name.to_str()) else {
        return false;
    };
    let stem = output.file_name().map_or(0, |_| {
        let plain = outcrop_disk::workspace::compressed::plain_name(output);
        plain.file_stem().map_or(0, std::ffi::OsStr::len)
    });
    let (before, after) = empty.split_at(stem + 1);
    let square = name
        .strip_prefix(before)
        .and_then(|n| n.strip_suffix(after));
    let numbers = |square: &str| {
        let (x, y) = square.split_once('_')?;
        Some((x.parse::<i64>().ok()?, y.parse::<i64>().ok()?))
    };
    square.and_then(numbers).is_some() || path == index_path(output)
}

/// Deletes temporary files of meshes named after `output`.
pub fn remove_unfinished(output: &Path) {
    let folder = folder_of(output);
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some(name) = name.to_str().and_then(|name| name.strip_prefix('.')) else {
            continue;
        };
        let Some((name, _)) = name.split_once(".outcrop-part") else {
            continue;
        };
        if is_square_of(output, &output.with_file_name(name)) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// The meshes while they are written.
struct Split<'a> {
    store: &'a PointStore,
    pieces: &'a Pieces,
    lattice: &'a Lattice,
    options: &'a ExportOptions<'a>,
    workspace: &'a Workspace,
    /// If tasks share the run: the number of this attempt at the meshes.
    number: Option<u32>,
}

/// Writes a mesh for each square.
///
/// # Errors
/// See [`super::export`].
pub fn export_split(
    store: &PointStore,
    stored: &StoredPieces,
    lattice: &Lattice,
    split: SplitOptions,
    options: ExportOptions<'_>,
    workspace: &Workspace,
) -> Result<MeshStats> {
    let pieces = &stored.open(workspace)?;
    let own = workspace.shared_number();
    let number = own.map(|own| workspace.once("file", |_| Ok(own)));
    let split_up = Split {
        store,
        pieces,
        lattice,
        options: &options,
        workspace,
        number: number.transpose()?,
    };
    let stats = split_up.check()?;
    if stats.triangles == 0 {
        return Err(no_triangles());
    }
    // Of an earlier run whose scratch folder was deleted.
    workspace.once("squares", |_| {
        if !workspace.is_shared() {
            remove_unfinished(options.output);
        }
        Ok(())
    })?;
    if options.in_order() {
        for tile in pieces.tiles() {
            let step = format!("compress {}", name_of(tile.square));
            workspace.once(&step, |unit| {
                in_order(&split_up.writer(tile)?, unit, workspace)
            })?;
        }
    } else {
        split_up.write()?;
    }
    split_up.finish(split.side)?;
    Ok(stats)
}

impl Split<'_> {
    fn path(&self, tile: &Tile) -> PathBuf {
        square_path(self.options.output, &name_of(tile.square))
    }

    fn temporary(&self, path: &Path) -> PathBuf {
        match self.number {
            Some(number) => temporary_of(path, number),
            None => temporary(path),
        }
    }

    fn parts(&self, tile: &Tile) -> MeshStats {
        let pieces = self.pieces;
        OfTile { pieces, tile }.stats()
    }

    /// The counts of all meshes together, when each is known to fit its format, and all the disk.
    fn check(&self) -> Result<MeshStats> {
        let (mut all, mut bytes) = (MeshStats::default(), 0);
        for tile in self.pieces.tiles() {
            let stats = self.parts(tile);
            let (format, mesh) = self.mesh(tile)?;
            check_size(&self.path(tile), &mesh, false)?;
            bytes += format.layout(&mesh).bytes;
            all.vertices += stats.vertices;
            all.points_used += stats.points_used;
            all.pinched_copies += stats.pinched_copies;
            all.triangles += stats.triangles;
            all.boundary_edges += stats.boundary_edges;
        }
        let folder = folder_of(self.options.output);
        let free = limits::disk_free(folder).filter(|free| *free < bytes);
        // What an earlier attempt wrote takes space already, and a compressed mesh takes less.
        let new = self.workspace.places(&self.first_name()).is_empty();
        match free.filter(|_| new && !self.options.in_order()) {
            Some(free) => Err(Error::Disk {
                path: self.options.output.to_path_buf(),
                needed: bytes,
                free,
            }),
            None => Ok(all),
        }
    }

    fn first_name(&self) -> String {
        let first = self.pieces.tiles().first();
        first.map_or_else(String::new, |tile| output_of(&name_of(tile.square)))
    }

    fn mesh(&self, tile: &Tile) -> Result<(&'static dyn super::MeshFormat, super::Mesh)> {
        let (format, mut mesh) = self.options.mesh(&self.parts(tile))?;
        mesh.bounds = Some(
            tile.bounds
                .map(|corner| self.options.in_file(self.lattice).of(corner)),
        );
        Ok((format, mesh))
    }

    /// The writer of a square, with its file open.
    fn writer<'b>(&'b self, tile: &'b Tile) -> Result<Writer<'b, OfTile<'b>>> {
        let (_, mesh) = self.mesh(tile)?;
        let (path, name) = (self.path(tile), output_of(&name_of(tile.square)));
        let temporary = self.temporary(&path);
        let format = format_of(self.options.output)?;
        Ok(Writer {
            store: self.store,
            parts: OfTile {
                pieces: self.pieces,
                tile,
            },
            columns: self.options.held(&mesh),
            normals: mesh.normals().is_some() && !mesh.compress,
            coordinates: self.options.in_file(self.lattice),
            bounds: Some(tile.bounds),
            file: MeshFile::one_of_several(&path, temporary, name, format, mesh, self.workspace)?,
        })
    }

    /// The square of a piece.
    fn tile_of(&self, piece: usize) -> &Tile {
        let tiles = self.pieces.tiles();
        &tiles[tiles.partition_point(|tile| tile.pieces.end <= piece)]
    }

    /// Writes all pieces.
    fn write(&self) -> Result<()> {
        let (workspace, count) = (self.workspace, self.pieces.count());
        let piece = |unit: &Unit<'_>, piece: usize| {
            let tile = self.tile_of(piece);
            let writer = self.writer(tile)?;
            let part = piece - tile.pieces.start;
            let mut edges = Vec::new();
            if part == 0 {
                edges.extend(writer.write_header(unit)?);
            }
            edges.extend(writer.write_part(unit, part)?);
            writer.file.write_edges(&edges)?;
            unit.advance(1);
            Ok(())
        };
        if workspace.is_shared() {
            // Two machines must not write to one page of a file, and squares are smaller than shares of tasks.
            return workspace.once("pieces", |unit| {
                (0..count).try_for_each(|n| {
                    workspace.check_cancel()?;
                    piece(unit, n)
                })
            });
        }
        let memory = |n: usize| {
            let tile = self.tile_of(n);
            let parts = OfTile {
                pieces: self.pieces,
                tile,
            };
            // With positions for triangles, and normals.
            let [points, records] = parts.sizes(workspace, n - tile.pieces.start);
            let columns = self.options.columns;
            let values = columns.map_or(0, |columns| columns.bytes(points as usize));
            160 * points + 200 * records + values + (1 << 20)
        };
        let work = |unit: &Unit<'_>| piece(unit, unit.number());
        workspace.units("export: piece", count, memory, work, |_, ()| Ok(()))
    }

    /// Gives all meshes their names, and writes the index.
    fn finish(&self, side: f64) -> Result<()> {
        let (workspace, tiles) = (self.workspace, self.pieces.tiles());
        for tile in tiles {
            workspace.check_cancel()?;
            let path = self.path(tile);
            // One that has its name already was synced.
            if let Ok(file) = open_existing(&self.temporary(&path)) {
                file.sync_all().map_err(|e| Error::io(&path, "sync", e))?;
            }
        }
        let index = index_path(self.options.output);
        let unfinished = self.temporary(&index);
        self.write_index(&unfinished, side)
            .map_err(|e| Error::io(&index, "write", e))?;
        workspace.once("rename", |unit| {
            for tile in tiles {
                unit.note(Put {
                    file: output_of(&name_of(tile.square)),
                    section: RENAMED,
                    place: Place::default(),
                });
            }
            Ok(())
        })?;
        for tile in tiles {
            self.rename(&self.path(tile))?;
        }
        self.rename(&index)?;
        let folder = folder_of(self.options.output);
        outcrop_platform::sync_folder(folder).map_err(|e| Error::io(folder, "sync the folder", e))
    }

    fn rename(&self, path: &Path) -> Result<()> {
        fault::point(Event::Rename);
        match outcrop_platform::rename(&self.temporary(path), path) {
            // An earlier attempt did it, and its file was verified.
            Err(e) if e.kind() == NotFound && path.exists() => {}
            done => done.map_err(|e| Error::io(path, "rename the finished file to it", e))?,
        }
        fault::point(Event::Renamed);
        Ok(())
    }

    /// Writes the index, a line for each mesh.
    fn write_index(&self, path: &Path, side: f64) -> std::io::Result<()> {
        let mut out = BufWriter::new(File::create(path)?);
        let (made_by, side) = (env!("CARGO_PKG_VERSION"), serde_json::to_string(&side)?);
        writeln!(
            out,
            "{{\n\"outcrop\": \"{made_by}\",\n\"side\": {side},\n\"meshes\": ["
        )?;
        let last = self.pieces.tiles().len() - 1;
        for (n, tile) in self.pieces.tiles().iter().enumerate() {
            let name = self.path(tile);
            let name = name.file_name().unwrap_or_default().to_string_lossy();
            let stats = self.parts(tile);
            let [min, max] = tile.bounds.map(|corner| self.lattice.position(corner));
            let entry = Entry {
                file: &name,
                square: tile.square,
                vertices: stats.vertices,
                triangles: stats.triangles,
                boundary_edges: stats.boundary_edges,
                min,
                max,
            };
            let end = if n < last { "," } else { "" };
            writeln!(out, "{}{end}", serde_json::to_string(&entry)?)?;
        }
        writeln!(out, "]\n}}")?;
        out.into_inner()?.sync_all()
    }
}

/// A mesh in the index.
#[derive(Serialize)]
struct Entry<'a> {
    /// Name of the file, in the folder of the index.
    file: &'a str,
    /// Numbers of the square along x and y; its lowest corner is at these times the side.
    square: Square,
    vertices: u64,
    triangles: u64,
    boundary_edges: u64,
    /// Lowest and highest coordinates of the vertices, in the cloud's coordinates.
    min: [f64; 3],
    max: [f64; 3],
}
