//! Identification of an input format.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Format of an input file: a constant for each, and for each of its variants that differ in what is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Format {
    /// Name in reports.
    id: &'static str,
    /// Name in messages.
    name: &'static str,
}

/// Makes the constants, and the list of them.
macro_rules! formats {
    ($($(#[$doc:meta])* $constant:ident = $id:literal, $name:literal;)*) => {
        impl Format {
            $($(#[$doc])* pub const $constant: Self = Self { id: $id, name: $name };)*
        }

        const ALL: &[Format] = &[$(Format::$constant),*];
    };
}

formats! {
    /// ASPRS LAS.
    LAS = "las", "LAS";
    /// LAS compressed by laszip, COPC included.
    LAZ = "laz", "LAZ";
    /// Entwine Point Tiles.
    EPT = "ept", "EPT";
    /// ASTM E57.
    E57 = "e57", "E57";
    /// PLY with numbers as text.
    PLY_ASCII = "ply_ascii", "PLY (ascii)";
    /// PLY, little-endian binary.
    PLY_BINARY_LITTLE_ENDIAN = "ply_binary_little_endian", "PLY (binary, little-endian)";
    /// PLY, big-endian binary.
    PLY_BINARY_BIG_ENDIAN = "ply_binary_big_endian", "PLY (binary, big-endian)";
    /// PCD with numbers as text.
    PCD_ASCII = "pcd_ascii", "PCD (ascii)";
    /// PCD, binary.
    PCD_BINARY = "pcd_binary", "PCD (binary)";
    /// PCD, binary and compressed by LZF.
    PCD_COMPRESSED = "pcd_binary_compressed", "PCD (compressed)";
    /// Scans as text, with poses.
    PTX = "ptx", "PTX";
    /// Meshes as text.
    OFF = "off", "OFF";
    /// Lines of numbers: XYZ, TXT, CSV, PTS.
    TEXT = "text", "text";
}

impl Serialize for Format {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.id)
    }
}

impl<'de> Deserialize<'de> for Format {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let id = String::deserialize(deserializer)?;
        let found = ALL.iter().find(|f| f.id == id);
        found
            .copied()
            .ok_or_else(|| D::Error::custom(format!("{id:?} is not a format")))
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}
