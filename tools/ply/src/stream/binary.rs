//! Bodies of binary files: entries of fixed size, as many as the buffer holds.

use super::index;
use super::source::Source;
use crate::error::FileError;
use crate::header::{Element, Field, bytes_of};
use crate::numbers::{integer, real};
use crate::types::Scalar;

/// Bytes of a triangle in the usual form: the number 3 and three corners of 32 bits.
pub(super) const PLAIN: usize = 13;

/// The corners of a triangle in the usual form.
#[inline]
pub(super) fn plain(row: &[u8; PLAIN]) -> [u32; 3] {
    let corner = |at: usize| i32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]]);
    [
        index(corner(1).into()),
        index(corner(5).into()),
        index(corner(9).into()),
    ]
}

impl Source {
    /// Decodes 1 to `most` vertices, and the values of `columns`; none if they are text or have lists.
    pub(super) fn fixed_vertices(
        &mut self,
        element: &Element,
        (axes, columns): ([Field; 3], &[Field]),
        most: usize,
        (slice, values): (&mut Vec<[f64; 3]>, &mut Vec<f64>),
    ) -> Result<(), FileError> {
        let (Some(big), Some(each)) = (self.big(), element.record_bytes()) else {
            return Ok(());
        };
        let place = |(at, s)| (element.bytes_before(at).unwrap_or(0), s);
        let [x, y, z] = axes.map(place);
        let columns: Vec<_> = columns.iter().map(|column| place(*column)).collect();
        let now = (self.peek(each)?.len() / each).clamp(1, most);
        let entries = self.take(now * each, "a vertex")?.chunks_exact(each);
        let axis = |e: &[u8], (at, scalar): (usize, Scalar)| real(scalar, &e[at..], big);
        slice.extend(
            entries
                .clone()
                .map(|e| [axis(e, x), axis(e, y), axis(e, z)]),
        );
        if !columns.is_empty() {
            values.extend(entries.flat_map(|e| columns.iter().map(move |column| axis(e, *column))));
        }
        Ok(())
    }

    /// Decodes up to `most` triangles of the buffer; stops before any other face. None if they are text or
    /// have further lists.
    pub(super) fn fixed_triangles(
        &mut self,
        element: &Element,
        (at, count, item): (usize, Scalar, Scalar),
        most: usize,
        slice: &mut Vec<[u32; 3]>,
    ) -> Result<(), FileError> {
        let after = bytes_of(&element.properties[at + 1..]);
        let (Some(big), Some(before), Some(after)) = (self.big(), element.bytes_before(at), after)
        else {
            return Ok(());
        };
        let (list, size) = (before + count.bytes(), item.bytes());
        let each = list + 3 * size + after;
        let old = slice.len();
        if (count, item, after, big) == (Scalar::U8, Scalar::I32, 0, false) && list == 1 {
            let rows = self.peek(each)?.as_chunks::<PLAIN>().0.iter().take(most);
            let triangles = rows.take_while(|row| row[0] == 3).map(plain);
            slice.extend(triangles);
            self.consume((slice.len() - old) * each);
            return Ok(());
        }
        let entries = self.peek(each)?.chunks_exact(each).take(most);
        let triangles = entries.take_while(|e| integer(count, &e[before..], big) == 3);
        let corner = |e: &[u8], k: usize, item| index(integer(item, &e[list + k * size..], big));
        let face = |e, item| [corner(e, 0, item), corner(e, 1, item), corner(e, 2, item)];
        // The usual types have loops of their own.
        match item {
            Scalar::I32 => slice.extend(triangles.map(|e| face(e, Scalar::I32))),
            Scalar::U32 => slice.extend(triangles.map(|e| face(e, Scalar::U32))),
            item => slice.extend(triangles.map(|e| face(e, item))),
        }
        self.consume((slice.len() - old) * each);
        Ok(())
    }
}
