//! Reference systems: what files say of them, as far as needed to name and to compare them.

use super::input::Input;
use crate::workspace::compressed::plain_name;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

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
}

impl std::fmt::Display for CrsSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::WellKnownText => "well-known text",
            Self::Prj => ".prj file",
            Self::GeotiffKeys => "GeoTIFF keys",
            Self::Comments => "comments",
        })
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
    /// The well-known text, if it was given by one; at most 1 MiB.
    #[serde(skip)]
    pub(super) wkt: Option<String>,
    /// The record without the parts that may differ between records of the same meaning.
    #[serde(skip)]
    pub(super) normal: String,
}

impl Crs {
    /// True if the two systems are certainly different.
    pub(super) fn differs(&self, other: &Self) -> bool {
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
            CrsSource::GeotiffKeys => None,
            CrsSource::Comments => Some("comments"),
            CrsSource::WellKnownText | CrsSource::Prj => self.normal.split(['[', '(']).next(),
        }
    }

    /// True if it differs from the same systems as the other.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let codes = |crs: &Self| (crs.horizontal, crs.vertical);
        let same = self.kind() == other.kind() && self.normal == other.normal;
        codes(self) == codes(other) && (self.horizontal.is_some() || same)
    }

    /// The same without the texts, and with a name of bounded length.
    pub(super) fn without_texts(&self) -> Self {
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

/// Path of the `.prj` file that belongs to an input.
#[must_use]
pub fn prj_of(input: &Path) -> PathBuf {
    plain_name(input).with_extension("prj")
}

/// The reference system in the `.prj` file beside an input, if there is one; a warning if it cannot be used.
pub(super) fn beside(input: &Input) -> (Option<Crs>, Option<String>) {
    of_prj(&prj_of(&input.path))
}

/// The system of comments, or of the `.prj` file beside the input if that gives the same one as a text; a warning if
/// it gives another one.
pub(super) fn fuller(crs: Crs, input: &Input) -> (Option<Crs>, Option<String>) {
    let (other, warning) = beside(input);
    match other {
        Some(other) if crs.horizontal.is_some() && other.horizontal == crs.horizontal => {
            (Some(other), warning)
        }
        Some(other) if other.differs(&crs) => {
            let prj = prj_of(&input.path);
            let warning = format!(
                "{}: its system is {other}, that in the header of {} is {crs}, which is taken",
                prj.display(),
                input.path.display()
            );
            (Some(crs), Some(warning))
        }
        _ => (Some(crs), warning),
    }
}

/// The reference system in a `.prj` file, if there is one; a warning if it cannot be used.
pub fn of_prj(path: &Path) -> (Option<Crs>, Option<String>) {
    let Ok(file) = File::open(path) else {
        return (None, None);
    };
    let not = |why: &str| {
        let warning = format!(
            "{}: {why}, no reference system is taken from it",
            path.display()
        );
        (None, Some(warning))
    };
    let mut bytes = Vec::new();
    if let Err(e) = file.take(LONGEST as u64 + 1).read_to_end(&mut bytes) {
        return not(&e.to_string());
    }
    if bytes.len() > LONGEST {
        return not("it is longer than 1 MiB");
    }
    let text = String::from_utf8_lossy(&bytes);
    let text = text.trim_start_matches('\u{feff}').trim();
    if !text.contains('[') {
        return not("it is no well-known text");
    }
    let crs = Crs {
        source: CrsSource::Prj,
        ..super::las::well_known(text)
    };
    (Some(crs), None)
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
