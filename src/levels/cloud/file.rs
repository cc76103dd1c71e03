//! The files of a tileset of points: `tileset.json`, and one tile as GLB.

use super::thinned::Even;
use outcrop_codecs::glb::{FLOAT, FOR_VERTICES, SHORT, header};
use outcrop_codecs::light;
use outcrop_disk::error::{Error, Result};
use outcrop_geom::Point;
use outcrop_geom::lattice::Lattice;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Bytes of a position, and of a colour with what fills it up to a multiple of four.
const POSITION: usize = 12;
const COLOR: usize = 8;

/// Most points of a file, whose length must fit 32 bits.
pub(super) const MOST: u64 = 200_000_000;

/// The name of the only tile.
const TILE: &str = "points.glb";

/// The box around some points, in steps.
pub(super) struct Extent {
    min: Point,
    max: Point,
}

impl Extent {
    fn of(points: impl Iterator<Item = Point>) -> Self {
        let mut extent = Self {
            min: [i32::MAX; 3],
            max: [i32::MIN; 3],
        };
        for point in points {
            for (axis, x) in point.into_iter().enumerate() {
                extent.min[axis] = extent.min[axis].min(x);
                extent.max[axis] = extent.max[axis].max(x);
            }
        }
        extent
    }

    fn middle(&self) -> Point {
        std::array::from_fn(|axis| self.min[axis] + (self.max[axis] - self.min[axis]) / 2)
    }

    /// The volume of a tile.
    fn volume(&self, step: f64) -> Value {
        let middle = self.middle().map(|x| f64::from(x) * step);
        let half: [f64; 3] =
            std::array::from_fn(|k| (f64::from(self.max[k] - self.min[k]) / 2.0 + 1.0) * step);
        let ([x, y, z], [a, b, c]) = (middle, half);
        json!({ "box": [x, y, z, a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c] })
    }
}

/// Writes the folder; `noted` is what the tileset says of the cloud.
pub(super) fn write(
    folder: &Path,
    even: &Even,
    has_colors: bool,
    lattice: &Lattice,
    noted: &Value,
) -> Result<()> {
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        move |e| Error::io(path, "write", e)
    };
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    let extent = Extent::of(even.points());
    let tile = folder.join(TILE);
    write_tile(&tile, even, has_colors, &extent, lattice.step).map_err(failed(&tile))?;
    let json = json!({
        "asset": { "version": "1.1" },
        "geometricError": 0.0,
        "root": {
            "boundingVolume": extent.volume(lattice.step),
            "geometricError": 0.0,
            "refine": "ADD",
            "content": { "uri": TILE },
        },
        "extras": { "outcrop": noted },
    });
    let path = folder.join(crate::NAME);
    std::fs::write(&path, json.to_string()).map_err(failed(&path))
}

/// A position in the file: whole steps from the middle, rounded to 24 bits.
fn placed(point: Point, middle: Point) -> [f32; 3] {
    std::array::from_fn(|axis| (point[axis] - middle[axis]) as f32)
}

fn write_tile(
    path: &Path,
    even: &Even,
    has_colors: bool,
    extent: &Extent,
    step: f64,
) -> io::Result<()> {
    let mut out = BufWriter::new(File::create_new(path)?);
    let (json, binary) = document(even.len(), has_colors, extent, step);
    out.write_all(&header(json.to_string().into_bytes(), binary))?;
    let middle = extent.middle();
    for point in even.points() {
        for x in placed(point, middle) {
            out.write_all(&x.to_le_bytes())?;
        }
    }
    for color in even.colors().filter(|_| has_colors) {
        let [red, green, blue] = color.map(|c| light::of_byte(c).to_le_bytes());
        out.write_all(&[red, green, blue, [0, 0]].concat())?;
    }
    out.into_inner().map_err(io::IntoInnerError::into_error)?;
    Ok(())
}

/// The JSON of the tile, and the bytes of its content.
fn document(count: usize, has_colors: bool, extent: &Extent, step: f64) -> (Value, u64) {
    let middle = extent.middle();
    let positions = count * POSITION;
    let view = |offset: usize, stride: usize| {
        json!({
            "buffer": 0, "byteOffset": offset, "byteLength": count * stride, "byteStride": stride,
            "target": FOR_VERTICES,
        })
    };
    let mut attributes = json!({ "POSITION": 0 });
    let mut views = vec![view(0, POSITION)];
    let mut accessors = vec![json!({
        "bufferView": 0, "componentType": FLOAT, "count": count, "type": "VEC3",
        "min": placed(extent.min, middle), "max": placed(extent.max, middle),
    })];
    let mut binary = positions;
    if has_colors {
        attributes["COLOR_0"] = 1.into();
        views.push(view(positions, COLOR));
        accessors.push(json!({
            "bufferView": 1, "componentType": SHORT, "normalized": true, "count": count, "type": "VEC3",
        }));
        binary += count * COLOR;
    }
    let [x, y, z] = middle.map(|x| f64::from(x) * step);
    // As of tiles of meshes: the scale, the place, and the turn from z upwards to y upwards.
    let matrix = [
        [step, 0.0, 0.0, 0.0],
        [0.0, 0.0, -step, 0.0],
        [0.0, step, 0.0, 0.0],
        [x, z, 0.0 - y, 1.0],
    ];
    let json = json!({
        "asset": { "version": "2.0", "generator": concat!("outcrop ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "matrix": matrix.as_flattened() }],
        "meshes": [{ "primitives": [{ "attributes": attributes, "mode": 0 }] }],
        "buffers": [{ "byteLength": binary }],
        "bufferViews": views,
        "accessors": accessors,
    });
    (json, binary as u64)
}
