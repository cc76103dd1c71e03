//! Selection of points by their class (LAS and LAZ).

use serde::{Deserialize, Serialize};

/// The classes of points to read; points of files without classes are always read.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Classes {
    /// All points.
    #[default]
    All,
    /// Only points of the listed classes.
    Keep(Vec<u8>),
    /// All points but those of the listed classes.
    Drop(Vec<u8>),
}

impl Classes {
    /// True if points of `class` are to be read.
    #[must_use]
    pub fn wants(&self, class: u8) -> bool {
        match self {
            Self::All => true,
            Self::Keep(classes) => classes.contains(&class),
            Self::Drop(classes) => !classes.contains(&class),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wants_what_it_says() {
        assert!(Classes::All.wants(7));
        assert!(Classes::Keep(vec![2, 6]).wants(6) && !Classes::Keep(vec![2, 6]).wants(7));
        assert!(Classes::Drop(vec![7]).wants(6) && !Classes::Drop(vec![7]).wants(7));
    }
}
