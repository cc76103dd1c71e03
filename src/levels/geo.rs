//! The place of a mesh on the globe.

use crate::error::{Error, Result};
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
    system: Proj,
    target: Proj,
    /// Metres in a unit of heights.
    unit: f64,
}

impl Globe {
    /// The reference system with this code.
    pub fn of(mesh: &Path, code: Option<u32>) -> Result<Self> {
        let refuse = |found: String| {
            let place = "reference system";
            let expected = "one with an EPSG code that can be placed on the globe, in a .prj file beside the mesh";
            Error::input(mesh, place, found, expected)
        };
        let code = code.ok_or_else(|| refuse("none with an EPSG code".into()))?;
        let wrong = |e: proj4rs::errors::Error| refuse(format!("EPSG:{code} ({e})"));
        let short = u16::try_from(code).map_err(|_| refuse(format!("EPSG:{code}")))?;
        let system = Proj::from_epsg_code(short).map_err(wrong)?;
        let target =
            Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").map_err(wrong)?;
        let unit = if system.is_latlong() {
            1.0
        } else {
            system.to_meter()
        };
        Ok(Self {
            system,
            target,
            unit,
        })
    }

    /// Geocentric coordinates of a position.
    fn place(&self, position: [f64; 3]) -> Option<[f64; 3]> {
        let [x, y, z] = position;
        let mut point = match self.system.is_latlong() {
            true => (x.to_radians(), y.to_radians(), 0.0),
            false => (x, y, 0.0),
        };
        proj4rs::transform::transform(&self.system, &self.target, &mut point).ok()?;
        let found = geocentric([point.0, point.1, z * self.unit]);
        found.iter().all(|x| x.is_finite()).then_some(found)
    }

    /// The matrix, by columns, from coordinates less `origin` to geocentric ones: exact at `middle` and to first
    /// order around it.
    pub fn matrix(&self, mesh: &Path, origin: [f64; 3], middle: [f64; 3]) -> Result<[f64; 16]> {
        let step = if self.system.is_latlong() {
            1e-4
        } else {
            10.0 / self.unit
        };
        let moved = |axis: usize, by: f64| {
            let mut position = middle;
            position[axis] += by;
            self.place(position)
        };
        let column = |axis| {
            let (a, b) = (moved(axis, -step)?, moved(axis, step)?);
            Some([0, 1, 2].map(|k| (b[k] - a[k]) / (2.0 * step)))
        };
        let all = || Some((self.place(middle)?, [column(0)?, column(1)?, column(2)?]));
        let [x, y, z] = middle;
        let (place, columns) = all().ok_or_else(|| {
            let found = format!("coordinates {x} {y} {z}, which cannot be placed on the globe");
            Error::input(mesh, "reference system", found, "coordinates in its range")
        })?;
        let shift = [0, 1, 2].map(|k| {
            let along = (0..3).map(|axis| columns[axis][k] * (origin[axis] - middle[axis]));
            place[k] + along.sum::<f64>()
        });
        let [[a, b, c], [d, e, f], [g, h, i]] = columns;
        let [x, y, z] = shift;
        Ok([a, b, c, 0.0, d, e, f, 0.0, g, h, i, 0.0, x, y, z, 1.0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: [f64; 3], b: [f64; 3], by: f64) {
        assert!((0..3).all(|k| (a[k] - b[k]).abs() < by), "{a:?} {b:?}");
    }

    #[test]
    fn known_places_are_met() {
        // Zero meridian on the equator, and the north pole.
        near(geocentric([0.0; 3]), [EQUATOR, 0.0, 0.0], 1e-6);
        let pole = geocentric([0.0, std::f64::consts::FRAC_PI_2, 0.0]);
        near(pole, [0.0, 0.0, 6_356_752.314_245], 1e-5);
        let mesh = Path::new("mesh.ply");
        // The middle of UTM zone 31 on the equator is 3 degrees east.
        let utm = Globe::of(mesh, Some(32631)).unwrap();
        let want = geocentric([3f64.to_radians(), 0.0, 0.0]);
        near(utm.place([500_000.0, 0.0, 0.0]).unwrap(), want, 1e-3);
        // The CN Tower: 43° 38' 33.24" N, 79° 23' 13.7" W is 630 084 m east and 4 833 438 m north in zone 17.
        let tower = Globe::of(mesh, Some(32617)).unwrap();
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
        assert!(Globe::of(mesh, None).is_err() && Globe::of(mesh, Some(1)).is_err());
        assert!(Globe::of(mesh, Some(1_000_000)).is_err());
    }

    #[test]
    fn the_matrix_is_true_around_the_middle() {
        let mesh = Path::new("mesh.ply");
        let globe = Globe::of(mesh, Some(32617)).unwrap();
        let (origin, middle) = (
            [630_000.0, 4_833_000.0, 0.0],
            [630_500.0, 4_833_500.0, 50.0],
        );
        let matrix = globe.matrix(mesh, origin, middle).unwrap();
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
            near(mapped, globe.place(position).unwrap(), 2e-3);
        }
    }
}
