//! The codecs of `EXT_meshopt_compression`, version 0 of that for vertices and 1 of that for triangles, which
//! all readers of the extension know.

use meshoptimizer_rs::{
    Workspace,
    codec::{
        Filter, IndexEncoding, Mode, VertexEncoding, decode_buffer_view, encode_index_buffer,
        encode_index_sequence, encode_vertex_buffer,
    },
};

/// The result of an encoder: it fails only if memory cannot be had.
type Encoded = std::io::Result<Vec<u8>>;

fn failed(error: meshoptimizer_rs::Error) -> std::io::Error {
    std::io::Error::other(format!("{error:?}"))
}

/// Encodes records of `stride` bytes, a multiple of 4 up to 256.
pub fn vertices(records: &[u8], stride: usize) -> Encoded {
    let encoding = VertexEncoding::new(0, 0).map_err(failed)?;
    let count = records.len() / stride;
    encode_vertex_buffer(records, count, stride, encoding, &mut Workspace::default())
        .map_err(failed)
}

/// Encodes triangles. Corners may begin with another one of the three, in the same direction.
pub fn triangles(triangles: &[[u32; 3]]) -> Encoded {
    let indices = triangles.as_flattened();
    encode_index_buffer(indices, IndexEncoding::DEFAULT, &mut Workspace::default()).map_err(failed)
}

/// Encodes indices of vertices in any order, such as those of lines.
pub fn sequence(indices: &[u32]) -> Encoded {
    encode_index_sequence(indices, IndexEncoding::DEFAULT, &mut Workspace::default())
        .map_err(failed)
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
    let wrong = |e: meshoptimizer_rs::Error| format!("what cannot be decoded ({e:?})");
    let mode = Mode::parse(mode).map_err(wrong)?;
    let filter = Filter::parse(filter.unwrap_or("NONE")).map_err(wrong)?;
    let mut workspace = Workspace::default();
    decode_buffer_view(mode, filter, count, stride, packed, &mut workspace).map_err(wrong)
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

#[cfg(test)]
mod tests {
    use super::*;
    use meshoptimizer_rs::codec::{decode_filter_exp, decode_index_buffer, decode_vertex_buffer};

    /// The numbers that a reader gets.
    fn read(steps: &[[i32; 3]]) -> (Vec<f32>, bool) {
        let words = words(steps);
        let records: &[u8] = bytemuck::cast_slice(&words.words);
        let encoded = vertices(records, 12).unwrap();
        let workspace = &mut Workspace::default();
        let mut bytes = decode_vertex_buffer(steps.len(), 12, &encoded, workspace).unwrap();
        if words.filtered {
            decode_filter_exp(&mut bytes, steps.len(), 12, workspace).unwrap();
        }
        let floats = bytes.as_chunks::<4>().0.iter();
        (
            floats.map(|b| f32::from_le_bytes(*b)).collect(),
            words.filtered,
        )
    }

    #[test]
    fn steps_are_read_exactly_or_as_the_nearest_float() {
        let most = 1 << 23;
        for (steps, exact) in [
            (vec![[0, 0, 0]], true),
            (vec![[1, -1, 77], [most - 1, -most, 0]], true),
            (vec![[most, 0, 1]], false),
            (vec![[most, 0, 2]], true),
            (vec![[128 - (1 << 30), 1 << 29, 3 << 7]; 300], true),
            (vec![[(1 << 30) - 1, -(1 << 30) + 1, 12_345_679]; 7], false),
        ] {
            let (read, filtered) = read(&steps);
            assert_eq!(filtered, exact, "{:?}", steps[0]);
            let expected: Vec<f32> = steps.as_flattened().iter().map(|x| *x as f32).collect();
            assert_eq!(read, expected);
        }
    }

    #[test]
    fn normals_are_read_to_half_a_step() {
        let mut random = oorandom::Rand64::new(2);
        let mut normals = vec![[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -0.6, 0.8]];
        normals.extend((0..500).map(|_| {
            let x = [0, 1, 2].map(|_| random.rand_float() * 2.0 - 1.0);
            let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
            x.map(|x| (x / length) as f32)
        }));
        let words: Vec<[u32; 3]> = normals.iter().map(|n| direction(*n)).collect();
        let encoded = vertices(bytemuck::cast_slice(&words), 12).unwrap();
        let workspace = &mut Workspace::default();
        let mut bytes = decode_vertex_buffer(words.len(), 12, &encoded, workspace).unwrap();
        decode_filter_exp(&mut bytes, words.len(), 12, workspace).unwrap();
        let read = bytes.as_chunks::<4>().0.iter();
        let read: Vec<f32> = read.map(|b| f32::from_le_bytes(*b)).collect();
        assert_eq!(read[..6], [0.0, 0.0, 1.0, -1.0, 0.0, 0.0]);
        for (x, exact) in read.iter().zip(normals.as_flattened()) {
            assert!((x - exact).abs() <= 0.5 / 4096.0, "{x} {exact}");
        }
    }

    #[test]
    fn triangles_are_read_with_their_direction() {
        let mut random = oorandom::Rand32::new(5);
        let list: Vec<[u32; 3]> = (0..1000)
            .map(|n| [n, n + 1 + random.rand_range(0..9), n + 20])
            .collect();
        let encoded = triangles(&list).unwrap();
        let workspace = &mut Workspace::default();
        let bytes = decode_index_buffer(3000, 4, &encoded, workspace).unwrap();
        let words = bytes.as_chunks::<4>().0.iter();
        let read: Vec<u32> = words.map(|b| u32::from_le_bytes(*b)).collect();
        for (read, t) in read.chunks_exact(3).zip(list) {
            let turned = [t, [t[1], t[2], t[0]], [t[2], t[0], t[1]]];
            assert!(turned.iter().any(|t| t == read), "{read:?} {t:?}");
        }
        assert!(triangles(&[]).is_ok());
    }
}
