//! Scanners: where they stood, and which of them saw each point (not in the paper). A scanner is on the outer side
//! of every surface that it saw.

use super::attributes::StoredScanners;
use super::ids::{Id, Ids};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::Point;
use outcrop_geom::aabb::Aabb;
use outcrop_geom::lattice::Lattice;

/// A position farther from the box around all points than this number of its diagonals is no scanner's.
const MOST_DIAGONALS: i128 = 100;

/// A position that a surface faces has coordinates less than this from the lowest corner of the cloud, in steps.
pub const FARTHEST: f64 = (1u64 << 40) as f64;

/// A position in lattice steps, rounded; none if it is too far from the cloud for that. The distance is that from the
/// cloud, wherever the origin of coordinates is.
#[must_use]
pub fn on_lattice(position: [f64; 3], lattice: &Lattice) -> Option<[i64; 3]> {
    let from_cloud = |axis: usize| {
        let steps = (position[axis] - lattice.offset[axis]) / lattice.step;
        steps.round() - lattice.base[axis] as f64
    };
    let steps = [0, 1, 2].map(from_cloud);
    let near = steps.iter().all(|x| x.abs() < FARTHEST);
    near.then(|| steps.map(|x| x as i64))
}

/// The position of a scanner in lattice steps, rounded; none if it is too far from all points, in `bounds`, to be
/// one. Such a position is rather the origin of coordinates.
#[must_use]
pub fn place(position: [f64; 3], lattice: &Lattice, bounds: Aabb) -> Option<[i64; 3]> {
    let place = on_lattice(position, lattice)?;
    let (mut gap2, mut diagonal2) = (0, 0);
    for (axis, x) in place.into_iter().enumerate() {
        let ends = [bounds.min[axis], bounds.max[axis]].map(i64::from);
        let gap = i128::from(x - x.clamp(ends[0], ends[1]));
        let side = i128::from(ends[1] - ends[0]);
        gap2 += gap * gap;
        diagonal2 += side * side;
    }
    let near = gap2 <= MOST_DIAGONALS * MOST_DIAGONALS * diagonal2;
    near.then_some(place)
}

/// The unit vector from a point to a place; none if they are equal.
#[must_use]
pub fn toward(place: [i64; 3], from: Point) -> Option<[f64; 3]> {
    let v: [f64; 3] = std::array::from_fn(|axis| (place[axis] - i64::from(from[axis])) as f64);
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    (length > 0.0).then(|| v.map(|x| x / length))
}

/// The scanners of a cloud.
#[derive(Debug, Clone, Copy)]
pub struct Scanners<'a> {
    stored: &'a StoredScanners,
    places: &'a [Option<[i64; 3]>],
}

impl<'a> Scanners<'a> {
    /// The scanners of the points, with their places in the order of their numbers.
    #[must_use]
    pub fn new(stored: &'a StoredScanners, places: &'a [Option<[i64; 3]>]) -> Self {
        Self { stored, places }
    }

    /// Bytes of memory for those of `ids` points while they are read.
    #[must_use]
    pub fn bytes(&self, ids: usize) -> u64 {
        self.stored.bytes(ids)
    }

    /// The scanners of the points of a block.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn open(&self, unit: &Unit<'_>, ids: Ids) -> Result<Seen<'a>> {
        Ok(Seen {
            ids,
            numbers: self.stored.open(unit, ids)?,
            places: self.places,
        })
    }
}

/// The scanners of the points of a block.
#[derive(Debug)]
pub struct Seen<'a> {
    ids: Ids,
    numbers: Vec<u32>,
    places: &'a [Option<[i64; 3]>],
}

impl Seen<'_> {
    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.numbers)
    }

    /// The place of the scanner that saw a point of the block.
    fn of(&self, id: Id) -> Option<[i64; 3]> {
        let number = self.numbers.get(self.ids.place(id))?;
        let place = self.places.get(number.checked_sub(1)? as usize);
        place.copied().flatten()
    }

    /// True if the scanner that saw a point of the block is known.
    #[must_use]
    pub fn has(&self, id: Id) -> bool {
        self.of(id).is_some()
    }

    /// The unit vector from a point of the block, at `from`, to the scanner that saw it.
    #[must_use]
    pub fn toward(&self, id: Id, from: Point) -> Option<[f64; 3]> {
        toward(self.of(id)?, from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_origin_of_far_coordinates_is_no_scanner() {
        let lattice = Lattice {
            step: 0.5,
            offset: [100.0, 0.0, 0.0],
            base: [7, -3, 0],
            exact: true,
        };
        let bounds = Aabb {
            min: [0; 3],
            max: [30, 40, 0],
        };
        let place = |position| place(position, &lattice, bounds);
        assert_eq!(place([103.5, -1.5, 2.0]), Some([0, 0, 4]));
        assert_eq!(place([100.26, 0.0, -1.0]), Some([-6, 3, -2]));
        // A hundred diagonals of 50 steps.
        assert_eq!(place([103.5, -1.5, 2500.0]), Some([0, 0, 5000]));
        assert_eq!(place([103.5, -1.5, 2500.5]), None);
        assert_eq!(place([1e300, 0.0, 0.0]), None);
        assert_eq!(place([f64::NAN, 0.0, 0.0]), None);
    }

    #[test]
    fn the_offset_of_the_lattice_is_no_measure() {
        // Fine steps far from the origin, as of a room in national coordinates.
        for (exponent, base) in [
            (-20, 5_300_000i64 << 20),
            (-30, 691_000 << 30),
            (-28, -(4_500_000 << 28)),
        ] {
            let lattice = Lattice {
                step: 2f64.powi(exponent),
                offset: [0.0; 3],
                base: [base; 3],
                exact: true,
            };
            let bounds = Aabb {
                min: [0; 3],
                max: [1 << 22; 3],
            };
            let low = base as f64 * lattice.step;
            let inside = [low, low + 256.0 * lattice.step, low + lattice.step];
            assert_eq!(place(inside, &lattice, bounds), Some([0, 256, 1]));
            assert_eq!(place([0.0; 3], &lattice, bounds), None);
            assert_eq!(on_lattice([low + 1e15; 3], &lattice), None);
        }
    }

    #[test]
    fn vectors_have_unit_length() {
        let places = [Some([4, -3, 12]), None];
        let seen = Seen {
            ids: Ids::of(5..10),
            numbers: vec![1, 2, 0, 3, 1],
            places: &places,
        };
        let vector = [4.0 / 13.0, -3.0 / 13.0, 12.0 / 13.0];
        let seen = |id, from| seen.toward(Id::new(id), from);
        assert_eq!(seen(5, [0; 3]), Some(vector));
        assert_eq!(seen(9, [4, -3, 0]), Some([0.0, 0.0, 1.0]));
        for unknown in [6, 7, 8] {
            assert_eq!(seen(unknown, [0; 3]), None);
        }
        assert_eq!(seen(5, [4, -3, 12]), None);
    }
}
