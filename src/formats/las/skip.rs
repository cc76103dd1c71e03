//! Parts of a file that are not decoded because they are outside a region: chunks of COPC, and whole files.
//!
//! Headers can be wrong. The box in a header, and the cubes of COPC, are believed only if a sample of the points
//! agrees: those at the beginning of chunks, which are not compressed, or records at equal distances.

use super::super::input::Input;
use super::super::reads::{Means, Reads};
use super::copc::Hierarchy;
use super::table::{self, Chunk};
use super::{Header, laszip, position};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_points::crop::Nearby;
use outcrop_points::spool::SourceWriter;

/// Number of points in a sample.
const SAMPLE: usize = 64;

/// Numbers of at most [`SAMPLE`] of `count` items at equal distances.
fn some_of(count: usize) -> impl Iterator<Item = usize> {
    let most = count.min(SAMPLE);
    (0..most).map(move |n| n * count / most)
}

impl Header {
    /// The position of the record at a byte of the file.
    fn position_at(&self, input: &Input, at: u64) -> Result<[f64; 3]> {
        let mut record = [0; 12];
        input.read_exact_at(at, &mut record, "a point")?;
        let p = position(&record).map(f64::from);
        Ok([0, 1, 2].map(|axis| p[axis] * self.scale[axis] + self.offset[axis]))
    }

    /// The box in the header; `None` if it is none.
    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let raw = &self.raw;
        let low = [raw.min_x, raw.min_y, raw.min_z];
        let high = [raw.max_x, raw.max_y, raw.max_z];
        let valid = |axis: usize| {
            low[axis].is_finite() && high[axis].is_finite() && low[axis] <= high[axis]
        };
        (0..3).all(valid).then_some([low, high])
    }

    /// Longest step of an axis: rounding moves a point by less.
    fn slack(&self) -> f64 {
        self.scale.iter().fold(0.0, |most, s| s.abs().max(most))
    }

    /// True if a point is in a box, or not farther from it than a step.
    fn is_in(&self, [low, high]: [[f64; 3]; 2], p: [f64; 3]) -> bool {
        let slack = self.slack();
        (0..3).all(|axis| low[axis] - slack <= p[axis] && p[axis] <= high[axis] + slack)
    }

    /// True if the sampled points at these bytes are in the box of the header.
    fn agrees(&self, input: &Input, places: &[u64]) -> Result<bool> {
        let Some(bounds) = self.bounds().filter(|_| !places.is_empty()) else {
            return Ok(false);
        };
        for place in some_of(places.len()) {
            if !self.is_in(bounds, self.position_at(input, places[place])?) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// True if the box of the header is certainly outside, and a sample of the points agrees with the box.
    pub(super) fn lies_outside(
        &self,
        input: &Input,
        wanted: &Nearby<'_>,
        workspace: &Workspace,
    ) -> Result<bool> {
        let outside = |bounds: &[[f64; 3]; 2]| !wanted.may_meet(*bounds);
        if self.claimed == 0 || !self.bounds().as_ref().is_some_and(outside) {
            return Ok(false);
        }
        let places = if self.format.is_compressed {
            let laszip = laszip::read(input, self)?;
            let table = match laszip.stream {
                true => None,
                false => table::read(input, self, &laszip, workspace)?,
            };
            table.map_or_else(Vec::new, |table| {
                let chunks = table.chunks.iter().filter(|chunk| chunk.points > 0);
                chunks.map(|chunk| chunk.at).collect()
            })
        } else {
            let bytes = u64::from(self.record_bytes);
            let present = (input.bytes - self.data) / bytes;
            if self.claimed > present {
                return Ok(false);
            }
            let count = usize::try_from(present).unwrap_or(usize::MAX);
            some_of(count)
                .map(|n| self.data + n as u64 * bytes)
                .collect()
        };
        self.agrees(input, &places)
    }

    /// What is read of the file if these points are wanted. Header and hierarchy are believed.
    pub(super) fn reads_near(
        &self,
        input: &Input,
        wanted: &Nearby<'_>,
        means: Means<'_>,
    ) -> Result<Reads> {
        let whole = Reads::whole(input, self.claimed);
        let outside = |bounds: [[f64; 3]; 2]| !wanted.may_meet(bounds);
        if self.claimed > 0 && self.bounds().is_some_and(outside) {
            return Ok(Reads {
                bytes: 0,
                points: 0,
                ..whole
            });
        }
        if !self.format.is_compressed || !input.is_at_hand() {
            return Ok(whole);
        }
        Ok(match Hierarchy::read(input, self, means)? {
            Some(Ok(hierarchy)) => hierarchy.reads(input, self.slack(), wanted),
            // All chunks of a file with a damaged one are read.
            Some(Err(_)) | None => whole,
        })
    }

    /// The box of the header in the file's integers; the lowest ends first.
    pub(super) fn native_bounds(&self) -> Option<[[f64; 3]; 2]> {
        let [low, high] = self.bounds()?;
        let ends = |axis: usize| {
            let of = |c: f64| ((c - self.offset[axis]) / self.scale[axis]).round();
            let (a, b) = (of(low[axis]), of(high[axis]));
            [a.min(b), a.max(b)].map(|c| c.clamp(i32::MIN.into(), i32::MAX.into()))
        };
        let ends = [0, 1, 2].map(ends);
        Some([ends.map(|e| e[0]), ends.map(|e| e[1])])
    }
}

/// Removes the chunks of a COPC file that are outside the wanted region; returns a warning if its hierarchy
/// cannot be used.
pub(super) fn outside(
    input: &Input,
    header: &Header,
    chunks: &mut Vec<Chunk>,
    writer: &SourceWriter<'_>,
) -> Result<Option<String>> {
    let Some(wanted) = writer.region() else {
        return Ok(None);
    };
    let warning = |why: &str| Ok(Some(format!("{why}: all of its chunks are read")));
    let hierarchy = match Hierarchy::read(input, header, Means::of(writer.workspace))? {
        None => return Ok(None),
        Some(Err(why)) => return warning(&format!("the COPC hierarchy is damaged ({why})")),
        Some(Ok(hierarchy)) => hierarchy,
    };
    let places: Vec<u64> = chunks.iter().map(|chunk| chunk.at).collect();
    let Some(bounds) = header.native_bounds() else {
        return warning("the header has no valid box");
    };
    if !header.agrees(input, &places)? {
        return warning("points are outside the box of the header");
    }
    let selected = hierarchy.select(chunks, header.slack(), wanted);
    let skipped: Vec<usize> = (0..chunks.len()).filter(|n| !selected[*n].0).collect();
    for n in some_of(skipped.len()).map(|n| skipped[n]) {
        let p = header.position_at(input, chunks[n].at)?;
        if selected[n].1.is_some_and(|cube| !header.is_in(cube, p)) {
            return warning("points are outside the cubes of the COPC hierarchy");
        }
    }
    let points = skipped.iter().map(|n| chunks[*n].points).sum();
    if points > 0 {
        writer.skip(points, bounds);
    }
    let mut kept = selected.iter().map(|(kept, _)| *kept);
    chunks.retain(|_| kept.next().unwrap_or(true));
    Ok(None)
}
