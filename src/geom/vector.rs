//! Vectors and boxes in double precision.

/// Three coordinates.
pub type V3 = [f64; 3];

/// The sum of two vectors.
#[inline]
#[must_use]
pub fn add(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The difference of two vectors.
#[inline]
#[must_use]
pub fn sub(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A vector times a number.
#[inline]
#[must_use]
pub fn scale(a: V3, by: f64) -> V3 {
    a.map(|c| c * by)
}

/// The scalar product.
#[inline]
#[must_use]
pub fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
#[inline]
#[must_use]
pub fn cross(a: V3, b: V3) -> V3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// A closed box; [`Box3::EMPTY`] is empty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Box3 {
    /// Lowest coordinates.
    pub min: V3,
    /// Highest coordinates.
    pub max: V3,
}

impl Box3 {
    /// The box without a point.
    pub const EMPTY: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    /// The smallest box of some points.
    #[inline]
    #[must_use]
    pub fn of(points: &[V3]) -> Self {
        points.iter().fold(Self::EMPTY, |b, p| b.with(*p))
    }

    /// The smallest box of this one and a point.
    #[inline]
    #[must_use]
    pub fn with(self, p: V3) -> Self {
        self.union(Self { min: p, max: p })
    }

    /// The smallest box of both.
    #[inline]
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|i| self.min[i].min(other.min[i])),
            max: std::array::from_fn(|i| self.max[i].max(other.max[i])),
        }
    }

    /// Squared distance to a point; 0 inside.
    #[inline]
    #[must_use]
    pub fn distance2(&self, p: V3) -> f64 {
        let gap = |i: usize| (self.min[i] - p[i]).max(p[i] - self.max[i]).max(0.0);
        let (x, y, z) = (gap(0), gap(1), gap(2));
        x * x + y * y + z * z
    }

    /// Squared distance to another box; 0 if they meet.
    #[inline]
    #[must_use]
    pub fn distance2_box(&self, other: &Self) -> f64 {
        let gap = |i: usize| (self.min[i] - other.max[i]).max(other.min[i] - self.max[i]);
        let gaps = [0, 1, 2].map(|i| gap(i).max(0.0));
        dot(gaps, gaps)
    }

    /// Length of the diagonal; 0 if the box is empty.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        if self.min[0] > self.max[0] {
            return 0.0;
        }
        let across = sub(self.max, self.min);
        dot(across, across).sqrt()
    }

    /// The key of a position on a Hilbert curve through this box.
    #[must_use]
    pub fn key(&self, p: V3) -> crate::hilbert::Key {
        let side = (0..3).fold(0.0, |s: f64, i| s.max(self.max[i] - self.min[i]));
        // The cast maps NaN to 0 and too large values to the maximum.
        let steps = f64::from((1u32 << crate::hilbert::BITS) - 1) / side;
        let most = (1 << crate::hilbert::BITS) - 1;
        let cell: crate::Point =
            std::array::from_fn(|i| (((p[i] - self.min[i]) * steps) as i32).clamp(0, most));
        crate::hilbert::encode(cell)
    }
}
