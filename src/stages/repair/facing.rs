//! Which components stay, and which way they face.
//!
//! Sums over a component are exact integers, so they do not depend on the order of triangles.

use super::RepairStats;
use crate::error::Result;
use crate::geom::Point;
use crate::spill::Sections;
use crate::spill::layouts::ORIENTED;
use crate::stages::blocks::Blocks;
use crate::stages::order::PointStore;
use crate::stages::surface::orient::Oriented;
use crate::stages::surface::star::{EDGES, Star, Triangle, has, sorted};
use crate::workspace::Workspace;
use rustc_hash::FxHashMap;
use std::sync::Mutex;

/// Exact sums over triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Sums {
    triangles: u64,
    /// Edges with one triangle.
    boundary: u64,
    /// Six times the signed volume against the lattice's origin.
    volume6: i128,
    /// Twice the vector area.
    area_vector: [i128; 3],
    /// Twice the area, each triangle's rounded down.
    area: u128,
    /// Sum of the positions of all corners.
    corners: [i128; 3],
    /// The smallest triangle, and whether it is turned.
    first: Option<(Triangle, bool)>,
}

impl Sums {
    fn add(&mut self, t: Triangle, at: impl Fn(u32) -> Point, flip: bool, boundary: u64) {
        let [a, b, c] = t.map(at);
        self.see(t, flip);
        let sign = if flip { -1 } else { 1 };
        let n = crate::stages::stitch::normal(a, b, c);
        self.triangles += 1;
        self.boundary += boundary;
        let length2 = n.iter().map(|x| (*x as f64) * (*x as f64)).sum::<f64>();
        self.area += length2.sqrt() as u128;
        for axis in 0..3 {
            self.volume6 += sign * n[axis] * i128::from(a[axis]);
            self.area_vector[axis] += sign * n[axis];
            self.corners[axis] += i128::from(a[axis]) + i128::from(b[axis]) + i128::from(c[axis]);
        }
    }

    fn see(&mut self, t: Triangle, flip: bool) {
        if self.first.is_none_or(|(first, _)| t < first) {
            self.first = Some((t, flip));
        }
    }

    fn merge(&mut self, other: &Sums, flip: bool) {
        let sign = if flip { -1 } else { 1 };
        if let Some((t, turned)) = other.first {
            self.see(t, turned ^ flip);
        }
        self.triangles += other.triangles;
        self.boundary += other.boundary;
        self.volume6 += sign * other.volume6;
        self.area += other.area;
        for axis in 0..3 {
            self.area_vector[axis] += sign * other.area_vector[axis];
            self.corners[axis] += other.corners[axis];
        }
    }

    /// True if the component must be turned round; where nothing else decides, its smallest triangle
    /// runs in ascending order.
    fn faces_wrong_way(&self) -> bool {
        let wrong = if self.boundary == 0 {
            sign(self.volume6)
        } else {
            let v = self.area_vector.map(|x| x as f64);
            let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
            if 4.0 * length >= self.area as f64 {
                let [x, y, z] = self.area_vector;
                [z, y, x].into_iter().find_map(sign)
            } else {
                sign(self.volume_about_centroid())
            }
        };
        wrong.unwrap_or_else(|| self.first.is_some_and(|(_, turned)| turned))
    }

    /// Six times the volume against the mean corner, times the number of corners.
    fn volume_about_centroid(&self) -> i128 {
        let corners = 3 * i128::from(self.triangles);
        let exact = || {
            let mut sum = corners.checked_mul(self.volume6)?;
            for axis in 0..3 {
                let part = self.corners[axis].checked_mul(self.area_vector[axis])?;
                sum = sum.checked_sub(part)?;
            }
            Some(sum)
        };
        exact().unwrap_or_else(|| {
            let parts: f64 = (0..3)
                .map(|k| self.corners[k] as f64 * self.area_vector[k] as f64)
                .sum();
            // The conversion saturates, which keeps the sign.
            (corners as f64 * self.volume6 as f64 - parts) as i128
        })
    }
}

/// Whether a number is negative; `None` for zero.
fn sign(x: i128) -> Option<bool> {
    (x != 0).then_some(x < 0)
}

/// What becomes of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Fate {
    keep: bool,
    turn: bool,
}

impl Fate {
    fn word(self) -> u32 {
        u32::from(self.keep) << 1 | u32::from(self.turn)
    }
}

#[derive(Default)]
struct Tally {
    global: FxHashMap<u32, Sums>,
    found: u64,
    removed: u64,
    removed_triangles: u64,
}

impl Tally {
    fn judge(&mut self, sums: &Sums, least: u64) -> Fate {
        let keep = sums.triangles >= least;
        self.found += 1;
        if !keep {
            self.removed += 1;
            self.removed_triangles += sums.triangles;
        }
        Fate {
            keep,
            turn: sums.faces_wrong_way(),
        }
    }
}

fn block_bytes(surface: &Oriented, blocks: Blocks, block: usize) -> u64 {
    let records = surface.interior.records(block) + surface.crossing.records(block);
    150 * records as u64 + blocks.ids(block).len() as u64 * 40 + (1 << 20)
}

/// All triangles that touch each block, as they run, `[i, a, b, component]`, small components left
/// out. Component numbers can be compared within a block.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn face(
    store: &PointStore,
    surface: &Oriented,
    least: u64,
    blocks: Blocks,
    stats: &mut RepairStats,
    workspace: &Workspace,
) -> Result<Sections<4>> {
    let fates = Sections::<1>::create(workspace, "repair.fates", blocks.count())?;
    let tally = Mutex::new(Tally::default());
    let bytes = |block| block_bytes(surface, blocks, block);
    workspace.for_each_unit("repair: block", blocks.count(), bytes, |block| {
        let sums = sum_block(store, surface, blocks, block)?;
        let mut tally = tally
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        for (root, (flip, sums)) in sums.global {
            tally.global.entry(root).or_default().merge(&sums, flip);
        }
        let local: Vec<[u32; 1]> = sums
            .local
            .iter()
            .map(|s| [tally.judge(s, least).word()])
            .collect();
        drop(tally);
        fates.put(block, &local)?;
        workspace.observer.advance(1);
        Ok(())
    })?;
    let mut tally = tally
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let global = std::mem::take(&mut tally.global);
    let _held = workspace.reserve("components", global.len() as u64 * 200)?;
    let global: FxHashMap<u32, Fate> = global
        .iter()
        .map(|(root, sums)| (*root, tally.judge(sums, least)))
        .collect();
    stats.components_found = tally.found;
    stats.components_removed = tally.removed;
    stats.component_triangles_removed = tally.removed_triangles;
    let around = Sections::with_layout(workspace, "repair.faced", blocks.count(), ORIENTED)?;
    workspace.for_each_unit("repair: block", blocks.count(), bytes, |block| {
        let local = fates.get(block)?;
        around.put(block, &apply(surface, block, &local, &global)?)
    })?;
    Ok(around)
}

/// Sums of a block's labels, those of global ones relative to their root.
struct BlockSums {
    local: Vec<Sums>,
    global: Vec<(u32, (bool, Sums))>,
}

fn sum_block(
    store: &PointStore,
    surface: &Oriented,
    blocks: Blocks,
    block: usize,
) -> Result<BlockSums> {
    let ids = blocks.ids(block);
    let interior = surface.interior.get(block)?;
    let crossing = surface.crossing.get(block)?;
    let mine = |r: &&[u32; 5]| blocks.of(r[1]) == block as u32;
    let triangles: Vec<Triangle> = interior
        .iter()
        .map(|r| [r[0], r[1], r[2]])
        .chain(crossing.iter().map(|r| [r[1], r[2], r[3]]))
        .collect();
    let star = Star::of(ids.clone(), &triangles);
    let own = store.slice(ids.start as usize..ids.end as usize)?;
    let mut foreign: Vec<u32> = crossing
        .iter()
        .flat_map(|r| [r[1], r[2], r[3]])
        .filter(|v| !ids.contains(v))
        .collect();
    foreign.sort_unstable();
    foreign.dedup();
    let mut points = Vec::with_capacity(foreign.len());
    store.fetch(&foreign, &mut points)?;
    let at = |v: u32| {
        if ids.contains(&v) {
            own[(v - ids.start) as usize]
        } else {
            // Every foreign vertex was fetched.
            points[foreign.partition_point(|f| *f < v)]
        }
    };
    // An edge counts where its lower vertex is.
    let boundary = |t: Triangle| {
        let single = |low: u32, high: u32| {
            ids.contains(&low)
                && star
                    .at(low)
                    .iter()
                    .filter(|n| has(triangles[**n as usize], high))
                    .count()
                    == 1
        };
        EDGES
            .iter()
            .filter(|(a, b, ..)| single(t[*a], t[*b]))
            .count() as u64
    };
    let globals = surface.globals[block].1;
    let mut sums = vec![Sums::default(); surface.labels[block] as usize];
    for r in &interior {
        let t = [r[0], r[1], r[2]];
        sums[(r[3] >> 1) as usize].add(t, at, r[3] & 1 == 1, boundary(t));
    }
    let mut global: FxHashMap<u32, Sums> = FxHashMap::default();
    for r in &crossing {
        let t = [r[1], r[2], r[3]];
        let (root, turned) = surface.sets.look(r[4] >> 1);
        let entry = global.entry(root).or_default();
        if mine(&r) {
            entry.add(t, at, turned ^ (r[4] & 1 == 1), boundary(t));
        } else {
            entry.boundary += boundary(t);
        }
    }
    let mut all: Vec<(u32, (bool, Sums))> = global
        .into_iter()
        .map(|(root, sums)| (root, (false, sums)))
        .collect();
    for label in 0..globals {
        let (root, turned) = surface.sets.look(surface.globals[block].0 + label);
        all.push((root, (turned, sums[label as usize])));
    }
    Ok(BlockSums {
        local: sums.split_off(globals as usize),
        global: all,
    })
}

fn apply(
    surface: &Oriented,
    block: usize,
    local: &[[u32; 1]],
    global: &FxHashMap<u32, Fate>,
) -> Result<Vec<[u32; 4]>> {
    let (first, globals) = surface.globals[block];
    let fate = |label: u32| -> (Fate, bool, u32) {
        let (root, turned) = surface.sets.look(label);
        let fate = global.get(&root).copied().unwrap_or(Fate {
            keep: false,
            turn: false,
        });
        (fate, turned, root << 1 | 1)
    };
    let mut out = Vec::new();
    let mut put = |t: Triangle, fate: Fate, flip: bool, component: u32| {
        if fate.keep {
            let turned = flip ^ fate.turn;
            let [a, b] = if turned { [t[2], t[1]] } else { [t[1], t[2]] };
            out.push([t[0], a, b, component]);
        }
    };
    for r in surface.crossing.get(block)? {
        let (fate, turned, component) = fate(r[4] >> 1);
        put(
            [r[1], r[2], r[3]],
            fate,
            turned ^ (r[4] & 1 == 1),
            component,
        );
    }
    for r in surface.interior.get(block)? {
        let label = r[3] >> 1;
        let (fate, turned, component) = if label < globals {
            fate(first + label)
        } else {
            let word = local[(label - globals) as usize][0];
            (
                Fate {
                    keep: word & 2 != 0,
                    turn: word & 1 != 0,
                },
                false,
                label << 1,
            )
        };
        put(
            [r[0], r[1], r[2]],
            fate,
            turned ^ (r[3] & 1 == 1),
            component,
        );
    }
    out.sort_unstable_by_key(|&[i, a, b, _]| sorted([i, a, b]));
    Ok(out)
}
