//! Coordinates of positions in the file.

use super::CoordinateType;
use outcrop_geom::Point;
use outcrop_geom::lattice::{Lattice, Shift};

/// The map from positions of the lattice to coordinates in the file.
#[derive(Debug, Clone, Copy)]
pub struct Coordinates<'a> {
    /// The lattice.
    pub lattice: &'a Lattice,
    /// The origin of the file, if it is not that of the cloud.
    pub shift: Option<Shift>,
    /// Type of the coordinates.
    pub written: CoordinateType,
}

impl Coordinates<'_> {
    /// The coordinates of a position, before they are rounded to the type in the file.
    pub fn exact(&self, point: Point) -> [f64; 3] {
        match &self.shift {
            None => self.lattice.position(point),
            Some(shift) => self.lattice.shifted(point, shift),
        }
    }

    /// The coordinates of a position.
    pub fn of(&self, point: Point) -> [f64; 3] {
        match (&self.shift, self.written) {
            (None, _) => self.lattice.position(point),
            (Some(shift), CoordinateType::Double) => self.lattice.shifted(point, shift),
            (Some(shift), CoordinateType::Float) => {
                self.lattice.shifted_single(point, shift).map(f64::from)
            }
        }
    }
}
