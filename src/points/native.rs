//! The types of coordinates in the spool.

use serde::{Deserialize, Serialize};

/// The type of a source's coordinates in the spool.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Native {
    /// Integers; the coordinate is `i * scale + offset`.
    Las {
        /// Step of each axis.
        scale: [f64; 3],
        /// Coordinates of the integers 0.
        offset: [f64; 3],
    },
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

impl Native {
    /// Bytes of one point in the spool.
    #[must_use]
    pub fn point_bytes(&self) -> usize {
        match self {
            Self::Las { .. } => size_of::<[i32; 3]>(),
            Self::F32 => size_of::<[f32; 3]>(),
            Self::F64 => size_of::<[f64; 3]>(),
        }
    }
}
