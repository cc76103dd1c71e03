//! The depth buffer and the drawing into it.

use crate::camera::Camera;
use crate::vec3::{Vec3, sub};
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

/// Marks on top of the surface; later ones have priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Mark {
    /// No mark.
    None,
    /// The edge of a triangle.
    Wire,
    /// An edge with one triangle.
    Boundary,
    /// An edge with more than two triangles, or another defect.
    NonManifold,
}

impl Mark {
    fn of(value: u8) -> Self {
        let all = [Self::None, Self::Wire, Self::Boundary, Self::NonManifold];
        all[usize::from(value) % all.len()]
    }
}

/// For each pixel the nearest thing, as a value that the caller chooses. Any number of threads may draw at a
/// time.
#[derive(Debug)]
pub struct Raster {
    /// Pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// The depth in the upper half, ordered as numbers, and the value in the lower; 0 where nothing is.
    pixels: Vec<AtomicU64>,
    marks: Vec<AtomicU8>,
}

/// Bits of a float such that they ascend as it does.
fn ascending(depth: f32) -> u32 {
    let bits = depth.to_bits();
    if bits >> 31 == 1 {
        !bits
    } else {
        bits | 1 << 31
    }
}

/// The float with these ascending bits.
fn float(bits: u32) -> f32 {
    f32::from_bits(if bits >> 31 == 1 {
        bits & !(1 << 31)
    } else {
        !bits
    })
}

impl Raster {
    /// An empty raster.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        let pixels = width * height;
        Raster {
            width,
            height,
            pixels: (0..pixels).map(|_| AtomicU64::new(0)).collect(),
            marks: (0..pixels).map(|_| AtomicU8::new(0)).collect(),
        }
    }

    /// Bytes of a raster with a number of pixels.
    #[must_use]
    pub fn bytes(pixels: usize) -> u64 {
        9 * pixels as u64
    }

    /// Depth of a pixel, increasing towards the viewer.
    #[must_use]
    pub fn depth(&self, pixel: usize) -> f32 {
        match self.pixels[pixel].load(Ordering::Relaxed) {
            0 => f32::NEG_INFINITY,
            found => float((found >> 32) as u32),
        }
    }

    /// The value of the nearest thing in a pixel, none if nothing is there.
    #[must_use]
    pub fn value(&self, pixel: usize) -> Option<u32> {
        let found = self.pixels[pixel].load(Ordering::Relaxed);
        (found != 0).then_some(found as u32)
    }

    /// The mark of a pixel.
    #[must_use]
    pub fn mark(&self, pixel: usize) -> Mark {
        Mark::of(self.marks[pixel].load(Ordering::Relaxed))
    }

    /// The pixels `low..high` of an axis whose centre is in the closed interval.
    #[inline]
    fn pixels(low: f64, high: f64, size: usize) -> std::ops::Range<usize> {
        // The casts saturate, and NaN gives an empty range. Rounding by casts is faster than by calls.
        let from = (low - 0.5).max(0.0);
        let below = from as usize;
        let first = below.saturating_add(usize::from((below as f64) < from));
        let end = (high + 0.5).max(0.0) as usize;
        first.min(size)..end.min(size)
    }

    /// The centres of pixels to the left of a projected position and above it, for [`Raster::misses`].
    #[must_use]
    #[inline]
    pub fn cell([x, y, _]: Vec3) -> u32 {
        // The casts saturate, and NaN gives zero.
        let half = |x: f64| (x + 0.5).clamp(0.0, 65535.0) as u32;
        half(x) << 16 | half(y)
    }

    /// True if a triangle whose corners have these cells covers no centre of a pixel for certain: the quick answer
    /// for most triangles of a large mesh.
    #[must_use]
    #[inline]
    pub fn misses([a, b, c]: [u32; 3]) -> bool {
        let differ = (a ^ b) | (a ^ c);
        differ >> 16 == 0 || differ & 0xffff == 0
    }

    /// Draws a triangle with projected corners; `value` is asked only if it is seen at the centre of a pixel,
    /// as far as is known by then.
    #[inline]
    pub fn triangle(&self, [a, b, c]: [Vec3; 3], value: impl FnOnce() -> u32) {
        let bounds = |k: usize| (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
        let ((left, right), (top, bottom)) = (bounds(0), bounds(1));
        let columns = Self::pixels(left, right, self.width);
        let rows = Self::pixels(top, bottom, self.height);
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let twice_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let inverse = 1.0 / twice_area;
        if !inverse.is_finite() {
            return;
        }
        let mut value = Some(value);
        let mut known = 0;
        // Barycentric weights of b and c and the depth are linear in the image.
        let (by_x, by_y) = ((c[1] - a[1]) * inverse, (a[0] - c[0]) * inverse);
        let (cx_x, cx_y) = ((a[1] - b[1]) * inverse, (b[0] - a[0]) * inverse);
        for y in rows {
            let dy = y as f64 + 0.5 - a[1];
            for x in columns.clone() {
                let dx = x as f64 + 0.5 - a[0];
                let (wb, wc) = (dx * by_x + dy * by_y, dx * cx_x + dy * cx_y);
                if wb >= 0.0 && wc >= 0.0 && wb + wc <= 1.0 {
                    let depth = a[2] + wb * (b[2] - a[2]) + wc * (c[2] - a[2]);
                    let pixel = y * self.width + x;
                    // What is hidden needs no value.
                    if self.is_behind(pixel, depth as f32) {
                        continue;
                    }
                    if let Some(ask) = value.take() {
                        known = ask();
                    }
                    self.put(pixel, depth as f32, known);
                }
            }
        }
    }

    /// True if something nearer is in a pixel already.
    #[inline]
    fn is_behind(&self, pixel: usize, depth: f32) -> bool {
        let found = self.pixels[pixel].load(Ordering::Relaxed);
        u64::from(ascending(depth)) < found >> 32
    }

    #[inline]
    fn put(&self, pixel: usize, depth: f32, value: u32) {
        if depth.is_nan() {
            return;
        }
        let new = u64::from(ascending(depth)) << 32 | u64::from(value);
        if new > self.pixels[pixel].load(Ordering::Relaxed) {
            self.pixels[pixel].fetch_max(new, Ordering::Relaxed);
        }
    }

    /// Draws a projected position as a square of `size` pixels.
    pub fn point(&self, [x, y, depth]: Vec3, size: f64, value: u32) {
        for row in Self::pixels(y - size / 2.0, y + size / 2.0, self.height) {
            for column in Self::pixels(x - size / 2.0, x + size / 2.0, self.width) {
                self.put(row * self.width + column, depth as f32, value);
            }
        }
    }

    /// Marks the square of `size` pixels around a projected position, whatever hides it.
    pub fn mark_point(&self, [x, y, _]: Vec3, size: f64, mark: Mark) {
        for row in Self::pixels(y - size / 2.0, y + size / 2.0, self.height) {
            for column in Self::pixels(x - size / 2.0, x + size / 2.0, self.width) {
                self.marks[row * self.width + column].fetch_max(mark as u8, Ordering::Relaxed);
            }
        }
    }

    /// Marks the part of a line that the surface does not hide. To be called when the surface is drawn.
    pub fn line(&self, camera: &Camera, ends: [Vec3; 2], mark: Mark, thickness: f64) {
        let [a, b] = ends.map(|p| camera.project(p));
        let along = sub(b, a);
        let margin = thickness;
        let Some((from, to)) = self.visible_part(a, along, margin) else {
            return;
        };
        // In front of its own surface, even where that is steep.
        let lift = 3.0 / camera.scale;
        let pixels = along[0].abs().max(along[1].abs()) * (to - from);
        let steps = pixels.ceil().max(1.0) as usize;
        let half = thickness / 2.0;
        for step in 0..=steps {
            let t = from + (to - from) * step as f64 / steps as f64;
            let [x, y, depth] = std::array::from_fn(|k| a[k] + t * along[k]);
            let depth = (depth + lift) as f32;
            for row in Self::pixels(y - half, y + half, self.height) {
                for column in Self::pixels(x - half, x + half, self.width) {
                    let pixel = row * self.width + column;
                    if depth >= self.depth(pixel) {
                        self.marks[pixel].fetch_max(mark as u8, Ordering::Relaxed);
                    }
                }
            }
        }
    }

    /// The part of a line inside the image with a margin, as fractions of its length.
    fn visible_part(&self, start: Vec3, along: Vec3, margin: f64) -> Option<(f64, f64)> {
        let (mut from, mut to) = (0.0f64, 1.0f64);
        for (k, size) in [self.width, self.height].into_iter().enumerate() {
            let (low, high) = (-margin - start[k], size as f64 + margin - start[k]);
            if along[k] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
            } else {
                let (s, t) = (low / along[k], high / along[k]);
                from = from.max(s.min(t));
                to = to.min(s.max(t));
            }
        }
        let finite = start.iter().chain(&along).all(|c| c.is_finite());
        (finite && from <= to).then_some((from, to))
    }
}

#[cfg(test)]
mod tests;
