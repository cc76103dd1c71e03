//! The short form of a normal that a point has in its file.

use outcrop_ply::{Scalar, real};

/// Length of a normal in its short form.
const LENGTH: f64 = i16::MAX as f64;

/// What is added to its components, so that they are not negative.
const ADDED: i32 = i16::MAX as i32;

/// Bytes of a normal in its short form: two words.
pub const NORMAL_BYTES: usize = 8;

/// A component of a point without a normal.
const NONE: u32 = u16::MAX as u32;

/// The short form of a direction, in words that compare like its components; none is larger than all.
pub(super) fn short(direction: [f64; 3]) -> [u32; 2] {
    let largest = direction.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let finite = direction.iter().all(|x| x.is_finite());
    let [x, y, z] = match finite && largest > 0.0 {
        true => {
            let scaled = direction.map(|x| x / largest);
            let [x, y, z] = scaled;
            let length = (x * x + y * y + z * z).sqrt();
            scaled.map(|x| ((x / length * LENGTH).round() as i32 + ADDED) as u32)
        }
        false => [NONE; 3],
    };
    [x << 16 | y, z << 16]
}

/// The direction with this short form, about 2^15 long.
#[must_use]
pub fn direction([first, second]: [u32; 2]) -> Option<[i32; 3]> {
    let parts = [first >> 16, first & 0xffff, second >> 16];
    let known = parts.iter().all(|part| *part < NONE);
    known.then(|| parts.map(|part| part as i32 - ADDED))
}

/// Places and types of the components of a normal in the rows of a source.
pub(super) type Parts = [(usize, Scalar); 3];

/// The short form of the normal of a point whose values in the spool are `values`.
pub(super) fn normal_of(parts: Option<&Parts>, values: &[u8]) -> [u32; 2] {
    let value = |(at, scalar): (usize, Scalar)| real(scalar, &values[at..], false);
    short(parts.map_or([0.0; 3], |parts| parts.map(value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_forms_are_directions_and_compare_like_them() {
        for (v, expected) in [
            ([0.0, 0.0, 1.0], Some([0, 0, 32767])),
            ([0.0, -7e200, 0.0], Some([0, -32767, 0])),
            ([3e-200, 0.0, -4e-200], Some([19660, 0, -26214])),
            ([0.0, -0.0, 0.0], None),
            ([f64::NAN, 0.0, 1.0], None),
            ([0.0, 1.0, f64::INFINITY], None),
        ] {
            assert_eq!(direction(short(v)), expected, "{v:?}");
        }
        let ascending = [
            [-1.0, 0.0, 0.0],
            [-0.6, 0.0, 0.8],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, -1.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [0.0; 3],
        ];
        assert!(ascending.map(short).is_sorted());
    }
}
