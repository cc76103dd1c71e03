//! A map of change and its distribution, for a page.

use super::rows::{ChangeRow, Changes, State};
use super::{Change, Witness};
use crate::compare::Sketch;
use crate::compare::shape::Shape;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_draw::histogram::{Bin, Histogram, Tally};
use outcrop_draw::picture::{Picture, Tone};
use outcrop_geom::vector::V3;

/// Bars of the distribution: an odd number, so that one is about no change.
const BARS: usize = 61;

/// Counts for each bar, by which percentiles are found.
const PARTS: usize = 64;

/// Lengths are counted as multiples of the diagonal divided by this.
const STEPS: f64 = (1u64 << 40) as f64;

/// A map of change, and the distribution of the changes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Illustration {
    /// The map from above, and obliquely.
    pub pictures: Vec<Picture>,
    /// The change at which growth and loss have their full colours: at 95 % of what changed significantly it is less.
    pub top: f64,
    /// Changes of all vertices that were compared, the first and the last bar with what is beyond; none if nothing was
    /// compared.
    pub changes: Option<Histogram>,
    /// The median of the uncertainty at 95 %.
    pub uncertainty: f64,
}

/// A map while it is drawn.
pub(super) struct Drawing {
    sketch: Sketch,
    diagonal: f64,
    /// Mean distances of the vertices of both, the new one first.
    spacings: [f64; 2],
}

impl Drawing {
    pub(super) fn of(new: &Shape, old: &Shape, workspace: &Workspace) -> Result<Self> {
        let spacing = |shape: &Shape| match shape.side.points {
            0 => 0.0,
            points => (shape.side.area / points as f64).sqrt(),
        };
        Ok(Self {
            sketch: Sketch::of(new, workspace)?,
            diagonal: new.side.bounds().diagonal(),
            spacings: [spacing(new), spacing(old)],
        })
    }

    /// The pictures, and the distribution of what was found.
    pub(super) fn finish(
        self,
        found: &Change,
        changes: &Changes,
        workspace: &Workspace,
    ) -> Result<Illustration> {
        let unit = found.new.bounds().diagonal().max(f64::MIN_POSITIVE) / STEPS;
        let [mut all, mut significant, mut uncertainties] = [(); 3].map(|()| Tally::default());
        each(changes, |row| {
            let [change, uncertainty] = row.changes().map(f64::from);
            all.add((change.abs() / unit) as u64);
            uncertainties.add((uncertainty / unit) as u64);
            if row.state() == State::Changed {
                significant.add((change.abs() / unit) as u64);
            }
        })?;
        let of = |tally: &Tally, pick: fn(&Histogram) -> f64| {
            let histogram = tally.histogram(BARS, |steps| steps * unit);
            histogram.as_ref().map_or(0.0, pick)
        };
        let uncertainty = of(&uncertainties, |h| h.p50);
        let top = match significant.total() {
            0 => uncertainty,
            _ => of(&significant, |h| h.p95),
        };
        let end = (3.0 * uncertainty).max(2.0 * of(&all, |h| h.p95));
        Ok(Illustration {
            changes: match all.total() {
                0 => None,
                _ => Some(distribution(changes, end)?),
            },
            pictures: self
                .sketch
                .pictures("Change", (self.diagonal, top), workspace)?,
            top,
            uncertainty,
        })
    }
}

impl Witness for Drawing {
    const SEES: bool = true;

    fn take(&mut self, position: V3, row: &ChangeRow) {
        let change = f64::from(row.changes()[0]);
        let tone = match row.state() {
            State::Same => Tone::Same,
            State::Changed if change > 0.0 => Tone::Growth,
            State::Changed => Tone::Loss,
            State::Alone => Tone::OnlyNew,
            State::Unused => return,
        };
        let sizes = [change.abs(), self.diagonal];
        self.sketch.change(position, tone, sizes, self.spacings[0]);
    }

    fn gone(&mut self, position: V3) {
        let sizes = [0.0, self.diagonal];
        let spacing = self.spacings[1];
        self.sketch.change(position, Tone::OnlyOld, sizes, spacing);
    }
}

/// Calls `see` with the rows of vertices that were compared.
fn each(changes: &Changes, mut see: impl FnMut(&ChangeRow)) -> Result<()> {
    let mut rows = Vec::new();
    for section in 0..changes.count() {
        changes.get_into(section, &mut rows)?;
        let compared = |row: &&ChangeRow| matches!(row.state(), State::Same | State::Changed);
        rows.iter().filter(compared).for_each(&mut see);
    }
    Ok(())
}

/// The distribution of changes up to `end` in both directions.
fn distribution(changes: &Changes, end: f64) -> Result<Histogram> {
    let end = if end > 0.0 { end } else { 1.0 };
    let parts = BARS * PARTS;
    let mut counts = vec![0u64; parts];
    let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
    each(changes, |row| {
        let change = f64::from(row.changes()[0]);
        (min, max) = (min.min(change), max.max(change));
        // The cast maps what is below to the first one.
        let part = (change / end + 1.0) / 2.0 * parts as f64;
        counts[(part as usize).min(parts - 1)] += 1;
    })?;
    let at = |part: usize| (part as f64 / parts as f64 * 2.0 - 1.0) * end;
    let total: u64 = counts.iter().sum();
    let percentile = |share: f64| {
        let mut passed = 0;
        let found = counts.iter().position(|count| {
            passed += count;
            passed as f64 >= share * total as f64
        });
        at(found.unwrap_or(0)).clamp(min, max)
    };
    let bars = counts.chunks(PARTS).enumerate();
    let bins = bars.map(|(bar, counts)| Bin {
        from: at(bar * PARTS),
        to: at((bar + 1) * PARTS),
        count: counts.iter().sum(),
    });
    Ok(Histogram {
        count: total,
        min,
        p5: percentile(0.05),
        p50: percentile(0.5),
        p95: percentile(0.95),
        max,
        bins: bins.collect(),
    })
}
