//! Sphere, torus and plane.

use std::f64::consts::{PI, TAU};

use super::refine::{patch, rectangle, refine};
use super::tessellate::Tessellation;
use super::{Line, Sample, Surface, box_point, midpoints};
use crate::vec3::{Vec3, length, normalize, scale};

/// A sphere around the origin.
#[derive(Debug)]
pub(crate) struct Sphere {
    radius: f64,
}

impl Sphere {
    pub(crate) fn new(size: f64) -> Self {
        Sphere {
            radius: size / 12f64.sqrt(),
        }
    }

    fn point(&self, z: f64, longitude: f64) -> Sample {
        let ring = (1.0 - z * z).max(0.0).sqrt();
        let normal = [ring * libm::cos(longitude), ring * libm::sin(longitude), z];
        Sample {
            position: normal.map(|c| c * self.radius),
            normal,
        }
    }
}

impl Surface for Sphere {
    fn area(&self) -> f64 {
        4.0 * PI * self.radius * self.radius
    }

    fn bounds(&self) -> [Vec3; 2] {
        [[-self.radius; 3], [self.radius; 3]]
    }

    fn at(&self, u: f64, v: f64) -> Sample {
        // Archimedes: zones of equal height have equal area.
        self.point(2.0 * u - 1.0, TAU * v)
    }

    fn scan_lines(&self, spacing: f64) -> Vec<Line> {
        midpoints(PI, spacing / self.radius)
            .map(|at| Line {
                patch: 0,
                at,
                weight: libm::sin(at),
            })
            .collect()
    }

    fn on_line(&self, line: &Line, t: f64, _v: f64) -> Sample {
        self.point(libm::cos(line.at), TAU * t)
    }

    fn distance(&self, p: Vec3) -> f64 {
        (length(p) - self.radius).abs()
    }

    fn reference(&self, tolerance: f64) -> Tessellation {
        let onto = |p| scale(normalize(p), self.radius);
        refine(octahedron(self.radius), tolerance, onto)
    }

    fn curvature(&self, _u: f64, _v: f64) -> Option<f64> {
        Some(2f64.sqrt() / self.radius)
    }
}

/// Anticlockwise as seen from outside.
fn octahedron(radius: f64) -> Tessellation {
    let mut mesh = Tessellation::default();
    for axis in 0..3 {
        for sign in [radius, -radius] {
            let mut vertex = [0.0; 3];
            vertex[axis] = sign;
            mesh.vertices.push(vertex);
        }
    }
    for octant in 0..8u32 {
        let corner = |axis: u32| 2 * axis + (octant >> axis & 1);
        // Every reflection reverses the orientation.
        let mirrored = octant.count_ones() % 2 == 1;
        let (second, third) = if mirrored { (2, 1) } else { (1, 2) };
        mesh.triangles
            .push([corner(0), corner(second), corner(third)]);
    }
    mesh
}

/// A torus around the z axis.
#[derive(Debug)]
pub(crate) struct Torus {
    major: f64,
    minor: f64,
}

impl Torus {
    /// Radius of the tube, relative to that of the ring.
    const TUBE: f64 = 0.4;

    pub(crate) fn new(size: f64) -> Self {
        let outer = 2.0 * (1.0 + Self::TUBE);
        let height = 2.0 * Self::TUBE;
        let major = size / (2.0 * outer * outer + height * height).sqrt();
        Torus {
            major,
            minor: Self::TUBE * major,
        }
    }

    fn point(&self, around: f64, tube: f64) -> Sample {
        let (sin_a, cos_a) = libm::sincos(around);
        let (sin_t, cos_t) = libm::sincos(tube);
        let ring = self.major + self.minor * cos_t;
        Sample {
            position: [ring * cos_a, ring * sin_a, self.minor * sin_t],
            normal: [cos_t * cos_a, cos_t * sin_a, sin_t],
        }
    }

    /// Tube angle below which the fraction `v` of the area lies: Kepler's equation `angle + e sin(angle) = 2
    /// pi v`, by Newton's method.
    fn tube_angle(v: f64) -> f64 {
        let mean = TAU * v;
        let mut angle = mean;
        for _ in 0..8 {
            let (sin, cos) = libm::sincos(angle);
            let step = (angle + Self::TUBE * sin - mean) / (1.0 + Self::TUBE * cos);
            angle -= step;
            if step.abs() < 1e-14 {
                break;
            }
        }
        angle
    }
}

impl Surface for Torus {
    fn area(&self) -> f64 {
        TAU * TAU * self.major * self.minor
    }

    fn bounds(&self) -> [Vec3; 2] {
        let outer = self.major + self.minor;
        [[-outer, -outer, -self.minor], [outer, outer, self.minor]]
    }

    fn at(&self, u: f64, v: f64) -> Sample {
        self.point(TAU * u, Self::tube_angle(v))
    }

    fn scan_lines(&self, spacing: f64) -> Vec<Line> {
        midpoints(TAU, spacing / self.minor)
            .map(|at| Line {
                patch: 0,
                at,
                weight: 1.0 + Self::TUBE * libm::cos(at),
            })
            .collect()
    }

    fn on_line(&self, line: &Line, t: f64, _v: f64) -> Sample {
        self.point(TAU * t, line.at)
    }

    fn distance(&self, p: Vec3) -> f64 {
        let ring = libm::hypot(p[0], p[1]) - self.major;
        (libm::hypot(ring, p[2]) - self.minor).abs()
    }

    fn reference(&self, tolerance: f64) -> Tessellation {
        // Angle at which an arc deviates from its chord by the tolerance.
        let cells = [self.major + self.minor, self.minor].map(|radius| {
            let angle = (8.0 * tolerance / radius).sqrt();
            (TAU / angle).ceil().max(3.0) as usize
        });
        patch(cells, [true, true], |u, v| {
            self.point(TAU * u, TAU * v).position
        })
    }

    fn curvature(&self, _u: f64, v: f64) -> Option<f64> {
        let cosine = libm::cos(Self::tube_angle(v));
        let around = cosine / (self.major + self.minor * cosine);
        Some(libm::hypot(1.0 / self.minor, around))
    }
}

/// A square in the plane z = 0.
#[derive(Debug)]
pub(crate) struct Plane {
    side: f64,
}

impl Plane {
    pub(crate) fn new(size: f64) -> Self {
        Plane {
            side: size / 2f64.sqrt(),
        }
    }

    fn point(&self, x: f64, y: f64) -> Sample {
        let half = self.side / 2.0;
        Sample {
            position: [x - half, y - half, 0.0],
            normal: [0.0, 0.0, 1.0],
        }
    }
}

impl Surface for Plane {
    fn area(&self) -> f64 {
        self.side * self.side
    }

    fn bounds(&self) -> [Vec3; 2] {
        let half = self.side / 2.0;
        [[-half, -half, 0.0], [half, half, 0.0]]
    }

    fn at(&self, u: f64, v: f64) -> Sample {
        self.point(self.side * u, self.side * v)
    }

    fn scan_lines(&self, spacing: f64) -> Vec<Line> {
        midpoints(self.side, spacing)
            .map(|at| Line {
                patch: 0,
                at,
                weight: 1.0,
            })
            .collect()
    }

    fn on_line(&self, line: &Line, t: f64, _v: f64) -> Sample {
        self.point(self.side * t, line.at)
    }

    fn distance(&self, p: Vec3) -> f64 {
        super::box_distance(self.bounds(), p)
    }

    fn reference(&self, _tolerance: f64) -> Tessellation {
        let mut mesh = Tessellation::default();
        let [low, _] = self.bounds();
        rectangle(&mut mesh, low, [self.side, 0.0, 0.0], [0.0, self.side, 0.0]);
        mesh
    }

    fn scanner(&self) -> Vec3 {
        let mut place = box_point(self.bounds(), [0.45, 0.55, 0.0]);
        place[2] = 0.05 * self.side;
        place
    }
}
