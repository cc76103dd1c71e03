//! GLB with meshopt compression (`EXT_meshopt_compression`): a mesh of primitives, one for each part, with
//! vertices of its own. All threads compress parts, and the calling thread writes them in their order; the JSON
//! before them is written last, into room of the largest size that it can have.
//!
//! Positions are whole steps of the lattice from one origin; a node scales them. So they are exact, and vertices
//! that several primitives have are the same in all.

use super::document::{Document, HEADS};
use super::glb;
use super::parts::Parts;
use super::piece::{self, About, Piece};
use super::write::Writer;
use crate::cut::Normal;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::place::Place;
use outcrop_geom::Point;

/// Steps of which the origin is a multiple above the lowest position.
const UNIT: i32 = 1 << 20;

/// The position from which steps are counted: near the middle, and above the lowest by multiples of a power of
/// two, so that low bits that are zero in all positions stay zero.
fn origin([low, high]: [Point; 2]) -> Point {
    // Rounded, so that 24 bits suffice for as long a side as they can.
    let half = |k: usize| (high[k] - low[k] + UNIT) / (2 * UNIT) * UNIT;
    [0, 1, 2].map(|k| low[k] + half(k))
}

/// Writes the file; returns its place.
pub(super) fn write_all<P: Parts>(writer: &Writer<'_, P>, workspace: &Workspace) -> Result<Place> {
    let count = writer.parts.count();
    let origin = origin(writer.bounds.unwrap_or_default());
    let memory = |part| {
        let [points, triangles] = writer.parts.sizes(workspace, part);
        // A triangle has up to two corners that are in other parts.
        let own = piece::estimate(points + 2 * triangles, triangles, writer.file.mesh());
        writer.memory(workspace, part) + own
    };
    let mut part = (0..count).map(memory).max().unwrap_or(0);
    if writer.file.mesh().normals().is_some() {
        // Those of a whole part, whichever it is.
        let points = |part| writer.parts.sizes(workspace, part)[0];
        part += (0..count).map(points).max().unwrap_or(0) * size_of::<Normal>() as u64;
    }
    let document = Document {
        mesh: writer.file.mesh(),
        translation: writer.coordinates.exact(origin),
        step: writer.coordinates.lattice.step,
    };
    let room = document.most(count);
    // The text and its parts, and what is known of pieces.
    let table = 2 * room + (count * size_of::<About>()) as u64;
    let left = workspace.memory.available().saturating_sub(table);
    let threads = (left / part.max(1)).clamp(1, workspace.threads as u64);
    let _held = workspace.reserve("export: pieces", threads * part + table)?;

    let (start, most) = (HEADS + room + 8, glb::most());
    let (mut end, mut crc) = (start, crc32fast::Hasher::new());
    let mut pieces: Vec<About> = Vec::with_capacity(count);
    let make = |part| {
        workspace.check_cancel()?;
        piece::compress(writer, &workspace.unit(), part, origin)
    };
    let take = |piece: Option<Piece>| {
        workspace.observer.advance(1);
        let Some(Piece { about, views }) = piece else {
            return Ok(());
        };
        for mut view in views {
            view.resize(view.len().next_multiple_of(4), 0);
            if end + view.len() as u64 > most {
                return Err(writer.file.too_large(most));
            }
            writer.file.put(&view, end)?;
            crc.update(&view);
            end += view.len() as u64;
        }
        pieces.push(about);
        Ok(())
    };
    workspace.pipe(threads as usize, count, make, take)?;

    let header = document.header(&pieces, room, end);
    writer.file.put(&header, 0)?;
    let mut whole = crc32fast::Hasher::new();
    whole.update(&header);
    whole.combine(&crc);
    Ok(Place {
        bytes: end as usize,
        crc: whole.finalize(),
        ..Place::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_origin_is_near_the_middle_and_keeps_low_bits() {
        for (low, high) in [(0, 0), (5, 4000), (77, (1 << 24) + 76), (3, (1 << 30) - 1)] {
            let [x, ..] = origin([[low; 3], [high; 3]]);
            let side = high - low;
            assert!(x >= low && x <= high.max(low) && (x - low) % UNIT == 0);
            assert!(high - x <= side / 2 + UNIT && x - low <= side / 2 + UNIT);
        }
        // The longest side on which all steps are exact.
        let [x, ..] = origin([[0; 3], [(1 << 24) - 1; 3]]);
        assert_eq!(x, 1 << 23);
    }
}
