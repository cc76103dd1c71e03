//! Reference systems, as far as needed to compare two of them.

/// A reference system.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Crs {
    /// EPSG codes of the horizontal and of the vertical system.
    pub(super) horizontal: Option<u32>,
    pub(super) vertical: Option<u32>,
    /// The record without the parts that may differ between records of the same meaning.
    pub(super) normal: String,
    pub(super) name: String,
}

impl Crs {
    /// True if the two systems are certainly different.
    pub(super) fn differs(&self, other: &Self) -> bool {
        match (self.horizontal, other.horizontal) {
            (Some(a), Some(b)) => {
                let heights = self.vertical.zip(other.vertical);
                a != b || heights.is_some_and(|(a, b)| a != b)
            }
            // Without codes, two texts of the same kind are compared.
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
