//! Pictures of meshes and clouds, drawn in bounded memory. Any number of threads may draw at a time, in any order;
//! the picture is the same.

use outcrop_disk::error::{Error, Result};
use outcrop_raster::light::{BACK, BOUNDARY, Colour, FRONT, Light, NON_MANIFOLD, ramp};
use outcrop_raster::{Camera, Framing, Mark, Raster, Vec3, View, picture};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU32, Ordering};

/// Size of a picture in pixels.
pub const SIZE: [usize; 2] = [880, 560];

/// Pixels of the raster along each side of a pixel of the picture.
const FACTOR: usize = 2;

/// Coordinates left out at either end when a picture is framed, in per cent, so that a few points far away do not
/// shrink the object.
const CROP: f64 = 0.5;

/// From above, north at the top.
pub const TOP: View = View {
    azimuth: -90.0,
    elevation: 90.0,
};

/// Obliquely, from the south-west and from the north-east.
pub const OBLIQUE: [View; 2] = [
    View {
        azimuth: -125.0,
        elevation: 35.0,
    },
    View {
        azimuth: 55.0,
        elevation: 35.0,
    },
];

/// Boundary edges above which they are drawn thin.
const MANY: u64 = 20_000;

/// A picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// The name of the view or of the map.
    pub name: String,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Pixels for one unit of the coordinates, at right angles to the view.
    pub scale: f64,
    /// The file, as PNG with a transparent background.
    pub png: Vec<u8>,
}

/// Content of a pixel of the raster: the upper half is the kind, the lower a level.
mod kind {
    pub const BACK: u32 = 0;
    pub const FRONT: u32 = 1;
    pub const RAMP: u32 = 2;
    pub const SAME: u32 = 3;
    pub const GROWTH: u32 = 4;
    pub const LOSS: u32 = 5;
    pub const ONLY_NEW: u32 = 6;
    pub const ONLY_OLD: u32 = 7;
}

/// How a place on a map of change is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// Nothing changed: nearly white.
    Same,
    /// The surface grew: from a pale red to a full one.
    Growth,
    /// It lost: from a pale blue to a full one.
    Loss,
    /// Only the new surface is there: violet.
    OnlyNew,
    /// Only the old one: green.
    OnlyOld,
}

/// The colours of [`Tone`].
mod tone {
    use outcrop_raster::light::Colour;

    pub const SAME: Colour = [240.0, 240.0, 236.0];
    pub const GROWTH: [Colour; 2] = [[244.0, 190.0, 176.0], [178.0, 20.0, 32.0]];
    pub const LOSS: [Colour; 2] = [[178.0, 205.0, 240.0], [22.0, 68.0, 172.0]];
    pub const ONLY_NEW: Colour = [156.0, 84.0, 196.0];
    pub const ONLY_OLD: Colour = [52.0, 148.0, 84.0];
}

/// A picture that is being drawn.
#[derive(Debug)]
pub struct Canvas {
    camera: Camera,
    light: Light,
    raster: Raster,
}

/// Bytes of a canvas, with the picture that is made of it.
#[must_use]
pub fn canvas_bytes() -> u64 {
    let pixels = SIZE[0] * SIZE[1];
    Raster::bytes(pixels * FACTOR * FACTOR) + 12 * pixels as u64
}

fn camera(view: View, positions: &[Vec3], factor: usize) -> Camera {
    let framing = Framing {
        size: SIZE.map(|pixels| pixels * factor),
        zoom: 1.0,
        centre: None,
        crop: CROP,
    };
    Camera::new(view, framing, positions)
}

fn encoded(name: &str, scale: f64, pixels: &[u8]) -> Result<Picture> {
    let [width, height] = SIZE.map(|pixels| pixels as u32);
    let png = picture::png(width, height, pixels, false);
    let png = png.map_err(|why| Error::io("a picture", "make", std::io::Error::other(why)))?;
    Ok(Picture {
        name: name.to_owned(),
        width,
        height,
        scale,
        png,
    })
}

impl Canvas {
    /// An empty picture that is framed by some of the positions. [`canvas_bytes`] must be reserved.
    #[must_use]
    pub fn new(view: View, positions: &[Vec3]) -> Self {
        let camera = camera(view, positions, FACTOR);
        let [width, height] = SIZE.map(|pixels| pixels * FACTOR);
        Self {
            light: Light::of(&camera, width, height),
            raster: Raster::new(width, height),
            camera,
        }
    }

    /// The cell of a position, for [`Canvas::misses`].
    #[must_use]
    #[inline]
    pub fn cell(&self, p: Vec3) -> u32 {
        Raster::cell(self.camera.project(p))
    }

    /// True if a triangle whose corners have these cells is not seen for certain.
    #[must_use]
    #[inline]
    pub fn misses(cells: [u32; 3]) -> bool {
        Raster::misses(cells)
    }

    /// The value of a triangle in the raster.
    fn lit(&self, corners: [Vec3; 3]) -> u32 {
        let lit = self.light.on(corners);
        let kind = if lit.front { kind::FRONT } else { kind::BACK };
        kind << 16 | level(lit.brightness)
    }

    /// Draws a triangle.
    #[inline]
    pub fn triangle(&self, corners: [Vec3; 3]) {
        let at = corners.map(|p| self.camera.project(p));
        self.raster.triangle(at, || self.lit(corners));
    }

    /// Draws a point as a square of `size` pixels; `share` is its colour on a scale from 0 to 1. It is in front of
    /// a surface on which it lies.
    pub fn point(&self, p: Vec3, size: f64, share: f64, lift: f64) {
        let [x, y, depth] = self.camera.project(p);
        let at = [x, y, depth + lift / self.camera.scale];
        let size = size * FACTOR as f64;
        self.raster.point(at, size, kind::RAMP << 16 | level(share));
    }

    /// Pixels of the picture for one unit of the positions.
    #[must_use]
    pub fn pixels(&self) -> f64 {
        self.camera.scale / FACTOR as f64
    }

    /// As [`Canvas::point`], in the colours of a map of change; `share` tells how much grew or was lost.
    pub fn change(&self, p: Vec3, size: f64, (tone, share): (Tone, f64), lift: f64) {
        let kind = match tone {
            Tone::Same => kind::SAME,
            Tone::Growth => kind::GROWTH,
            Tone::Loss => kind::LOSS,
            Tone::OnlyNew => kind::ONLY_NEW,
            Tone::OnlyOld => kind::ONLY_OLD,
        };
        let [x, y, depth] = self.camera.project(p);
        let at = [x, y, depth + lift / self.camera.scale];
        self.raster
            .point(at, size * FACTOR as f64, kind << 16 | level(share));
    }

    /// Draws a boundary edge, one of `many`: thinner if they would hide the surface. To be called when all triangles
    /// are drawn.
    pub fn edge(&self, ends: [Vec3; 2], many: u64) {
        let thickness = if many > MANY {
            1.0
        } else {
            1.1 * FACTOR as f64
        };
        self.raster
            .line(&self.camera, ends, Mark::Boundary, thickness);
    }

    /// Marks a position, whatever hides it.
    pub fn mark(&self, p: Vec3, size: f64) {
        let at = self.camera.project(p);
        self.raster
            .mark_point(at, size * FACTOR as f64, Mark::NonManifold);
    }

    fn colour(&self, pixel: usize, scale: &impl Fn(f64) -> f64) -> Option<Colour> {
        let base = self.raster.value(pixel).map(|value| {
            let share = f64::from(value & 0xffff) / 65535.0;
            match value >> 16 {
                kind::BACK => BACK.map(|c| c * share),
                kind::FRONT => FRONT.map(|c| c * share),
                other => {
                    let shade = self.light.eye_dome(&self.raster, pixel);
                    painted(other, scale(share)).map(|c| c * shade)
                }
            }
        });
        match self.raster.mark(pixel) {
            Mark::None | Mark::Wire => base,
            Mark::Boundary => Some(BOUNDARY),
            Mark::NonManifold => Some(NON_MANIFOLD),
        }
    }

    /// The picture; `unit` is the length of the unit of the positions, and `scale` maps the shares of points to
    /// those on the scale of colours.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be encoded.
    pub fn picture(&self, name: &str, unit: f64, scale: impl Fn(f64) -> f64) -> Result<Picture> {
        let image = picture::image(&self.raster, FACTOR, |pixel| self.colour(pixel, &scale));
        let scale = self.camera.scale / FACTOR as f64 / unit;
        encoded(name, scale, &image)
    }
}

/// The colour of a point, of this kind and at this place on the scale.
fn painted(kind: u32, share: f64) -> Colour {
    let share = share.clamp(0.0, 1.0);
    let between =
        |[from, to]: [Colour; 2]| std::array::from_fn(|k| from[k] + (to[k] - from[k]) * share);
    match kind {
        kind::SAME => tone::SAME,
        kind::GROWTH => between(tone::GROWTH),
        kind::LOSS => between(tone::LOSS),
        kind::ONLY_NEW => tone::ONLY_NEW,
        kind::ONLY_OLD => tone::ONLY_OLD,
        _ => ramp(share),
    }
}

/// A share of 1 as a level.
fn level(share: f64) -> u32 {
    (share.clamp(0.0, 1.0) * 65535.0).round() as u32
}

/// A map from above that counts points in cells of some pixels, and some of them once more.
#[derive(Debug)]
pub struct Map {
    camera: Camera,
    /// Side of a cell in pixels.
    cell: usize,
    all: Vec<AtomicU32>,
    some: Vec<AtomicU32>,
}

/// Bytes of a map, with the picture that is made of it.
#[must_use]
pub fn map_bytes() -> u64 {
    20 * (SIZE[0] * SIZE[1]) as u64
}

/// Counts of a cell end here; there is no room for more in a picture.
const MOST: u32 = u32::MAX / 2;

/// Points that fill a map with cells of one pixel: some for each.
const POINTS: u64 = (SIZE[0] * SIZE[1]) as u64 * 4;

impl Map {
    /// An empty map for a number of points that is framed by some positions. [`map_bytes`] must be reserved.
    #[must_use]
    pub fn new(positions: &[Vec3], points: u64) -> Self {
        let zeros = || (0..SIZE[0] * SIZE[1]).map(|_| AtomicU32::new(0)).collect();
        let fits = |cell: &usize| points * (cell * cell) as u64 >= POINTS;
        Self {
            camera: camera(TOP, positions, 1),
            cell: [1, 2, 4].into_iter().find(fits).unwrap_or(8),
            all: zeros(),
            some: zeros(),
        }
    }

    /// Counts a point.
    #[inline]
    pub fn add(&self, p: Vec3, special: bool) {
        let [x, y, _] = self.camera.project(p);
        let inside = (0.0..SIZE[0] as f64).contains(&x) && (0.0..SIZE[1] as f64).contains(&y);
        if !inside {
            return;
        }
        let at = y as usize / self.cell * SIZE[0] + x as usize / self.cell;
        if self.all[at].load(Ordering::Relaxed) < MOST {
            self.all[at].fetch_add(1, Ordering::Relaxed);
            self.some[at].fetch_add(special.into(), Ordering::Relaxed);
        }
    }

    fn image(&self, colour: impl Fn(u32, u32) -> Colour) -> Vec<u8> {
        let [width, height] = SIZE;
        let mut image = Vec::with_capacity(4 * width * height);
        for y in 0..height {
            for x in 0..width {
                let at = y / self.cell * width + x / self.cell;
                let all = self.all[at].load(Ordering::Relaxed);
                let some = self.some[at].load(Ordering::Relaxed);
                match all {
                    0 => image.extend([0; 4]),
                    _ => {
                        image.extend(colour(all, some).map(|c| c.round() as u8));
                        image.push(255);
                    }
                }
            }
        }
        image
    }

    /// The shares of special points: grey without any, orange where all are.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be encoded.
    pub fn shares(&self, name: &str, unit: f64) -> Result<Picture> {
        const NONE: Colour = [176.0, 178.0, 182.0];
        const ALL: Colour = [222.0, 92.0, 0.0];
        let image = self.image(|all, some| {
            // Few of many are seen as well.
            let share = (f64::from(some) / f64::from(all)).sqrt();
            std::array::from_fn(|k| NONE[k] * (1.0 - share) + ALL[k] * share)
        });
        encoded(name, self.camera.scale / unit, &image)
    }

    /// The points for each area, on a logarithmic scale; and the largest number of points for an area of one
    /// square unit.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be encoded.
    pub fn density(&self, name: &str, unit: f64) -> Result<(Picture, f64)> {
        let counts = self.all.iter().map(|all| all.load(Ordering::Relaxed));
        let most = counts.max().unwrap_or(0);
        let whole = libm::log(f64::from(most.max(2)));
        let image = self.image(|all, _| ramp(libm::log(f64::from(all)) / whole));
        let scale = self.camera.scale / unit;
        let densest = f64::from(most) * (scale / self.cell as f64).powi(2);
        Ok((encoded(name, scale, &image)?, densest))
    }
}
