//! Identification of an input format.

use serde::{Serialize, Serializer};

/// Format of an input file. Each format is a constant next to its reader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Format {
    /// Name in reports.
    pub(super) id: &'static str,
    /// Name in messages.
    pub(super) name: &'static str,
}

impl Format {
    pub(super) const fn new(id: &'static str, name: &'static str) -> Self {
        Self { id, name }
    }
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
