//! The points of an E57 file: a unit for each scan.

use super::super::input::Input;
use super::super::spool::{Coordinate, Sink, SourceWriter, sink_bytes};
use super::packets::{self, BLOCK, Records};
use super::scan::{Motion, Name, Scan};
use crate::error::Result;

/// Most points of which every record takes no bits, since all are the same.
const FEW: u64 = 1 << 23;

/// Where the coordinates of a scan are.
struct Plan {
    motion: Motion,
    cartesian: Option<[usize; 3]>,
    cartesian_state: Option<usize>,
    spherical: Option<[usize; 3]>,
    spherical_state: Option<usize>,
    /// The parts of the records that are read; the others are numbers of these.
    columns: Vec<usize>,
}

impl Plan {
    fn of(input: &Input, number: usize, scan: &Scan) -> Result<Self> {
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
        let mut columns = Vec::new();
        let mut take = |field: usize| {
            columns.push(field);
            columns.len() - 1
        };
        let cartesian = scan.three(Name::Cartesian).map(|f| f.map(&mut take));
        let spherical = scan.three(Name::Spherical).map(|f| f.map(&mut take));
        if cartesian.is_none() && spherical.is_none() {
            let expected = "cartesianX, cartesianY and cartesianZ, or sphericalRange, \
                            sphericalAzimuth and sphericalElevation";
            return Err(wrong("records without coordinates".into(), expected));
        }
        Ok(Self {
            motion,
            cartesian,
            cartesian_state: scan.field(&Name::CartesianState).map(&mut take),
            spherical,
            spherical_state: scan.field(&Name::SphericalState).map(&mut take),
            columns,
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
            Ok(point) => sink.push(point).map(Ok),
            Err(found) => Ok(Err(found)),
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
        // The parts that may be read: six coordinates and two states.
        let numbers = 8 * BLOCK * size_of::<f64>();
        packets::memory(&scans[unit]) + numbers as u64 + sink_bytes::<T>()
    };
    let work = |unit: usize, sink: &mut Sink<'_, T>| {
        let scan = &scans[unit];
        let plan = Plan::of(input, unit, scan)?;
        let mut records = Records::new(input, scan, ends[unit])?;
        let mut values = vec![Vec::with_capacity(BLOCK); plan.columns.len()];
        let mut done = 0;
        loop {
            let count = records.next(&plan.columns, unscaled, &mut values)?;
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
