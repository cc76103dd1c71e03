//! Streams the spool as lattice positions.

use super::Spool;
use super::carry::Carried;
use super::columns::{MOST_ROW, row_bytes};
use super::far::is_near;
use super::frames::{FRAME, FrameBuffer, read_frame, read_values, values_of};
use super::map::SourceMap;
use super::native::Native;
use super::source::Source;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::file::ScratchFile;
use outcrop_disk::workspace::{Workspace, lock};
use outcrop_geom::Point;
use outcrop_geom::lattice::{COORDINATE_LIMIT, Lattice};
use std::sync::Mutex;

/// Bytes of the buffers of one thread that streams a [`Spool`].
pub const READ_BUFFERS: u64 = (FRAME * (24 + 24 + 12 + 4)) as u64;

/// Bytes of the buffers of one thread that streams the values of a [`Spool`] as well.
pub const VALUE_BUFFERS: u64 = READ_BUFFERS + (FRAME * 2 * MOST_ROW) as u64;

/// The buffers of one thread.
#[derive(Default)]
pub(super) struct Buffers {
    pub(super) frame: FrameBuffer,
    wide: Vec<[i64; 3]>,
    pub(super) points: Vec<Point>,
    /// Numbers of the points in the frame, if some of its source are far and left out.
    near: Option<Vec<u32>>,
}

impl Buffers {
    /// The number in the frame of a point.
    pub(super) fn place(&self, point: usize) -> usize {
        let near = self.near.as_ref();
        near.map_or(point, |near| near[point] as usize)
    }
}

/// The remaining frames; empty after a thread has failed.
type Next<'a> = Mutex<std::slice::Iter<'a, u32>>;

impl Spool {
    /// The number of each frame, and its number of points.
    #[must_use]
    pub fn frames(&self) -> Vec<(u32, u64)> {
        let frames = (0..).zip(&self.frames);
        frames.map(|(n, frame)| (n, frame.near().into())).collect()
    }

    /// Streams all points as positions on `lattice`, in chunks, with buffers of [`READ_BUFFERS`] bytes.
    ///
    /// The order of the points has no meaning.
    ///
    /// # Errors
    /// Errors of `each`, [`Error::Io`], [`Error::Cancelled`]; [`Error::Corrupt`] if a frame does not
    /// match its checksum; [`Error::Parameter`] if the lattice was not chosen for this spool.
    pub fn for_each(
        &self,
        workspace: &Workspace,
        lattice: &Lattice,
        mut each: impl FnMut(&[Point]) -> Result<()>,
    ) -> Result<()> {
        self.for_each_frame(workspace, lattice, |buffers, _| each(&buffers.points))
    }

    /// Streams all frames with their positions on `lattice`, and the type of their coordinates.
    pub(super) fn for_each_frame(
        &self,
        workspace: &Workspace,
        lattice: &Lattice,
        mut each: impl FnMut(&Buffers, Native) -> Result<()>,
    ) -> Result<()> {
        let maps = self.maps(lattice)?;
        let mut buffers = Buffers::default();
        let file = workspace.files.open(&self.name, true)?;
        for (frame, _) in self.frames() {
            workspace.check_cancel()?;
            self.read(&file, frame, &maps, lattice, &mut buffers)?;
            each(&buffers, self.sources[buffers.frame.source].native)?;
        }
        Ok(())
    }

    /// Streams the points of some `frames`, on `threads` threads, each with its own [`READ_BUFFERS`].
    ///
    /// # Errors
    /// See [`Spool::for_each`]; the first error of any thread.
    pub fn par_for_frames(
        &self,
        workspace: &Workspace,
        threads: usize,
        lattice: &Lattice,
        frames: &[u32],
        each: impl Fn(&[Point]) -> Result<()> + Sync,
    ) -> Result<()> {
        let maps = self.maps(lattice)?;
        let file = workspace.files.open(&self.name, true)?;
        let next: Next<'_> = Mutex::new(frames.iter());
        let failed = Mutex::new(None);
        let worker = || {
            let mut buffers = Buffers::default();
            let mut work = || -> Result<()> {
                loop {
                    let Some(frame) = lock(&next).next() else {
                        return Ok(());
                    };
                    workspace.check_cancel()?;
                    self.read(&file, *frame, &maps, lattice, &mut buffers)?;
                    each(&buffers.points)?;
                }
            };
            if let Err(error) = work() {
                *lock(&next) = [].iter();
                lock(&failed).get_or_insert(error);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..threads {
                scope.spawn(worker);
            }
            worker();
        });
        let failed = lock(&failed).take();
        failed.map_or(Ok(()), Err)
    }

    /// Streams the points of some `frames` with their rows of the columns `carried`, on the calling thread, with
    /// buffers of [`VALUE_BUFFERS`] bytes. A row has [`Carried::bytes`] bytes.
    ///
    /// # Errors
    /// See [`Spool::for_each`].
    pub fn for_values(
        &self,
        workspace: &Workspace,
        lattice: &Lattice,
        frames: &[u32],
        carried: &Carried,
        mut each: impl FnMut(&[Point], &[u8]) -> Result<()>,
    ) -> Result<()> {
        let maps = self.maps(lattice)?;
        let file = workspace.files.open(&self.name, true)?;
        let values = workspace.files.open(&values_of(&self.name), true)?;
        let mut buffers = Buffers::default();
        let (mut words, mut rows) = (Vec::new(), Vec::new());
        for &frame in frames {
            workspace.check_cancel()?;
            self.read(&file, frame, &maps, lattice, &mut buffers)?;
            let (source, points) = (buffers.frame.source, buffers.frame.points);
            let each_bytes = row_bytes(&self.sources[source].columns);
            words.clear();
            let at = self.values.get(frame as usize).copied().unwrap_or_default();
            if each_bytes > 0 {
                let of = read_values(&values, &self.sources, at, &mut words)?;
                if of != source || at.points as usize != points {
                    let found = format!("values of {} points of source {of}", at.points);
                    let expected = format!("of {points} points of source {source}");
                    return Err(values.damaged(at.segment, at.offset, found, expected));
                }
            }
            let bytes: &[u8] = bytemuck::cast_slice(&words);
            rows.clear();
            let mut put = |point: usize| {
                let own = &bytes[point * each_bytes..(point + 1) * each_bytes];
                carried.put(source, own, &mut rows);
            };
            match &buffers.near {
                Some(near) => near.iter().for_each(|point| put(*point as usize)),
                None => (0..points).for_each(put),
            }
            each(&buffers.points, &rows)?;
        }
        Ok(())
    }

    /// The maps of all sources to `lattice`; `None` for sources without kept points, which had no influence
    /// on the lattice and may not fit it.
    fn maps(&self, lattice: &Lattice) -> Result<Vec<Option<SourceMap>>> {
        let map = |source: &Source| {
            if !source.stats.any() {
                return Ok(None);
            }
            let map = SourceMap::new(source, lattice.step, lattice.offset);
            map.map(Some).ok_or_else(|| Error::Parameter {
                name: "the lattice",
                found: format!("a step of {}", lattice.step),
                expected: "a lattice chosen for this spool".into(),
            })
        };
        self.sources.iter().map(map).collect()
    }

    /// Reads a frame and converts it to positions.
    fn read(
        &self,
        file: &ScratchFile,
        frame: u32,
        maps: &[Option<SourceMap>],
        lattice: &Lattice,
        buffers: &mut Buffers,
    ) -> Result<()> {
        let at = self.frames[frame as usize];
        read_frame(file, &self.sources, at, &mut buffers.frame)?;
        let Buffers {
            frame, wide, near, ..
        } = buffers;
        let source = &self.sources[frame.source];
        if at.near() == 0 {
            *near = Some(Vec::new());
            buffers.points.clear();
            return Ok(());
        }
        let Some(map) = &maps[frame.source] else {
            let found = format!("points of source {}", frame.source);
            let expected = "none of it were kept".into();
            return Err(file.damaged(at.segment, at.offset, found, expected));
        };
        map.apply(source.native, frame, lattice.base, wide);
        *near = source.cut.then(|| {
            let native = |point: &u32| frame.native(source.native, *point as usize);
            let all = 0..frame.points as u32;
            let near: Vec<u32> = all.filter(|p| is_near(source, native(p))).collect();
            for (to, from) in near.iter().enumerate() {
                wide[to] = wide[*from as usize];
            }
            wide.truncate(near.len());
            near
        });
        buffers.points.clear();
        buffers
            .points
            .extend(wide.iter().map(|p| p.map(|c| c as i32)));
        let outside = wide
            .iter()
            .find(|p| !p.iter().all(|c| (0..COORDINATE_LIMIT).contains(c)));
        let Some(outside) = outside else {
            return Ok(());
        };
        let found = format!("position {outside:?}");
        let expected = format!("0 to {}", COORDINATE_LIMIT - 1);
        Err(file.damaged(at.segment, at.offset, found, expected))
    }
}
