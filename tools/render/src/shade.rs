//! Colours from the depth buffer.

use crate::camera::{Camera, span};
use crate::raster::{Mark, NOTHING, Raster};
use crate::scene::Scene;
use crate::vec3::{Vec3, cross, dot, normalize, sub};

type Colour = [f64; 3];

const BACKGROUND: Colour = [255.0, 255.0, 255.0];
/// Triangles seen from the side of their counter-clockwise winding, without colours of their own.
const FRONT: Colour = [236.0, 224.0, 206.0];
/// Triangles seen from behind.
const BACK: Colour = [92.0, 132.0, 232.0];
const BOUNDARY: Colour = [225.0, 20.0, 20.0];
const NON_MANIFOLD: Colour = [225.0, 0.0, 225.0];
/// Factor of the surface colour under wires.
const WIRE: f64 = 0.35;

/// Colours of points from the lowest to the highest.
const RAMP: [Colour; 6] = [
    [62.0, 38.0, 130.0],
    [50.0, 98.0, 160.0],
    [38.0, 150.0, 140.0],
    [92.0, 190.0, 90.0],
    [190.0, 210.0, 60.0],
    [245.0, 225.0, 80.0],
];

/// Computes the colours of pixels.
pub(crate) struct Shader<'a> {
    mesh: &'a Scene,
    camera: &'a Camera,
    light: Vec3,
    heights: [f64; 2],
    /// Darkening of a point per unit of depth step.
    relief: f64,
}

impl<'a> Shader<'a> {
    pub(crate) fn new(mesh: &'a Scene, camera: &'a Camera, raster: &Raster) -> Self {
        // A headlight over the left shoulder: light from the viewer's direction would flatten shapes.
        let light = std::array::from_fn(|k| {
            camera.towards[k] + 0.45 * camera.up[k] - 0.35 * camera.right[k]
        });
        Shader {
            mesh,
            camera,
            light: normalize(light),
            heights: span(&mesh.positions, [0.0, 0.0, 1.0], 1.0),
            relief: 60.0 * camera.scale / (raster.width + raster.height) as f64,
        }
    }

    fn triangle(&self, number: u32) -> Colour {
        let [a, b, c] =
            self.mesh.triangles[number as usize].map(|v| self.mesh.positions[v as usize]);
        let mut normal = normalize(cross(sub(b, a), sub(c, a)));
        let facing = dot(normal, self.camera.towards) >= 0.0;
        if !facing {
            normal = normal.map(|c| -c);
        }
        let head = dot(normal, self.light).max(0.0);
        let sky = 0.5 + 0.5 * normal[2];
        let brightness = 0.16 + 0.64 * head + 0.20 * sky;
        let color = match facing {
            true => self
                .own(&self.mesh.triangles[number as usize])
                .unwrap_or(FRONT),
            false => BACK,
        };
        color.map(|c| c * brightness)
    }

    /// The mean of the colours of some vertices, if the file has any.
    fn own(&self, vertices: &[u32]) -> Option<Colour> {
        if self.mesh.colors.is_empty() {
            return None;
        }
        let mut sum = [0.0; 3];
        for v in vertices {
            let color = self.mesh.colors[*v as usize];
            sum = std::array::from_fn(|k| sum[k] + f64::from(color[k]));
        }
        Some(sum.map(|c| c / vertices.len() as f64))
    }

    fn point(&self, raster: &Raster, pixel: usize) -> Colour {
        let height = self.mesh.positions[raster.item[pixel] as usize][2];
        let [low, high] = self.heights;
        let share = if high > low {
            ((height - low) / (high - low)).clamp(0.0, 1.0)
        } else {
            0.5
        };
        let place = share * (RAMP.len() - 1) as f64;
        let step = (place as usize).min(RAMP.len() - 2);
        let blend = place - step as f64;
        let shade = self.eye_dome(raster, pixel);
        if let Some(color) = self.own(&[raster.item[pixel]]) {
            return color.map(|c| c * shade);
        }
        std::array::from_fn(|k| shade * (RAMP[step][k] * (1.0 - blend) + RAMP[step + 1][k] * blend))
    }

    /// Darkens a pixel whose surroundings are nearer to the viewer, which shows the shape of a cloud without
    /// normals.
    fn eye_dome(&self, raster: &Raster, pixel: usize) -> f64 {
        const REACH: isize = 2;
        let (x, y) = (
            (pixel % raster.width) as isize,
            (pixel / raster.width) as isize,
        );
        let mut rise = 0.0;
        for (dx, dy) in [
            (-1, 0),
            (1, 0),
            (0, -1),
            (0, 1),
            (-1, -1),
            (1, 1),
            (-1, 1),
            (1, -1),
        ] {
            let (nx, ny) = (x + REACH * dx, y + REACH * dy);
            let inside = (0..raster.width as isize).contains(&nx)
                && (0..raster.height as isize).contains(&ny);
            if inside {
                let other = raster.depth[ny as usize * raster.width + nx as usize];
                rise += f64::from(other - raster.depth[pixel]).max(0.0);
            }
        }
        (-self.relief * rise / 8.0).exp().max(0.25)
    }

    fn pixel(&self, raster: &Raster, pixel: usize) -> Colour {
        let number = raster.item[pixel];
        let base = match number {
            NOTHING => BACKGROUND,
            _ if self.mesh.triangles.is_empty() => self.point(raster, pixel),
            _ => self.triangle(number),
        };
        match raster.mark[pixel] {
            Mark::None => base,
            Mark::Wire => base.map(|c| c * WIRE),
            Mark::Boundary => BOUNDARY,
            Mark::NonManifold => NON_MANIFOLD,
        }
    }

    /// The image as RGB bytes; each pixel is the mean of `factor` squared pixels of the raster.
    pub(crate) fn image(&self, raster: &Raster, factor: usize) -> Vec<u8> {
        let (width, height) = (raster.width / factor, raster.height / factor);
        let mut bytes = Vec::with_capacity(width * height * 3);
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0.0; 3];
                for row in y * factor..(y + 1) * factor {
                    for column in x * factor..(x + 1) * factor {
                        let colour = self.pixel(raster, row * raster.width + column);
                        sum = std::array::from_fn(|k| sum[k] + colour[k]);
                    }
                }
                bytes.extend(sum.map(|c| (c / (factor * factor) as f64).round() as u8));
            }
        }
        bytes
    }
}
