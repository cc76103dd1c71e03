//! Samples of surfaces that no scanner has seen.

use super::worlds::{DENSE, SHEET};
use super::{Measured, Task};
use crate::picker::Picker;
use crate::rng::Purpose;
use crate::surface::{Tessellation, inside};
use crate::vec3::{Vec3, cross, length, normalize, scale, sub};

/// Spread of outliers near a surface, in spacings.
const NEAR: f64 = 8.0;

/// Density on the sheet: the square in the middle is denser by the square of a ratio of spacings.
pub(super) fn jump(ratio: f64) -> impl Fn(Vec3) -> f64 {
    move |p| {
        let off = |c: f64| (c - SHEET / 2.0).abs() < DENSE / 2.0;
        if off(p[0]) && off(p[1]) {
            ratio * ratio
        } else {
            1.0
        }
    }
}

/// Density on the round body: its bottom is sparser.
pub(super) fn cap(ratio: f64) -> impl Fn(Vec3) -> f64 {
    move |p| {
        if p[2] < -0.55 * length(p) {
            1.0 / (ratio * ratio)
        } else {
            1.0
        }
    }
}

/// Random places on a surface, in proportion to a density, with noise in all directions.
pub(super) fn sample(
    mesh: &Tessellation,
    task: &Task,
    density: impl Fn(Vec3) -> f64,
) -> Vec<Measured> {
    let corners: Vec<[Vec3; 3]> = mesh
        .triangles
        .iter()
        .map(|t| t.map(|v| mesh.vertices[v as usize]))
        .collect();
    let normal = |[a, b, c]: &[Vec3; 3]| cross(sub(*b, *a), sub(*c, *a));
    let middle =
        |t: &[Vec3; 3]| -> Vec3 { std::array::from_fn(|k| (t[0][k] + t[1][k] + t[2][k]) / 3.0) };
    let picker = Picker::new(
        corners
            .iter()
            .map(|t| length(normal(t)) / 2.0 * density(middle(t))),
    );
    // Where the density is one: of the densest part of the bust, of the coarse part of the sheet.
    let spacing = (picker.total() / task.points as f64).sqrt();
    let one = |index: usize| {
        let mut rng = task.random(Purpose::Position, index);
        let (triangle, t) = picker.pick(rng.uniform());
        Measured {
            place: inside(&corners[triangle], t, rng.uniform()),
            normal: normalize(normal(&corners[triangle])),
            error: task.shake(index, task.measuring.noise * spacing),
            real: true,
        }
    };
    (0..task.points).map(one).collect()
}

/// A sample of which a share, the ratio in per cent, is off the surface: half of it anywhere in the box, half
/// of it within some spacings.
pub(super) fn strewn(mesh: &Tessellation, task: &Task) -> Vec<Measured> {
    let mut points = sample(mesh, task, |_| 1.0);
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
        length(cross(sub(b, a), sub(c, a))) / 2.0
    };
    let area: f64 = mesh.triangles.iter().map(area).sum();
    let spacing = (area / task.points as f64).sqrt();
    let share = task.ratio / 100.0;
    stray(&mut points, task, share, NEAR * spacing);
    points
}

/// Moves a share of points off the surface: every second anywhere in the box, the others by a distance.
pub(super) fn stray(points: &mut [Measured], task: &Task, share: f64, near: f64) {
    let [mut low, mut high] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for point in &*points {
        for k in 0..3 {
            low[k] = low[k].min(point.place[k]);
            high[k] = high[k].max(point.place[k]);
        }
    }
    for (index, point) in points.iter_mut().enumerate() {
        let mut rng = task.random(Purpose::Outlier, index);
        if rng.uniform() >= share {
            continue;
        }
        point.real = false;
        point.error = if rng.uniform() < 0.5 {
            scale([(); 3].map(|()| rng.normal()), near)
        } else {
            let place = std::array::from_fn(|k| low[k] + (high[k] - low[k]) * rng.uniform());
            sub(place, point.place)
        };
    }
}

/// The integer places on the faces of a block with one corner at the origin, with noise.
pub(super) fn lattice(mesh: &Tessellation, task: &Task) -> Vec<Measured> {
    let zero: Vec3 = [0.0; 3];
    let far = mesh
        .vertices
        .iter()
        .fold(zero, |far, v| std::array::from_fn(|k| far[k].max(v[k])));
    let [nx, ny, nz] = far.map(|c| c as u64);
    let mut points = Vec::new();
    for (z, y) in (0..=nz).flat_map(|z| (0..=ny).map(move |y| (z, y))) {
        let rim = z == 0 || z == nz || y == 0 || y == ny;
        let step = if rim { 1 } else { nx.max(1) as usize };
        for x in (0..=nx).step_by(step) {
            let place = [x, y, z].map(|c| c as f64);
            let side = |k: usize| match place[k] {
                c if c == far[k] => 1.0,
                0.0 => -1.0,
                _ => 0.0,
            };
            points.push(Measured {
                place,
                normal: normalize([0, 1, 2].map(side)),
                error: task.shake(points.len(), task.measuring.noise),
                real: true,
            });
        }
    }
    points
}
