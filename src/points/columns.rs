//! Columns of input files: values that points have beside their positions, such as colours.

use outcrop_disk::error::{Error, Result};
use outcrop_ply::Scalar;
use serde::{Deserialize, Serialize};

/// The colour of a point.
pub const COLORS: [&str; 3] = ["red", "green", "blue"];

/// The coordinates, which are no columns.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// The strength of the echo.
pub const INTENSITY: &str = "intensity";

/// The class of a point, as in LAS.
pub const CLASSIFICATION: &str = "classification";

/// The scanner that saw a point, in files that give positions of scanners: its number in
/// `PointFile::scanners` of the readers, or [`NO_SCANNER`].
pub const SCANNER: &str = "scanner";

/// Of points whose scanner is unknown.
pub const NO_SCANNER: u16 = u16::MAX;

/// How far a point moved from where it was measured, in the cloud's unit: of the mesh, not of a file.
pub(super) const DISPLACEMENT: &str = "displacement";

/// How well a vertex is supported, from 0 to 1: of the mesh, not of a file.
pub(super) const CONFIDENCE: &str = "confidence";

/// The names of columns that are made.
const MADE: [&str; 2] = [DISPLACEMENT, CONFIDENCE];

/// Other names of columns, in lower case.
const ALIASES: [(&str, &str); 15] = [
    ("r", "red"),
    ("g", "green"),
    ("b", "blue"),
    ("diffuse_red", "red"),
    ("diffuse_green", "green"),
    ("diffuse_blue", "blue"),
    ("class", CLASSIFICATION),
    ("reflectance", INTENSITY),
    ("gpstime", "gps_time"),
    ("pointsourceid", "point_source"),
    ("point_source_id", "point_source"),
    ("returnnumber", "return_number"),
    ("numberofreturns", "number_of_returns"),
    ("scananglerank", "scan_angle"),
    ("userdata", "user_data"),
];

/// Names of the columns of a normal, as they are known in all formats: of PLY and CloudCompare, of PCD, of the
/// extension of E57, and of LAS, the last of three numbers in one.
const NORMALS: [[&str; 3]; 5] = [
    ["nx", "ny", "nz"],
    ["normal_x", "normal_y", "normal_z"],
    ["nor_normalx", "nor_normaly", "nor_normalz"],
    ["normalx", "normaly", "normalz"],
    ["normal0", "normal1", "normal2"],
];

/// Most bytes of all columns of a point that are wanted for the mesh.
pub(super) const MOST_BYTES: usize = 48;

/// Most bytes of a point's row: these, the number of its scanner, its normal, its class, and colours.
pub(super) const MOST_ROW: usize = MOST_BYTES + size_of::<u32>() + 7 * size_of::<f64>();

/// A column of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Column {
    /// Its name, in lower case.
    pub name: String,
    /// Type of its values.
    pub scalar: Scalar,
}

impl Column {
    /// The column that a file calls `name`.
    pub fn new(name: &str, scalar: Scalar) -> Self {
        let name = column_name(name);
        Self { name, scalar }
    }

    /// How far a point moved from where it was measured.
    #[must_use]
    pub fn displacement() -> Self {
        Self::new(DISPLACEMENT, Scalar::F32)
    }

    /// How well a vertex is supported.
    #[must_use]
    pub fn confidence() -> Self {
        Self::new(CONFIDENCE, Scalar::F32)
    }
}

/// The name by which a column is known in all formats: in lower case, with `_` for spaces, which PLY has between
/// words, and without the prefix that CloudCompare writes.
pub fn usual_name(name: &str) -> String {
    let lower = name.to_ascii_lowercase();
    let words = lower.split(|c: char| c.is_whitespace() || c.is_control());
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let name = words.join("_");
    let name = name.strip_prefix("scalar_").unwrap_or(&name);
    let alias = ALIASES.iter().find(|(alias, _)| *alias == name);
    alias.map_or(name, |(_, usual)| usual).to_owned()
}

/// The name of a column that is no coordinate: the usual one, and `extra_x` for what has the name of a coordinate.
fn column_name(name: &str) -> String {
    let usual = usual_name(name);
    match AXES.contains(&&*usual) {
        true => extra(&usual),
        false => usual,
    }
}

/// The name of a column whose own is taken.
pub fn extra(name: &str) -> String {
    format!("extra_{name}")
}

/// Columns that the mesh keeps.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Attributes {
    /// None.
    #[default]
    None,
    /// Colours, intensity and classification, each if it is not the same at all points.
    Auto,
    /// The columns with these names.
    List(Vec<String>),
}

impl Attributes {
    /// True if the mesh tells how far each point moved.
    #[must_use]
    pub fn has_displacement(&self) -> bool {
        self.lists(DISPLACEMENT)
    }

    /// True if the mesh tells how well each vertex is supported.
    #[must_use]
    pub fn has_confidence(&self) -> bool {
        self.lists(CONFIDENCE)
    }

    fn lists(&self, name: &str) -> bool {
        matches!(self, Self::List(names) if names.iter().any(|listed| listed == name))
    }

    /// True for the column `name` of a file.
    pub(super) fn wants(&self, name: &str) -> bool {
        match self {
            _ if MADE.contains(&name) => false,
            Self::None => false,
            Self::Auto => COLORS.contains(&name) || name == INTENSITY || name == CLASSIFICATION,
            Self::List(names) => names.iter().any(|n| n == name),
        }
    }

    /// Numbers of the wanted columns among those of a file. Of columns with the same name the first counts.
    pub fn of(&self, columns: &[Column]) -> Vec<usize> {
        let first = |at: usize| columns[..at].iter().all(|c| c.name != columns[at].name);
        let wanted = |at: &usize| self.wants(&columns[*at].name) && first(*at);
        (0..columns.len()).filter(wanted).collect()
    }

    /// The names of columns of files, in the order of the mesh.
    pub(super) fn names(&self) -> Vec<&str> {
        match self {
            Self::None => Vec::new(),
            Self::Auto => [&COLORS[..], &[INTENSITY, CLASSIFICATION]].concat(),
            Self::List(names) => {
                let names = names.iter().map(String::as_str);
                names.filter(|name| !MADE.contains(name)).collect()
            }
        }
    }

    /// # Errors
    /// [`Error::Parameter`] if a listed column is in none of the files, whose columns are `present`.
    pub fn check(&self, present: &[Column]) -> Result<()> {
        let Self::List(_) = self else {
            return Ok(());
        };
        let names = self.names();
        let missing = |name: &&&str| present.iter().all(|c| c.name != **name);
        let Some(name) = names.iter().find(missing) else {
            return Ok(());
        };
        let mut known: Vec<&str> = present.iter().map(|c| &*c.name).collect();
        known.sort_unstable();
        known.dedup();
        let expected = match known.is_empty() {
            true => "none: the points have no columns".to_owned(),
            false => format!("columns of the points: {}", known.join(", ")),
        };
        Err(Error::Parameter {
            name: "attributes",
            found: name.escape_debug().to_string(),
            expected,
        })
    }
}

impl std::str::FromStr for Attributes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.trim() {
            "none" => return Ok(Self::None),
            "auto" => return Ok(Self::Auto),
            _ => {}
        }
        let mut names: Vec<String> = Vec::new();
        for word in text.split(',') {
            let word = word.trim();
            if word.is_empty() {
                return Err(format!(
                    "{text:?} is not auto, none, or a list of columns like color,intensity"
                ));
            }
            let color = ["color", "colour", "colors", "colours", "rgb"];
            let more = match color.contains(&&*word.to_ascii_lowercase()) {
                true => COLORS.map(str::to_owned).to_vec(),
                false => vec![column_name(word)],
            };
            for name in more {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
        }
        Ok(Self::List(names))
    }
}

/// The wanted columns of one file, as its reader sees them.
#[derive(Debug, Clone, Default)]
pub struct Wanted {
    /// Numbers of the columns in the file's list, ascending.
    pub numbers: Vec<usize>,
    /// The columns.
    pub columns: Vec<Column>,
    /// Byte and type of the class in a row, if points are left out by it.
    pub class: Option<(usize, Scalar)>,
}

/// What is read beside the columns for the mesh.
#[derive(Debug, Clone, Copy, Default)]
pub struct Also {
    /// The column of scanners.
    pub scanners: bool,
    /// Those of normals.
    pub normals: bool,
    /// That of classes, for leaving out points.
    pub classes: bool,
    /// Colours whose scale only their numbers tell.
    pub depths: bool,
}

impl Wanted {
    /// Of a file with these columns.
    ///
    /// # Errors
    /// [`Error::Parameter`] if those for the mesh take more than `MOST_BYTES`.
    pub fn of(attributes: &Attributes, columns: &[Column], also: Also) -> Result<Self> {
        let mut numbers = attributes.of(columns);
        let bytes: usize = numbers.iter().map(|n| columns[*n].scalar.bytes()).sum();
        let number = |name: &str| columns.iter().position(|c| c.name == name);
        numbers.extend(number(SCANNER).filter(|_| also.scanners));
        let normal = normal_columns(columns).filter(|_| also.normals);
        numbers.extend(normal.into_iter().flatten());
        numbers.extend(number(CLASSIFICATION).filter(|_| also.classes));
        let colors = COLORS.iter().filter_map(|name| number(name));
        numbers.extend(colors.filter(|_| also.depths));
        numbers.sort_unstable();
        numbers.dedup();
        let columns: Vec<Column> = numbers.iter().map(|n| columns[*n].clone()).collect();
        let class = columns.iter().position(|c| c.name == CLASSIFICATION);
        let class = class.filter(|_| also.classes);
        let class = class.map(|n| (row_bytes(&columns[..n]), columns[n].scalar));
        if bytes > MOST_BYTES {
            return Err(Error::Parameter {
                name: "attributes",
                found: format!("columns of {bytes} bytes for each point"),
                expected: format!("at most {MOST_BYTES}"),
            });
        }
        Ok(Self {
            numbers,
            columns,
            class,
        })
    }

    /// The columns as they are, when the points were read: those that none of them has have no name.
    pub fn found(&self, found: &[Column]) -> Vec<Column> {
        let mut columns = self.columns.clone();
        let absent = |column: &&mut Column| found.iter().all(|f| f.name != column.name);
        columns
            .iter_mut()
            .filter(absent)
            .for_each(|c| c.name.clear());
        columns
    }

    /// True if no column is wanted.
    pub(super) fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Bytes of the values of a point.
    pub(super) fn bytes(&self) -> usize {
        row_bytes(&self.columns)
    }
}

/// Numbers of the columns of a normal; of several with the same name the first counts.
pub fn normal_columns(columns: &[Column]) -> Option<[usize; 3]> {
    let number = |name: &str| columns.iter().position(|c| c.name == name);
    NORMALS.iter().find_map(|names| {
        let [x, y, z] = names.map(number);
        Some([x?, y?, z?])
    })
}

/// Bytes of the values of a point.
pub(super) fn row_bytes(columns: &[Column]) -> usize {
    columns.iter().map(|c| c.scalar.bytes()).sum()
}

/// Smallest and largest value of a column; merging is commutative.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Span {
    pub(super) min: f64,
    pub(super) max: f64,
}

impl Default for Span {
    fn default() -> Self {
        Self {
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
        }
    }
}

impl Span {
    /// Widens the span; NaN has no effect.
    #[inline]
    pub(super) fn add(&mut self, value: f64) {
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }
}

#[cfg(test)]
mod tests;
