//! Streams the spool as lattice positions.

use super::Spool;
use super::map::SourceMap;
use super::source::Source;
use super::spool::{FRAME, FrameBuffer};
use crate::error::{Error, Result};
use crate::geom::Point;
use crate::geom::lattice::{COORDINATE_LIMIT, Lattice};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Memory of the buffers of one thread that streams a [`Spool`], in bytes.
pub const READ_BUFFERS: u64 = (FRAME * (24 + 24 + 12)) as u64;

/// Buffers of one thread.
#[derive(Default)]
struct Buffers {
    frame: FrameBuffer,
    wide: Vec<[i64; 3]>,
    points: Vec<Point>,
}

/// Where the next frame starts; none once a thread has reached the end or failed.
type Next = Mutex<Option<u64>>;

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Spool {
    /// Streams all points as positions on `lattice`, one chunk at a time, in memory of
    /// [`READ_BUFFERS`].
    ///
    /// The order of the points has no meaning.
    ///
    /// # Errors
    /// What `each` returned; [`Error::Io`], [`Error::Cancelled`], [`Error::Corrupt`] if the spool
    /// is not what was written; [`Error::Parameter`] for a lattice that was not chosen for it.
    pub fn for_each(
        &self,
        lattice: &Lattice,
        mut each: impl FnMut(&[Point]) -> Result<()>,
    ) -> Result<()> {
        let maps = self.maps(lattice)?;
        let next = Mutex::new(Some(0));
        let mut buffers = Buffers::default();
        while self.next(&next, &maps, lattice, &mut buffers)? {
            each(&buffers.points)?;
        }
        Ok(())
    }

    /// Like [`Spool::for_each`], on `threads` threads at the same time, each with its own
    /// [`READ_BUFFERS`].
    ///
    /// # Errors
    /// See [`Spool::for_each`]; the first error of any thread.
    pub fn par_for_each(
        &self,
        threads: usize,
        lattice: &Lattice,
        each: impl Fn(&[Point]) -> Result<()> + Sync,
    ) -> Result<()> {
        let maps = self.maps(lattice)?;
        let next = Mutex::new(Some(0));
        let failed = Mutex::new(None);
        let worker = || {
            let mut buffers = Buffers::default();
            let mut work = || -> Result<()> {
                while self.next(&next, &maps, lattice, &mut buffers)? {
                    each(&buffers.points)?;
                }
                Ok(())
            };
            if let Err(error) = work() {
                *lock(&next) = None;
                lock(&failed).get_or_insert(error);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..threads {
                scope.spawn(worker);
            }
            worker();
        });
        match failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    fn maps(&self, lattice: &Lattice) -> Result<Vec<SourceMap>> {
        let map = |source: &Source| {
            SourceMap::new(source, lattice.step, lattice.offset).ok_or_else(|| Error::Parameter {
                name: "lattice",
                found: format!("a step of {}", lattice.step),
                expected: "a lattice chosen for this spool".into(),
            })
        };
        self.sources.iter().map(map).collect()
    }

    /// Reads and converts the next frame; false at the end.
    fn next(
        &self,
        next: &Next,
        maps: &[SourceMap],
        lattice: &Lattice,
        buffers: &mut Buffers,
    ) -> Result<bool> {
        if self.cancel.is_cancelled() {
            return Err(Error::Cancelled);
        }
        {
            let mut at = lock(next);
            *at = match *at {
                Some(now) => self
                    .file
                    .next_frame(&self.sources, now, &mut buffers.frame)?,
                None => None,
            };
            if at.is_none() {
                return Ok(false);
            }
        }
        self.convert(maps, lattice, buffers)?;
        Ok(true)
    }

    /// Converts a frame to positions.
    fn convert(&self, maps: &[SourceMap], lattice: &Lattice, buffers: &mut Buffers) -> Result<()> {
        let Buffers {
            frame,
            wide,
            points,
        } = buffers;
        maps[frame.source].apply(self.sources[frame.source].native, frame, lattice.base, wide);
        points.clear();
        points.extend(wide.iter().map(|p| p.map(|c| c as i32)));
        let outside = wide
            .iter()
            .find(|p| !p.iter().all(|c| (0..COORDINATE_LIMIT).contains(c)));
        match outside {
            None => Ok(()),
            Some(found) => Err(Error::Corrupt {
                path: self.file.path.clone(),
                offset: frame.offset,
                found: format!("position {found:?}"),
                expected: format!("0 to {}", COORDINATE_LIMIT - 1),
            }),
        }
    }
}
