//! How the boundary of a mesh is closed.

use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// How the boundary of a mesh is closed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Close {
    /// Smoothly where the surface runs on into the loop, else by lids.
    #[default]
    Auto,
    /// By lids, without new vertices.
    Lids,
    /// Smoothly.
    Smooth,
    /// Outer rims by walls down to a floor at this height, or below the lowest vertex; others as with `Auto`.
    Base(Option<f64>),
}

impl FromStr for Close {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, height) = match text.split_once('=') {
            None => (text, None),
            Some((name, height)) => (name, Some(height)),
        };
        match (name, height) {
            ("auto", None) => Ok(Self::Auto),
            ("lids", None) => Ok(Self::Lids),
            ("smooth", None) => Ok(Self::Smooth),
            ("base", None) => Ok(Self::Base(None)),
            ("base", Some(height)) => match height.parse::<f64>() {
                Ok(z) if z.is_finite() => Ok(Self::Base(Some(z))),
                _ => Err(format!("{height:?} is no height, as in base=120.5")),
            },
            _ => Err("expected auto, lids, smooth, base or base=Z".to_owned()),
        }
    }
}

#[cfg(feature = "levels")]
impl From<Close> for outcrop_levels::close::Kind {
    fn from(close: Close) -> Self {
        match close {
            Close::Auto => Self::Auto,
            Close::Lids => Self::Lids,
            Close::Smooth => Self::Smooth,
            Close::Base(z) => Self::Base(z),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read() {
        assert_eq!("lids".parse(), Ok(Close::Lids));
        assert_eq!("base".parse(), Ok(Close::Base(None)));
        assert_eq!("base=-2.5".parse(), Ok(Close::Base(Some(-2.5))));
        for wrong in [
            "lid", "", "lids=1", "base=", "base=inf", "base=NaN", "base=a",
        ] {
            assert!(wrong.parse::<Close>().is_err(), "{wrong}");
        }
    }
}
