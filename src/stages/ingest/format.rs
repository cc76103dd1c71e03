//! The name of a format.

use serde::{Serialize, Serializer};

/// Format of an input file. Each has its constant beside its reader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Format {
    /// The name in reports.
    pub(super) id: &'static str,
    /// The name on the screen.
    pub(super) name: &'static str,
}

impl Serialize for Format {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.id)
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}
