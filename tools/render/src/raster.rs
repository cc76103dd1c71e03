//! The depth buffer and the drawing into it.

use crate::camera::Camera;
use crate::vec3::{Vec3, cross, dot, sub};

/// Marks on top of the surface; later ones have priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Mark {
    None,
    Wire,
    Boundary,
    NonManifold,
}

/// Stands for no triangle or point.
pub(crate) const NOTHING: u32 = u32::MAX;

/// For each pixel the nearest triangle or point. Colours are computed later, once per pixel.
#[derive(Debug)]
pub(crate) struct Raster {
    pub width: usize,
    pub height: usize,
    /// Depth, increasing towards the viewer.
    pub depth: Vec<f32>,
    pub item: Vec<u32>,
    pub mark: Vec<Mark>,
}

impl Raster {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let pixels = width * height;
        Raster {
            width,
            height,
            depth: vec![f32::NEG_INFINITY; pixels],
            item: vec![NOTHING; pixels],
            mark: vec![Mark::None; pixels],
        }
    }

    /// Draws all triangles; with `cull` only those that face the viewer.
    pub(crate) fn triangles(
        &mut self,
        camera: &Camera,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        cull: bool,
    ) {
        for (number, triangle) in triangles.iter().enumerate() {
            let corners = triangle.map(|v| positions[v as usize]);
            if cull {
                let [a, b, c] = corners;
                let normal = cross(sub(b, a), sub(c, a));
                if dot(normal, camera.towards) <= 0.0 {
                    continue;
                }
            }
            self.triangle(corners.map(|p| camera.project(p)), number as u32);
        }
    }

    /// The pixels `low..high` of an axis whose centre is in the closed interval.
    fn pixels(low: f64, high: f64, size: usize) -> std::ops::Range<usize> {
        // The casts saturate, and NaN gives an empty range.
        let first = (low - 0.5).ceil().max(0.0) as usize;
        let end = ((high - 0.5).floor() + 1.0).max(0.0) as usize;
        first.min(size)..end.min(size)
    }

    fn triangle(&mut self, [a, b, c]: [Vec3; 3], number: u32) {
        let twice_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let inverse = 1.0 / twice_area;
        if !inverse.is_finite() {
            return;
        }
        let bounds = |k: usize| (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
        let ((left, right), (top, bottom)) = (bounds(0), bounds(1));
        let columns = Self::pixels(left, right, self.width);
        let rows = Self::pixels(top, bottom, self.height);
        if columns.is_empty() || rows.is_empty() {
            return;
        }
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
                    self.put(y * self.width + x, depth as f32, number);
                }
            }
        }
    }

    fn put(&mut self, pixel: usize, depth: f32, number: u32) {
        if depth > self.depth[pixel] {
            self.depth[pixel] = depth;
            self.item[pixel] = number;
        }
    }

    /// Draws all positions as squares of `size` pixels.
    pub(crate) fn points(&mut self, camera: &Camera, positions: &[Vec3], size: f64) {
        for (number, &p) in positions.iter().enumerate() {
            let [x, y, depth] = camera.project(p);
            for row in Self::pixels(y - size / 2.0, y + size / 2.0, self.height) {
                for column in Self::pixels(x - size / 2.0, x + size / 2.0, self.width) {
                    self.put(row * self.width + column, depth as f32, number as u32);
                }
            }
        }
    }

    /// Marks the part of a line that the surface does not hide.
    pub(crate) fn line(&mut self, camera: &Camera, ends: [Vec3; 2], mark: Mark, thickness: f64) {
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
                    if depth >= self.depth[pixel] {
                        self.mark[pixel] = self.mark[pixel].max(mark);
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
mod tests {
    use super::*;
    use crate::camera::Framing;

    fn scene() -> (Camera, [Vec3; 4]) {
        let corners = [
            [-1.0, -1.0, 0.0],
            [1.0, -1.0, 0.0],
            [1.0, 1.0, 0.0],
            [-1.0, 1.0, 0.0],
        ];
        let framing = Framing {
            size: [100, 100],
            zoom: 1.0,
            centre: None,
            crop: 0.0,
        };
        (
            Camera::new("top".parse().unwrap(), framing, &corners),
            corners,
        )
    }

    #[test]
    fn square_fills_its_pixels_once() {
        let (camera, corners) = scene();
        let mut raster = Raster::new(100, 100);
        raster.triangles(&camera, &corners, &[[0, 1, 2], [0, 2, 3]], true);
        assert_eq!(
            raster.item.iter().filter(|&&item| item != NOTHING).count(),
            90 * 90
        );
        let mut culled = Raster::new(100, 100);
        culled.triangles(&camera, &corners, &[[0, 2, 1]], true);
        assert!(culled.item.iter().all(|&item| item == NOTHING));
    }

    #[test]
    fn nearer_wins_and_hides_lines() {
        let (camera, corners) = scene();
        let mut all = corners.to_vec();
        all.extend(corners.map(|[x, y, _]| [x, y, 5.0]));
        let mut raster = Raster::new(100, 100);
        raster.triangles(&camera, &all, &[[4, 5, 6], [0, 1, 2], [0, 2, 3]], false);
        assert!(raster.item.contains(&0) && raster.item.contains(&2));
        assert!(!raster.item.contains(&1));
        let below = [[-0.9, -0.95, 0.0], [0.9, -0.95, 0.0]];
        raster.line(&camera, below, Mark::Boundary, 3.0);
        assert!(!raster.mark[50..].contains(&Mark::NonManifold));
        let above = below.map(|[x, y, _]| [x, y, 5.0]);
        raster.line(&camera, above, Mark::NonManifold, 3.0);
        let marked = raster
            .mark
            .iter()
            .filter(|&&m| m == Mark::NonManifold)
            .count();
        assert!((200..300).contains(&marked), "{marked}");
        assert!(raster.mark.iter().filter(|&&m| m == Mark::Boundary).count() < 10);
    }

    #[test]
    fn strange_numbers_do_no_harm() {
        let (camera, _) = scene();
        let mut raster = Raster::new(100, 100);
        let bad = [
            [f64::NAN; 3],
            [f64::INFINITY; 3],
            [1e300, -1e300, 1e300],
            [1e9, 1e9, 0.0],
        ];
        for k in 0..4u32 {
            raster.triangles(
                &camera,
                &bad,
                &[[k, (k + 1) % 4, (k + 2) % 4], [k, k, k]],
                false,
            );
            let ends = [bad[k as usize], bad[(k as usize + 1) % 4]];
            raster.line(&camera, ends, Mark::Wire, 2.0);
        }
        raster.points(&camera, &bad, 3.0);
    }
}
