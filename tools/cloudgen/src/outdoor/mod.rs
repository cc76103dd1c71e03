//! An aerial scan of hilly land: ground, houses, trees, walls, wires. Open ground is a height field, so it
//! faces up and has no boundary.

mod epoch;
mod land;
mod measure;
mod points;

pub use epoch::{Changes, HEAP_VOLUME, PIT_VOLUME};
pub(crate) use land::Land;
pub use measure::GroundReport;
pub(crate) use measure::measure;
pub(crate) use points::Outdoor;

/// Side of the square that the land covers.
pub const OUTDOOR_SIDE: f64 = 400.0;

/// Largest number of trees.
pub(crate) const MOST_TREES: u32 = 20_000;

/// Largest number of wires.
pub(crate) const MOST_WIRES: u32 = 1000;

/// Largest height of a free-standing wall.
pub(crate) const HIGHEST_WALL: f64 = 100.0;

/// Objects on the ground of [`Kind::Outdoor`](crate::Kind::Outdoor).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Objects {
    /// Number of trees.
    pub trees: u32,
    /// Number of power lines, each 180 long and at a height of 12 to 18.
    pub wires: u32,
    /// Height of the free-standing walls; None for heights from 1 to 3.
    pub wall_height: Option<f64>,
    /// True for a second survey, after a pit was dug, a heap and a house were made, and ten trees were felled. Its points
    /// are others; all else is the land of the first survey.
    pub epoch: bool,
}

impl Default for Objects {
    fn default() -> Self {
        Objects {
            trees: 400,
            wires: 0,
            wall_height: None,
            epoch: false,
        }
    }
}

/// Height of the ground.
pub(crate) fn height(x: f64, y: f64) -> f64 {
    12.0 * libm::sin(x / 61.0) * libm::cos(y / 47.0)
        + 4.0 * libm::sin(x / 17.0 + 1.0) * libm::sin(y / 23.0)
        + 0.6 * libm::sin(x / 3.1) * libm::sin(y / 2.7)
}

/// Slopes of the ground along x and y.
fn slopes(x: f64, y: f64) -> [f64; 2] {
    let ((a, da), (b, db)) = (libm::sincos(x / 61.0), libm::sincos(y / 47.0));
    let ((c, dc), (d, dd)) = (libm::sincos(x / 17.0 + 1.0), libm::sincos(y / 23.0));
    let ((e, de), (f, df)) = (libm::sincos(x / 3.1), libm::sincos(y / 2.7));
    [
        12.0 / 61.0 * da * db + 4.0 / 17.0 * dc * d + 0.6 / 3.1 * de * f,
        -12.0 / 47.0 * a * b + 4.0 / 23.0 * c * dd + 0.6 / 2.7 * e * df,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_match_differences() {
        let step = 1e-6;
        for k in 0..500 {
            let (x, y) = (0.8 * f64::from(k), (247.2 * f64::from(k)) % OUTDOOR_SIDE);
            let by_x = (height(x + step, y) - height(x - step, y)) / (2.0 * step);
            let by_y = (height(x, y + step) - height(x, y - step)) / (2.0 * step);
            let [slope_x, slope_y] = slopes(x, y);
            assert!((slope_x - by_x).abs() < 1e-6, "{slope_x} {by_x}");
            assert!((slope_y - by_y).abs() < 1e-6, "{slope_y} {by_y}");
        }
    }
}
