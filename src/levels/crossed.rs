//! How many triangles of a mesh cross another one of it: of all, or of a sample.
//!
//! A tree over the boxes of the sample is asked for every triangle of the mesh. So the mesh is read twice, whatever
//! its size, and only the sample is in memory.

use crate::meet::{Corners, bounds, cross_each_other};
use crate::source::{RANGE, READER, Source};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_geom::boxes::BoxTree;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Mutex;

/// Most triangles that are tested. The error of a share (one standard deviation) is then 0.1 % of the triangles at
/// most, and 0.006 % where 0.1 % of them cross.
const MOST: u64 = 1 << 18;

/// Bytes of memory for each of them, while the tree is built.
const EACH: u64 = 2 * size_of::<Corners>() as u64 + BoxTree::<f64>::BYTES;

/// Triangles of a mesh that cross others of it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crossed {
    /// Triangles that were tested against all of the mesh.
    pub tested: u64,
    /// Those of them that cross another one. Triangles that only touch do not cross.
    pub crossing: u64,
}

impl Crossed {
    /// The share of the triangles that cross another one, from 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.crossing as f64 / self.tested.max(1) as f64
    }
}

/// One triangle in each of as many equal parts of the mesh, at a place that looks random.
struct Sample {
    tested: u64,
    all: u64,
}

impl Sample {
    fn begin(&self, part: u64) -> u64 {
        (u128::from(part) * u128::from(self.all) / u128::from(self.tested.max(1))) as u64
    }

    /// The triangle of a part.
    fn of(&self, part: u64) -> u64 {
        let begin = self.begin(part);
        begin + mixed(part) % (self.begin(part + 1) - begin).max(1)
    }

    /// Those among the triangles from `first` up to `end`, ascending.
    fn between(&self, first: u64, end: u64) -> impl Iterator<Item = u64> {
        let part = u128::from(first) * u128::from(self.tested) / u128::from(self.all.max(1));
        let parts = part as u64..self.tested;
        let at = parts.map(|part| self.of(part));
        at.skip_while(move |at| *at < first)
            .take_while(move |at| *at < end)
    }
}

/// A number that looks random (the finish of SplitMix64).
fn mixed(number: u64) -> u64 {
    let x = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Tests at most `most` triangles of a mesh, and never more than 262 144. `name` is that of the step.
///
/// # Errors
/// [`outcrop_disk::error::Error::Input`] for a file that is no mesh; [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn count(path: &Path, name: &str, most: u64, workspace: &Workspace) -> Result<Crossed> {
    workspace.once(name, |_| {
        let source = Source::open(path, workspace)?;
        let sample = Sample {
            tested: source.triangles.min(most).min(MOST),
            all: source.triangles,
        };
        let _held = workspace.reserve("crossings: sample", sample.tested * EACH + (1 << 20))?;
        let triangles = read(&source, &sample, workspace)?;
        Ok(Crossed {
            tested: sample.tested,
            crossing: find(&source, name, &triangles, workspace)?,
        })
    })
}

/// The triangles of the sample, in their order.
fn read(source: &Source, sample: &Sample, workspace: &Workspace) -> Result<Vec<Corners>> {
    let all = Mutex::new(Vec::with_capacity(sample.tested as usize));
    let bytes = |_| READER + RANGE.min(sample.tested) * EACH / 2;
    let (name, ranges) = ("crossings: reading", source.ranges());
    workspace.for_each_unit(name, ranges, bytes, |unit| {
        let mut at = unit.number() as u64 * RANGE;
        let mut wanted = sample.between(at, at + RANGE).peekable();
        let mut own = Vec::new();
        source.read(unit, |triangles, positions| {
            let end = at + triangles.len() as u64;
            while let Some(next) = wanted.next_if(|next| *next < end) {
                own.push((next, positions.corners(triangles[(next - at) as usize])?));
            }
            at = end;
            Ok(())
        })?;
        let mut all = all.lock().unwrap_or_else(|e| e.into_inner());
        all.append(&mut own);
        Ok(())
    })?;
    let mut all = all.into_inner().unwrap_or_else(|e| e.into_inner());
    all.sort_unstable_by_key(|(number, _)| *number);
    Ok(all.into_iter().map(|(_, corners)| corners).collect())
}

/// How many triangles of the sample cross one of the mesh.
fn find(source: &Source, name: &str, sample: &[Corners], workspace: &Workspace) -> Result<u64> {
    let tree = BoxTree::of(sample.iter().map(bounds));
    let observer = &workspace.observer;
    observer.begin("find crossings", "triangles", source.triangles);
    let mut crossing = BTreeSet::new();
    workspace.units(
        (format!("{name} of ranges"), "crossings: ranges"),
        source.ranges(),
        |_| READER + 4 * sample.len() as u64,
        |unit| {
            let mut found = BTreeSet::new();
            source.read(unit, |triangles, positions| {
                for corners in triangles {
                    let t = positions.corners(*corners)?;
                    let near = tree.meeting(bounds(&t));
                    found.extend(near.filter(|k| cross_each_other(&sample[*k], &t)));
                }
                Ok(())
            })?;
            Ok(found)
        },
        |_, found: BTreeSet<usize>| {
            crossing.extend(found);
            Ok(())
        },
    )?;
    observer.end();
    Ok(crossing.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_ranges_are_that_of_the_whole() {
        for (tested, all) in [(0, 0), (1, 1), (5, 5), (7, 100), (99, 100), (3, 1 << 40)] {
            let sample = Sample { tested, all };
            let whole: Vec<u64> = (0..tested).map(|part| sample.of(part)).collect();
            assert!(whole.is_sorted_by(|a, b| a < b) && whole.iter().all(|at| *at < all));
            let step = (all / 7).max(1);
            let ranges = (0..all).step_by(step as usize);
            let parts: Vec<u64> = ranges
                .flat_map(|first| sample.between(first, first + step))
                .collect();
            assert_eq!(parts, whole, "{tested} of {all}");
        }
    }
}
