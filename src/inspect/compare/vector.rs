//! Vectors and boxes in double precision.

/// Three coordinates.
pub(super) type V3 = [f64; 3];

pub(super) fn add(a: V3, b: V3) -> V3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn sub(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn scale(a: V3, by: f64) -> V3 {
    a.map(|c| c * by)
}

pub(super) fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: V3, b: V3) -> V3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// A closed box; [`Box3::EMPTY`] is empty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Box3 {
    pub(super) min: V3,
    pub(super) max: V3,
}

impl Box3 {
    pub(super) const EMPTY: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    pub(super) fn of(points: &[V3]) -> Self {
        points.iter().fold(Self::EMPTY, |b, p| b.with(*p))
    }

    pub(super) fn with(self, p: V3) -> Self {
        self.union(Self { min: p, max: p })
    }

    pub(super) fn union(self, other: Self) -> Self {
        Self {
            min: std::array::from_fn(|i| self.min[i].min(other.min[i])),
            max: std::array::from_fn(|i| self.max[i].max(other.max[i])),
        }
    }

    /// Squared distance to a point; 0 inside.
    pub(super) fn distance2(&self, p: V3) -> f64 {
        let gap = |i: usize| (self.min[i] - p[i]).max(p[i] - self.max[i]).max(0.0);
        let (x, y, z) = (gap(0), gap(1), gap(2));
        x * x + y * y + z * z
    }

    /// Squared distance to another box; 0 if they meet.
    pub(super) fn distance2_box(&self, other: &Self) -> f64 {
        let gap = |i: usize| (self.min[i] - other.max[i]).max(other.min[i] - self.max[i]);
        let gaps = [0, 1, 2].map(|i| gap(i).max(0.0));
        dot(gaps, gaps)
    }

    pub(super) fn diagonal(&self) -> f64 {
        if self.min[0] > self.max[0] {
            return 0.0;
        }
        let across = sub(self.max, self.min);
        dot(across, across).sqrt()
    }

    /// The key of a position on a Hilbert curve through this box.
    pub(super) fn key(&self, p: V3) -> crate::geom::hilbert::Key {
        let side = (0..3).fold(0.0, |s: f64, i| s.max(self.max[i] - self.min[i]));
        // The cast maps NaN to 0 and too large values to the maximum.
        let steps = f64::from((1u32 << crate::geom::hilbert::BITS) - 1) / side;
        let most = (1 << crate::geom::hilbert::BITS) - 1;
        let cell: crate::geom::Point =
            std::array::from_fn(|i| (((p[i] - self.min[i]) * steps) as i32).clamp(0, most));
        crate::geom::hilbert::encode(cell)
    }
}
