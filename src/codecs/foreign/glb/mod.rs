//! Binary glTF: the triangles of all meshes of its scene, where its nodes put them, with y up turned to z up.
//! Vertices at the same position become one if a file has normals, textures or several parts: it then has copies of a
//! vertex where these differ.

mod accessor;
mod document;
mod place;

use super::Mesh;
use super::spool::{NO_MATERIAL, Spool};
use super::weld::Weld;
use crate::light;
use accessor::Reader;
use document::{Document, Primitive};
use outcrop_disk::error::Result;
use place::{Matrix, Placed};

/// Largest JSON that is read, in bytes.
const JSON: u64 = 64 << 20;

/// Numbers of the chunks.
const CHUNKS: [[u8; 4]; 2] = [*b"JSON", *b"BIN\0"];

/// Extensions that may be required of a reader.
const KNOWN: [&str; 8] = [
    "EXT_meshopt_compression",
    "KHR_mesh_quantization",
    "KHR_materials_unlit",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "KHR_materials_specular",
    "KHR_materials_ior",
];

/// Reads a mesh.
pub(super) fn read(mesh: &Mesh<'_>, spool: &mut Spool<'_>) -> Result<()> {
    let (json, buffer) = chunks(mesh)?;
    let document: Document = serde_json::from_slice(&json)
        .map_err(|e| mesh.error("JSON", e.to_string(), "a document of glTF 2.0"))?;
    drop(json);
    let mut required = document.extensions_required.iter();
    if let Some(name) = required.find(|name| !KNOWN.contains(&&***name)) {
        let found = format!("the required extension {name}");
        let expected = "no compression but EXT_meshopt_compression";
        return Err(mesh.error("JSON", found, expected));
    }
    let placed = place::placed(&document)
        .map_err(|(place, found, expected)| mesh.error(place, found, expected))?;
    let mut reader = Reader::new(mesh, &document, buffer);
    let primitives = listed(&document, &placed, spool);
    if let [(primitive, matrix)] = &primitives[..]
        && !primitive.has_copies()
    {
        let take = |place, colour| spool.vertex(place, colour);
        take_vertices(&mut reader, primitive, matrix, &document, take)?;
        let count = reader.positions(primitive)?.count;
        let number = |index: usize| u32::try_from(index).ok().filter(|_| index < count);
        return push_triangles(&mut reader, primitive, (number, matrix.mirrors()), spool);
    }
    let mut count = 0;
    for (primitive, _) in &primitives {
        count += reader.positions(primitive)?.count as u64;
    }
    let mut weld = Weld::new(mesh, spool, count)?;
    for (primitive, matrix) in &primitives {
        let take = |place, colour| weld.push(place, colour);
        take_vertices(&mut reader, primitive, matrix, &document, take)?;
    }
    // Four bytes for each vertex of the file, of which there are at most 4 GiB.
    let _held = mesh.workspace.reserve("mesh: numbers", 4 * count)?;
    let mut numbers = Vec::with_capacity(count as usize);
    weld.finish(spool, |_, number| {
        numbers.push(number);
        Ok(())
    })?;
    let mut first = 0;
    for (primitive, matrix) in &primitives {
        let vertices = reader.positions(primitive)?.count;
        let numbers = &numbers[first..first + vertices];
        let number = |index: usize| numbers.get(index).copied();
        push_triangles(&mut reader, primitive, (number, matrix.mirrors()), spool)?;
        first += vertices;
    }
    Ok(())
}

/// The JSON, and the range of the buffer in the file.
fn chunks(mesh: &Mesh<'_>) -> Result<(Vec<u8>, std::ops::Range<u64>)> {
    let mut head = [0; 12];
    mesh.read_at(0, &mut head[..mesh.bytes.min(12) as usize])?;
    let version = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
    if version != 2 {
        return Err(mesh.error("header", format!("version {version}"), "version 2"));
    }
    let (mut at, mut json, mut buffer) = (12, Vec::new(), 0..0);
    while at + 8 <= mesh.bytes {
        let mut chunk = [0; 8];
        mesh.read_at(at, &mut chunk)?;
        let bytes = u64::from(u32::from_le_bytes([chunk[0], chunk[1], chunk[2], chunk[3]]));
        let begin = at + 8;
        if bytes > mesh.bytes - begin {
            let found = format!("a chunk of {bytes} bytes");
            let expected = format!("at most {}, which follow", mesh.bytes - begin);
            return Err(mesh.error(format!("byte {at}"), found, &expected));
        }
        let kind = [chunk[4], chunk[5], chunk[6], chunk[7]];
        if kind == CHUNKS[0] && json.is_empty() {
            if bytes > JSON {
                let found = format!("{bytes} bytes");
                return Err(mesh.error("JSON", found, &format!("at most {JSON}")));
            }
            json.resize(bytes as usize, 0);
            mesh.read_at(begin, &mut json)?;
        } else if kind == CHUNKS[1] && buffer.is_empty() {
            buffer = begin..begin + bytes;
        }
        at = begin + bytes;
    }
    if json.is_empty() {
        return Err(mesh.error("chunks", "none with JSON", "JSON first"));
    }
    Ok((json, buffer))
}

/// The primitives of triangles with their places; others are left out, and so is what is not read.
fn listed<'d>(
    document: &'d Document,
    placed: &[Placed],
    spool: &mut Spool<'_>,
) -> Vec<(&'d Primitive, Matrix)> {
    let mut all = Vec::new();
    let mut leave_out = |what| {
        if !spool.left_out.contains(&what) {
            spool.left_out.push(what);
        }
    };
    for Placed { mesh, matrix } in placed {
        for primitive in &document.meshes[*mesh].primitives {
            if !(4..=6).contains(&primitive.mode()) {
                leave_out("lines and points");
                continue;
            }
            for name in primitive.attributes.keys() {
                match name.split('_').next() {
                    Some("TEXCOORD") => leave_out("texture coordinates"),
                    Some("NORMAL") => leave_out("normals"),
                    Some("JOINTS" | "WEIGHTS") => leave_out("skins"),
                    _ => {}
                }
            }
            all.push((primitive, *matrix));
        }
    }
    if !document.images.is_empty() {
        leave_out("textures");
    }
    all
}

/// Passes on the positions of a primitive, where its node puts them, with their colours.
fn take_vertices(
    reader: &mut Reader<'_>,
    primitive: &Primitive,
    matrix: &Matrix,
    document: &Document,
    mut take: impl FnMut([f64; 3], Option<[u8; 3]>) -> Result<()>,
) -> Result<()> {
    let positions = reader.positions(primitive)?;
    let colours = reader.colours(primitive, positions.count)?;
    let of_material = document.base_colour(primitive);
    let byte = |part: f64| light::byte_of(part.clamp(0.0, 1.0));
    let painted = of_material.map(|colour| colour.map(byte));
    let mut slice = Vec::new();
    let mut colour_slice = Vec::new();
    for begin in (0..positions.count).step_by(accessor::SLICE) {
        let range = begin..(begin + accessor::SLICE).min(positions.count);
        reader.read(&positions, range.clone(), &mut slice)?;
        if let Some(colours) = &colours {
            reader.read(colours, range.clone(), &mut colour_slice)?;
        }
        for (number, position) in range.clone().zip(slice.chunks_exact(3)) {
            let place = matrix.apply([position[0], position[1], position[2]]);
            if !place.iter().all(|x| x.is_finite()) {
                return Err(reader.no_number(number, place));
            }
            let colour = match &colours {
                Some(colours) => {
                    let at = (number - begin) * colours.parts;
                    let parts = &colour_slice[at..at + 3];
                    let factor = of_material.unwrap_or([1.0; 3]);
                    Some([0, 1, 2].map(|k| byte(parts[k] * factor[k])))
                }
                None => painted,
            };
            take(place, colour)?;
        }
    }
    Ok(())
}

/// Passes on the triangles of a primitive; `number` gives the number of each vertex, and `mirrors` that they are turned.
fn push_triangles(
    reader: &mut Reader<'_>,
    primitive: &Primitive,
    (number, mirrors): (impl Fn(usize) -> Option<u32>, bool),
    spool: &mut Spool<'_>,
) -> Result<()> {
    let indices = reader.indices(primitive)?;
    let count = match &indices {
        Some(indices) => indices.count,
        None => reader.positions(primitive)?.count,
    };
    let (mut last, mut taken) = ([0; 2], 0u64);
    let mut slice = Vec::new();
    for begin in (0..count).step_by(accessor::SLICE) {
        let range = begin..(begin + accessor::SLICE).min(count);
        match &indices {
            Some(indices) => reader.read(indices, range.clone(), &mut slice)?,
            None => {
                slice.clear();
                slice.extend(range.clone().map(|index| index as f64));
            }
        }
        for index in &slice {
            let Some(corner) = number(*index as usize) else {
                return Err(spool.no_vertex("indices".into(), index.to_string()));
            };
            let due = match primitive.mode() {
                4 => taken % 3 == 2,
                _ => taken >= 2,
            };
            if due {
                let turned = primitive.mode() == 5 && taken % 2 == 1;
                let [a, b] = last;
                let triangle = match turned != mirrors {
                    true => [b, a, corner],
                    false => [a, b, corner],
                };
                spool.triangle(triangle, NO_MATERIAL)?;
            }
            last = match primitive.mode() {
                // A fan keeps its first corner.
                6 if taken >= 2 => [last[0], corner],
                _ if taken == 0 => [corner, corner],
                6 if taken == 1 => [last[0], corner],
                _ => [last[1], corner],
            };
            taken += 1;
        }
    }
    Ok(())
}
