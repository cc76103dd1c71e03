//! Clouds that are no scans of a surface, as tests of programs that expect one.

use std::f64::consts::TAU;

use crate::rng::{Purpose, Rng};
use crate::vec3::{Vec3, add, scale};

/// Positions of [`Odd::FewPlaces`].
const PLACES: u64 = 1000;

/// Patches of [`Odd::Patches`].
const PATCHES: u64 = 100;

/// A cloud without a surface, or with one unfit for reconstruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Odd {
    /// Two spheres whose distance is ten thousand times their diameter.
    TwoClusters,
    /// Integer steps along one direction.
    LineGrid,
    /// An integer grid that fills a cube.
    CubeGrid,
    /// All points at one position.
    OnePlace,
    /// A thousand positions on a sphere, the corners of an icosahedron among them.
    FewPlaces,
    /// The corners of an icosahedron.
    Icosahedron,
    /// Random points on a line off every lattice.
    Line,
    /// Random points in a cube.
    Volume,
    /// Random in direction and in the logarithm of the distance, over nine powers of ten.
    Powers,
    /// Half of the points on a field, half on a millionth of it.
    DenseInSparse,
    /// A profile of hills: all points are on one scan line.
    ScanLine,
    /// A circle and its centre.
    Wheel,
    /// A sphere and its centre.
    Shell,
    /// Spheres that together fill a hundredth of the volume.
    Patches,
}

impl Odd {
    /// All of them.
    pub const ALL: [Odd; 14] = [
        Odd::TwoClusters,
        Odd::LineGrid,
        Odd::CubeGrid,
        Odd::OnePlace,
        Odd::FewPlaces,
        Odd::Icosahedron,
        Odd::Line,
        Odd::Volume,
        Odd::Powers,
        Odd::DenseInSparse,
        Odd::ScanLine,
        Odd::Wheel,
        Odd::Shell,
        Odd::Patches,
    ];

    /// Name as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Odd::TwoClusters => "two-clusters",
            Odd::LineGrid => "line-grid",
            Odd::CubeGrid => "cube-grid",
            Odd::OnePlace => "one-place",
            Odd::FewPlaces => "few-places",
            Odd::Icosahedron => "icosahedron",
            Odd::Line => "line",
            Odd::Volume => "volume",
            Odd::Powers => "powers",
            Odd::DenseInSparse => "dense-in-sparse",
            Odd::ScanLine => "scan-line",
            Odd::Wheel => "wheel",
            Odd::Shell => "shell",
            Odd::Patches => "patches",
        }
    }

    /// Upper bound for absolute coordinates.
    pub(crate) fn reach(self, points: u64, size: f64) -> f64 {
        match self {
            Odd::LineGrid => 2.0 * points as f64,
            Odd::CubeGrid => libm::cbrt(points as f64).ceil(),
            Odd::OnePlace => 3.0,
            _ => 0.51 * size,
        }
    }

    /// Point `index` of `points`, in a cloud of about this diagonal; integer grids have steps of one.
    pub(crate) fn point(self, index: u64, points: u64, size: f64, rng: &mut Rng) -> Vec3 {
        let side = size / 3f64.sqrt();
        match self {
            Odd::TwoClusters => {
                let place = [-0.5, 0.5][(index % 2) as usize] * side;
                add([place; 3], scale(direction(rng), size / 2e4))
            }
            Odd::LineGrid => [1, 1, 2].map(|step| (step * index) as f64),
            Odd::CubeGrid => {
                let row = libm::cbrt(points as f64).ceil() as u64;
                [index % row, index / row % row, index / row / row].map(|c| c as f64)
            }
            Odd::OnePlace => [1.0, 2.0, 3.0],
            Odd::FewPlaces => match rng.below(PLACES) {
                corner @ 0..12 => scale(icosahedron(corner), size / 2.0),
                place => {
                    let place = Rng::at(place, Purpose::Position, 0).next_u64();
                    scale(
                        direction(&mut Rng::at(place, Purpose::Position, 1)),
                        size / 2.0,
                    )
                }
            },
            Odd::Icosahedron => scale(icosahedron(index % 12), size / 2.0),
            Odd::Line => scale([0.48, 0.6, 0.64], size * (rng.uniform() - 0.5)),
            Odd::Volume => std::array::from_fn(|_| side * (rng.uniform() - 0.5)),
            Odd::Powers => {
                let far = libm::exp10(-9.0 * rng.uniform());
                scale(direction(rng), size / 2.0 * far)
            }
            Odd::DenseInSparse => {
                let part = [1.0, 1e-3][(index % 2) as usize];
                let [x, y] = [rng.uniform(), rng.uniform()].map(|c| (c - 0.5) * size * part);
                let hill = libm::sin(x / size / part * TAU) * libm::cos(y / size / part * TAU);
                [x, y, 0.05 * size * part * hill]
            }
            Odd::ScanLine => {
                let t = rng.uniform();
                let hills = libm::sin(TAU * 3.0 * t) + 0.3 * libm::sin(TAU * 17.0 * t);
                [size * (t - 0.5), 0.0, 0.02 * size * hills]
            }
            Odd::Wheel | Odd::Shell if index == 0 => [0.0; 3],
            Odd::Wheel => {
                let (sin, cos) = libm::sincos(TAU * rng.uniform());
                [size / 2.0 * cos, size / 2.0 * sin, 0.0]
            }
            Odd::Shell => scale(direction(rng), size / 2.0),
            Odd::Patches => {
                let mut place = Rng::at(index % PATCHES, Purpose::Outlier, 0);
                let centre = std::array::from_fn(|_| side * (place.uniform() - 0.5));
                let radius = side * libm::cbrt(0.01 / PATCHES as f64 * 3.0 / (2.0 * TAU));
                add(centre, scale(direction(rng), radius))
            }
        }
    }
}

/// A random direction.
fn direction(rng: &mut Rng) -> Vec3 {
    let z = 2.0 * rng.uniform() - 1.0;
    let ring = (1.0 - z * z).sqrt();
    let (sin, cos) = libm::sincos(TAU * rng.uniform());
    [ring * cos, ring * sin, z]
}

/// A corner of an icosahedron, at distance one from the centre.
fn icosahedron(corner: u64) -> Vec3 {
    let golden = f64::midpoint(1.0, 5f64.sqrt());
    let sign = |bit: u64| if corner >> bit & 1 == 0 { 1.0 } else { -1.0 };
    let length = libm::hypot(1.0, golden);
    let mut place = [0.0, sign(0) / length, sign(1) * golden / length];
    place.rotate_right((corner / 4) as usize);
    place
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3::length;

    #[test]
    fn an_icosahedron_has_edges_of_one_length() {
        let corners: Vec<_> = (0..12).map(icosahedron).collect();
        for a in &corners {
            assert!((length(*a) - 1.0).abs() < 1e-12);
            let mut far: Vec<_> = corners
                .iter()
                .map(|b| length(add(*a, scale(*b, -1.0))))
                .collect();
            far.sort_by(f64::total_cmp);
            assert!((far[5] - far[1]).abs() < 1e-12 && far[6] > far[5] + 0.1);
        }
    }

    #[test]
    fn every_cloud_stays_in_its_size() {
        for odd in Odd::ALL {
            let points = (0..2000).map(|i| {
                let mut rng = Rng::at(0, Purpose::Position, i);
                odd.point(i, 2000, 1000.0, &mut rng)
            });
            let farthest = points.flatten().fold(0.0, |m: f64, c| m.max(c.abs()));
            assert!(farthest <= odd.reach(2000, 1000.0), "{}", odd.name());
        }
    }
}
