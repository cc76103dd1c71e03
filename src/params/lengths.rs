//! Lengths in units of the cloud, or of its density or size.

use outcrop_disk::error::Result;

/// Radius of the disks (paper, section 3.4).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Radius {
    /// Twice the distance of the last neighbour used for the plane: follows the local density.
    Auto,
    /// Percent of the diagonal of the cloud's bounding box.
    Percent(f64),
    /// A length in the input's unit.
    Length(f64),
}

impl std::str::FromStr for Radius {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |t: &str| match t.trim().parse::<f64>() {
            Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
            _ => Err(format!(
                "{text:?} is not auto, a percentage like 5%, or a positive length"
            )),
        };
        match text.trim() {
            "auto" => Ok(Radius::Auto),
            t => match t.strip_suffix('%') {
                Some(percent) => number(percent).map(Radius::Percent),
                None => number(t).map(Radius::Length),
            },
        }
    }
}

/// A limit for lengths.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MaxWidth {
    /// In units of the local spacing of points on the surface.
    Spacings(f64),
    /// A length in the input's unit.
    Length(f64),
    /// No limit.
    None,
}

impl std::str::FromStr for MaxWidth {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let number = |t: &str| match t.trim().parse::<f64>() {
            Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
            _ => Err(format!(
                "{text:?} is not none, a positive length, or one in local spacings like 25x"
            )),
        };
        match text.strip_suffix('x') {
            _ if text == "none" => Ok(Self::None),
            Some(spacings) => number(spacings).map(Self::Spacings),
            None => number(text).map(Self::Length),
        }
    }
}

impl std::fmt::Display for MaxWidth {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Spacings(spacings) => write!(f, "{spacings}x"),
            Self::Length(length) => write!(f, "{length}"),
            Self::None => f.write_str("none"),
        }
    }
}
