//! The reference system that is given, whatever files say of it.

use super::crs::{Crs, CrsSource, LONGEST};
use super::wkt::well_known;
use serde::{Deserialize, Serialize};

/// A reference system that is given: EPSG codes, or a well-known text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct GivenCrs(String);

/// The codes in a text like `EPSG:25832` or `EPSG:25832+7837`, of the plane and of heights.
pub(super) fn codes(text: &str) -> Option<(u32, Option<u32>)> {
    let (authority, codes) = text.trim().split_once(':')?;
    if !authority.trim().eq_ignore_ascii_case("EPSG") {
        return None;
    }
    let code = |text: &str| {
        let digits = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        text.parse::<u32>().ok().filter(|code| digits && *code > 0)
    };
    match codes.split_once('+') {
        Some((plane, heights)) => Some((code(plane.trim())?, Some(code(heights.trim())?))),
        None => Some((code(codes.trim())?, None)),
    }
}

impl std::str::FromStr for GivenCrs {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim_start_matches('\u{feff}').trim();
        if let Some((plane, heights)) = codes(text) {
            let heights = heights.map_or_else(String::new, |code| format!("+{code}"));
            return Ok(Self(format!("EPSG:{plane}{heights}")));
        }
        if text.len() > LONGEST {
            return Err("a text of more than 1 MiB is no reference system".into());
        }
        if well_known(text).kind.is_some() {
            return Ok(Self(text.to_owned()));
        }
        let short: String = text.chars().take(40).collect();
        Err(format!(
            "{short:?} is no code like EPSG:25832 or EPSG:25832+7837, and no well-known text of a reference system"
        ))
    }
}

impl GivenCrs {
    /// The system.
    #[must_use]
    pub fn crs(&self) -> Crs {
        let system = match codes(&self.0) {
            Some((plane, heights)) => {
                Crs::named(String::new(), Some(plane), heights, CrsSource::Given).completed()
            }
            None => well_known(&self.0),
        };
        Crs {
            source: CrsSource::Given,
            ..system
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_and_texts_are_systems_and_nothing_else_is() {
        let line = |text: &str| text.parse::<GivenCrs>().map(|given| given.crs().line());
        assert_eq!(line(" epsg:25832 "), Ok("EPSG:25832".into()));
        assert_eq!(line("EPSG:6543+5703"), Ok("EPSG:6543+5703".into()));
        assert_eq!(
            line("\u{feff}LOCAL_CS[\"site\",UNIT[\"metre\",1]]\n"),
            Ok("site".into())
        );
        for wrong in [
            "",
            "25832",
            "EPSG:",
            "EPSG:0",
            "EPSG:1+",
            "EPSG:+1",
            "ESRI:102008",
            "A[]",
            "x[y",
        ] {
            assert!(line(wrong).is_err(), "{wrong}");
        }
    }
}
