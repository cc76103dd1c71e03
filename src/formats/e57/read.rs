//! The points of an E57 file: a unit for each scan.

use super::super::input::Input;
use super::packets::{self, BLOCK, Decoded, Records};
use super::scan::{Field, Motion, Name, Scan};
use super::shades;
use outcrop_disk::error::Result;
use outcrop_ply::Scalar;
use outcrop_points::columns::{Column, SCANNER, Wanted, normal_columns};
use outcrop_points::coordinate::Coordinate;
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};

/// Most points of which every record takes no bits, since all are the same.
const FEW: u64 = 1 << 23;

/// Where the coordinates of a scan are.
struct Plan {
    motion: Motion,
    cartesian: Option<[usize; 3]>,
    cartesian_state: Option<usize>,
    spherical: Option<[usize; 3]>,
    spherical_state: Option<usize>,
    /// The values of wanted columns.
    values: Vec<Value>,
    /// Numbers of the columns of a normal, if the scan was turned.
    normal: Option<[usize; 3]>,
    /// The parts of the records that are read; all other fields are numbers of these.
    parts: Vec<Decoded>,
}

/// The values of a column.
struct Value {
    /// Number of its part, and of the one that tells if it is valid; none if the scan lacks the column.
    from: Option<(usize, Option<usize>)>,
    /// The value of points without one.
    otherwise: f64,
    /// The ends of the scale, if the value becomes one from 0 to 65535.
    limits: Option<[f64; 2]>,
    scalar: Scalar,
}

impl Plan {
    fn of(
        input: &Input,
        (number, scan): (usize, &Scan),
        unscaled: bool,
        wanted: &Wanted,
    ) -> Result<Self> {
        let wrong = |found: String, expected: &str| {
            input.error(
                format!("scan {} of those with points", number + 1),
                found,
                expected,
            )
        };
        let motion = scan.motion().ok_or_else(|| {
            let found = format!("the pose {:?}", scan.pose.unwrap_or_default());
            wrong(found, "a rotation that is not zero, and finite numbers")
        })?;
        let mut parts = Vec::new();
        let mut take = |field: usize| {
            parts.push(Decoded { field, unscaled });
            parts.len() - 1
        };
        let cartesian = scan.three(Name::Cartesian).map(|f| f.map(&mut take));
        let spherical = scan.three(Name::Spherical).map(|f| f.map(&mut take));
        if cartesian.is_none() && spherical.is_none() {
            let expected = "cartesianX, cartesianY and cartesianZ, or sphericalRange, \
                            sphericalAzimuth and sphericalElevation";
            return Err(wrong("records without coordinates".into(), expected));
        }
        let cartesian_state = scan.field(&Name::CartesianState).map(&mut take);
        let spherical_state = scan.field(&Name::SphericalState).map(&mut take);
        let mut take = |field: usize| {
            let unscaled = false;
            parts.push(Decoded { field, unscaled });
            parts.len() - 1
        };
        let value = |column: &Column| {
            let is = |field: &Field| field.column().is_some_and(|c| c.name == column.name);
            let field = scan.fields.iter().position(is);
            let state = scan.state(&column.name);
            let color = field.and_then(|field| shades::color(&scan.fields[field]));
            Value {
                limits: scan.widened.zip(color).map(|(limits, color)| limits[color]),
                from: field.map(|field| (take(field), state.map(&mut take))),
                otherwise: match column.name == SCANNER {
                    true => f64::from(scan.scanner_number()),
                    false => f64::NAN,
                },
                scalar: column.scalar,
            }
        };
        Ok(Self {
            normal: normal_columns(&wanted.columns).filter(|_| motion.turns()),
            motion,
            cartesian,
            cartesian_state,
            spherical,
            spherical_state,
            values: wanted.columns.iter().map(value).collect(),
            parts,
        })
    }

    /// Passes a record on.
    #[inline]
    fn take<T: Coordinate>(
        &self,
        values: &[Vec<f64>],
        record: usize,
        convert: impl Fn([f64; 3]) -> Result<[T; 3], String>,
        sink: &mut Sink<'_, T>,
    ) -> Result<Result<(), String>> {
        let value = |column: usize| values[column][record];
        let valid = |state: Option<usize>| state.is_none_or(|state| value(state) == 0.0);
        let cartesian = self.cartesian.filter(|_| valid(self.cartesian_state));
        let point = cartesian.map(|axes| axes.map(value)).or_else(|| {
            let spherical = self.spherical.filter(|_| valid(self.spherical_state));
            spherical.map(|parts| placed(parts.map(value)))
        });
        let Some(point) = point else {
            sink.invalid();
            return Ok(Ok(()));
        };
        let point = match self.motion.rests() {
            true => point,
            false => self.motion.apply(point),
        };
        match convert(point) {
            Ok(point) => {
                let push = sink.push_with(point, |out| self.put(values, record, out));
                push.map(Ok)
            }
            Err(found) => Ok(Err(found)),
        }
    }
}

impl Plan {
    /// Appends the values of the wanted columns of a record.
    #[inline]
    fn put(&self, values: &[Vec<f64>], record: usize, out: &mut Vec<u8>) {
        let value = |column: &Value| {
            let valid = |state: &usize| values[*state][record] == 0.0;
            let from = column.from.filter(|(_, state)| state.iter().all(valid));
            let own = from.map_or(column.otherwise, |(part, _)| values[part][record]);
            column
                .limits
                .map_or(own, |[low, high]| (own - low) / (high - low) * 65535.0)
        };
        let normal = self.normal.map(|columns| {
            let normal = columns.map(|number| value(&self.values[number]));
            (columns, self.motion.turned(normal))
        });
        for (number, column) in self.values.iter().enumerate() {
            let turned = normal.as_ref().and_then(|(columns, turned)| {
                let axis = columns.iter().position(|own| *own == number)?;
                Some(turned[axis])
            });
            column
                .scalar
                .put(turned.unwrap_or_else(|| value(column)), out);
        }
    }
}

/// The point of a range, an azimuth and an elevation.
fn placed([range, azimuth, elevation]: [f64; 3]) -> [f64; 3] {
    let flat = range * libm::cos(elevation);
    [
        flat * libm::cos(azimuth),
        flat * libm::sin(azimuth),
        range * libm::sin(elevation),
    ]
}

/// Whole numbers as such; the error says what was found.
pub(super) fn whole(point: [f64; 3]) -> Result<[i32; 3], String> {
    // A file may have numbers up to the next power of two above the range that it gives.
    let inside = |c: &f64| f64::from(i32::MIN) <= *c && *c <= f64::from(i32::MAX);
    match point.iter().find(|c| !inside(c)) {
        None => Ok(point.map(|c| c as i32)),
        Some(outside) => Err(format!("the whole number {outside}")),
    }
}

/// Reads all scans; whole numbers are not scaled if `unscaled`.
pub(super) fn scans<T: Coordinate>(
    input: &Input,
    scans: &[Scan],
    unscaled: bool,
    convert: impl Fn([f64; 3]) -> Result<[T; 3], String> + Sync,
    writer: &SourceWriter<'_>,
) -> Result<()> {
    let ends = ends(input, scans)?;
    let memory = |unit: usize| {
        // The parts that may be read: six coordinates and two states, and columns, each with a state.
        let parts = 8 + 2 * writer.wanted.columns.len();
        let numbers = parts * BLOCK * size_of::<f64>();
        packets::memory(&scans[unit]) + numbers as u64 + sink_bytes::<T>()
    };
    let work = |unit: usize, sink: &mut Sink<'_, T>| {
        let scan = &scans[unit];
        let plan = Plan::of(input, (unit, scan), unscaled, writer.wanted)?;
        let mut records = Records::new(input, scan, ends[unit])?;
        let mut values = vec![Vec::with_capacity(BLOCK); plan.parts.len()];
        let mut done = 0;
        loop {
            let count = records.next(&plan.parts, &mut values)?;
            if count == 0 {
                return Ok(());
            }
            for record in 0..count {
                if let Err(found) = plan.take(&values, record, &convert, sink)? {
                    let place = format!("record {} of scan {}", done + record, unit + 1);
                    let expected = "numbers in the range that the description gives";
                    return Err(input.error(place, found, expected));
                }
            }
            done += count;
        }
    };
    writer.units("E57 scans", scans.len(), memory, work)
}

/// The end of each scan: the begin of the next section, or the end of the file. What lies between must have room
/// for the records.
fn ends(input: &Input, scans: &[Scan]) -> Result<Vec<u64>> {
    let mut starts: Vec<u64> = scans.iter().map(|scan| scan.section).collect();
    starts.sort_unstable();
    if let Some(twice) = starts.windows(2).find(|pair| pair[0] == pair[1]) {
        let place = format!("section at byte {}", twice[0]);
        return Err(input.error(place, "the points of two scans", "those of one"));
    }
    let mut free = FEW;
    let mut ends = Vec::with_capacity(scans.len());
    for scan in scans {
        let next = starts.partition_point(|start| *start <= scan.section);
        let end = starts.get(next).copied().unwrap_or(input.bytes);
        let bytes = end.min(input.bytes).saturating_sub(scan.section);
        let most = match scan.bits() {
            0 => free,
            bits => bytes.saturating_mul(8) / bits,
        };
        if scan.points > most {
            return Err(input.error(
                format!("section at byte {}", scan.section),
                format!("{} points in {bytes} bytes", scan.points),
                format!("at most {most}"),
            ));
        }
        if scan.bits() == 0 {
            free -= scan.points;
        }
        ends.push(end);
    }
    Ok(ends)
}
