//! A part of a mesh with vertices of its own, compressed for `EXT_meshopt_compression`.

use super::format::Mesh;
use super::glb::{self, COLOUR};
use super::parts::Parts;
use super::stored;
use super::write::Writer;
use outcrop_codecs::meshopt;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::Point;
use outcrop_stages::ids::Id;

/// Views of the buffer that a piece may have: positions, normals, colours, triangles.
pub const VIEWS: usize = 4;

/// Counts, bounds and sizes of a piece, for the JSON.
#[derive(Debug, Clone, Copy)]
pub struct About {
    /// Number of vertices; those at the rim are in other pieces, too.
    pub vertices: u32,
    /// Number of triangles.
    pub triangles: u32,
    /// True if positions have the exponential filter.
    pub filtered: bool,
    /// Lowest and highest numbers of the positions.
    pub bounds: [[f32; 3]; 2],
    /// Bytes of each view; none of what vertices do not have.
    pub bytes: [u32; VIEWS],
}

/// A compressed piece.
pub struct Piece {
    /// Its counts, bounds and sizes.
    pub about: About,
    /// Its views.
    pub views: [Vec<u8>; VIEWS],
}

/// A vertex of a piece: the id of its point, and its number in the mesh, by which copies differ.
type Vertex = (Id, u32);

/// Bytes of memory for a piece of at most so many vertices and triangles, beside the triangles as they are read.
pub fn estimate(vertices: u64, triangles: u64, mesh: &Mesh) -> u64 {
    // Corners and indices; of a vertex its names, order, position twice, values and records, packed.
    let mut values = 4 * mesh.value_bytes() as u64;
    if mesh.colours().is_some() {
        values += 2 * COLOUR as u64;
    }
    if mesh.normals().is_some() {
        values += NORMALS;
    }
    72 * triangles + (64 + values) * vertices + (256 << 10)
}

/// Compresses a part; `None` if it has no triangle. Positions are steps of the lattice from `origin`.
pub fn compress<P: Parts>(
    writer: &Writer<'_, P>,
    unit: &Unit<'_>,
    part: usize,
    origin: Point,
) -> Result<Option<Piece>> {
    let corners = corners(writer, unit, part)?;
    if corners.is_empty() {
        return Ok(None);
    }
    let _corners = unit.hold(bytes_of(&corners));
    let (known, triangles, order) = number(&corners);
    drop(corners);
    let ids: Vec<Id> = known.iter().map(|(id, _)| *id).collect();
    let mut points = Vec::with_capacity(ids.len());
    writer.store.fetch(&ids, &mut points)?;
    let step = |at: &u32| [0, 1, 2].map(|k| points[*at as usize][k] - origin[k]);
    let steps: Vec<[i32; 3]> = order.iter().map(step).collect();
    let lists = bytes_of(&known) + bytes_of(&triangles) + bytes_of(&order) + bytes_of(&ids);
    let _held = unit.hold(lists + bytes_of(&points) + bytes_of(&steps));
    let normals = normals(writer, unit, &known, &order)?;
    let _normals = unit.hold(bytes_of(&normals));
    let colours = colours(writer, unit, &ids, &order)?;
    let _colours = unit.hold(bytes_of(&colours));
    let words = meshopt::words(&steps);
    let views = [
        meshopt::vertices(bytemuck::cast_slice(&words.words), 12),
        match normals.is_empty() {
            true => Vec::new(),
            false => meshopt::vertices(bytemuck::cast_slice(&normals), 12),
        },
        match colours.is_empty() {
            true => Vec::new(),
            false => meshopt::vertices(&colours, COLOUR),
        },
        meshopt::triangles(&triangles),
    ];
    let about = About {
        vertices: order.len() as u32,
        triangles: triangles.len() as u32,
        filtered: words.filtered,
        bounds: bounds(&steps),
        bytes: [0, 1, 2, 3].map(|view: usize| views[view].len() as u32),
    };
    Ok(Some(Piece { about, views }))
}

/// The corners of the part's triangles.
fn corners<P: Parts>(
    writer: &Writer<'_, P>,
    unit: &Unit<'_>,
    part: usize,
) -> Result<Vec<[Vertex; 3]>> {
    let faces = writer.parts.faces(unit, part)?;
    let _held = unit.hold(faces.bytes());
    let [first, next] = [part, part + 1].map(|n| writer.first_triangle(n));
    let mut corners = Vec::with_capacity((next - first) as usize);
    faces.for_each(|t, ids| corners.push([0, 1, 2].map(|k| (ids[k], t[k]))));
    Ok(corners)
}

/// All vertices, ascending; the triangles by numbers of vertices in the order of their first use; this order, by
/// places in the list.
fn number(corners: &[[Vertex; 3]]) -> (Vec<Vertex>, Vec<[u32; 3]>, Vec<u32>) {
    let mut known = corners.as_flattened().to_vec();
    known.sort_unstable();
    known.dedup();
    known.shrink_to_fit();
    let mut numbers = vec![u32::MAX; known.len()];
    let mut order = Vec::with_capacity(known.len());
    let mut number = |corner: &Vertex| {
        // All are in the list.
        let (Ok(at) | Err(at)) = known.binary_search(corner);
        if numbers[at] == u32::MAX {
            numbers[at] = order.len() as u32;
            order.push(at as u32);
        }
        numbers[at]
    };
    let mut triangles = Vec::with_capacity(corners.len());
    for [a, b, c] in corners {
        triangles.push([number(a), number(b), number(c)]);
    }
    (known, triangles, order)
}

/// Bytes of memory for the normal of a vertex: found, with its number, as words, packed.
const NORMALS: u64 = 3 * 12 + 8;

/// The words of the normals of vertices in this order; nothing if the mesh has none.
fn normals<P: Parts>(
    writer: &Writer<'_, P>,
    unit: &Unit<'_>,
    known: &[Vertex],
    order: &[u32],
) -> Result<Vec<[u32; 3]>> {
    if writer.file.mesh().normals().is_none() {
        return Ok(Vec::new());
    }
    let numbers = known.iter().map(|(_, number)| *number);
    let normals = stored::of_vertices(&writer.parts, unit, numbers)?;
    let _held = unit.hold(bytes_of(&normals));
    let word = |at: &u32| meshopt::direction(normals[*at as usize]);
    Ok(order.iter().map(word).collect())
}

/// The colours of vertices in this order, with an opaque fourth component; nothing if there are none.
fn colours<P: Parts>(
    writer: &Writer<'_, P>,
    unit: &Unit<'_>,
    ids: &[Id],
    order: &[u32],
) -> Result<Vec<u8>> {
    let mesh = writer.file.mesh();
    let Some((places, scalar)) = mesh.colours() else {
        return Ok(Vec::new());
    };
    // Normals come before the columns of points.
    let before = if mesh.normals().is_some() { 12 } else { 0 };
    let places = places.map(|place| place - before);
    let values = writer.values(unit, ids, None)?;
    let _held = unit.hold(bytes_of(&values));
    let each = mesh.value_bytes() - before;
    let mut colours = Vec::with_capacity(order.len() * COLOUR);
    for at in order {
        let own = &values[*at as usize * each..][..each];
        glb::put_colour(own, (places, scalar), &mut colours);
    }
    Ok(colours)
}

/// Lowest and highest numbers along each axis.
fn bounds(steps: &[[i32; 3]]) -> [[f32; 3]; 2] {
    let mut found = [[i32::MAX; 3], [i32::MIN; 3]];
    for p in steps {
        for k in 0..3 {
            found[0][k] = found[0][k].min(p[k]);
            found[1][k] = found[1][k].max(p[k]);
        }
    }
    // Rounding keeps the order.
    found.map(|corner| corner.map(|x| x as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_are_numbered_as_they_are_used_and_copies_stay_apart() {
        let vertex = |id: u32, number: u32| (Id::new(id), number);
        let (a, b, c, copy) = (vertex(5, 0), vertex(9, 1), vertex(7, 2), vertex(9, 3));
        let (known, triangles, order) = number(&[[b, c, a], [a, c, copy]]);
        assert_eq!(known, [a, c, b, copy]);
        assert_eq!(triangles, [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(order, [2, 1, 0, 3]);
    }

    #[test]
    fn bounds_are_those_of_the_numbers_that_readers_get() {
        let steps = [[1, -5, (1 << 30) - 1], [-7, 3, (1 << 30) - 40]];
        let bounds = bounds(&steps);
        assert_eq!(bounds[0][..2], [-7.0, -5.0]);
        assert_eq!(bounds[1][2], ((1 << 30) - 1) as f32);
    }
}
