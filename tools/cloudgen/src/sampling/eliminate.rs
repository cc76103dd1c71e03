//! Sample elimination: from many candidates the most crowded one is removed, repeatedly, until the wanted
//! number remains (Yuksel, *Sample elimination for generating Poisson disk sample sets*, Computer Graphics
//! Forum 34, 2015).

use std::collections::BinaryHeap;

use super::grid::Grid;
use crate::surface::Sample;
use crate::vec3::{dot, length, sub};

/// Points whose normals differ by more than 120 degrees are on two sides of a thin part.
const OTHER_SIDE: f64 = -0.5;

/// A candidate is removed if its crowding is nearly the largest: the difference is invisible, and saves most
/// of the sorting.
const NEARLY: f64 = 0.98;

/// Indices of the remaining candidates. Each candidate comes with its density, in `(0, 1]`; `area` is that of
/// the surface, weighted with the density.
pub(super) fn eliminate(candidates: &[(Sample, f64)], wanted: usize, area: f64) -> Vec<bool> {
    let mut keep = vec![true; candidates.len()];
    if candidates.len() <= wanted {
        return keep;
    }
    let crowd = Crowd::new(candidates, wanted, area);
    let mut crowding: Vec<f64> = (0..candidates.len())
        .map(|i| {
            let mut sum = 0.0;
            crowd.around(i, |_, weight| sum += weight);
            sum
        })
        .collect();
    // Values are not negative, so their bits have the same order. An outdated entry is too large, since
    // crowding only falls: it is put back when it comes up.
    let entry = |crowding: f64, i: usize| (crowding.max(0.0).to_bits(), i);
    let mut heap: BinaryHeap<_> = (0..candidates.len())
        .map(|i| entry(crowding[i], i))
        .collect();
    let mut left = candidates.len();
    while left > wanted {
        let Some((_, i)) = heap.pop() else { break };
        let next = heap.peek().map_or(0.0, |&(bits, _)| f64::from_bits(bits));
        if crowding[i].max(0.0) < NEARLY * next {
            heap.push(entry(crowding[i], i));
            continue;
        }
        keep[i] = false;
        left -= 1;
        crowd.around(i, |j, weight| {
            if keep[j] {
                crowding[j] -= weight;
            }
        });
    }
    keep
}

/// The candidates and their crowding.
struct Crowd<'a> {
    candidates: &'a [(Sample, f64)],
    /// One grid for each doubling of the reach; a candidate is in one of them.
    grids: Vec<Grid>,
    /// Distance beyond which two candidates of density 1 do not affect each other.
    reach: f64,
    /// Smaller distances count like this one.
    close: f64,
}

impl<'a> Crowd<'a> {
    fn new(candidates: &'a [(Sample, f64)], wanted: usize, area: f64) -> Self {
        // Radius of equal disks in the densest packing.
        let radius = (area / (2.0 * 3f64.sqrt() * wanted.max(1) as f64)).sqrt();
        let share = wanted as f64 / candidates.len() as f64;
        let mut crowd = Crowd {
            candidates,
            grids: Vec::new(),
            reach: 2.0 * radius,
            close: 2.0 * radius * (1.0 - share * share.sqrt()) * 0.65,
        };
        let mut levels: Vec<Vec<u32>> = Vec::new();
        for i in 0..candidates.len() {
            let level = crowd.level(i);
            levels.resize_with(levels.len().max(level + 1), Vec::new);
            levels[level].push(i as u32);
        }
        for (level, members) in levels.into_iter().enumerate() {
            let cell = crowd.reach * (2u64 << level) as f64;
            crowd.grids.push(Grid::new(cell, members, |i| {
                candidates[i as usize].0.position
            }));
        }
        crowd
    }

    /// Doublings of the reach from that of density 1 to that of a candidate, rounded down.
    fn level(&self, i: usize) -> usize {
        let mut level = 0;
        while self.candidates[i].1 * (4u64 << (2 * level)) as f64 <= 1.0 {
            level += 1;
        }
        level
    }

    /// Calls `visit` with every other candidate that affects `i`, and its effect.
    fn around(&self, i: usize, mut visit: impl FnMut(usize, f64)) {
        let (sample, density) = &self.candidates[i];
        for grid in &self.grids {
            // The denser of the two decides, so neither the candidate's own reach nor that of the level may
            // be exceeded.
            let most = (self.reach / density.sqrt()).min(grid.cell());
            grid.within(sample.position, most, |place, j| {
                let distance = length(sub(sample.position, place));
                let j = j as usize;
                if i == j || distance >= most {
                    return;
                }
                let (other, other_density) = &self.candidates[j];
                let stretch = density.max(*other_density).sqrt();
                let distance = stretch * distance;
                if distance >= self.reach || dot(sample.normal, other.normal) < OTHER_SIDE {
                    return;
                }
                let near = 1.0 - distance.max(self.close) / self.reach;
                let square = near * near;
                let fourth = square * square;
                visit(j, fourth * fourth);
            });
        }
    }
}
