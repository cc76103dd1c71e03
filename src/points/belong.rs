//! Warnings about files that may not belong together: different units or places.

use super::crs::Crs;
use super::stats::FileStats;
use super::systems::Mixed;

/// A warning is given if one file's point spacing and box are both this many times those of another: it may
/// be in another unit. A small piece of a survey has a small box but no smaller spacing.
const LARGER: f64 = 100.0;

/// Fewest points of a file whose size is compared.
const FEWEST: u64 = 100;

/// A warning is given if a gap between files exceeds this many times the extent of the largest file.
const FARTHER: f64 = 100.0;

/// At most one warning, about sizes or places.
pub(super) fn warnings(files: &[FileStats]) -> Vec<String> {
    let boxes: Vec<Extent<'_>> = files.iter().filter_map(Extent::of).collect();
    let places = far_apart(&boxes).or_else(|| unlike_sizes(&boxes));
    places.into_iter().collect()
}

/// A warning if some files have no reference system, and others have this one.
pub(super) fn without(files: &[FileStats], crs: &Crs) -> Option<String> {
    let mut without = files.iter().filter(|file| file.crs.is_none());
    let first = without.next()?;
    let count = 1 + without.count();
    let all = files.len();
    Some(format!(
        "{}: it gives no reference system, as {count} of {all} files; that of the others, {crs}, is taken for \
         all",
        first.path.display()
    ))
}

/// A warning if files give another system than that which is given for them by `option`, or if nothing is known of
/// that.
pub(super) fn replaced(
    files: &[FileStats],
    common: &Result<Option<Crs>, Mixed>,
    given: &Crs,
    option: &str,
) -> Option<String> {
    let said = match common {
        Err(mixed) => {
            let [(first, system), (other, another)] = mixed.both();
            format!(
                "{option}: {given} is taken for all files, though {} gives {system} and {} gives {another}",
                first.display(),
                other.display()
            )
        }
        Ok(Some(found)) if found.differs(given) || found.horizontal != given.horizontal => {
            let gives = |file: &&FileStats| file.crs.is_some();
            let first = files.iter().find(gives)?.path.display();
            format!("{option}: {given} is taken instead of {found}, which {first} gives")
        }
        _ if given.kind.is_none() => format!(
            "{option}: {given} is none of the systems that are known here, so its units are not, and tiles in it \
             cannot be placed on the globe"
        ),
        _ => return None,
    };
    Some(said)
}

/// The box of a file.
struct Extent<'a> {
    file: &'a FileStats,
    min: [f64; 3],
    max: [f64; 3],
    diagonal: f64,
}

impl<'a> Extent<'a> {
    fn of(file: &'a FileStats) -> Option<Self> {
        let (min, max) = (file.min?, file.max?);
        let sides = (0..3).map(|axis| max[axis] - min[axis]);
        Some(Self {
            file,
            min,
            max,
            diagonal: sides.map(|s| s * s).sum::<f64>().sqrt(),
        })
    }

    /// Approximate spacing of the points, if they lie on a surface.
    fn spacing(&self) -> f64 {
        self.diagonal / (self.file.kept as f64).sqrt()
    }
}

/// A warning with two files that have a long gap between them along an axis.
fn far_apart(boxes: &[Extent<'_>]) -> Option<String> {
    let largest = boxes.iter().map(|b| b.diagonal).fold(0.0, f64::max);
    if largest == 0.0 {
        return None;
    }
    for axis in 0..3 {
        let mut order: Vec<&Extent<'_>> = boxes.iter().collect();
        order.sort_by(|a, b| a.min[axis].total_cmp(&b.min[axis]));
        let mut reach = *order.first()?;
        for next in order {
            let gap = next.min[axis] - reach.max[axis];
            if gap > FARTHER * largest {
                return Some(format!(
                    "{}: it is {} away from {}, {:.0} times the size of the largest file; do they \
                     belong together?",
                    next.file.path.display(),
                    rounded(gap),
                    reach.file.path.display(),
                    gap / largest
                ));
            }
            if next.max[axis] > reach.max[axis] {
                reach = next;
            }
        }
    }
    None
}

/// A warning with the largest and the smallest file, if one of them seems to be in another unit.
fn unlike_sizes(boxes: &[Extent<'_>]) -> Option<String> {
    let is_filled = |b: &&Extent<'_>| b.file.kept >= FEWEST && b.diagonal > 0.0;
    let filled = boxes.iter().filter(is_filled);
    let by_size = |a: &&Extent<'_>, b: &&Extent<'_>| a.diagonal.total_cmp(&b.diagonal);
    let large = filled.clone().max_by(by_size)?;
    let small = filled.min_by(by_size)?;
    let size = large.diagonal / small.diagonal;
    let spacing = large.spacing() / small.spacing();
    (size > LARGER && spacing > LARGER).then(|| {
        format!(
            "{}: it is {size:.0} times as large as {}, and its points are {spacing:.0} times as far apart; \
             are they in the same unit?",
            large.file.path.display(),
            small.file.path.display()
        )
    })
}

/// A length rounded to three digits.
fn rounded(length: f64) -> f64 {
    let unit = libm::exp10(libm::log10(length).floor() - 2.0);
    if unit >= 1.0 && unit.is_finite() {
        (length / unit).round() * unit
    } else {
        length
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::Format;

    fn file(name: &str, kept: u64, min: [f64; 3], max: [f64; 3]) -> FileStats {
        FileStats {
            path: name.into(),
            format: Format::LAS,
            bytes: 0,
            fetched: None,
            taken: None,
            guessed: false,
            colors: None,
            columns: Vec::new(),
            claimed: None,
            points: kept,
            kept,
            dropped_non_finite: 0,
            withheld: 0,
            invalid: 0,
            dropped_by_class: 0,
            dropped_by_crop: 0,
            skipped_by_crop: 0,
            dropped_far: 0,
            min: (kept > 0).then_some(min),
            max: (kept > 0).then_some(max),
            scanners: Vec::new(),
            crs: None,
        }
    }

    fn said(files: &[FileStats]) -> Vec<String> {
        warnings(files)
    }

    /// A square of side `side` with a corner at `x`, `y` and points `spacing` apart.
    fn square(name: &str, [x, y]: [f64; 2], side: f64, spacing: f64) -> FileStats {
        let points = (side / spacing).powi(2) as u64;
        file(name, points, [x, y, 0.0], [x + side, y + side, side / 10.0])
    }

    #[test]
    fn tiles_of_a_survey_belong_together() {
        let mut tiles = Vec::new();
        for row in 0..30 {
            for column in 0..30 {
                let corner = [
                    4e5 + 1000.0 * f64::from(row),
                    5e6 + 1000.0 * f64::from(column),
                ];
                tiles.push(square("tile", corner, 1000.0, 0.5));
            }
        }
        // At the boundary of a survey a tile may have few points, or none.
        tiles.push(file(
            "sliver",
            150,
            [4.3e5, 5e6, 0.0],
            [4.3e5 + 3.0, 5e6 + 4.0, 1.0],
        ));
        tiles.push(file("single", 1, [4.3e5, 5e6, 0.0], [4.3e5, 5e6, 0.0]));
        tiles.push(file("empty", 0, [0.0; 3], [0.0; 3]));
        // A few tiles of many, far from each other.
        tiles.push(square("island", [4.9e5, 5.05e6], 1000.0, 0.5));
        assert_eq!(said(&tiles), [""; 0]);
        tiles.reverse();
        assert_eq!(said(&tiles), [""; 0]);
        assert_eq!(said(&[]), [""; 0]);
    }

    #[test]
    fn a_detail_in_a_wider_scan_belongs_there() {
        let street = square("street", [0.0, 0.0], 300.0, 0.02);
        let statue = square("statue", [100.0, 100.0], 4.0, 0.001);
        assert_eq!(said(&[street, statue]), [""; 0]);
    }

    #[test]
    fn metres_and_millimetres_do_not() {
        let metres = square("m.las", [0.0, 0.0], 20.0, 0.01);
        let millimetres = square("mm.las", [0.0, 0.0], 15_000.0, 10.0);
        let lines = said(&[metres, millimetres]);
        assert_eq!(lines.len(), 1);
        assert!(
            lines[0].starts_with("mm.las: it is 750 times as large as m.las"),
            "{lines:?}"
        );
    }

    #[test]
    fn local_and_national_coordinates_do_not() {
        let mut files: Vec<FileStats> = (0..5)
            .map(|i| square("national", [4e5 + 100.0 * f64::from(i), 5e6], 100.0, 0.1))
            .collect();
        files.push(square("local", [0.0, 0.0], 100.0, 0.1));
        let lines = said(&files);
        assert_eq!(lines.len(), 1);
        assert!(
            lines[0].contains("national") && lines[0].contains("away from local"),
            "{lines:?}"
        );
    }
}
