//! Light and colours.

use crate::camera::Camera;
use crate::raster::Raster;
use crate::vec3::{Vec3, cross, dot, normalize, sub};

/// Red, green and blue, from 0 to 255.
pub type Colour = [f64; 3];

/// Triangles seen from the side of their counter-clockwise winding, without colours of their own.
pub const FRONT: Colour = [236.0, 224.0, 206.0];
/// Triangles seen from behind.
pub const BACK: Colour = [92.0, 132.0, 232.0];
/// Edges with one triangle.
pub const BOUNDARY: Colour = [225.0, 20.0, 20.0];
/// Edges with more than two triangles.
pub const NON_MANIFOLD: Colour = [225.0, 0.0, 225.0];
/// Factor of the surface colour under wires.
pub const WIRE: f64 = 0.35;

/// Colours from the lowest to the highest value.
const RAMP: [Colour; 6] = [
    [62.0, 38.0, 130.0],
    [50.0, 98.0, 160.0],
    [38.0, 150.0, 140.0],
    [92.0, 190.0, 90.0],
    [190.0, 210.0, 60.0],
    [245.0, 225.0, 80.0],
];

/// The colour of a value, given as its share of the whole range, from 0 to 1.
#[must_use]
pub fn ramp(share: f64) -> Colour {
    let place = share.clamp(0.0, 1.0) * (RAMP.len() - 1) as f64;
    let step = (place as usize).min(RAMP.len() - 2);
    let blend = place - step as f64;
    std::array::from_fn(|k| RAMP[step][k] * (1.0 - blend) + RAMP[step + 1][k] * blend)
}

/// The light of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Light {
    from: Vec3,
    towards: Vec3,
    /// Darkening of a point per unit of depth step.
    relief: f64,
}

/// How a triangle is lit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lit {
    /// True if the viewer sees the side of its counter-clockwise winding.
    pub front: bool,
    /// Factor of its colour, from 0 to 1.
    pub brightness: f64,
}

impl Light {
    /// A headlight over the left shoulder: light from the viewer's direction would flatten shapes.
    #[must_use]
    pub fn of(camera: &Camera, width: usize, height: usize) -> Self {
        let from = std::array::from_fn(|k| {
            camera.towards[k] + 0.45 * camera.up[k] - 0.35 * camera.right[k]
        });
        Self {
            from: normalize(from),
            towards: camera.towards,
            relief: 60.0 * camera.scale / (width + height) as f64,
        }
    }

    /// The light on a triangle.
    #[must_use]
    #[inline]
    pub fn on(&self, [a, b, c]: [Vec3; 3]) -> Lit {
        let mut normal = normalize(cross(sub(b, a), sub(c, a)));
        let front = dot(normal, self.towards) >= 0.0;
        if !front {
            normal = normal.map(|c| -c);
        }
        let head = dot(normal, self.from).max(0.0);
        let sky = 0.5 + 0.5 * normal[2];
        Lit {
            front,
            brightness: 0.16 + 0.64 * head + 0.20 * sky,
        }
    }

    /// Darkens a pixel whose surroundings are nearer to the viewer, which shows the shape of a cloud without
    /// normals.
    #[must_use]
    pub fn eye_dome(&self, raster: &Raster, pixel: usize) -> f64 {
        const REACH: isize = 2;
        const AROUND: [(isize, isize); 8] = [
            (-1, 0),
            (1, 0),
            (0, -1),
            (0, 1),
            (-1, -1),
            (1, 1),
            (-1, 1),
            (1, -1),
        ];
        let (width, height) = (raster.width as isize, raster.height as isize);
        let (x, y) = (pixel as isize % width, pixel as isize / width);
        let own = raster.depth(pixel);
        let mut rise = 0.0;
        for (dx, dy) in AROUND {
            let (nx, ny) = (x + REACH * dx, y + REACH * dy);
            if (0..width).contains(&nx) && (0..height).contains(&ny) {
                let other = raster.depth((ny * width + nx) as usize);
                rise += f64::from(other - own).max(0.0);
            }
        }
        libm::exp(-self.relief * rise / 8.0).max(0.25)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ramp_goes_through_its_colours() {
        assert_eq!(ramp(-1.0), RAMP[0]);
        assert_eq!(ramp(0.2), RAMP[1]);
        assert_eq!(ramp(2.0), RAMP[5]);
        assert_eq!(ramp(f64::NAN).map(f64::is_nan), [true; 3]);
    }
}
