//! The codecs of `EXT_meshopt_compression`, by the specification of this extension: version 0 of that for vertices and
//! 1 of that for triangles, which all readers of the extension know.

mod attributes;
mod filters;
mod indices;
mod triangles;

#[cfg(test)]
mod tests;

/// The reason why bytes cannot be decoded, in words.
type Damaged = &'static str;

/// Takes bytes from the front of these.
fn take<'a>(from: &mut &'a [u8], count: usize) -> Result<&'a [u8], Damaged> {
    from.split_off(..count)
        .ok_or("an end before the last element")
}

/// Encodes records of `stride` bytes, a multiple of 4 up to 256.
#[must_use]
pub fn vertices(records: &[u8], stride: usize) -> Vec<u8> {
    attributes::encode(records, stride)
}

/// Encodes triangles. Corners may begin with another one of the three, in the same direction.
#[must_use]
pub fn triangles(triangles: &[[u32; 3]]) -> Vec<u8> {
    triangles::encode(triangles)
}

/// Encodes indices of vertices in any order, such as those of lines.
#[must_use]
pub fn sequence(indices: &[u32]) -> Vec<u8> {
    indices::encode(indices)
}

/// Decodes a part of a buffer with the mode and the filter of these names: `count` elements of `stride` bytes.
///
/// # Errors
/// In words, if the bytes are damaged, or the names are none of the extension.
pub fn decode(
    (mode, filter): (&str, Option<&str>),
    (count, stride): (usize, usize),
    packed: &[u8],
) -> Result<Vec<u8>, String> {
    let decoded = match (mode, filter.unwrap_or("NONE")) {
        ("ATTRIBUTES", filter) => {
            let mut plain = attributes::decode(packed, count, stride);
            let filtered = plain.as_mut().map_err(|e| *e);
            filtered
                .and_then(|plain| filters::apply(filter, stride, plain))
                .and(plain)
        }
        ("TRIANGLES", "NONE") => triangles::decode(packed, count, stride),
        ("INDICES", "NONE") => indices::decode(packed, count, stride),
        ("TRIANGLES" | "INDICES", _) => Err("a filter for indices"),
        _ => Err("a mode that is none of the extension"),
    };
    decoded.map_err(|e| format!("what cannot be decoded ({e})"))
}

/// Positions in whole steps, as words of four bytes.
pub struct Words {
    /// Three words for each position.
    pub words: Vec<[u32; 3]>,
    /// True if they are of the exponential filter: an exponent in the highest byte, and below it a signed
    /// integer, so the number of steps is exact. False if they are floats.
    pub filtered: bool,
}

/// Bits of the integer below an exponent.
const BITS: u32 = 24;

/// The words of positions. Readers get each number of steps exactly, or where a number has more than 23 bits
/// above the lowest one that any of them has, the float that is nearest.
pub fn words(steps: &[[i32; 3]]) -> Words {
    let all = steps.as_flattened();
    let zeros = all.iter().fold(0, |bits, x| bits | x).trailing_zeros() % 32;
    let fits = |x: &i32| (x >> zeros) << (32 - BITS) >> (32 - BITS) == x >> zeros;
    let filtered = all.iter().all(fits);
    let word = |x: i32| match filtered {
        true => zeros << BITS | (x >> zeros) as u32 & ((1 << BITS) - 1),
        false => (x as f32).to_bits(),
    };
    Words {
        words: steps.iter().map(|p| p.map(word)).collect(),
        filtered,
    }
}

/// Bits of the components of a normal behind the point.
const NORMAL_BITS: u32 = 12;

/// The words of a normal for the exponential filter: each component in whole steps of 2^-12.
pub fn direction(normal: [f32; 3]) -> [u32; 3] {
    let one = (1 << NORMAL_BITS) as f32;
    let exponent = 0u32.wrapping_sub(NORMAL_BITS) << BITS;
    normal.map(|x| exponent | (x * one).round() as i32 as u32 & ((1 << BITS) - 1))
}
