//! The view: direction, framing, projection.

use crate::vec3::{Vec3, cross, dot, sub};
use std::str::FromStr;

/// Viewing direction, as azimuth and elevation of the camera in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Angle in the plane of x and y, from x towards y.
    pub azimuth: f64,
    /// Angle above that plane.
    pub elevation: f64,
}

impl FromStr for View {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (azimuth, elevation) = match text {
            "iso" => (-50.0, 32.0),
            "top" => (-90.0, 90.0),
            "front" => (-90.0, 0.0),
            "side" => (0.0, 0.0),
            other => {
                let angles = other.split_once(',').and_then(|(azimuth, elevation)| {
                    Some((azimuth.trim().parse().ok()?, elevation.trim().parse().ok()?))
                });
                let fits = |&(a, e): &(f64, f64)| a.is_finite() && (-90.0..=90.0).contains(&e);
                angles.filter(fits).ok_or(
                    "expected iso, top, front, side or AZIMUTH,ELEVATION in degrees".to_owned(),
                )?
            }
        };
        Ok(View { azimuth, elevation })
    }
}

/// Part of the scene in the image.
#[derive(Clone, Copy, Debug)]
pub struct Framing {
    /// Size of the image in pixels.
    pub size: [usize; 2],
    /// Magnification after fitting.
    pub zoom: f64,
    /// Point at the centre of the image; None for the centre of the scene.
    pub centre: Option<Vec3>,
    /// Percentage of coordinates left out at either end when fitting.
    pub crop: f64,
}

/// An orthographic camera.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Direction to the right of the image.
    pub right: Vec3,
    /// Direction to the top of the image.
    pub up: Vec3,
    /// Direction from the scene to the viewer.
    pub towards: Vec3,
    /// Pixels per unit.
    pub scale: f64,
    centre: Vec3,
    middle: [f64; 2],
}

/// Part of the image that the scene fills.
const FILL: f64 = 0.9;

/// Margin around the cropped extent, relative to it.
const CROP_MARGIN: f64 = 0.15;

/// Positions sampled for the framing; more do not change the percentiles visibly.
const FRAMING_SAMPLES: usize = 1 << 21;

impl Camera {
    /// A camera that sees all `positions`, as far as the framing says so.
    #[must_use]
    pub fn new(view: View, framing: Framing, positions: &[Vec3]) -> Self {
        let (sin_a, cos_a) = libm::sincos(view.azimuth.to_radians());
        let (sin_e, cos_e) = libm::sincos(view.elevation.to_radians());
        let towards = [cos_a * cos_e, sin_a * cos_e, sin_e];
        let right = [-sin_a, cos_a, 0.0];
        let up = cross(towards, right);
        let spans = [right, up, towards].map(|axis| framed(positions, axis, framing.crop));
        let middle = spans.map(|[low, high]| f64::midpoint(low, high));
        let auto = std::array::from_fn(|k| {
            right[k] * middle[0] + up[k] * middle[1] + towards[k] * middle[2]
        });
        let size = framing.size.map(|pixels| pixels as f64);
        let fit = |k: usize| FILL * size[k] / (spans[k][1] - spans[k][0]);
        let scale = fit(0).min(fit(1));
        Camera {
            right,
            up,
            towards,
            // A single point, or none, has no extent to fit.
            scale: if scale.is_finite() { scale } else { 1.0 } * framing.zoom,
            centre: framing.centre.unwrap_or(auto),
            middle: size.map(|pixels| pixels / 2.0),
        }
    }

    /// The position at the middle of the image.
    #[must_use]
    pub fn centre(&self) -> Vec3 {
        self.centre
    }

    /// Pixel coordinates, and depth in units, increasing towards the viewer.
    #[must_use]
    #[inline]
    pub fn project(&self, p: Vec3) -> Vec3 {
        let p = sub(p, self.centre);
        [
            self.middle[0] + self.scale * dot(p, self.right),
            self.middle[1] - self.scale * dot(p, self.up),
            dot(p, self.towards),
        ]
    }
}

/// The extent to fit: without the outermost percentiles, plus a margin for sparse ends, limited to the whole
/// extent.
fn framed(positions: &[Vec3], axis: Vec3, crop: f64) -> [f64; 2] {
    let ([low, high], all) = (span(positions, axis, crop), span(positions, axis, 0.0));
    let margin = CROP_MARGIN * (high - low);
    [all[0].max(low - margin), all[1].min(high + margin)]
}

/// Extent of the positions along an axis without the outermost `crop` percent on both sides.
#[must_use]
pub fn span(positions: &[Vec3], axis: Vec3, crop: f64) -> [f64; 2] {
    let stride = positions.len().div_ceil(FRAMING_SAMPLES).max(1);
    let along = positions.iter().step_by(stride).map(|&p| dot(p, axis));
    let mut values: Vec<f64> = along.filter(|value| value.is_finite()).collect();
    let Some(last) = values.len().checked_sub(1) else {
        return [0.0; 2];
    };
    let cut = ((last as f64 * crop / 100.0) as usize).min(last / 2);
    let low = *values.select_nth_unstable_by(cut, f64::total_cmp).1;
    let high = *values.select_nth_unstable_by(last - cut, f64::total_cmp).1;
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_right_handed() {
        let framing = Framing {
            size: [200, 100],
            zoom: 1.0,
            centre: None,
            crop: 0.0,
        };
        let corners = [[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]];
        let camera = |view: &str| Camera::new(view.parse().unwrap(), framing, &corners);
        let near = |a: Vec3, b: Vec3| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-12);
        let top = camera("top");
        assert!(near(top.right, [1.0, 0.0, 0.0]) && near(top.up, [0.0, 1.0, 0.0]));
        let front = camera("front");
        assert!(near(front.right, [1.0, 0.0, 0.0]) && near(front.up, [0.0, 0.0, 1.0]));
        let side = camera("side");
        assert!(near(side.right, [0.0, 1.0, 0.0]) && near(side.up, [0.0, 0.0, 1.0]));
        assert!(near(front.project([0.0; 3]), [100.0, 50.0, 0.0]));
        assert!((front.project([0.0, 0.0, 1.0])[1] - 5.0).abs() < 1e-9);
        for bad in ["", "up", "1", "1,91", "a,b", "1,2,3"] {
            assert!(bad.parse::<View>().is_err(), "{bad}");
        }
    }

    #[test]
    fn crop_ignores_outliers() {
        let mut positions: Vec<Vec3> = (0..1000).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        positions.push([1e9, 0.0, 0.0]);
        positions.push([f64::NAN, 0.0, 0.0]);
        let axis = [1.0, 0.0, 0.0];
        assert_eq!(span(&positions, axis, 1.0), [10.0, 990.0]);
        assert_eq!(span(&positions, axis, 0.0), [0.0, 1e9]);
        assert_eq!(span(&[], axis, 1.0), [0.0, 0.0]);
    }
}
