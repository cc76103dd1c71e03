//! The place of a mesh on the globe.

use outcrop_disk::error::{Error, Remedy, Result, Setting};
use outcrop_points::{Crs, CrsKind};
use proj4rs::Proj;
use std::path::Path;

/// Half axes of the ellipsoid of WGS 84 in metres.
const EQUATOR: f64 = 6_378_137.0;
const FLATTENING: f64 = 1.0 / 298.257_223_563;

/// From longitude and latitude in radians and height in metres to the geocentric coordinates of 3D Tiles.
fn geocentric([longitude, latitude, height]: [f64; 3]) -> [f64; 3] {
    let squared = FLATTENING * (2.0 - FLATTENING);
    let (sin, cos) = (libm::sin(latitude), libm::cos(latitude));
    let normal = EQUATOR / (1.0 - squared * sin * sin).sqrt();
    [
        (normal + height) * cos * libm::cos(longitude),
        (normal + height) * cos * libm::sin(longitude),
        (normal * (1.0 - squared) + height) * sin,
    ]
}

/// A reference system whose coordinates can be placed on the globe.
pub(super) struct Globe {
    plane: Plane,
    /// Metres in a unit of heights.
    height_unit: f64,
}

/// The first two coordinates of a system.
enum Plane {
    /// They are those of a projection or of the ellipsoid, times `scale`.
    On {
        system: Box<Proj>,
        target: Box<Proj>,
        scale: f64,
    },
    /// All three are lengths from the middle of the earth, in units of so many metres.
    Geocentric(f64),
}

/// Columns of a matrix whose parallelepiped has less than this part of the volume of a box with their lengths are no
/// axes.
const LEAST_VOLUME: f64 = 1e-3;

/// Lengths in metres to which the place of a tileset is rounded, and part of its longest component to which an axis is:
/// a projection calls the system's `sin` and `cos`, so that its last digits, of 1e-9 m and of 1e-10 of an axis, are not
/// the same on all systems. Ten kilometres from the middle this moves a point by less than a millimetre; there the globe
/// is eight metres below the plane.
const PLACE_STEP: f64 = 1.0 / 65_536.0;
const AXIS_STEP: f64 = 1.0 / 16_777_216.0;

/// A unit of a system has at least so many metres on the globe; at a pole a degree of longitude has none.
const LEAST_LENGTH: f64 = 1e-6;

impl Globe {
    /// That of a system.
    pub fn of(mesh: &Path, crs: Option<&Crs>) -> Result<Self> {
        let refuse = |found: String| {
            let place = "reference system";
            let expected = "one that can be placed on the globe, with an EPSG code or geocentric, in the header of \
                            the mesh or in a .prj file beside it";
            let given = Remedy::Give(Setting::Option("crs"), "gives one");
            Error::input(mesh, place, found, expected).with(given)
        };
        let crs = crs.ok_or_else(|| refuse("none".into()))?;
        let height_unit = crs.metres_of_heights();
        if crs.kind == Some(CrsKind::Geocentric) {
            return Ok(Self {
                plane: Plane::Geocentric(crs.unit.unwrap_or(1.0)),
                height_unit,
            });
        }
        let code = crs
            .horizontal
            .ok_or_else(|| refuse(format!("{crs}, without an EPSG code")))?;
        let wrong = |e: proj4rs::errors::Error| refuse(format!("EPSG:{code} ({e})"));
        let short = u16::try_from(code).map_err(|_| refuse(format!("EPSG:{code}")))?;
        let system = Proj::from_epsg_code(short).map_err(wrong)?;
        let target =
            Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").map_err(wrong)?;
        // A text may give another unit than the code has.
        let scale = match crs.unit {
            Some(unit) if !system.is_latlong() => unit / system.to_meter(),
            _ => 1.0,
        };
        Ok(Self {
            plane: Plane::On {
                system: Box::new(system),
                target: Box::new(target),
                // Numbers in files are rounded.
                scale: if (scale - 1.0).abs() < 1e-9 {
                    1.0
                } else {
                    scale
                },
            },
            height_unit,
        })
    }

    /// Geocentric coordinates of a position.
    fn place(&self, position: [f64; 3]) -> Option<[f64; 3]> {
        let [x, y, z] = position;
        let found = match &self.plane {
            Plane::Geocentric(unit) => position.map(|c| c * unit),
            Plane::On {
                system,
                target,
                scale,
            } => {
                let mut point = match system.is_latlong() {
                    true => (x.to_radians(), y.to_radians(), 0.0),
                    false => (x * scale, y * scale, 0.0),
                };
                proj4rs::transform::transform(system, target, &mut point).ok()?;
                geocentric([point.0, point.1, z * self.height_unit])
            }
        };
        found.iter().all(|x| x.is_finite()).then_some(found)
    }

    /// Half of the length over which a column of the matrix is measured along an axis.
    fn step(&self, axis: usize) -> f64 {
        match &self.plane {
            Plane::On { system, .. } if axis < 2 && system.is_latlong() => 1e-4,
            Plane::On { system, scale, .. } if axis < 2 => 10.0 / (system.to_meter() * scale),
            _ => 10.0 / self.height_unit,
        }
    }

    /// The matrix, by columns, from coordinates less `origin` to geocentric ones: exact at `middle` and to first
    /// order around it.
    pub fn matrix(&self, mesh: &Path, origin: [f64; 3], middle: [f64; 3]) -> Result<[f64; 16]> {
        if let Plane::Geocentric(unit) = self.plane {
            let axis = |k: usize| std::array::from_fn(|axis| if axis == k { unit } else { 0.0 });
            return Ok(by_columns([0, 1, 2].map(axis), origin.map(|c| c * unit)));
        }
        let moved = |axis: usize, by: f64| {
            let mut position = middle;
            position[axis] += by;
            self.place(position)
        };
        let column = |axis| {
            let step = self.step(axis);
            let (a, b) = (moved(axis, -step)?, moved(axis, step)?);
            Some([0, 1, 2].map(|k| (b[k] - a[k]) / (2.0 * step)))
        };
        let all = || Some((self.place(middle)?, [column(0)?, column(1)?, column(2)?]));
        let (place, columns) = all()
            .filter(|(_, columns)| is_regular(columns))
            .ok_or_else(|| {
                let [x, y, z] = middle;
                let found = format!("coordinates {x} {y} {z}, which cannot be placed on the globe");
                Error::input(mesh, "reference system", found, "coordinates in its range")
            })?;
        let columns = columns.map(rounded);
        let shift = [0, 1, 2].map(|k| {
            let along = (0..3).map(|axis| columns[axis][k] * (origin[axis] - middle[axis]));
            to_step(place[k] + along.sum::<f64>(), PLACE_STEP)
        });
        Ok(by_columns(columns, shift))
    }
}

/// The nearest multiple of a step that is a power of two.
fn to_step(x: f64, step: f64) -> f64 {
    (x / step).round() * step
}

/// An axis to [`AXIS_STEP`] of the power of two below its longest component.
fn rounded(axis: [f64; 3]) -> [f64; 3] {
    let longest = axis.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    // Without the bits of its fraction.
    let power = f64::from_bits(longest.to_bits() >> 52 << 52);
    axis.map(|x| to_step(x, power * AXIS_STEP))
}

/// A matrix of 4 by 4.
fn by_columns([[a, b, c], [d, e, f], [g, h, i]]: [[f64; 3]; 3], [x, y, z]: [f64; 3]) -> [f64; 16] {
    [a, b, c, 0.0, d, e, f, 0.0, g, h, i, 0.0, x, y, z, 1.0]
}

/// True if the columns are finite and can be axes.
fn is_regular([a, b, c]: &[[f64; 3]; 3]) -> bool {
    let length = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let volume = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0]);
    let whole = length(a) * length(b) * length(c);
    let long = [a, b, c].iter().all(|v| length(v) >= LEAST_LENGTH);
    long && whole.is_finite() && volume.abs() >= LEAST_VOLUME * whole
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The system with these codes.
    fn crs(codes: &str) -> Crs {
        let given: outcrop_points::GivenCrs = codes.parse().unwrap();
        given.crs()
    }

    fn globe(code: u32) -> Result<Globe> {
        Globe::of(Path::new("mesh.ply"), Some(&crs(&format!("EPSG:{code}"))))
    }

    fn near(a: [f64; 3], b: [f64; 3], by: f64) {
        assert!((0..3).all(|k| (a[k] - b[k]).abs() < by), "{a:?} {b:?}");
    }

    #[test]
    fn known_places_are_met() {
        // Zero meridian on the equator, and the north pole.
        near(geocentric([0.0; 3]), [EQUATOR, 0.0, 0.0], 1e-6);
        let pole = geocentric([0.0, std::f64::consts::FRAC_PI_2, 0.0]);
        near(pole, [0.0, 0.0, 6_356_752.314_245], 1e-5);
        // The middle of UTM zone 31 on the equator is 3 degrees east.
        let utm = globe(32631).unwrap();
        let want = geocentric([3f64.to_radians(), 0.0, 0.0]);
        near(utm.place([500_000.0, 0.0, 0.0]).unwrap(), want, 1e-3);
        // The CN Tower: 43° 38' 33.24" N, 79° 23' 13.7" W is 630 084 m east and 4 833 438 m north in zone 17.
        let tower = globe(32617).unwrap();
        let want = geocentric([
            -(79.0 + 23.0 / 60.0 + 13.7 / 3600.0f64).to_radians(),
            (43.0 + 38.0 / 60.0 + 33.24 / 3600.0f64).to_radians(),
            100.0,
        ]);
        near(
            tower.place([630_084.0, 4_833_438.0, 100.0]).unwrap(),
            want,
            1.0,
        );
        assert!(Globe::of(Path::new("mesh.ply"), None).is_err());
        assert!(globe(1).is_err() && globe(1_000_000).is_err());
    }

    #[test]
    fn the_matrix_is_true_around_the_middle() {
        let mesh = Path::new("mesh.ply");
        let utm = globe(32617).unwrap();
        let (origin, middle) = (
            [630_000.0, 4_833_000.0, 0.0],
            [630_500.0, 4_833_500.0, 50.0],
        );
        let matrix = utm.matrix(mesh, origin, middle).unwrap();
        for by in [
            [0.0; 3],
            [100.0, 0.0, 0.0],
            [0.0, -100.0, 20.0],
            [-70.0, 70.0, 0.0],
        ] {
            let position: [f64; 3] = std::array::from_fn(|k| middle[k] + by[k]);
            let local: [f64; 3] = std::array::from_fn(|k| position[k] - origin[k]);
            let mapped = std::array::from_fn(|k| {
                let along = (0..3).map(|axis| matrix[4 * axis + k] * local[axis]);
                matrix[12 + k] + along.sum::<f64>()
            });
            near(mapped, utm.place(position).unwrap(), 2e-3);
        }
    }

    #[test]
    fn what_the_library_of_a_system_rounds_does_not_reach_the_matrix() {
        let axis = [0.612_345_678_901, -0.787_654_321_098, 1e5];
        let once = rounded(axis);
        assert_eq!(once, rounded(axis.map(|x| x * (1.0 + 1e-15))));
        assert_eq!(once, rounded(once));
        near(once, axis, 65_536.0 * AXIS_STEP);
        assert_eq!(rounded([1.0, 0.0, -0.25]), [1.0, 0.0, -0.25]);
        assert_eq!(to_step(-1e6 - 1e-9, PLACE_STEP), -1e6);
    }

    /// As it is on Linux.
    #[test]
    fn the_matrix_is_the_same_on_every_system() {
        let (origin, middle) = (
            [630_000.0, 4_833_000.0, 0.0],
            [630_500.0, 4_833_500.0, 50.0],
        );
        let matrix = globe(32617)
            .unwrap()
            .matrix(Path::new("mesh.ply"), origin, middle);
        #[rustfmt::skip]
        let expected = [
            0.9853648841381073, 0.1710374355316162, -0.014108002185821533, 0.0,
            -0.10800927877426147, 0.6819440126419067, 0.7236596047878265, 0.0,
            0.13334083557128906, -0.7112627327442169, 0.6901634335517883, 0.0,
            851386.7154998779, -4544207.756393433, 4379121.745635986, 1.0,
        ];
        assert_eq!(matrix.unwrap(), expected);
    }

    #[test]
    fn a_geocentric_system_is_the_globe_itself() {
        let mesh = Path::new("mesh.ply");
        let matrix = globe(4978)
            .unwrap()
            .matrix(mesh, [4e6, 7e5, 5e6], [4.1e6, 7.1e5, 5.1e6])
            .unwrap();
        let [x, y, z] = [4e6, 7e5, 5e6];
        let identity = [
            1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, y, z, 1.0,
        ];
        assert_eq!(matrix, identity);
    }

    #[test]
    fn matrices_without_three_axes_are_refused() {
        assert!(is_regular(&[
            [1.0, 0.0, 0.0],
            [0.0, 0.3, 0.0],
            [0.0, 0.1, 1e5]
        ]));
        for columns in [
            [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            [[f64::NAN, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            [[f64::INFINITY, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        ] {
            assert!(!is_regular(&columns), "{columns:?}");
        }
        // At a pole a step along a meridian is one, but all meridians meet.
        let pole = globe(4326).unwrap();
        assert!(
            pole.matrix(Path::new("mesh.ply"), [0.0; 3], [9.0, 90.0, 0.0])
                .is_err()
        );
    }
}
