//! The fate of a component: kept or removed, and its orientation.
//!
//! Sums over a component are exact integers, so they do not depend on the order of triangles. Where it is known
//! at points which side is out, this decides; else volume or area.

use super::RepairStats;
use crate::surface::evidence::facing;
use crate::surface::parity::signed;
use crate::surface::star::Triangle;
use outcrop_disk::spill::row;
use outcrop_geom::Point;
use outcrop_geom::triangle::small_normal;
use outcrop_paper::method::METHOD;
use serde::{Deserialize, Serialize};

/// Exact sums over the triangles of a component.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Sums {
    triangles: u64,
    /// Triangles whose smallest vertex is a noisy point.
    noisy: u64,
    /// True if there is a boundary edge.
    open: bool,
    /// Six times the signed volume relative to the lattice's origin.
    volume6: i128,
    /// Twice the vector area.
    area_vector: [i128; 3],
    /// Twice the area; that of each triangle is rounded down.
    area: u128,
    /// Sum of the positions of all corners.
    corners: [i128; 3],
    /// Evidence that the triangles face the side that is out at their points.
    seen: i64,
    /// The smallest triangle, and true if it is turned (does not run ascending).
    first: Option<(Triangle, bool)>,
}

row! {
    /// [`Sums`] on disk; numbers of 64 and 128 bits are lists of words, lowest first.
    pub struct SumsRow {
        /// Six times the signed volume.
        volume6: [u32; 4],
        /// Twice the area.
        area: [u32; 4],
        /// Twice the vector area.
        area_vector: [[u32; 4]; 3],
        /// Sum of the corners' positions.
        corners: [[u32; 4]; 3],
        /// Number of triangles.
        triangles: [u32; 2],
        /// Triangles at noisy points.
        noisy: [u32; 2],
        /// Evidence that they face the side that is out.
        seen: [u32; 2],
        /// Bit 1: the smallest triangle is turned; bit 2: there is a triangle; bit 4: there is a boundary
        /// edge.
        flags: u32,
        /// The smallest triangle.
        first: Triangle,
    }
    unpacked
}

/// The words of a number, lowest first.
fn words(number: i128) -> [u32; 4] {
    [0, 32, 64, 96].map(|shift| (number >> shift) as u32)
}

fn number(words: [u32; 4]) -> i128 {
    let wide = words.iter().rev();
    wide.fold(0u128, |sum, w| sum << 32 | u128::from(*w))
        .cast_signed()
}

fn words64(number: u64) -> [u32; 2] {
    [number as u32, (number >> 32) as u32]
}

fn number64(words: [u32; 2]) -> u64 {
    let [low, high] = words.map(u64::from);
    high << 32 | low
}

impl Sums {
    /// Adds a triangle with corners at `corners`; `flip` if it is turned against its ascending ids. `toward` is
    /// the unit vector out of the surface at its first corner, if it is known.
    pub fn add(
        &mut self,
        t: Triangle,
        [a, b, c]: [Point; 3],
        flip: bool,
        toward: Option<[f64; 3]>,
    ) {
        self.see(t, flip);
        let mut n = small_normal(a, b, c);
        let length2 = n.iter().map(|x| (*x as f64) * (*x as f64)).sum::<f64>();
        let length = length2.sqrt();
        self.triangles += 1;
        self.area += u128::from((length as i64).cast_unsigned());
        if let Some(toward) = toward
            && length > 0.0
        {
            let unit = n.map(|x| x as f64 / length);
            self.seen += signed(flip, facing(unit, toward));
        }
        if flip {
            n = n.map(|x| -x);
        }
        let [x, y, z] = [0, 1, 2].map(|axis| i128::from(n[axis]) * i128::from(a[axis]));
        self.volume6 += x + y + z;
        for axis in 0..3 {
            self.area_vector[axis] += i128::from(n[axis]);
            let corners = i64::from(a[axis]) + i64::from(b[axis]) + i64::from(c[axis]);
            self.corners[axis] += i128::from(corners);
        }
    }

    /// Records that a triangle is at a noisy point.
    pub fn note_noise(&mut self) {
        self.noisy += 1;
    }

    fn is_noisy(&self) -> bool {
        2 * self.noisy >= self.triangles
    }

    /// Records that there is a boundary edge.
    pub fn open(&mut self) {
        self.open = true;
    }

    fn see(&mut self, t: Triangle, flip: bool) {
        if self.first.is_none_or(|(first, _)| t < first) {
            self.first = Some((t, flip));
        }
    }

    /// Adds the sums over other triangles, with all of them turned if `flip`.
    pub fn merge(&mut self, other: &Sums, flip: bool) {
        let sign = if flip { -1 } else { 1 };
        if let Some((t, turned)) = other.first {
            self.see(t, turned ^ flip);
        }
        self.triangles += other.triangles;
        self.noisy += other.noisy;
        self.open |= other.open;
        self.volume6 += sign * other.volume6;
        self.area += other.area;
        self.seen += signed(flip, other.seen);
        for axis in 0..3 {
            self.area_vector[axis] += sign * other.area_vector[axis];
            self.corners[axis] += other.corners[axis];
        }
    }

    /// Converts to a row.
    #[must_use]
    pub fn row(&self) -> SumsRow {
        let (first, turned) = self.first.unwrap_or_default();
        let flags = u32::from(self.open) << 2 | u32::from(self.first.is_some()) << 1;
        SumsRow {
            volume6: words(self.volume6),
            area: words(self.area.cast_signed()),
            area_vector: self.area_vector.map(words),
            corners: self.corners.map(words),
            triangles: words64(self.triangles),
            noisy: words64(self.noisy),
            seen: words64(self.seen.cast_unsigned()),
            flags: flags | u32::from(turned),
            first,
        }
    }

    /// Converts from a row.
    #[must_use]
    pub fn of(row: &SumsRow) -> Self {
        Self {
            triangles: number64(row.triangles),
            noisy: number64(row.noisy),
            seen: number64(row.seen).cast_signed(),
            open: row.flags & 4 != 0,
            volume6: number(row.volume6),
            area: number(row.area).cast_unsigned(),
            area_vector: row.area_vector.map(number),
            corners: row.corners.map(number),
            first: (row.flags & 2 != 0).then_some((row.first, row.flags & 1 == 1)),
        }
    }

    /// True if the component must be turned. If nothing else decides, its smallest triangle is to run
    /// ascending.
    fn faces_wrong_way(&self) -> bool {
        let wrong = if self.seen != 0 {
            Some(self.seen < 0)
        } else if !self.open {
            sign(self.volume6)
        } else {
            let v = self.area_vector.map(|x| x as f64);
            let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
            if METHOD.components.open * length >= self.area as f64 {
                let [x, y, z] = self.area_vector;
                [z, y, x].into_iter().find_map(sign)
            } else {
                sign(self.volume_about_centroid())
            }
        };
        wrong.unwrap_or_else(|| self.first.is_some_and(|(_, turned)| turned))
    }

    /// Six times the volume relative to the mean corner, times the number of corners.
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

/// True if a number is negative; `None` for zero.
fn sign(x: i128) -> Option<bool> {
    (x != 0).then_some(x < 0)
}

/// The decision about a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fate {
    /// True if it is large enough to be kept.
    pub keep: bool,
    /// True if its triangles must be turned.
    pub turn: bool,
}

impl Fate {
    /// Before the decision, everything is kept as it is.
    pub const UNKNOWN: Self = Self {
        keep: true,
        turn: false,
    };
}

/// Decides about a component with complete sums. It is removed if it has fewer than `least` triangles, or, if
/// it is noisy, fewer than the second number.
pub fn judge(sums: &Sums, [least, if_noisy]: [u64; 2], stats: &mut RepairStats) -> Fate {
    let least = if sums.is_noisy() { if_noisy } else { least };
    let keep = sums.triangles >= least;
    // All triangles of a component may have been removed as bridges.
    if sums.triangles > 0 {
        stats.components_found += 1;
        if !keep {
            stats.components_removed += 1;
            stats.component_triangles_removed += sums.triangles;
        }
    }
    Fate {
        keep,
        turn: sums.faces_wrong_way(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use outcrop_stages::ids::triangle;

    /// A floor that faces up, seen from a side of it.
    #[test]
    fn what_the_scanner_saw_is_out() {
        let floor = [[0, 0, 5], [9, 0, 5], [0, 9, 5]];
        for (toward, wrong) in [
            (Some([0.6, 0.0, 0.8]), false),
            (Some([0.6, 0.0, -0.8]), true),
        ] {
            for flip in [false, true] {
                let mut sums = Sums::default();
                sums.open();
                sums.add(triangle([1, 2, 3]), floor, flip, toward);
                assert_eq!(sums.seen.abs(), 12);
                assert_eq!(sums.faces_wrong_way(), wrong ^ flip);
            }
        }
        // A scanner beside it says nothing.
        let mut sums = Sums::default();
        sums.open();
        sums.add(triangle([1, 2, 3]), floor, true, Some([1.0, 0.0, 0.0]));
        assert_eq!((sums.seen, sums.faces_wrong_way()), (0, true));
    }

    #[test]
    fn sums_as_rows() {
        let far = (1 << 30) - 1;
        let mut sums = Sums::default();
        let corners = [[0, far, 7], [far, 0, 0], [4, 2, far]];
        sums.add(triangle([3, 5, 9]), corners, true, Some([0.0, 0.0, 1.0]));
        let corners = [[far, far, 0], [0, far, 9], [far, 5, 0]];
        sums.add(triangle([4, 5, 9]), corners, false, Some([-0.8, 0.0, 0.6]));
        assert!(sums.seen != 0);
        sums.open();
        sums.note_noise();
        assert_eq!(Sums::of(&sums.row()), sums);
        let empty = Sums::default();
        assert_eq!(Sums::of(&empty.row()), empty);
        let mut both = sums;
        both.merge(&sums, true);
        assert_eq!((both.volume6, both.area_vector), (0, [0; 3]));
        assert_eq!(both.seen, 0);
        assert_eq!((both.triangles, both.first), (4, sums.first));
    }
}
