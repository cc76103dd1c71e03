//! Points by cell of a cubic grid.

use rustc_hash::FxHashMap;

use crate::vec3::Vec3;

/// Points with their indices, sorted by cell.
pub(super) struct Grid {
    cell: f64,
    members: Vec<(Vec3, u32)>,
    /// For each cell the range of its points in `members`.
    ranges: FxHashMap<[i64; 3], (u32, u32)>,
}

impl Grid {
    pub(super) fn new(cell: f64, members: Vec<u32>, place: impl Fn(u32) -> Vec3) -> Self {
        let mut keyed: Vec<([i64; 3], u32)> = members
            .into_iter()
            .map(|i| (place(i).map(|c| (c / cell).floor() as i64), i))
            .collect();
        keyed.sort_unstable();
        let mut ranges = FxHashMap::default();
        for (at, (key, _)) in keyed.iter().enumerate() {
            let at = at as u32;
            ranges.entry(*key).or_insert((at, at)).1 = at + 1;
        }
        Grid {
            cell,
            members: keyed.into_iter().map(|(_, i)| (place(i), i)).collect(),
            ranges,
        }
    }

    /// Side of the cells.
    pub(super) fn cell(&self) -> f64 {
        self.cell
    }

    /// Calls `visit` with all points of the cells that meet the cube of half side `reach`.
    pub(super) fn within(&self, centre: Vec3, reach: f64, mut visit: impl FnMut(Vec3, u32)) {
        let low = centre.map(|c| ((c - reach) / self.cell).floor() as i64);
        let high = centre.map(|c| ((c + reach) / self.cell).floor() as i64);
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    if let Some(&(start, end)) = self.ranges.get(&[x, y, z]) {
                        for &(place, i) in &self.members[start as usize..end as usize] {
                            visit(place, i);
                        }
                    }
                }
            }
        }
    }
}
