//! The middle of a frame: a sample that proves that no point is far from all others.

use super::coordinate::Coordinate;

/// Of each frame every point with a multiple of this as its number is a sample.
const SAMPLE: usize = 64;

/// The middle of a frame along each axis: at least a quarter of its samples are at or below the first
/// coordinate, and as many at or above the second.
pub(super) type Middle = [[f64; 2]; 3];

/// Number of samples that are at or below the middle of a frame with `points` points.
pub(super) fn sure(points: u64) -> u64 {
    (points.div_ceil(SAMPLE as u64).max(1) - 1) / 4 + 1
}

/// The middle of a frame.
pub(super) fn middle<T: Coordinate>(points: &[[T; 3]]) -> Middle {
    std::array::from_fn(|axis| {
        let mut sample: Vec<f64> = points
            .iter()
            .step_by(SAMPLE)
            .map(|p| p[axis].into())
            .collect();
        sample.sort_unstable_by(f64::total_cmp);
        let quarter = sure(points.len() as u64) as usize - 1;
        [sample[quarter], sample[sample.len() - 1 - quarter]]
    })
}
