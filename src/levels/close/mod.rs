//! A closed mesh: every boundary loop of a mesh of any size closed by triangles, in bounded memory.
//!
//! The boundary (`rim`) is linked to loops (`loops`); with the triangles around them (`near`) they are closed batch by
//! batch (`patches`): without new vertices (`lid`, `ears`), by a thin plate (`membrane`: `refine`, `fair`), or by walls
//! and a floor (`base`). Patches that cross the mesh (`crossings`) are made again as lids. Nothing depends on
//! memory or threads, so neither does the mesh.

mod base;
mod crossings;
mod ears;
mod fair;
mod lid;
mod loops;
mod membrane;
mod near;
mod patches;
mod refine;
mod rim;
mod rows;

use crate::source::Source;
use base::Base;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use patches::{Closing, Patches, Shape, Wish};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// How loops are closed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Smoothly where the surface runs on into the loop, else by lids.
    #[default]
    Auto,
    /// By lids, without new vertices.
    Lids,
    /// Smoothly.
    Smooth,
    /// Outer rims by walls down to a floor at this height, or below the lowest vertex; others as with `Auto`.
    Base(Option<f64>),
}

/// The way in which a loop is closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// A thin plate that runs on from the rim.
    Smooth,
    /// Triangles between the vertices of the loop.
    Lid,
    /// Walls and a floor.
    Base,
}

/// Loops that are closed in one way.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Closed {
    /// Number of loops.
    pub loops: u64,
    /// Their edges.
    pub edges: u64,
    /// New triangles.
    pub triangles: u64,
    /// Area of the new triangles, in the square of the unit of the mesh.
    pub area: f64,
}

/// Counts of the loops that were closed, by the way in which they were.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ClosingStats {
    /// Loops closed smoothly.
    pub smooth: Closed,
    /// Loops closed by lids.
    pub lids: Closed,
    /// Loops closed by walls and a floor.
    pub base: Closed,
    /// Height of the floor, if there is one.
    pub floor: Option<f64>,
    /// New vertices.
    pub vertices: u64,
    /// Edges of the longest loop.
    pub longest: u64,
    /// Loops whose smooth patch crossed the mesh or another patch and that got a lid.
    pub flattened: u64,
    /// Loops that were to be closed smoothly and are too long for it.
    pub too_long: u64,
    /// Loops whose patch crosses the mesh, another patch or itself.
    pub crossing: u64,
    /// Triangles that such patches cross.
    pub crossed_triangles: u64,
    /// Triangles of floors that overlap others, because the rim crosses itself seen from above.
    pub overlaps: u64,
    /// Vertices at which several loops meet.
    pub pinched: u64,
    /// Edges with several triangles that run along them the same way: there the mesh cannot become a manifold.
    pub crowded: u64,
}

impl ClosingStats {
    /// All loops.
    #[must_use]
    pub fn all(&self) -> Closed {
        [self.smooth, self.lids, self.base]
            .iter()
            .fold(Closed::default(), |a, b| Closed {
                loops: a.loops + b.loops,
                edges: a.edges + b.edges,
                triangles: a.triangles + b.triangles,
                area: a.area + b.area,
            })
    }
}

/// The triangles that close a mesh; they lie in the scratch folder.
#[derive(Debug)]
pub struct Closure {
    /// Counts of its loops and triangles.
    pub stats: ClosingStats,
    /// Vertices and triangles of the mesh.
    pub before: [u64; 2],
    tries: Vec<Patches>,
    /// Loops of a later try than the first, with its number.
    chosen: BTreeMap<u32, usize>,
    batches: usize,
}

/// Closes a mesh.
///
/// # Errors
/// [`outcrop_disk::error::Error::Input`] for a file that is no mesh;
/// [`outcrop_disk::error::Error::Parameter`] for a floor that is not below the mesh; errors of memory and files.
pub fn close(path: &Path, kind: Kind, workspace: &Workspace) -> Result<Closure> {
    let source = Source::open(path, workspace)?;
    let before = [source.vertices, source.triangles];
    let rim = rim::find(&source, workspace)?;
    let crowded = rim.crowded;
    let loops = loops::link(&rim, workspace)?;
    workspace.trim();
    let near = near::find(&source, &loops, workspace)?;
    let base = base::plan(&source, &near, kind, workspace)?;
    let wish = Wish {
        number: 0,
        shape: Shape::Wanted(kind),
        base: &base,
        only: None,
    };
    let (first, closings) = patches::close(&near, &wish, workspace)?;
    let mut made = Tried {
        source: &source,
        tries: vec![first],
        closings: closings.into_iter().collect(),
        chosen: BTreeMap::new(),
        crossing: BTreeMap::new(),
        flattened: 0,
    };
    workspace.trim();
    made.test(workspace)?;
    made.again(&near, (&base, Shape::Lid), workspace)?;
    made.again(&near, (&base, Shape::Taut), workspace)?;
    let stats = ClosingStats {
        pinched: loops.pinched,
        crowded,
        floor: (!base.loops.is_empty()).then_some(base.z),
        ..made.stats()
    };
    let mut closure = Closure {
        stats,
        before,
        tries: made.tries,
        chosen: made.chosen,
        batches: loops.batches.len(),
    };
    closure.stats.vertices = closure.count(workspace)?;
    Ok(closure)
}

/// Patches that are tested.
struct Tried<'a> {
    source: &'a Source,
    tries: Vec<Patches>,
    closings: BTreeMap<u32, Closing>,
    chosen: BTreeMap<u32, usize>,
    /// Loops whose patch crosses something, with the number of triangles.
    crossing: BTreeMap<u32, u64>,
    /// Loops that got a lid instead of a smooth patch.
    flattened: u64,
}

impl Tried<'_> {
    /// Tests the first patches.
    fn test(&mut self, workspace: &Workspace) -> Result<()> {
        let tries: Vec<&Patches> = self.tries.iter().collect();
        self.crossing = crossings::find(self.source, 0, &tries, |_, _| true, |_| true, workspace)?;
        Ok(())
    }

    /// Makes patches that cross something again: smooth ones as lids, or lids with the least area. Those that cross
    /// less are taken.
    fn again(
        &mut self,
        near: &near::Near<'_>,
        (base, shape): (&Base, Shape),
        workspace: &Workspace,
    ) -> Result<()> {
        let was = match shape {
            Shape::Taut => Way::Lid,
            _ => Way::Smooth,
        };
        let is_it = |number: &u32| self.closings[number].way == was;
        let wrong: Vec<u32> = self.crossing.keys().copied().filter(is_it).collect();
        if wrong.is_empty() {
            return Ok(());
        }
        let wish = Wish {
            number: self.tries.len() as u32,
            shape,
            base,
            only: Some(&wrong),
        };
        let (patches, closings) = patches::close(near, &wish, workspace)?;
        let wrong: Vec<u32> = closings.iter().map(|closing| closing.0).collect();
        self.tries.push(patches);
        let tries: Vec<&Patches> = self.tries.iter().collect();
        let again = |number: u32| wrong.binary_search(&number).is_ok();
        let last = tries.len() - 1;
        let chosen = |number: u32, n: usize| match again(number) {
            true => n == last,
            false => n == self.chosen.get(&number).copied().unwrap_or(0),
        };
        let step = wish.number;
        let found = crossings::find(self.source, step, &tries, chosen, again, workspace)?;
        for (number, closing) in closings {
            let (was, is) = (self.crossing[&number], found.get(&number).copied());
            if is.unwrap_or(0) >= was {
                continue;
            }
            self.flattened += u64::from(shape == Shape::Lid);
            self.chosen.insert(number, last);
            self.closings.insert(number, closing);
            self.crossing.remove(&number);
            if let Some(is) = is {
                self.crossing.insert(number, is);
            }
        }
        Ok(())
    }

    fn stats(&self) -> ClosingStats {
        let mut stats = ClosingStats {
            flattened: self.flattened,
            crossing: self.crossing.len() as u64,
            crossed_triangles: self.crossing.values().sum(),
            ..ClosingStats::default()
        };
        for closing in self.closings.values() {
            let sum = match closing.way {
                Way::Smooth => &mut stats.smooth,
                Way::Lid => &mut stats.lids,
                Way::Base => &mut stats.base,
            };
            sum.loops += 1;
            sum.edges += closing.edges;
            sum.triangles += closing.triangles;
            sum.area += closing.area;
            stats.longest = stats.longest.max(closing.edges);
            stats.too_long += u64::from(closing.is_too_long);
            stats.overlaps += closing.overlaps;
        }
        stats
    }
}

/// The vertices and triangles that close a batch of loops. Numbers of vertices are those of the closed mesh.
#[derive(Debug, Default)]
pub struct Part {
    /// Positions of new vertices.
    pub positions: Vec<[f64; 3]>,
    /// For each of them, the vertices of the closed mesh whose values it has the mean of.
    pub parents: Vec<[u32; 3]>,
    /// New triangles.
    pub triangles: Vec<[u32; 3]>,
}

impl Closure {
    /// Number of parts.
    #[must_use]
    pub fn parts(&self) -> usize {
        self.batches
    }

    /// The new vertices and triangles of a part, of which the first new vertex has this number.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn part(&self, number: usize, first: u64, workspace: &Workspace) -> Result<Part> {
        let unit = workspace.unit();
        let mut part = Part::default();
        for (n, patches) in self.tries.iter().enumerate() {
            let all = patches.vertices.get(&unit, number)?;
            let mut triangles = patches.triangles.get(&unit, number)?;
            triangles.retain(|row| self.chosen.get(&row.number).copied().unwrap_or(0) == n);
            // Vertices of patches that were not taken are left out.
            let mut numbers = vec![u32::MAX; all.len()];
            for row in &triangles {
                for k in (0..3).filter(|k| row.mask >> k & 1 == 1) {
                    numbers[row.corners[k] as usize] = 0;
                }
            }
            for (row, number) in all.iter().zip(&mut numbers).filter(|(_, n)| **n == 0) {
                *number = first as u32 + part.positions.len() as u32;
                part.positions.push(row.position);
            }
            let named = |mask: u32, corners: [u32; 3]| {
                [0, 1, 2].map(|k| match mask >> k & 1 {
                    0 => corners[k],
                    _ => numbers[corners[k] as usize],
                })
            };
            let used = all.iter().zip(&numbers).filter(|(_, n)| **n != u32::MAX);
            part.parents
                .extend(used.map(|(row, _)| named(row.mask, row.parents)));
            let rows = triangles.iter();
            part.triangles
                .extend(rows.map(|row| named(row.mask, row.corners)));
        }
        Ok(part)
    }

    fn count(&self, workspace: &Workspace) -> Result<u64> {
        let mut all = 0;
        for number in 0..self.batches {
            all += self.part(number, 0, workspace)?.positions.len() as u64;
        }
        Ok(all)
    }

    /// Bytes of memory for a part.
    #[must_use]
    pub fn bytes(&self, number: usize, workspace: &Workspace) -> u64 {
        let rows = |patches: &Patches| {
            let vertices = patches.vertices.expected_rows(workspace, number) as u64;
            let triangles = patches.triangles.expected_rows(workspace, number) as u64;
            100 * vertices + 64 * triangles
        };
        self.tries.iter().map(rows).sum::<u64>() + (1 << 16)
    }
}
