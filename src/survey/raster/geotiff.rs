//! Rasters as cloud-optimised GeoTIFF files: tiles compressed with Deflate, and overviews.
//!
//! The directories come first, that of the full raster before those of its overviews, and the tiles follow, those of
//! the coarsest overview first. So a reader finds its way with one request. Files of 4 GB and more are BigTIFF.
//! Crates write such files too, but `tiff` writes no tiles, and `geotiff-writer` keeps tiles in the system's folder for
//! temporary files: outside the scratch folder, and where that folder is memory, outside the budget.
//!
//! Sources: TIFF 6.0 (1992), Adobe Photoshop TIFF Technical Note 3 (2005) for the predictor of floating-point numbers, and
//! OGC 19-008r4 (GeoTIFF 1.1).

use super::cells::{CELLS, Cell, Level, TILE_BYTES};
use super::grid::{Grid, TILE};
use super::keys::Keys;
use super::output::Output;
use miniz_oxide::deflate::compress_to_vec_zlib;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{LocalTable, row};
use outcrop_disk::workspace::{Workspace, lock};
use std::path::Path;
use std::sync::Mutex;

/// Level of compression: more takes twice the time for 1 % of the bytes.
const LEVEL: u8 = 6;

/// Bytes from which on offsets of 32 bits may not do, less those of the directories.
const BIG: u64 = 4_000_000_000;

/// Bytes of a unit that compresses a tile: its cells, its bytes, and the compressed ones.
const ENCODING: u64 = TILE_BYTES + 3 * (CELLS * 4) as u64;

/// Bytes that a tile takes in the tables: offset and size, as numbers and as they are written.
const LISTED: u64 = 32;

row! {
    /// Four bytes of a compressed tile.
    struct Word {
        bytes: u32,
    }
    unpacked
}

/// The samples of a raster: heights, or colours.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    /// Heights; this number stands for none.
    Heights(f32),
    /// Red, green, blue, and how opaque the cell is.
    Colours,
}

impl Kind {
    /// Appends the bytes of a tile, with the predictor of the kind.
    fn bytes(self, cells: &[Cell], bytes: &mut Vec<u8>) {
        for line in cells.chunks_exact(TILE) {
            let begin = bytes.len();
            match self {
                Self::Heights(nothing) => {
                    // The highest bytes of a line first, then the second ones, and so on.
                    for k in 0..4 {
                        bytes.extend(line.iter().map(|cell| {
                            let height = match cell.height.is_nan() {
                                true => nothing,
                                false => cell.height,
                            };
                            height.to_be_bytes()[k]
                        }));
                    }
                }
                Self::Colours => bytes.extend(line.iter().flat_map(|cell| {
                    let [_, red, green, blue] = cell.colour.to_be_bytes();
                    match cell.height.is_nan() {
                        true => [0; 4],
                        false => [red, green, blue, 255],
                    }
                })),
            }
            let step = match self {
                Self::Heights(_) => 1,
                Self::Colours => 4,
            };
            for at in (begin + step..bytes.len()).rev() {
                bytes[at] = bytes[at].wrapping_sub(bytes[at - step]);
            }
        }
    }

    fn samples(self) -> u16 {
        match self {
            Self::Heights(_) => 1,
            Self::Colours => 4,
        }
    }
}

/// The compressed tiles of a level.
struct Tiles {
    columns: u32,
    rows: u32,
    bytes: LocalTable<Word>,
    /// Bytes of each tile.
    sizes: Vec<u32>,
}

impl Tiles {
    fn of(level: &Level, number: usize, kind: Kind, workspace: &Workspace) -> Result<Self> {
        let what = match kind {
            Kind::Heights(_) => "heights",
            Kind::Colours => "colours",
        };
        let bytes = LocalTable::create(workspace, &format!("raster.{what}{number}"))?;
        let sizes = Mutex::new(vec![0; level.count()]);
        workspace.for_each_unit(
            "raster: compressed tiles",
            level.count(),
            |_| ENCODING,
            |unit| {
                let _held = unit.hold(ENCODING);
                let (mut cells, mut plain) = (Vec::new(), Vec::with_capacity(CELLS * 4));
                level.read(unit, unit.number(), &mut cells)?;
                kind.bytes(&cells, &mut plain);
                let packed = compress_to_vec_zlib(&plain, LEVEL);
                let words = packed.chunks(4).map(|chunk| {
                    let mut bytes = [0; 4];
                    bytes[..chunk.len()].copy_from_slice(chunk);
                    let bytes = u32::from_le_bytes(bytes);
                    Word { bytes }
                });
                let words: Vec<Word> = words.collect();
                bytes.put(unit.number(), &words)?;
                lock(&sizes)[unit.number()] = packed.len() as u32;
                unit.advance(1);
                unit.check_cancel()
            },
        )?;
        Ok(Self {
            columns: level.columns,
            rows: level.rows,
            bytes,
            sizes: lock(&sizes).clone(),
        })
    }

    fn total(&self) -> u64 {
        self.sizes.iter().map(|size| u64::from(*size)).sum()
    }
}

/// A value of a directory.
enum Value {
    Short(Vec<u16>),
    Long(Vec<u32>),
    Offsets(Vec<u64>),
    Double(Vec<f64>),
    Text(String),
}

/// Writes numbers and directories.
struct Form {
    is_big: bool,
}

impl Form {
    /// Bytes of an offset.
    fn word(&self) -> u64 {
        if self.is_big { 8 } else { 4 }
    }

    fn offset(&self, at: u64) -> Vec<u8> {
        match self.is_big {
            true => at.to_le_bytes().to_vec(),
            // Without BigTIFF they are below 2^32.
            false => (at as u32).to_le_bytes().to_vec(),
        }
    }

    fn header(&self) -> Vec<u8> {
        match self.is_big {
            true => [&b"II+\0\x08\0\0\0"[..], &16u64.to_le_bytes()].concat(),
            false => [&b"II*\0"[..], &8u32.to_le_bytes()].concat(),
        }
    }

    /// The type, the number of values and their bytes.
    fn value(&self, value: &Value) -> (u16, usize, Vec<u8>) {
        match value {
            Value::Short(all) => {
                let bytes = all.iter().flat_map(|v| v.to_le_bytes());
                (3, all.len(), bytes.collect())
            }
            Value::Long(all) => {
                let bytes = all.iter().flat_map(|v| v.to_le_bytes());
                (4, all.len(), bytes.collect())
            }
            Value::Offsets(all) => {
                let kind = if self.is_big { 16 } else { 4 };
                let bytes = all.iter().flat_map(|v| self.offset(*v));
                (kind, all.len(), bytes.collect())
            }
            Value::Double(all) => {
                let bytes = all.iter().flat_map(|v| v.to_le_bytes());
                (12, all.len(), bytes.collect())
            }
            Value::Text(text) => {
                let bytes = [text.as_bytes(), &[0]].concat();
                (2, bytes.len(), bytes)
            }
        }
    }

    /// A directory at `at`, followed by its values that do not fit it; `is_last` if no other follows.
    fn directory(&self, at: u64, tags: &[(u16, Value)], is_last: bool) -> Vec<u8> {
        let (head, word) = (if self.is_big { 8 } else { 2 }, self.word());
        let entry = 4 + 2 * word;
        let mut behind = at + head + entry * tags.len() as u64 + word;
        let (mut entries, mut values) = (Vec::new(), Vec::new());
        for (tag, value) in tags {
            let (kind, count, mut bytes) = self.value(value);
            entries.extend(tag.to_le_bytes());
            entries.extend(kind.to_le_bytes());
            entries.extend(self.offset(count as u64));
            if bytes.len() as u64 <= word {
                bytes.resize(word as usize, 0);
                entries.extend(bytes);
            } else {
                entries.extend(self.offset(behind));
                bytes.resize(bytes.len().next_multiple_of(8), 0);
                behind += bytes.len() as u64;
                values.extend(bytes);
            }
        }
        // The next one begins at a multiple of 8.
        let padding = behind.next_multiple_of(8) - behind;
        let next = if is_last { 0 } else { behind + padding };
        let count = tags.len() as u64;
        let mut bytes = match self.is_big {
            true => count.to_le_bytes().to_vec(),
            false => (count as u16).to_le_bytes().to_vec(),
        };
        bytes.extend(entries);
        bytes.extend(self.offset(next));
        bytes.extend(values);
        bytes.resize(bytes.len() + padding as usize, 0);
        bytes
    }
}

/// A raster to be written.
pub(super) struct Picture<'a> {
    pub grid: &'a Grid,
    pub kind: Kind,
    pub keys: &'a Keys,
}

impl Picture<'_> {
    /// Writes a file; returns its size.
    pub fn write(&self, path: &Path, levels: &[Level], workspace: &Workspace) -> Result<u64> {
        let listed: u64 = levels.iter().map(|level| level.count() as u64).sum();
        let _held = workspace.reserve("raster: tables of tiles", listed * LISTED)?;
        workspace.observer.begin("compress", "tiles", listed);
        let tiles = levels.iter().enumerate();
        let tiles = tiles.map(|(number, level)| Tiles::of(level, number, self.kind, workspace));
        let tiles = tiles.collect::<Result<Vec<_>>>()?;
        workspace.observer.end();
        let data: u64 = tiles.iter().map(Tiles::total).sum();
        let form = Form {
            is_big: data + listed * LISTED > BIG,
        };
        let mut file = Output::create(path)?;
        file.write(&form.header())?;
        for directory in self.directories(&form, &tiles) {
            file.write(&directory)?;
        }
        let mut words = Vec::new();
        for tiles in tiles.iter().rev() {
            for (tile, size) in tiles.sizes.iter().enumerate() {
                tiles.bytes.get_into(tile, &mut words)?;
                let bytes: Vec<u8> = words.iter().flat_map(|w| w.bytes.to_le_bytes()).collect();
                file.write(&bytes[..*size as usize])?;
                workspace.check_cancel()?;
            }
        }
        file.finish()
    }

    /// All directories. Their sizes do not depend on the offsets, so they are made twice.
    fn directories(&self, form: &Form, tiles: &[Tiles]) -> Vec<Vec<u8>> {
        let made = |begin: u64| {
            // The coarsest level comes first.
            let mut at = begin;
            let mut offsets = Vec::new();
            for tiles in tiles.iter().rev() {
                let level = tiles.sizes.iter().scan(&mut at, |at, size| {
                    let own = **at;
                    **at += u64::from(*size);
                    Some(own)
                });
                offsets.push(level.collect::<Vec<u64>>());
            }
            let mut at = form.header().len() as u64;
            let levels = tiles.iter().zip(offsets.into_iter().rev()).enumerate();
            let all = levels.map(|(number, (level, offsets))| {
                let tags = self.tags(number, level, offsets);
                let bytes = form.directory(at, &tags, number + 1 == tiles.len());
                at += bytes.len() as u64;
                bytes
            });
            all.collect::<Vec<_>>()
        };
        let sizes = made(0).iter().map(|bytes| bytes.len() as u64).sum::<u64>();
        made(form.header().len() as u64 + sizes)
    }

    /// The tags of a level, ascending.
    fn tags(&self, number: usize, tiles: &Tiles, offsets: Vec<u64>) -> Vec<(u16, Value)> {
        let samples = self.kind.samples();
        let (bits, photometric, predictor, format) = match self.kind {
            Kind::Heights(_) => (32, 1, 3, 3),
            Kind::Colours => (8, 2, 2, 1),
        };
        let short = |value: u16| Value::Short(vec![value]);
        let long = |value: u32| Value::Long(vec![value]);
        let each = |value: u16| Value::Short(vec![value; usize::from(samples)]);
        let mut tags = vec![
            (254, long(u32::from(number > 0))),
            (256, long(tiles.columns)),
            (257, long(tiles.rows)),
            (258, each(bits)),
            // Deflate with the header of zlib.
            (259, short(8)),
            (262, short(photometric)),
            (277, short(samples)),
            (284, short(1)),
            (317, short(predictor)),
            (322, long(TILE as u32)),
            (323, long(TILE as u32)),
            (324, Value::Offsets(offsets)),
            (325, Value::Long(tiles.sizes.clone())),
        ];
        if matches!(self.kind, Kind::Colours) {
            // The fourth sample tells how opaque the cell is; colours are not multiplied by it.
            tags.push((338, short(2)));
        }
        tags.push((339, each(format)));
        if number == 0 {
            let [x, y] = self.grid.corner();
            let cell = self.grid.cell;
            tags.push((33550, Value::Double(vec![cell, cell, 0.0])));
            tags.push((33922, Value::Double(vec![0.0, 0.0, 0.0, x, y, 0.0])));
            tags.push((34735, Value::Short(self.keys.numbers.clone())));
            if !self.keys.texts.is_empty() {
                tags.push((34737, Value::Text(self.keys.texts.clone())));
            }
        }
        if let Kind::Heights(nothing) = self.kind {
            tags.push((42113, Value::Text(nothing.to_string())));
        }
        tags
    }
}
