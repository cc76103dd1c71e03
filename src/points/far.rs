//! Points far from all others, such as one at the origin of a cloud in national coordinates. A lattice that
//! spans them has coarser steps for all points, so they are left out where they cost steps.
//!
//! This takes up to six passes over the spool, in [`Spool::drop_far`], and none where the finest lattice fits or
//! where samples of the frames prove that no point is far.

use super::Spool;
use super::frames::{Frame, FrameBuffer, read_frame};
use super::lattice;
use super::middle::{Middle, sure};
use super::native::Native;
use super::source::Source;
use super::stats::SourceStats;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::file::ScratchFile;
use outcrop_geom::lattice::COORDINATE_LIMIT;
use serde::{Deserialize, Serialize};

/// At either end of an axis one point in this many may be far: at least 99.9 % of the cloud lie between. Stray
/// points are fewer, parts of an object are more.
const ONE_IN: u64 = 2000;

/// Floating-point values have no step that a cloud must keep. There a point is far if it is this many times the
/// extent of the others away from them: the lattice then keeps 25 of its 30 bits for them, one more than single
/// precision has.
const REACH: f64 = 16.0;

/// Bits of a key that are counted in one pass.
const BITS: u32 = 16;

/// Bytes of the counts and of the buffers.
const MEMORY: u64 = ((6 * 8) << BITS) + (1 << 20);

/// The result of the passes.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Found {
    /// Statistics of the near points of each source.
    near: Vec<SourceStats>,
    /// Far points in frames that have some.
    frames: Vec<(usize, u32)>,
    /// The least far point, in the order of coordinates.
    example: Option<[f64; 3]>,
}

/// The closed interval of an axis in which points are near.
type Window = [f64; 2];

impl Spool {
    /// Leaves out points that are far from all others, if the lattice would be finer without them. They stay in
    /// the scratch file, but are not streamed any more, and are not counted as kept.
    ///
    /// The points left out do not depend on the order of points and files.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
    pub fn drop_far(&mut self, workspace: &Workspace) -> Result<()> {
        let exact = lattice::exact_step(&self.sources);
        let fits = exact.is_some_and(|exact| exact.fits);
        if fits || self.stats.kept < ONE_IN || self.middles_prove_it() {
            return Ok(());
        }
        let step = exact
            .filter(|exact| exact.grids_only)
            .map(|exact| exact.step);
        let found = workspace.once("far points", |_| {
            let _held = workspace.reserve("ingest: far points", MEMORY)?;
            let file = workspace.files.open(&self.name, true)?;
            let core = self.core(workspace, &file)?;
            match windows(core, step) {
                Some(windows) => self.sift(workspace, &file, &windows),
                None => Ok(Found::default()),
            }
        })?;
        self.leave_out(found);
        Ok(())
    }

    /// True if no point can be far, by the middles of the frames.
    fn middles_prove_it(&self) -> bool {
        // Sources without middles are on grids.
        let mut all: Vec<(Middle, u64)> = Vec::with_capacity(self.frames.len());
        for frame in &self.frames {
            let Some(middle) = frame.middle else {
                return false;
            };
            all.push((middle, sure(frame.points.into())));
        }
        let may = self.stats.kept / ONE_IN;
        let mut inner = [[0.0; 2]; 3];
        for axis in 0..3 {
            for end in 0..2 {
                all.sort_unstable_by(|a, b| a.0[axis][end].total_cmp(&b.0[axis][end]));
                if end == 1 {
                    all.reverse();
                }
                let mut count = 0;
                let enough = all.iter().find(|(_, sure)| {
                    count += sure;
                    count > may
                });
                let Some((middle, _)) = enough else {
                    return false;
                };
                inner[axis][end] = middle[axis][end];
            }
        }
        let extent = inner
            .iter()
            .map(|[low, high]| high - low)
            .fold(0.0, f64::max);
        let kept = self.sources.iter().filter(|source| source.stats.kept > 0);
        kept.into_iter().all(|source| {
            let [low, high] = [source.stats.min, source.stats.max];
            (0..3).all(|axis| {
                let [a, b] = inner[axis];
                low[axis] >= a - REACH * extent && high[axis] <= b + REACH * extent
            })
        })
    }

    /// Streams the frames with the positions of their points in the unit of the input.
    fn for_native(
        &self,
        workspace: &Workspace,
        file: &ScratchFile,
        mut each: impl FnMut(usize, &FrameBuffer, &dyn Fn(usize) -> [f64; 3]),
    ) -> Result<()> {
        let mut frame = FrameBuffer::default();
        for (number, at) in self.frames.iter().enumerate() {
            workspace.check_cancel()?;
            read_frame(file, &self.sources, *at, &mut frame)?;
            let native = self.sources[frame.source].native;
            let position = |point: usize| in_unit(native, frame.native(native, point));
            each(number, &frame, &position);
        }
        Ok(())
    }

    /// For each axis the coordinates below and above which there are as many points as may be far.
    fn core(&self, workspace: &Workspace, file: &ScratchFile) -> Result<[Window; 3]> {
        let may = self.stats.kept / ONE_IN;
        // The leading bits of the keys searched, and the points with lower ones.
        let mut search = [[(0u64, 0u64); 2]; 3];
        for known in (0..u64::BITS).step_by(BITS as usize) {
            let mut counts = vec![0u64; 6 << BITS];
            self.for_native(workspace, file, |_, frame, position| {
                for point in 0..frame.points {
                    for (axis, coordinate) in position(point).into_iter().enumerate() {
                        let key = key(coordinate);
                        for (end, (prefix, _)) in search[axis].into_iter().enumerate() {
                            if leading(key, known) == prefix {
                                let next =
                                    (leading(key, known + BITS) & ((1 << BITS) - 1)) as usize;
                                counts[((2 * axis + end) << BITS) + next] += 1;
                            }
                        }
                    }
                }
            })?;
            for (number, counts) in counts.chunks(1 << BITS).enumerate() {
                let (prefix, below) = &mut search[number / 2][number % 2];
                let rank = match number % 2 {
                    0 => may,
                    _ => self.stats.kept - 1 - may,
                };
                for (next, count) in counts.iter().enumerate() {
                    if *below + count > rank {
                        *prefix = *prefix << BITS | next as u64;
                        break;
                    }
                    *below += count;
                }
            }
        }
        Ok(search.map(|ends| ends.map(|(key, _)| coordinate(key))))
    }

    /// Counts the points outside the windows, and takes the statistics of the others.
    fn sift(
        &self,
        workspace: &Workspace,
        file: &ScratchFile,
        windows: &[Window; 3],
    ) -> Result<Found> {
        let mut found = Found {
            near: self
                .sources
                .iter()
                .map(|source| source.stats.emptied())
                .collect(),
            ..Found::default()
        };
        let near = |p: [f64; 3]| (0..3).all(|a| (windows[a][0]..=windows[a][1]).contains(&p[a]));
        self.for_native(workspace, file, |number, frame, position| {
            let native = self.sources[frame.source].native;
            let mut far = 0;
            for point in 0..frame.points {
                let at = position(point);
                if near(at) {
                    found.near[frame.source].take(frame.native(native, point), native);
                    continue;
                }
                far += 1;
                let least = found
                    .example
                    .is_none_or(|least| at.map(key) < least.map(key));
                if least {
                    found.example = Some(at);
                }
            }
            if far > 0 {
                found.frames.push((number, far));
            }
        })?;
        Ok(found)
    }

    /// Takes over what was found.
    fn leave_out(&mut self, found: Found) {
        if found.frames.is_empty() {
            return;
        }
        for (frame, far) in &found.frames {
            if let Some(frame) = self.frames.get_mut(*frame) {
                frame.far = (*far).min(frame.points);
            }
        }
        let files = self.stats.files.iter_mut();
        for ((source, near), file) in self.sources.iter_mut().zip(&found.near).zip(files) {
            source.cut = near.kept < source.stats.kept;
            file.dropped_far = source.stats.kept - near.kept.min(source.stats.kept);
            source.stats = *near;
            file.kept = near.kept;
            let bounds = source.bounds();
            (file.min, file.max) = (bounds.map(|b| b[0]), bounds.map(|b| b[1]));
            self.stats.dropped_far += file.dropped_far;
            self.stats.kept -= file.dropped_far;
        }
        self.stats.far_example = found.example;
    }
}

/// The windows of near points around the core of a cloud; `None` if no point is left out.
fn windows(core: [Window; 3], step: Option<f64>) -> Option<[Window; 3]> {
    let extents = core.map(|[low, high]| high - low);
    let extent = extents.into_iter().fold(0.0, f64::max);
    // All but a few points are one, or the extent cannot be represented.
    if !(extent > 0.0 && extent.is_finite()) {
        return None;
    }
    // Two steps are for rounding at the ends.
    let limit = (COORDINATE_LIMIT - 2) as f64;
    let steps = step.filter(|step| extent / step < limit);
    Some(std::array::from_fn(|axis| {
        let [low, high] = core[axis];
        let reach = match steps {
            Some(step) => (limit - (extents[axis] / step).ceil()) / 2.0 * step,
            None => REACH * extent,
        };
        [low - reach, high + reach]
    }))
}

/// Native coordinates in the unit of the input.
pub(super) fn in_unit(native: Native, point: [f64; 3]) -> [f64; 3] {
    match native {
        Native::Las { scale, offset } => {
            std::array::from_fn(|axis| point[axis] * scale[axis] + offset[axis])
        }
        Native::F32 | Native::F64 => point,
    }
}

/// The first `bits` bits.
fn leading(key: u64, bits: u32) -> u64 {
    key.checked_shr(u64::BITS - bits).unwrap_or(0)
}

/// A number that ascends with the coordinate.
fn key(coordinate: f64) -> u64 {
    // Adding zero makes one of both zeros.
    let bits = (coordinate + 0.0).to_bits();
    match bits >> 63 {
        0 => bits | 1 << 63,
        _ => !bits,
    }
}

fn coordinate(key: u64) -> f64 {
    match key >> 63 {
        0 => f64::from_bits(!key),
        _ => f64::from_bits(key & !(1 << 63)),
    }
}

/// The points of a frame that are near: those in the box of all near points of their source.
pub(super) fn is_near(source: &Source, point: [f64; 3]) -> bool {
    let SourceStats { min, max, .. } = &source.stats;
    (0..3).all(|axis| (min[axis]..=max[axis]).contains(&point[axis]))
}

impl Frame {
    /// Number of its points that are not far.
    pub(super) fn near(&self) -> u32 {
        self.points - self.far
    }
}
