//! The box around a mesh.

/// Smallest box around all vertices with finite coordinates, in the coordinates of the cloud.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Bounds {
    /// Lowest coordinates.
    pub min: [f64; 3],
    /// Highest coordinates.
    pub max: [f64; 3],
}

impl Bounds {
    pub(super) fn with(bounds: Option<Self>, p: [f64; 3]) -> Self {
        // No negative zero: which of two zeros is less would depend on the order.
        let p = p.map(|c| c + 0.0);
        let Some(b) = bounds else {
            return Self { min: p, max: p };
        };
        Self {
            min: std::array::from_fn(|i| b.min[i].min(p[i])),
            max: std::array::from_fn(|i| b.max[i].max(p[i])),
        }
    }

    /// The box around two boxes.
    pub(super) fn around(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        let Some(other) = b else {
            return a;
        };
        Some(Self::with(Some(Self::with(a, other.min)), other.max))
    }
}
