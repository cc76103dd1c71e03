//! The scale of the colours of scans, by the limits that the description gives.

use super::scan::{Field, Kind, Limits, Scan};
use outcrop_ply::Scalar;
use outcrop_points::colors::Depth;
use outcrop_points::columns::{COLORS, Column};

/// The largest range of whole numbers that is believed to be that of the colours.
const WIDEST: f64 = 65535.0;

/// Ranges of usual scales.
const USUAL: [([f64; 2], Depth); 3] = [
    ([0.0, 1.0], Depth::One),
    ([0.0, 255.0], Depth::Eight),
    ([0.0, 65535.0], Depth::Sixteen),
];

/// The number of the colour in a field, if it is one.
pub(super) fn color(field: &Field) -> Option<usize> {
    let column = field.column()?;
    COLORS.iter().position(|name| *name == column.name)
}

/// The range of a type of whole numbers, if it may be that of colours.
fn range(kind: Kind) -> Option<[f64; 2]> {
    let Kind::Integer {
        lowest,
        highest,
        scale,
        offset,
    } = kind
    else {
        return None;
    };
    let ends = [lowest, highest].map(|end| end as f64 * scale + offset);
    (ends[1] > ends[0] && ends[1] - ends[0] <= WIDEST).then_some(ends)
}

/// The limits of one colour of a scan: those of the description, unless the numbers cannot reach them; else those of
/// the type, unless that is one of 16 bits, in which many programs write 8.
fn limits(kind: Kind, given: [Option<f64>; 2]) -> Option<[f64; 2]> {
    let range = range(kind);
    let given = match given {
        [Some(low), Some(high)] if high > low && (high - low).is_finite() => Some([low, high]),
        _ => None,
    };
    match (given, range) {
        (Some(given), Some(range)) if given[1] > range[1] => Some(range),
        (Some(given), _) => Some(given),
        (None, range) => range.filter(|range| *range != [0.0, WIDEST]),
    }
}

/// The limits of a scan whose colours have none.
fn usual(kind: Kind) -> [f64; 2] {
    match kind {
        Kind::Single | Kind::Double => [0.0, 1.0],
        Kind::Integer { .. } => range(kind).unwrap_or([0.0, 255.0]),
    }
}

impl Scan {
    /// The columns of its fields.
    pub(super) fn columns(&self) -> impl Iterator<Item = Column> {
        let changed = self.widened.is_some();
        self.fields.iter().filter_map(move |field| {
            let column = field.column()?;
            Some(match changed && color(field).is_some() {
                true => Column::new(&column.name, Scalar::F32),
                false => column,
            })
        })
    }

    /// The limits of its colours, as far as they are known; none if it has no colours.
    fn limits(&self) -> Option<[Option<[f64; 2]>; 3]> {
        let mut all = [None; 3];
        let mut any = false;
        for field in &self.fields {
            if let Some(number) = color(field) {
                all[number] = limits(field.kind, self.color_limits[number]);
                any = true;
            }
        }
        any.then_some(all)
    }

    /// The same, with usual ones where none are known.
    fn all_limits(&self) -> Limits {
        let mut all = [[0.0, 1.0]; 3];
        for field in &self.fields {
            if let Some(number) = color(field) {
                let own = limits(field.kind, self.color_limits[number]);
                all[number] = own.unwrap_or(usual(field.kind));
            }
        }
        all
    }
}

/// The scale of the colours of all scans, if the file says it. Colours on another scale than a usual one, the same in
/// all scans, become numbers from 0 to 65535: their upper 8 bits stay, whether 8 bits were shifted or multiplied.
pub(super) fn scale(scans: &mut [Scan]) -> Option<Depth> {
    let known: Vec<_> = scans.iter().filter_map(Scan::limits).collect();
    let own: Vec<Option<[f64; 2]>> = known.iter().flatten().copied().collect();
    if own.iter().all(Option::is_none) {
        return None;
    }
    let usual = USUAL
        .iter()
        .find(|(ends, _)| own.iter().all(|o| *o == Some(*ends)));
    if let Some((_, depth)) = usual {
        return Some(*depth);
    }
    for scan in scans {
        scan.widened = Some(scan.all_limits());
    }
    Some(Depth::Given)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_those_that_numbers_can_reach() {
        let whole = |highest| Kind::Integer {
            lowest: 0,
            highest,
            scale: 1.0,
            offset: 0.0,
        };
        let to = |high| [Some(0.0), Some(high)];
        for (kind, given, wanted) in [
            (whole(1023), to(1023.0), Some([0.0, 1023.0])),
            (whole(65535), to(1023.0), Some([0.0, 1023.0])),
            (whole(255), to(65535.0), Some([0.0, 255.0])),
            (whole(4095), [None; 2], Some([0.0, 4095.0])),
            (whole(65535), [None; 2], None),
            (whole(i64::MAX), [None; 2], None),
            (Kind::Single, to(1.0), Some([0.0, 1.0])),
            (Kind::Single, [None; 2], None),
            (Kind::Double, to(0.0), None),
        ] {
            assert_eq!(limits(kind, given), wanted, "{kind:?} {given:?}");
        }
    }
}
