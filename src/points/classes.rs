//! Selection of points by their class: that of LAS and LAZ, or a column `classification`.

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

    /// The same of a number in a column; what is no class is in no list.
    pub(super) fn wants_number(&self, class: f64) -> bool {
        let is_class = (0.0..=255.0).contains(&class) && class.fract() == 0.0;
        match self {
            _ if is_class => self.wants(class as u8),
            Self::Keep(_) => false,
            Self::All | Self::Drop(_) => true,
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
        for odd in [f64::NAN, -1.0, 6.5, 256.0, f64::INFINITY] {
            assert!(!Classes::Keep(vec![0, 6]).wants_number(odd));
            assert!(Classes::Drop(vec![0, 6]).wants_number(odd));
        }
        assert!(Classes::Keep(vec![6]).wants_number(6.0));
    }
}
