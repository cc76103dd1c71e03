//! Axis-aligned boxes of lattice positions.

use super::Point;

/// A closed box; [`Aabb::EMPTY`] contains no point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Aabb {
    /// Lowest corner.
    pub min: Point,
    /// Highest corner.
    pub max: Point,
}

impl Aabb {
    /// The box that contains no point.
    pub const EMPTY: Self = Self {
        min: [i32::MAX; 3],
        max: [i32::MIN; 3],
    };

    /// The smallest box around `points`.
    #[must_use]
    pub fn of(points: &[Point]) -> Self {
        points.iter().fold(Self::EMPTY, |b, &p| b.with(p))
    }

    /// The smallest box around `boxes`.
    #[must_use]
    pub fn around(boxes: &[Self]) -> Self {
        boxes.iter().fold(Self::EMPTY, |all, b| all.union(*b))
    }

    /// The smallest box that contains this box and `p`.
    #[must_use]
    pub fn with(self, p: Point) -> Self {
        self.union(Self { min: p, max: p })
    }

    /// The smallest box that contains both boxes.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|i| self.min[i].min(other.min[i])),
            max: std::array::from_fn(|i| self.max[i].max(other.max[i])),
        }
    }

    /// The lowest and the highest corner of this box, extended by `by` on all sides.
    #[must_use]
    pub fn wide(&self, by: i64) -> [[i64; 3]; 2] {
        let min = self.min.map(|at| i64::from(at) - by);
        [min, self.max.map(|at| i64::from(at) + by)]
    }

    /// Length of the longest side, in steps; 0 for the empty box.
    #[must_use]
    pub fn longest_side(&self) -> i64 {
        (0..3)
            .map(|i| i64::from(self.max[i]) - i64::from(self.min[i]))
            .max()
            .unwrap_or(0)
            .max(0)
    }

    /// Exact squared distance to a point; 0 inside.
    #[must_use]
    pub fn distance2(&self, p: Point) -> u64 {
        self.distance2_box(&Self { min: p, max: p })
    }

    /// Exact squared distance between two boxes; 0 if they intersect.
    #[must_use]
    pub fn distance2_box(&self, other: &Self) -> u64 {
        let mut sum = 0u64;
        for i in 0..3 {
            let below = i64::from(self.min[i]) - i64::from(other.max[i]);
            let above = i64::from(other.min[i]) - i64::from(self.max[i]);
            let gap = below.max(above).max(0) as u64;
            sum += gap * gap;
        }
        sum
    }
}
