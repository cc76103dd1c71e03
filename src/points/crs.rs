//! Reference systems: what files say of them, as far as needed to name and to compare them.

use super::kind::CrsKind;
use outcrop_disk::error::Setting;
use serde::{Deserialize, Serialize};

/// Most bytes of a well-known text.
pub(super) const LONGEST: usize = 1 << 20;

/// Most characters of a name that is shown.
const LONGEST_NAME: usize = 200;

/// Where a reference system was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CrsSource {
    /// Well-known text in the file.
    WellKnownText,
    /// Well-known text in a `.prj` file beside it.
    Prj,
    /// GeoTIFF keys in the file.
    GeotiffKeys,
    /// Comments in the header of a PLY file.
    Comments,
    /// The option `crs`.
    Given,
}

impl std::fmt::Display for CrsSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.told(Setting::to_string))
    }
}

impl CrsSource {
    /// In words, for a front that spells options so.
    fn told(self, spell: impl Fn(&Setting) -> String) -> String {
        let source = match self {
            Self::WellKnownText => "well-known text",
            Self::Prj => ".prj file",
            Self::GeotiffKeys => "GeoTIFF keys",
            Self::Comments => "comments of the header",
            Self::Given => return spell(&Setting::Option("crs")),
        };
        source.to_owned()
    }
}

/// A reference system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Crs {
    /// Its name.
    pub name: String,
    /// EPSG code of the horizontal system.
    pub horizontal: Option<u32>,
    /// EPSG code of the vertical system.
    pub vertical: Option<u32>,
    /// Where it was found.
    pub source: CrsSource,
    /// Its kind, if it is known.
    pub kind: Option<CrsKind>,
    /// Metres in a unit of the plane, if it is known and no angle.
    pub unit: Option<f64>,
    /// Metres in a unit of heights, if that is known.
    pub height_unit: Option<f64>,
    /// The well-known text, if it was given by one; at most 1 MiB.
    #[serde(skip)]
    pub wkt: Option<String>,
    /// The record without the parts that may differ between records of the same meaning.
    #[serde(skip)]
    pub normal: String,
}

impl Crs {
    /// A system of which no more is known than this.
    pub fn named(
        name: String,
        horizontal: Option<u32>,
        vertical: Option<u32>,
        source: CrsSource,
    ) -> Self {
        Self {
            name,
            horizontal,
            vertical,
            source,
            kind: None,
            unit: None,
            height_unit: None,
            wkt: None,
            normal: String::new(),
        }
    }

    /// True if the two systems are certainly different.
    pub fn differs(&self, other: &Self) -> bool {
        match (self.horizontal, other.horizontal) {
            (Some(a), Some(b)) => {
                let heights = self.vertical.zip(other.vertical);
                a != b || heights.is_some_and(|(a, b)| a != b)
            }
            // Without codes, two texts of the same kind are compared.
            (None, None) => self.kind() == other.kind() && self.normal != other.normal,
            _ => false,
        }
    }

    /// The kind of the record: GeoTIFF keys, comments, or the first word of a well-known text.
    fn kind(&self) -> Option<&str> {
        match self.source {
            CrsSource::GeotiffKeys | CrsSource::Comments => None,
            CrsSource::WellKnownText | CrsSource::Prj | CrsSource::Given => {
                self.normal.split(['[', '(']).next()
            }
        }
    }

    /// True if it differs from the same systems as the other.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let codes = |crs: &Self| (crs.horizontal, crs.vertical);
        let same = self.kind() == other.kind() && self.normal == other.normal;
        codes(self) == codes(other) && (self.horizontal.is_some() || same)
    }

    /// The same without the texts, and with a name of bounded length.
    #[must_use]
    pub fn without_texts(&self) -> Self {
        Self {
            name: self.name.chars().take(LONGEST_NAME).collect(),
            wkt: None,
            normal: String::new(),
            ..*self
        }
    }
}

impl Crs {
    /// The well-known text, if it was given by one.
    #[must_use]
    pub fn wkt(&self) -> Option<&str> {
        self.wkt.as_deref()
    }

    /// The EPSG codes, as `EPSG:26917` or `EPSG:26917+5703`.
    #[must_use]
    pub fn codes(&self) -> Option<String> {
        match (self.horizontal, self.vertical) {
            (Some(plane), Some(heights)) => Some(format!("EPSG:{plane}+{heights}")),
            (Some(plane), None) => Some(format!("EPSG:{plane}")),
            _ => None,
        }
    }

    /// The codes, or without codes the name, on one line: names of one system differ from file to file.
    #[must_use]
    pub fn label(&self) -> String {
        self.codes().unwrap_or_else(|| self.line())
    }

    /// The same, with the units and where it was found, for a front that spells options so.
    pub fn described(&self, spell: impl Fn(&Setting) -> String) -> String {
        let (line, source) = (self.line(), self.source.told(spell));
        match self.units() {
            units if units.is_empty() => format!("{line} ({source})"),
            units => format!("{line} ({source}), {units}"),
        }
    }

    /// Codes and name on one line, at most 250 characters.
    #[must_use]
    pub fn line(&self) -> String {
        let name = self.name.split_whitespace().collect::<Vec<_>>().join(" ");
        let name = name.chars().filter(|c| !c.is_control());
        let name: String = name.take(LONGEST_NAME).collect();
        let line = format!("{} {name}", self.codes().unwrap_or_default());
        line.trim().to_owned()
    }

    /// Order by what a system tells: first those with a text, with a code, with a code for heights; then by
    /// name and text. It does not depend on the order of files.
    pub(super) fn rank(&self) -> impl Ord + use<> {
        (
            (
                self.wkt.is_none(),
                self.horizontal.is_none(),
                self.vertical.is_none(),
            ),
            self.source,
            (self.name.clone(), self.wkt.clone(), self.normal.clone()),
        )
    }
}

impl std::fmt::Display for Crs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(codes) = self.codes() {
            return f.write_str(&codes);
        }
        let short: String = self.name.chars().take(40).collect();
        write!(f, "\"{}\"", short.escape_debug())
    }
}
