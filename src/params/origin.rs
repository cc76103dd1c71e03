//! The origin of the coordinates in the mesh file.

use super::facing;
use outcrop_disk::error::Result;

/// The origin of the coordinates in the mesh file.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Origin {
    /// That of the input's coordinates.
    None,
    /// A round position below the cloud, where single precision does not suffice without it.
    Auto,
    /// The lattice position nearest to this one, in the input's coordinates.
    At([f64; 3]),
}

impl std::str::FromStr for Origin {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("{text:?} is not auto, none, or three numbers like 635000,848000,0");
        match text.trim() {
            "auto" => Ok(Self::Auto),
            "none" => Ok(Self::None),
            numbers => facing::position(numbers).map(Self::At).ok_or_else(wrong),
        }
    }
}
