//! The place of local coordinates, in comments of the header.

use crate::types::Scalar;

/// The origin of the coordinates in a file, and the grid they were rounded from.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Place {
    /// Comments `offsetx`, `offsety` and `offsetz`: what each coordinate is to be added to. Other programs
    /// write and read them too, also as `shift_x`, `shift_y` and `shift_z`.
    offset: [Option<f64>; 3],
    /// Comment `gridstep`: the coordinates were multiples of it before they were rounded to the type in the file.
    step: Option<f64>,
}

/// Names of the comments.
const OFFSETS: [&str; 3] = ["offsetx", "offsety", "offsetz"];

/// Beginnings of such names, before the axis.
const BEGINNINGS: [&str; 4] = ["offset", "offset_", "shift_", "shift"];
const STEP: &str = "gridstep";

impl Place {
    /// The place with this origin, and this step of the coordinates.
    #[must_use]
    pub fn new(origin: [f64; 3], step: Option<f64>) -> Self {
        Self {
            offset: origin.map(Some),
            step,
        }
    }

    /// The comments that give it.
    #[must_use]
    pub fn comments(&self) -> Vec<String> {
        let named = OFFSETS.into_iter().zip(self.offset);
        let named = named.chain([(STEP, self.step)]);
        let line = |(name, value): (&str, Option<f64>)| Some(format!("{name} {}", value?));
        named.filter_map(line).collect()
    }

    /// Takes the words of a comment, if it is one of these with a finite number.
    pub(crate) fn take(&mut self, words: &[&str]) {
        let [name, value] = words else {
            return;
        };
        let Some(value) = value.parse().ok().filter(|v: &f64| v.is_finite()) else {
            return;
        };
        if *name == STEP {
            self.step = Some(value).filter(|step| *step > 0.0);
        } else if let Some(axis) = axis(name) {
            self.offset[axis] = Some(value);
        }
    }

    /// The origin; none unless there is one for each axis.
    #[must_use]
    pub fn origin(&self) -> Option<[f64; 3]> {
        let [x, y, z] = self.offset;
        Some([x?, y?, z?])
    }

    /// The position of a vertex with these local coordinates, which have the types `types` in the file.
    /// Coordinates that the step explains are taken as the multiples that they were.
    #[must_use]
    pub fn position(&self, local: [f64; 3], types: [Scalar; 3]) -> [f64; 3] {
        let Some(origin) = self.origin() else {
            return local;
        };
        std::array::from_fn(|axis| {
            let exact = self.step.map(|step| (local[axis] / step).round() * step);
            let explains = |exact: &f64| match types[axis] {
                Scalar::F32 => f64::from(*exact as f32) == local[axis],
                _ => *exact == local[axis],
            };
            exact.filter(explains).unwrap_or(local[axis]) + origin[axis]
        })
    }
}

/// The axis of which a comment of this name gives the origin.
fn axis(name: &str) -> Option<usize> {
    let name = name.trim_end_matches([':', '=']).to_ascii_lowercase();
    let (beginning, axis) = name.split_at_checked(name.len().checked_sub(1)?)?;
    let known = BEGINNINGS.contains(&beginning);
    ["x", "y", "z"]
        .iter()
        .position(|a| *a == axis)
        .filter(|_| known)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Header;

    fn read(comments: &[String]) -> Place {
        let lines: String = comments.iter().map(|c| format!("comment {c}\n")).collect();
        let text = format!("ply\nformat ascii 1.0\n{lines}end_header\n");
        Header::read(&mut text.as_bytes()).unwrap().place
    }

    #[test]
    fn comments_are_read_as_they_were_written() {
        let origin = [635_000.0, -848_000.25, 1e-300];
        for step in [None, Some(0.01)] {
            let place = Place::new(origin, step);
            assert_eq!(read(&place.comments()), place);
            assert_eq!(place.origin(), Some(origin));
        }
        assert_eq!(
            Place::new(origin, Some(0.01)).comments()[..2],
            ["offsetx 635000", "offsety -848000.25"]
        );
        assert_eq!(read(&[]).origin(), None);
    }

    #[test]
    fn comments_that_are_no_place_are_text() {
        let lines =
            |lines: &[&str]| read(&lines.iter().map(ToString::to_string).collect::<Vec<_>>());
        for odd in [
            "offsetz",
            "offsetz nan",
            "offsetz inf",
            "offsetz 1 2",
            "offsetz far",
            "gridstep 0",
        ] {
            let place = lines(&["offsetx 1", "offsety 2", odd]);
            assert_eq!((place.origin(), place.step), (None, None), "{odd}");
        }
        let place = lines(&[
            "offsety 2",
            "epsg 2994",
            "offsetx 1",
            "offsetz 3",
            "gridstep -1",
        ]);
        assert_eq!((place.origin(), place.step), (Some([1.0, 2.0, 3.0]), None));
        for other in ["shift_", "Shift", "offset_", "OFFSET"] {
            let names = ["x", "y", "z"].map(|axis| format!("{other}{axis} 7"));
            assert_eq!(read(&names).origin(), Some([7.0; 3]), "{other}");
        }
        assert_eq!(
            lines(&["offsetx 1", "offsety 2", "offset 3"]).origin(),
            None
        );
    }

    #[test]
    fn rounded_coordinates_become_the_multiples_they_were() {
        let place = Place::new([1000.0; 3], Some(0.01));
        let local = [1234.56, 0.1, 7.0].map(|c| f64::from(c as f32));
        let single = [Scalar::F32; 3];
        assert_eq!(place.position(local, single), [2234.56, 1000.1, 1007.0]);
        // Not near a multiple, for its precision: it was moved.
        let moved = [0.015, 0.25 / 3.0, 7.001];
        assert_eq!(
            place.position(moved, [Scalar::F64; 3]),
            moved.map(|c| c + 1000.0)
        );
        assert_eq!(Place::default().position(moved, single), moved);
    }
}
