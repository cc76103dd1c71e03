//! The order of all points if tasks share the run: a sample sort, every step of which is divided among tasks.
//!
//! Units read parts of the spool and send their keys, sorted, to buckets of the curve, which are cut at a sample
//! of all keys. Units merge buckets. The number of points before a bucket is then known, and units write the
//! pages.

use super::files::STEP;
use super::{CurveKey, Position, Rewriter, StoredPoints};
use crate::ids::Id;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::{Shuffle, Table, row};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace, lock};
use outcrop_geom::lattice::Lattice;
use outcrop_geom::{Point, hilbert};
use outcrop_points::{READ_BUFFERS, Spool};
use std::sync::Mutex;

/// Points of a unit, and of a bucket: at most 75 MB are in memory for a unit.
const GROUP: u64 = 1 << 20;

/// Most units that read, and most buckets: each of either has an entry of 40 bytes for each of the other.
pub const MOST_GROUPS: u64 = 1024;

/// Keys in the sample of a unit. Buckets differ in size by about a tenth.
const SAMPLES: usize = 256;

/// Bytes of memory for a point that is sent: its key, its row, the row packed twice.
const SENT: u64 = 68;

/// Bytes of memory for a point that is merged: its row, a copy, the position, and the packed row.
const MERGED: u64 = 60;

row! {
    /// A key on the curve, sent to a bucket.
    pub struct KeyTo {
        /// Number of the bucket.
        to: u32,
        /// The key.
        key: hilbert::Key,
    }
    packed Above Above Above Above
}

/// A part of the spool: frames, and their number of points.
type Group = (Vec<u32>, u64);

/// Divides the frames into groups of about `size` points.
fn groups(frames: Vec<(u32, u64)>, size: u64) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (frame, points) in frames {
        match groups
            .last_mut()
            .filter(|(_, before)| before + points <= size)
        {
            Some((frames, before)) => {
                frames.push(frame);
                *before += points;
            }
            None => groups.push((vec![frame], points)),
        }
    }
    groups
}

/// The keys at which `buckets` buckets of about equal size begin, without the first.
#[must_use]
pub fn cuts(mut samples: Vec<hilbert::Key>, buckets: usize) -> Vec<hilbert::Key> {
    samples.sort_unstable();
    let cut = |bucket: usize| samples.get(bucket * samples.len() / buckets).copied();
    let mut cuts: Vec<_> = (1..buckets).filter_map(cut).collect();
    cuts.dedup();
    cuts
}

/// The spool on the lattice, in groups.
pub struct Grouped<'a> {
    spool: &'a Spool,
    lattice: &'a Lattice,
    groups: Vec<Group>,
    workspace: &'a Workspace,
}

impl<'a> Grouped<'a> {
    /// Groups of about `size` points.
    #[must_use]
    pub fn new(
        spool: &'a Spool,
        lattice: &'a Lattice,
        size: u64,
        workspace: &'a Workspace,
    ) -> Self {
        Self {
            spool,
            lattice,
            groups: groups(spool.frames(), size),
            workspace,
        }
    }

    /// Number of groups.
    #[must_use]
    pub fn count(&self) -> usize {
        self.groups.len()
    }

    /// The frames of a group.
    #[must_use]
    pub fn frames(&self, group: usize) -> &[u32] {
        &self.groups[group].0
    }

    /// Reads a group; `each` takes some of its points at a time.
    fn read(&self, group: usize, each: impl FnMut(&[Point]) + Send) -> Result<()> {
        let each = Mutex::new(each);
        let frames = &self.groups[group].0;
        let take = |points: &[Point]| {
            (*lock(&each))(points);
            Ok(())
        };
        self.spool
            .par_for_frames(self.workspace, 1, self.lattice, frames, take)
    }

    /// Number of points of a group.
    #[must_use]
    pub fn points(&self, group: usize) -> u64 {
        self.groups[group].1
    }

    /// A sample of the keys of all points, taken in the step `name`.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`], [`Error::Memory`], [`Error::Cancelled`].
    pub fn samples(&self, name: &'static str) -> Result<Vec<hilbert::Key>> {
        let mut all = Vec::new();
        let work = |unit: &Unit<'_>| {
            let each = (self.points(unit.number()) as usize / SAMPLES).max(1);
            let (mut samples, mut seen) = (Vec::new(), 0);
            self.read(unit.number(), |points| {
                let first = (each - seen % each) % each;
                let some = points.iter().skip(first).step_by(each);
                samples.extend(some.map(|point| hilbert::encode(*point)));
                seen += points.len();
            })?;
            Ok(samples)
        };
        let bytes = |_| READ_BUFFERS + (64 << 10);
        let count = self.groups.len();
        self.workspace
            .units(name, count, bytes, work, |_, more: Vec<_>| {
                all.extend(more);
                Ok(())
            })?;
        Ok(all)
    }

    /// Sends the keys of all points to their buckets.
    fn send(&self, cuts: &[hilbert::Key], sent: &Shuffle<KeyTo>) -> Result<()> {
        let work = |unit: &Unit<'_>| {
            let group = unit.number();
            let mut rows = Vec::with_capacity(self.points(group) as usize);
            self.read(group, |points| {
                rows.extend(points.iter().map(|point| KeyTo {
                    to: 0,
                    key: hilbert::encode(*point),
                }));
            })?;
            let _held = unit.hold(bytes_of(&rows) + READ_BUFFERS);
            rows.sort_unstable_by_key(|row| row.key);
            rows.dedup();
            let mut bucket = 0;
            for row in &mut rows {
                while cuts.get(bucket).is_some_and(|cut| *cut <= row.key) {
                    bucket += 1;
                }
                row.to = bucket as u32;
            }
            unit.advance(self.points(group));
            sent.send(unit, group, rows)
        };
        let bytes = |group: usize| READ_BUFFERS + self.points(group) * SENT;
        let (name, count) = ("order: send", self.groups.len());
        self.workspace
            .units(name, count, bytes, work, |_, ()| Ok(()))
    }
}

/// The points of all buckets: in sections 2 b the first of bucket b, in 2 b + 1 the others.
struct Buckets {
    points: Table<Position>,
    /// Number of points before each bucket, and of all.
    starts: Vec<usize>,
    /// Most points of a first section.
    head: usize,
}

impl Buckets {
    /// Merges the keys that were sent.
    fn merge(
        sent: &Shuffle<KeyTo>,
        count: usize,
        head: usize,
        workspace: &Workspace,
    ) -> Result<Self> {
        let inbox = sent.open(workspace, count)?.unique();
        let points = Table::new("order.merged", 2 * count);
        let work = |unit: &Unit<'_>| {
            let bucket = unit.number();
            let rows = inbox.get(unit, bucket)?;
            let point = |row: &KeyTo| Position {
                point: CurveKey { key: row.key }.point(),
            };
            let all: Vec<Position> = rows.iter().map(point).collect();
            let _held = unit.hold(bytes_of(&rows) + bytes_of(&all));
            let (first, rest) = all.split_at(head.min(all.len()));
            points.put(unit, 2 * bucket, first)?;
            points.put(unit, 2 * bucket + 1, rest)?;
            Ok(all.len())
        };
        let bytes = |bucket: usize| inbox.rows(bucket) as u64 * MERGED + (1 << 20);
        let mut sizes = vec![0; count];
        workspace.units("order: merge", count, bytes, work, |bucket, size| {
            sizes[bucket] = size;
            Ok(())
        })?;
        let mut starts = vec![0];
        for size in sizes {
            starts.push(starts[starts.len() - 1] + size);
        }
        Ok(Self {
            points,
            starts,
            head,
        })
    }

    fn len(&self) -> usize {
        self.starts[self.starts.len() - 1]
    }

    /// Writes the pages of all buckets. A bucket writes the groups of pages that begin in it, with the first
    /// points of the buckets after it.
    fn write(&self, page: usize, workspace: &Workspace) -> Result<StoredPoints> {
        let store = Rewriter::new("points", self.len(), page, workspace)?;
        let count = self.starts.len() - 1;
        let end = |bucket: usize| {
            self.starts[bucket]
                .next_multiple_of(self.head)
                .min(self.len())
        };
        let work = |unit: &Unit<'_>| {
            let bucket = unit.number();
            let (from, to) = (end(bucket), end(bucket + 1));
            if from >= to {
                return Ok(());
            }
            let mut points: Vec<Point> = Vec::new();
            let mut sections = 2 * bucket..2 * count;
            let mut at = self.starts[bucket];
            while at < to
                && let Some(section) = sections.next()
            {
                let rows = self.points.get(unit, section)?;
                let skipped = from.saturating_sub(at).min(rows.len());
                let wanted = (to - at).min(rows.len());
                at += rows.len();
                let rows = rows.get(skipped..wanted).unwrap_or_default();
                points.extend(rows.iter().map(|row| row.point));
            }
            let _held = unit.hold(bytes_of(&points));
            store.put(unit, from, &points)
        };
        let size = |bucket: usize| (self.starts[bucket + 1] - self.starts[bucket]) as u64;
        let bytes = |bucket: usize| (size(bucket) + self.head as u64) * 40 + (1 << 20);
        workspace.units("order: pages", count, bytes, work, |_, ()| Ok(()))?;
        store.finish(workspace)
    }
}

/// Sorts all points of a spool as [`super::order`] does, in units for tasks. The spool always comes back.
///
/// # Errors
/// [`Error::Io`], [`Error::Corrupt`], [`Error::TooManyPoints`], [`Error::Memory`], [`Error::Cancelled`].
pub fn sample_sort(
    spool: Spool,
    lattice: &Lattice,
    page: usize,
    workspace: &Workspace,
) -> Result<(StoredPoints, u64, Option<Spool>)> {
    let size = GROUP.max(spool.points() / MOST_GROUPS);
    let (store, duplicates) = sort_in_groups(&spool, lattice, page, size, workspace)?;
    Ok((store, duplicates, Some(spool)))
}

fn sort_in_groups(
    spool: &Spool,
    lattice: &Lattice,
    page: usize,
    size: u64,
    workspace: &Workspace,
) -> Result<(StoredPoints, u64)> {
    let source = Grouped::new(spool, lattice, size, workspace);
    let buckets = source.groups.len().max(1);
    let cuts = cuts(source.samples("order: samples")?, buckets);
    let sent = Shuffle::new("order.sent");
    source.send(&cuts, &sent)?;
    let page = page.max(1);
    let merged = Buckets::merge(&sent, cuts.len() + 1, STEP * page, workspace)?;
    sent.release(workspace)?;
    let (found, limit) = (merged.len() as u64, Id::MOST);
    if found > limit {
        return Err(Error::TooManyPoints { found, limit });
    }
    let store = merged.write(page, workspace)?;
    merged.points.release(workspace)?;
    Ok((store, spool.points() - found))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::order::order;
    use outcrop_formats::ingest;
    use std::fmt::Write;

    /// Both sorts of a cloud in text, with pages of `page` points.
    fn both(text: &str, page: usize, size: u64) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cloud.xyz");
        std::fs::write(&path, text).unwrap();
        let workspace = Workspace::for_tests(3).expect("a scratch folder");
        let spool = ingest(&[path], &workspace).unwrap();
        let lattice = spool.choose_lattice(0).unwrap();
        let sampled = sort_in_groups(&spool, &lattice, page, size, &workspace).unwrap();
        let read = |stored: &StoredPoints| {
            let store = stored.open(&workspace).unwrap();
            (store.slice(0..store.len()).unwrap(), stored.bounds())
        };
        let found = read(&sampled.0);
        sampled.0.release(&workspace).unwrap();
        let expected = order(spool, &lattice, page, &workspace).unwrap();
        assert_eq!(sampled.1, expected.1);
        assert!(found == read(&expected.0));
    }

    #[test]
    fn it_is_the_order_of_one_process() {
        let mut random = oorandom::Rand32::new(7);
        let mut text = String::new();
        for _ in 0..30_000 {
            // Some points are there twice, and some places are full.
            let [x, y, z] = [900, 40, 3].map(|most| random.rand_range(0..most));
            writeln!(text, "{x} {y} {z}").unwrap();
        }
        for (page, size) in [(16, 1000), (16, 10), (256, 5000), (3, 100_000), (64, 300)] {
            both(&text, page, size);
        }
        both("1 2 3\n", 16, 10);
        both(&"4 5 6\n".repeat(5000), 16, 100);
    }

    #[test]
    fn buckets_are_cut_at_samples() {
        let key = |n: u32| [0, 0, n];
        let samples = (0..100).rev().map(key).collect();
        assert_eq!(cuts(samples, 4), [key(25), key(50), key(75)]);
        assert_eq!(cuts(vec![key(3); 9], 4), [key(3)]);
        assert!(cuts(Vec::new(), 4).is_empty());
    }

    #[test]
    fn groups_have_all_frames() {
        let frames = (0..10).map(|n| (n, 4)).collect();
        let groups = groups(frames, 10);
        assert_eq!(groups.len(), 5);
        assert!(groups.iter().all(|(_, points)| *points == 8));
    }
}
