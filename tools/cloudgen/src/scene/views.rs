//! Where the scanners stand, and how they look around.

use std::f64::consts::{PI, TAU};

use super::sampled::{sample, stray};
use super::scanner::{Limits, Scan, measure, sees, spacing};
use super::worlds::LAND;
use super::{Measured, Measuring, Task};
use crate::rng::{Purpose, Rng};
use crate::surface::Tessellation;
use crate::triangles::Triangles;
use crate::vec3::{Vec3, add, cross, dot, length, normalize, scale, sub};

/// Scanners around a body.
const AROUND: usize = 10;

/// Lines of the scanner on a car: distance, degrees between rays, and rays of a line.
const CAR: (f64, f64, usize) = (0.1, 0.1, 2500);

/// Lines that fit into the street, at most.
const LINES: usize = 190;

/// Stands of a scanner that turns about the vertical.
#[derive(Debug)]
pub(super) struct Stands {
    eyes: &'static [Vec3],
    /// Angles between rays around and upwards, in proportion.
    steps: [f64; 2],
    /// Lowest and highest rays, in degrees.
    heights: [f64; 2],
    far: f64,
}

/// In the room.
pub(super) const ROOM: Stands = Stands {
    eyes: &[[1.0, 1.2, 1.5], [4.0, 3.4, 1.6], [2.6, 0.8, 1.4]],
    steps: [0.6, 0.6],
    heights: [-65.0, 90.0],
    far: 20.0,
};

/// In the street.
pub(super) const STREET: Stands = Stands {
    eyes: &[[8.0, -1.0, 1.8], [20.0, 2.0, 1.8], [33.0, -2.0, 1.8]],
    steps: [0.25, 0.7],
    heights: [-35.0, 60.0],
    far: 40.0,
};

fn tree(mesh: &Tessellation) -> Triangles {
    Triangles::new(&mesh.vertices, &mesh.triangles)
}

/// By a first try with steps of some size: the size of steps that gives the wanted number of points.
fn fitted(task: &Task, first: f64, scans: impl Fn(f64) -> Vec<Scan>) -> Vec<Scan> {
    let count = |scans: &[Scan]| scans.iter().map(Scan::count).sum::<usize>().max(1);
    let tried = count(&scans(first)) as f64;
    scans(first * (tried / task.points as f64).sqrt())
}

/// From scanners on a sphere around a body; noise grows with the square of the range.
pub(super) fn around(mesh: &Tessellation, task: &Task) -> Vec<Measured> {
    let tree = tree(mesh);
    let radius = mesh.vertices.iter().map(|v| length(*v)).fold(0.0, f64::max);
    let half = (1.0 / (2.5f64 * 2.5 - 1.0)).sqrt();
    let limits = Limits {
        far: f64::INFINITY,
        grazing: libm::cos(80f64.to_radians()),
    };
    let turn = TAU * task.random(Purpose::Scanner, AROUND).uniform();
    let one = |number: usize, step: f64| {
        let k = number as f64 + 0.5;
        let up = 1.0 - 2.0 * k / AROUND as f64;
        let (sin, cos) = libm::sincos(PI * (1.0 + 5f64.sqrt()) * k + turn);
        let ring = (1.0 - up * up).sqrt();
        let toward = [-ring * cos, -ring * sin, -up];
        let eye = scale(toward, -2.5 * radius);
        // The grid of rays is turned at random about the view.
        let (sin, cos) = libm::sincos(TAU * task.random(Purpose::Ray, number).uniform());
        let u = normalize(cross(toward, [0.3, 0.5, 0.8]));
        let v = cross(toward, u);
        let [u, v] = [
            add(scale(u, cos), scale(v, sin)),
            sub(scale(v, cos), scale(u, sin)),
        ];
        let row = (2.0 / step).round().max(1.0) as usize;
        let place = move |i: usize| half * ((i as f64 + 0.5) / row as f64 * 2.0 - 1.0);
        let ray = move |n: usize| {
            let across = add(scale(u, place(n % row)), scale(v, place(n / row)));
            (eye, add(toward, across))
        };
        Scan::new(&tree, (0..row * row).map(ray), row, limits)
    };
    let all = |step: f64| (0..AROUND).map(|number| one(number, step)).collect();
    measure(&fitted(task, 2.0 / 60.0, all), task, |range| range * range)
}

/// From stands in a room or a street; noise grows with the range.
pub(super) fn from_stands(mesh: &Tessellation, stands: &Stands, task: &Task) -> Vec<Measured> {
    let tree = tree(mesh);
    let limits = Limits {
        far: stands.far,
        grazing: libm::cos(87f64.to_radians()),
    };
    let one = |number: usize, step: f64| {
        let mut rng = task.random(Purpose::Ray, number);
        let start = [(); 2].map(|()| 0.01 * rng.uniform());
        let [around, up] = stands.steps.map(|s| (s * step).to_radians());
        let [low, high] = stands.heights.map(f64::to_radians);
        let row = ((high - low) / up).ceil().max(1.0) as usize;
        let columns = (TAU / around).ceil().max(1.0) as usize;
        let eye = stands.eyes[number];
        let ray = move |n: usize| {
            let (sin, cos) = libm::sincos((n / row) as f64 * around + start[0]);
            let (rise, flat) = libm::sincos(low + (n % row) as f64 * up + start[1]);
            (eye, [cos * flat, sin * flat, rise])
        };
        Scan::new(&tree, (0..row * columns).map(ray), row, limits)
    };
    let all = |step: f64| {
        (0..stands.eyes.len())
            .map(|number| one(number, step))
            .collect()
    };
    measure(&fitted(task, 4.0, all), task, |range| 0.5 + 0.5 * range)
}

/// From a car in the street, in lines across it that lean forward; the car drives as far as the points
/// suffice, 19 m at most.
pub(super) fn from_car(mesh: &Tessellation, task: &Task) -> Vec<Measured> {
    let tree = tree(mesh);
    let (apart, degrees, rays) = CAR;
    let wanted = task.points as f64 / rays as f64;
    let lines = (wanted.round() as usize).clamp(1, LINES);
    // More points than that stand closer on each line.
    let step = degrees * (lines as f64 / wanted).min(1.0);
    let row = (250.0 / step).round().max(1.0) as usize;
    let start = 10.0 - 0.5 * apart * lines as f64;
    let limits = Limits {
        far: 20.0,
        grazing: 0.0,
    };
    let ray = |n: usize| {
        let eye = [start + apart * (n / row) as f64, -1.5, 2.2];
        let (sin, cos) = libm::sincos((-215.0 + step * (n % row) as f64).to_radians());
        (eye, [0.25, cos, sin])
    };
    let scan = Scan::new(&tree, (0..lines * row).map(ray), row, limits);
    measure(&[scan], task, |_| 1.0)
}

/// From two swaths over the land that cross, with rays up to 20 degrees off the vertical and noise in all
/// directions.
pub(super) fn from_air(mesh: &Tessellation, task: &Task) -> Vec<Measured> {
    let tree = tree(mesh);
    let ray = |n: usize| {
        let mut rng = task.random(Purpose::Ray, n);
        let [x, y] = [(); 2].map(|()| LAND * rng.uniform());
        let swath = n % 2;
        let off = ([x, y][swath] / LAND * 2.0 - 1.0) * 20.0;
        let (sin, cos) = libm::sincos(off.to_radians());
        let mut direction = [0.0, 0.0, -cos];
        direction[swath] = sin;
        (sub([x, y, 0.0], scale(direction, 60.0)), direction)
    };
    let limits = Limits {
        far: f64::INFINITY,
        grazing: 0.0,
    };
    let scan = Scan::new(&tree, (0..task.points).map(ray), 0, limits);
    let exact = Task {
        measuring: Measuring {
            noise: 0.0,
            ..task.measuring
        },
        ..*task
    };
    let mut points = measure(&[scan], &exact, |_| 1.0);
    let places: Vec<Vec3> = points.iter().map(|p| p.place).collect();
    let deviation = task.measuring.noise * spacing(&places);
    for (index, point) in points.iter_mut().enumerate() {
        point.error = add(point.error, task.shake(index, deviation));
    }
    points
}

/// A smooth random field of deviation one: waves of about this length in all directions.
struct Waves(Vec<(Vec3, f64)>);

impl Waves {
    fn new(rng: &mut Rng, length: f64, count: usize) -> Self {
        let mut wave = || {
            let along = [(); 3].map(|()| rng.normal() / length);
            (along, TAU * rng.uniform())
        };
        Waves((0..count).map(|_| wave()).collect())
    }

    fn at(&self, place: Vec3) -> f64 {
        let waves = self.0.iter();
        let sum: f64 = waves
            .map(|(along, phase)| libm::cos(dot(*along, place) + phase))
            .sum();
        sum * (2.0 / self.0.len() as f64).sqrt()
    }
}

/// Places that at least three of 36 cameras see, with noise that is alike over six spacings and noise that is
/// not (four tenths as large), a density that varies by six, places without points and one outlier in a
/// hundred.
pub(super) fn photographed(mesh: &Tessellation, task: &Task) -> Vec<Measured> {
    let tree = tree(mesh);
    let cameras: Vec<Vec3> = [25.0, 70.0, 120.0]
        .iter()
        .flat_map(|z| {
            (0..12).map(|k| {
                let (sin, cos) = libm::sincos(TAU * f64::from(k) / 12.0);
                [110.0 * cos, 110.0 * sin, *z]
            })
        })
        .collect();
    let exact = Task {
        points: 5 * task.points,
        measuring: Measuring::EXACT,
        ..*task
    };
    let mut rng = task.random(Purpose::Scanner, 0);
    let density = Waves::new(&mut rng, 9.0, 24);
    let all = sample(mesh, &exact, |_| 1.0);
    let bare: Vec<(Vec3, f64)> = all
        .iter()
        .rev()
        .take(14)
        .map(|p| (p.place, 1.5 + 3.5 * rng.uniform()))
        .collect();
    let kept = |index: usize, point: &Measured| {
        let share = (0.55 + 0.45 * density.at(point.place)).clamp(1.0 / 6.0, 1.0);
        let facing = |eye: &&Vec3| {
            let way = sub(point.place, **eye);
            -dot(way, point.normal) > 0.25 * length(way) && sees(&tree, **eye, point.place)
        };
        task.random(Purpose::Ray, index).uniform() < share
            && bare
                .iter()
                .all(|(p, reach)| length(sub(*p, point.place)) > *reach)
            && cameras.iter().filter(facing).take(3).count() == 3
    };
    let numbered = all.into_iter().enumerate();
    let seen = numbered.filter(|(index, point)| kept(*index, point));
    let mut points: Vec<Measured> = seen.map(|s| s.1).take(task.points).collect();
    let places: Vec<Vec3> = points.iter().map(|p| p.place).collect();
    let spacing = spacing(&places);
    let alike = Waves::new(&mut rng, 6.0 * spacing, 64);
    let noise = task.measuring.noise * spacing;
    for (index, point) in points.iter_mut().enumerate() {
        let along = scale(point.normal, noise * alike.at(point.place));
        point.error = add(along, task.shake(index, 0.4 * noise));
    }
    stray(&mut points, task, 0.01, 8.0 * spacing);
    points
}
