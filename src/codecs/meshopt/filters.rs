//! The filters of attributes: what becomes of the numbers of an element after it was decoded.

use super::Damaged;
use std::f32::consts::FRAC_1_SQRT_2;

/// Applies the filter with this name to elements of `stride` bytes.
pub(super) fn apply(name: &str, stride: usize, bytes: &mut [u8]) -> Result<(), Damaged> {
    match (name, stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => {
            for element in bytes.as_chunks_mut::<4>().0 {
                let [x, y, one, _] = element.map(|byte| f32::from(byte as i8));
                let rounded = direction([x, y, one], i8::MAX.into());
                element[..3].copy_from_slice(&rounded.map(|x| x as i8 as u8));
            }
        }
        ("OCTAHEDRAL", 8) => shorts(bytes, |[x, y, one, last]| {
            let rounded = direction([x, y, one].map(f32::from), SHORT);
            let [x, y, z] = rounded.map(|x| x as i16);
            [x, y, z, last]
        }),
        ("QUATERNION", 8) => shorts(bytes, rotation),
        ("EXPONENTIAL", _) => {
            for word in bytes.as_chunks_mut::<4>().0 {
                *word = float(i32::from_le_bytes(*word)).to_le_bytes();
            }
        }
        ("OCTAHEDRAL" | "QUATERNION", _) => return Err("a stride that the filter cannot have"),
        _ => return Err("a filter that is none of the extension"),
    }
    Ok(())
}

/// The largest of 16 bits.
const SHORT: f32 = i16::MAX as f32;

fn shorts(bytes: &mut [u8], change: impl Fn([i16; 4]) -> [i16; 4]) {
    for element in bytes.as_chunks_mut::<8>().0 {
        let number = |k: usize| i16::from_le_bytes([element[2 * k], element[2 * k + 1]]);
        let changed = change([0, 1, 2, 3].map(number)).map(i16::to_le_bytes);
        element.copy_from_slice(changed.as_flattened());
    }
}

/// The vector of this length, in whole numbers, at a place of the octahedron whose corners are `one` from its centre.
fn direction([x, y, one]: [f32; 3], most: f32) -> [f32; 3] {
    let z = one - x.abs() - y.abs();
    let below = z.min(0.0);
    let [x, y] = [x, y].map(|x| x - below.copysign(x));
    let scale = most / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|x| (x * scale).round())
}

/// A rotation from three of its numbers; the last one tells which is left out, and the scale.
fn rotation([x, y, z, last]: [i16; 4]) -> [i16; 4] {
    let scale = FRAC_1_SQRT_2 / f32::from(last | 3);
    let three = [x, y, z].map(|x| f32::from(x) * scale);
    let rest = three.iter().fold(1.0f32, |rest, x| rest - x * x);
    let largest = rest.max(0.0).sqrt();
    let mut all = [largest, three[0], three[1], three[2]].map(|x| (x * SHORT).round() as i16);
    all.rotate_right((last & 3) as usize);
    all
}

/// An integer of 24 bits times a power of two, whose exponent is in the highest byte.
fn float(word: i32) -> f32 {
    let power = f64::from_bits(((1023 + i64::from(word >> 24)) as u64) << 52);
    (f64::from(word << 8 >> 8) * power) as f32
}
