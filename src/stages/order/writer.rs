//! Writes the ordered store: in id order, or, with `rewrite`, in any order.

use super::files::{STEP, StoreFiles, StoredPoints, WRITTEN, Written};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Table, row};
use outcrop_disk::workspace::steps::Step;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_geom::aabb::Aabb;
use rayon::prelude::*;

row! {
    /// The position of a point on the lattice.
    pub struct Position {
        /// Coordinates.
        point: Point,
    }
    unpacked
}

/// Writes a store in id order.
pub struct StoreWriter<'w> {
    workspace: &'w Workspace,
    files: StoreFiles,
    /// Number of points written so far.
    pub(super) len: usize,
    /// The first of the pages that an earlier attempt recorded last.
    recorded: usize,
    /// Points not written yet, less than a group of pages.
    pending: Vec<Point>,
    bounds: Aabb,
    /// The step whose units are the groups of pages.
    step: Step<'w>,
}

impl<'w> StoreWriter<'w> {
    /// Opens the scratch file `name`. It contains the points that an earlier attempt of the run wrote; see
    /// `len`.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn create(workspace: &'w Workspace, name: &str, page: usize) -> Result<Self> {
        let files = StoreFiles::open(workspace, name, page)?;
        // The end of the points may have cut the last group short; it is written again.
        let (mut recorded, mut pages) = (0, 0);
        loop {
            let more = files.index.rows(workspace, pages / STEP)? / WRITTEN * WRITTEN;
            if more == 0 {
                break;
            }
            (recorded, pages) = (pages, pages + more);
        }
        Ok(Self {
            len: pages * files.page,
            recorded,
            bounds: files.bounds(&workspace.unit(), pages)?,
            workspace,
            files,
            pending: Vec::new(),
            step: workspace.step(&format!("store {name}"))?,
        })
    }

    /// The last point that an earlier attempt wrote.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn last_found(&self) -> Result<Option<Point>> {
        let pages = self.len / self.files.page;
        let unit = self.workspace.unit();
        self.files.last_before(&unit, self.recorded, pages)
    }

    /// A whole store from the points of the sections, in their order.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
    /// [`outcrop_disk::error::Error::Cancelled`].
    pub fn gather(
        workspace: &Workspace,
        name: &str,
        page: usize,
        sections: &Table<Position>,
    ) -> Result<StoredPoints> {
        workspace.once(&format!("gather {name}"), |unit| {
            let mut writer = StoreWriter::create(workspace, name, page)?;
            let mut first = 0;
            for section in 0..sections.count() {
                workspace.check_cancel()?;
                let end = first + sections.rows(unit, section)?;
                let done = writer.len.clamp(first, end) - first;
                if first + done < end {
                    let points = sections.get(unit, section)?;
                    writer.push(bytemuck::cast_slice(&points[done..]))?;
                }
                first = end;
            }
            writer.finish()
        })
    }

    /// Appends points, in id order.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`].
    pub fn push(&mut self, mut points: &[Point]) -> Result<()> {
        let (group, mut written) = (WRITTEN * self.files.page, Vec::new());
        while self.pending.len() + points.len() >= group {
            let (now, later) = points.split_at(group - self.pending.len());
            self.pending.extend_from_slice(now);
            points = later;
            written.push(self.files.write(self.workspace, &self.pending)?);
            self.pending.clear();
        }
        self.pending.extend_from_slice(points);
        self.note(&written, written.len() * group)
    }

    /// Appends the points of `items`, in id order, on all threads.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Cancelled`].
    pub fn append<T: Sync>(
        &mut self,
        items: &[T],
        point: impl Fn(&T) -> Point + Sync,
    ) -> Result<()> {
        let group = WRITTEN * self.files.page;
        let (first, rest) = items.split_at(((group - self.pending.len()) % group).min(items.len()));
        let (groups, last) = rest.split_at(rest.len() / group * group);
        self.push(&first.iter().map(&point).collect::<Vec<_>>())?;
        let (workspace, files) = (self.workspace, &self.files);
        let written: Result<Vec<Written>> = workspace.install(|| {
            let write = |part: &[T]| {
                workspace.check_cancel()?;
                let points: Vec<Point> = part.iter().map(&point).collect();
                workspace.observer.advance(points.len() as u64);
                files.write(workspace, &points)
            };
            groups.par_chunks(group).map(write).collect()
        });
        self.note(&written?, groups.len())?;
        let others = first.len() + last.len();
        workspace.observer.advance(others as u64);
        self.push(&last.iter().map(&point).collect::<Vec<_>>())
    }

    /// Records groups of `points` points that were written.
    fn note(&mut self, groups: &[Written], points: usize) -> Result<()> {
        if groups.is_empty() {
            return Ok(());
        }
        let first = self.len / self.files.page;
        let keep = |unit: &Unit<'_>| self.files.keep(unit, first, groups);
        self.step.finish(first as u64, &(), keep)?;
        for row in groups.iter().flat_map(|group| &group.0) {
            self.bounds = self.bounds.union(row.bounds());
        }
        self.len += points;
        Ok(())
    }

    /// Writes the pending points.
    fn flush(&mut self) -> Result<()> {
        if !self.pending.is_empty() {
            let group = self.files.write(self.workspace, &self.pending)?;
            self.note(&[group], self.pending.len())?;
            self.pending.clear();
        }
        Ok(())
    }

    /// Ends the store.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Disk`].
    pub fn finish(mut self) -> Result<StoredPoints> {
        self.flush()?;
        Ok(self.files.stored(self.len, self.bounds))
    }
}
