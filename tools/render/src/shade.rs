//! Colours from the depth buffer.

use crate::scene::Scene;
use outcrop_raster::camera::span;
use outcrop_raster::light::{self, BOUNDARY, Colour, Light, NON_MANIFOLD, WIRE, ramp};
use outcrop_raster::{Camera, Mark, Raster, picture};

/// The value of a triangle or point in the raster: of equally near ones the first is seen.
pub(crate) fn value_of(number: u32) -> u32 {
    !number
}

/// Computes the colours of pixels.
pub(crate) struct Shader<'a> {
    mesh: &'a Scene,
    light: Light,
    heights: [f64; 2],
}

impl<'a> Shader<'a> {
    pub(crate) fn new(mesh: &'a Scene, camera: &Camera, raster: &Raster) -> Self {
        Shader {
            mesh,
            light: Light::of(camera, raster.width, raster.height),
            heights: span(&mesh.positions, [0.0, 0.0, 1.0], 1.0),
        }
    }

    fn triangle(&self, number: u32) -> Colour {
        let corners = self.mesh.triangles[number as usize];
        let lit = self
            .light
            .on(corners.map(|v| self.mesh.positions[v as usize]));
        let color = match lit.front {
            true => self.own(&corners).unwrap_or(light::FRONT),
            false => light::BACK,
        };
        color.map(|c| c * lit.brightness)
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

    fn point(&self, raster: &Raster, pixel: usize, number: u32) -> Colour {
        let height = self.mesh.positions[number as usize][2];
        let [low, high] = self.heights;
        let share = if high > low {
            (height - low) / (high - low)
        } else {
            0.5
        };
        let shade = self.light.eye_dome(raster, pixel);
        let color = self.own(&[number]).unwrap_or_else(|| ramp(share));
        color.map(|c| c * shade)
    }

    fn pixel(&self, raster: &Raster, pixel: usize) -> Option<Colour> {
        let base = raster.value(pixel).map(|value| match value_of(value) {
            number if self.mesh.triangles.is_empty() => self.point(raster, pixel, number),
            number => self.triangle(number),
        });
        match raster.mark(pixel) {
            Mark::None => base,
            Mark::Wire => base.map(|base| base.map(|c| c * WIRE)),
            Mark::Boundary => Some(BOUNDARY),
            Mark::NonManifold => Some(NON_MANIFOLD),
        }
    }

    /// The image as RGB bytes; each pixel is the mean of `factor` squared pixels of the raster.
    pub(crate) fn image(&self, raster: &Raster, factor: usize) -> Vec<u8> {
        let image = picture::image(raster, factor, |pixel| self.pixel(raster, pixel));
        picture::on_white(&image)
    }
}
