//! Choice of a common lattice for all sources.

use super::map::{SourceMap, rational};
use super::source::Source;
use super::stats::IngestStats;
use outcrop_disk::error::{Error, Result};
use outcrop_geom::lattice::{COORDINATE_LIMIT, Lattice};

/// Largest factor by which the step is refined so that the offsets of all files are on the lattice.
const MOST_REFINEMENT: i64 = 1000;

/// The lattice of the sources; see `Spool::choose_lattice`.
pub(super) fn choose(sources: &[Source], stats: &IngestStats, refine: u32) -> Result<Lattice> {
    let sources: Vec<&Source> = sources.iter().filter(|s| s.stats.any()).collect();
    if sources.iter().all(|s| s.stats.kept == 0) {
        return Err(no_points(stats));
    }
    let offset = common_offset(&sources);
    let mut step = match grid_step(&sources, offset) {
        Some(step) => refine_for_floats(&sources, offset, step),
        None => float_step(&sources),
    };
    // In a forged spool the scale may be zero, and doubling zero would not end.
    step = step.max(f64::MIN_POSITIVE);
    let mut chosen = loop {
        match place(&sources, step, offset) {
            Some(lattice) => break lattice,
            None => step *= 2.0,
        }
        if !step.is_finite() {
            return Err(Error::Degenerate {
                found: "coordinates so large that no lattice can hold them".into(),
            });
        }
    };
    for _ in 0..refine {
        match place(&sources, chosen.step / 2.0, offset) {
            Some(finer) if finer.step.is_normal() => chosen = finer,
            _ => break,
        }
    }
    Ok(chosen)
}

/// The finest step that a cloud asks for.
#[derive(Debug, Clone, Copy)]
pub(super) struct ExactStep {
    pub(super) step: f64,
    /// True if a lattice with this step holds the cloud.
    pub(super) fits: bool,
    /// True without floating-point sources.
    pub(super) grids_only: bool,
}

/// The step with which all points are on the lattice, or are rounded invisibly; `None` without points.
pub(super) fn exact_step(sources: &[Source]) -> Option<ExactStep> {
    let sources: Vec<&Source> = sources.iter().filter(|s| s.stats.kept > 0).collect();
    let offset = common_offset(&sources);
    let floats = sources.iter().filter(|s| s.grid(0).is_none());
    let exponent = floats.clone().map(|s| s.stats.exponent).min();
    let grid = finest_grid_step(&sources, offset).map(|(step, _)| step);
    let step = match (grid, exponent) {
        (Some(step), Some(exponent)) => step.min(pow2(exponent.max(-1000))),
        (Some(step), None) => step,
        (None, Some(_)) => float_step(&sources),
        (None, None) => return None,
    };
    Some(ExactStep {
        step,
        fits: place(&sources, step.max(f64::MIN_POSITIVE), offset).is_some(),
        grids_only: exponent.is_none(),
    })
}

fn no_points(stats: &IngestStats) -> Error {
    let reasons = [
        (
            stats.dropped_non_finite,
            "with coordinates that are no numbers",
        ),
        (stats.withheld, "withheld"),
        (stats.invalid, "that the scanner marked as invalid"),
        (stats.dropped_by_class, "of classes that are not wanted"),
    ];
    let counted = reasons.iter().filter(|(count, _)| *count > 0);
    let reasons: Vec<String> = counted
        .map(|(count, why)| format!("{count} {why}"))
        .collect();
    let mut found = format!("no usable point in {} input file(s)", stats.files.len());
    if !reasons.is_empty() {
        found += &format!(" ({} were left out)", reasons.join(", "));
    }
    Error::Degenerate { found }
}

/// The lattice of a step and an offset; `None` if the sources do not fit it.
fn place(sources: &[&Source], step: f64, offset: [f64; 3]) -> Option<Lattice> {
    let mut low = [i64::MAX; 3];
    let mut high = [i64::MIN; 3];
    let mut exact = true;
    for source in sources {
        let map = SourceMap::new(source, step, offset)?;
        exact &= map.exact;
        for axis in 0..3 {
            let [a, b] = map.extent(source, axis)?;
            low[axis] = low[axis].min(a);
            high[axis] = high[axis].max(b);
        }
    }
    let extent = |axis: usize| high[axis].checked_sub(low[axis]);
    let fits = (0..3).all(|axis| extent(axis).is_some_and(|e| e < COORDINATE_LIMIT));
    fits.then_some(Lattice {
        step,
        offset,
        base: low,
        exact,
    })
}

/// The lowest offset of all sources on a grid, which does not depend on their order.
fn common_offset(sources: &[&Source]) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let offsets = sources.iter().filter_map(|s| s.grid(axis));
        let lowest = offsets.map(|(_, offset)| offset).reduce(f64::min);
        // Avoids negative zero, which would depend on the order of files.
        lowest.unwrap_or(0.0) + 0.0
    })
}

/// The step for sources on grids (LAS, decimals): the finest, if it fits; else the finest that fits. `None`
/// without such sources.
fn grid_step(sources: &[&Source], offset: [f64; 3]) -> Option<f64> {
    let (fine, step) = finest_grid_step(sources, offset)?;
    let factors = (0..).flat_map(|k| [1.0, 2.0, 5.0].map(|f: f64| f * 10f64.powi(k)));
    let coarser = factors.take(60).map(|factor| nice(step * factor));
    std::iter::once(fine)
        .chain(coarser)
        .find(|step| place(sources, *step, offset).is_some())
        .or(Some(step))
}

/// The finest step for sources on grids: the greatest common divisor of all scales, refined to include all
/// offsets; and that before it is refined. `None` without such sources.
fn finest_grid_step(sources: &[&Source], offset: [f64; 3]) -> Option<(f64, f64)> {
    let grids: Vec<Vec<(f64, f64)>> = (0..3)
        .map(|axis| sources.iter().filter_map(|s| s.grid(axis)).collect())
        .collect();
    let mut scales: Vec<f64> = grids.iter().flatten().map(|(s, _)| s.abs()).collect();
    scales.sort_by(f64::total_cmp);
    scales.dedup();
    let finest = *scales.first()?;
    let common = common_divisor(&scales);
    let step = common.unwrap_or(finest);
    let shifts = (0..3).flat_map(|a| {
        grids[a]
            .iter()
            .map(move |(_, o)| (o - offset[a], offset[a]))
    });
    let parts = common.and_then(|step| offset_parts(step, shifts));
    // Ten parts are not exact, but a tenth of a step keeps rounding errors invisible.
    Some((divided(step, parts.unwrap_or(10)), step))
}

/// `step / parts`, corrected to the decimal number it stands for.
fn divided(step: f64, parts: i64) -> f64 {
    if parts == 1 {
        step
    } else {
        nice(step / parts as f64)
    }
}

/// The multiple of 1e-12 that equals `step` up to rounding errors, else `step`.
fn nice(step: f64) -> f64 {
    let picos = (step * 1e12).round();
    let decimal = picos / 1e12;
    if picos < 9e15 && (decimal - step).abs() <= 1e-12 * step {
        decimal
    } else {
        step
    }
}

/// The greatest common divisor of ascending scales, if they are commensurable.
fn common_divisor(scales: &[f64]) -> Option<f64> {
    let (&finest, rest) = scales.split_first()?;
    let mut parts = 1i64;
    for scale in rest {
        let (_, d) = rational(scale / (finest / parts as f64), MOST_REFINEMENT)?;
        parts = parts.checked_mul(d)?;
        if parts > MOST_REFINEMENT {
            return None;
        }
    }
    // Rounding errors as in 1.0000000000000002e-7 are only removed if there are several scales.
    Some(if rest.is_empty() {
        finest
    } else {
        nice(finest / parts as f64)
    })
}

/// The number of parts into which a step must be divided so that all offsets are integer numbers of parts.
fn offset_parts(step: f64, shifts: impl Iterator<Item = (f64, f64)>) -> Option<i64> {
    let mut parts = 1i64;
    for (shift, origin) in shifts {
        // Upper bound, in steps, on the rounding errors of offsets stored as doubles.
        let noise = 1e-9 + (shift.abs() + 2.0 * origin.abs()) * f64::EPSILON / step;
        let steps = shift / step;
        let on = |q: i64| {
            let x = steps * q as f64;
            (x - x.round()).abs() <= noise * q as f64
        };
        // With more parts, any offset would be close to an integer number of them by chance.
        let most = MOST_REFINEMENT.min((0.1 / noise.sqrt()) as i64).max(1);
        let q = (1..=most).find(|q| on(parts * q))?;
        parts *= q;
        if parts > MOST_REFINEMENT {
            return None;
        }
    }
    Some(parts)
}

/// Halves the step until floating-point sources beside grids lie on the lattice, as long as the cloud fits.
fn refine_for_floats(sources: &[&Source], offset: [f64; 3], mut step: f64) -> f64 {
    let floats = sources.iter().filter(|s| s.grid(0).is_none());
    let Some(wanted) = floats.map(|s| s.stats.exponent).min() else {
        return step;
    };
    while step > pow2(wanted) && place(sources, step / 2.0, offset).is_some() {
        step /= 2.0;
    }
    step
}

/// The step for floating-point sources alone: the largest power of two of which all values are multiples, or
/// the finest that fits.
fn float_step(sources: &[&Source]) -> f64 {
    match sources.iter().map(|s| s.stats.exponent).min() {
        None | Some(i32::MAX) => 1.0,
        // The step must stay a normal number so that its inverse is finite.
        Some(e) => pow2(e.max(-1000)),
    }
}

fn pow2(exponent: i32) -> f64 {
    2f64.powi(exponent.clamp(-1074, 1023))
}

#[cfg(test)]
mod tests {
    use super::super::native::Native;
    use super::super::stats::SourceStats;
    use super::*;

    #[test]
    fn a_forged_scale_of_nothing_or_beyond_all_numbers_ends() {
        for scale in [0.0, -0.0, 5e-324, f64::MAX, f64::INFINITY, f64::NAN] {
            for max in [0.0, 1.0, 1e300] {
                let source = Source {
                    native: Native::Las {
                        scale: [scale, 0.01, 0.01],
                        offset: [0.0; 3],
                    },
                    stats: SourceStats {
                        kept: 2,
                        min: [0.0; 3],
                        max: [max; 3],
                        ..SourceStats::default()
                    },
                    text: false,
                    cut: false,
                    columns: Vec::new(),
                    depth: None,
                    tally: Default::default(),
                    spans: Vec::new(),
                };
                let found = choose(&[source], &IngestStats::default(), 3);
                if let Ok(lattice) = found {
                    assert!(lattice.step.is_normal(), "{scale:e}, {max:e}: {lattice:?}");
                }
            }
        }
    }
}
