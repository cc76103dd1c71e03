//! Reference systems, as far as it takes to tell two of them apart.

/// A reference system.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Crs {
    /// Its numbers in the EPSG registry: in the plane, and of heights.
    pub(super) horizontal: Option<u32>,
    pub(super) vertical: Option<u32>,
    /// The record, without what may differ between two of the same meaning.
    pub(super) normal: String,
    pub(super) name: String,
}

impl Crs {
    /// True if two systems are certainly not the same.
    pub(super) fn differs(&self, other: &Self) -> bool {
        let unlike =
            |a: Option<u32>, b: Option<u32>| matches!((a, b), (Some(a), Some(b)) if a != b);
        match (self.horizontal, other.horizontal) {
            (Some(_), Some(_)) => {
                unlike(self.horizontal, other.horizontal) || unlike(self.vertical, other.vertical)
            }
            // Without numbers, two texts of one kind can be compared.
            (None, None) => {
                self.normal.is_empty() == other.normal.is_empty() && self.normal != other.normal
            }
            _ => false,
        }
    }
}

impl std::fmt::Display for Crs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.horizontal, self.vertical) {
            (Some(plane), Some(heights)) => write!(f, "EPSG:{plane}+{heights}"),
            (Some(plane), None) => write!(f, "EPSG:{plane}"),
            _ => {
                let short: String = self.name.chars().take(40).collect();
                write!(f, "\"{}\"", short.escape_debug())
            }
        }
    }
}
