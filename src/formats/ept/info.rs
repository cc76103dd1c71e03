//! `ept.json`.

use super::super::input::{Input, u64_at};
use outcrop_disk::error::{Error, Result};
use outcrop_ply::{Scalar, real};
use serde::Deserialize;

/// Most bytes of an `ept.json`: its schema has a line for each column.
const LONGEST: u64 = 4 << 20;

/// Most points of all nodes.
const MOST_POINTS: u64 = 1 << 48;

/// Valid scales and offsets, as of LAS.
const SCALES: std::ops::RangeInclusive<f64> = 1e-15..=1e9;
const LARGEST_OFFSET: f64 = 1e15;

/// What `ept.json` says.
#[derive(Debug, Clone)]
pub(super) struct Info {
    /// The cube of the root.
    pub(super) cube: [[f64; 3]; 2],
    /// The box of the points.
    pub(super) conforming: [[f64; 3]; 2],
    pub(super) points: u64,
    pub(super) version: Option<String>,
    pub(super) wkt: Option<String>,
    pub(super) data: Data,
    /// Columns of a row, in their order.
    pub(super) schema: Vec<Dimension>,
}

/// How the points of a node are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Data {
    Laszip,
    Binary,
    Zstandard,
}

impl Data {
    /// The extension of the files.
    pub(super) fn extension(self) -> &'static str {
        match self {
            Self::Laszip => "laz",
            Self::Binary => "bin",
            Self::Zstandard => "zst",
        }
    }
}

/// A column.
#[derive(Debug, Clone)]
pub(super) struct Dimension {
    pub(super) name: String,
    pub(super) stored: Stored,
    /// The coordinate is `number * scale + offset`.
    pub(super) transform: Option<(f64, f64)>,
    /// Byte in a row.
    pub(super) at: usize,
}

/// The type of a number in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stored {
    I32,
    F32,
    Other(Scalar),
    /// Eight bytes, signed or not.
    Long(bool),
}

impl Stored {
    fn of(kind: &str, size: u64) -> Option<Self> {
        Some(match (kind, size) {
            ("signed", 1) => Self::Other(Scalar::I8),
            ("signed", 2) => Self::Other(Scalar::I16),
            ("signed", 4) => Self::I32,
            ("signed", 8) => Self::Long(true),
            ("unsigned", 1) => Self::Other(Scalar::U8),
            ("unsigned", 2) => Self::Other(Scalar::U16),
            ("unsigned", 4) => Self::Other(Scalar::U32),
            ("unsigned", 8) => Self::Long(false),
            ("float", 4) => Self::F32,
            ("float", 8) => Self::Other(Scalar::F64),
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I32 | Self::F32 => 4,
            Self::Other(scalar) => scalar.bytes(),
            Self::Long(_) => 8,
        }
    }

    /// The type of its column.
    pub(super) fn scalar(self) -> Scalar {
        match self {
            Self::I32 => Scalar::I32,
            Self::F32 => Scalar::F32,
            Self::Other(scalar) => scalar,
            Self::Long(_) => Scalar::F64,
        }
    }
}

impl Dimension {
    /// The number in a row.
    #[inline]
    pub(super) fn number(&self, row: &[u8]) -> f64 {
        let bytes = &row[self.at..self.at + self.stored.bytes()];
        match self.stored {
            Stored::Long(signed) => {
                let bits = u64_at(bytes, 0);
                if signed {
                    bits.cast_signed() as f64
                } else {
                    bits as f64
                }
            }
            other => real(other.scalar(), bytes, false),
        }
    }

    /// The number with scale and offset.
    #[inline]
    pub(super) fn value(&self, row: &[u8]) -> f64 {
        let number = self.number(row);
        self.transform
            .map_or(number, |(scale, offset)| number * scale + offset)
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Raw {
    bounds: [f64; 6],
    bounds_conforming: Option<[f64; 6]>,
    data_type: Data,
    points: u64,
    schema: Vec<RawDimension>,
    srs: Option<Srs>,
    version: Option<String>,
}

#[derive(Deserialize)]
struct RawDimension {
    name: String,
    #[serde(rename = "type")]
    kind: String,
    size: u64,
    scale: Option<f64>,
    offset: Option<f64>,
}

#[derive(Deserialize)]
struct Srs {
    wkt: Option<String>,
}

impl Info {
    /// Reads and checks `ept.json`.
    ///
    /// # Errors
    /// [`Error::Input`] naming what is wrong.
    pub(super) fn read(input: &Input) -> Result<Self> {
        if input.bytes > LONGEST {
            return Err(input.error(
                "size",
                format!("{} bytes", input.bytes),
                format!("at most {LONGEST}"),
            ));
        }
        let text = input.head(LONGEST as usize)?;
        let raw: Raw = serde_json::from_slice(&text).map_err(|e| {
            let place = format!("line {}", e.line());
            input.error(
                place,
                e.to_string().escape_debug().to_string(),
                "a description of Entwine Point Tiles",
            )
        })?;
        let cube = bounds(input, "bounds", raw.bounds)?;
        let conforming = match raw.bounds_conforming {
            Some(own) => bounds(input, "boundsConforming", own)?,
            None => cube,
        };
        if raw.points > MOST_POINTS {
            return Err(input.error(
                "points",
                raw.points.to_string(),
                format!("at most {MOST_POINTS}"),
            ));
        }
        Ok(Self {
            cube,
            conforming,
            points: raw.points,
            version: raw.version,
            wkt: raw.srs.and_then(|srs| srs.wkt),
            data: raw.data_type,
            schema: schema(input, raw.schema)?,
        })
    }

    /// Bytes of a row.
    pub(super) fn row(&self) -> usize {
        self.schema.iter().map(|d| d.stored.bytes()).sum()
    }

    /// The column of this name.
    pub(super) fn dimension(&self, name: &str) -> Option<&Dimension> {
        self.schema.iter().find(|d| d.name == name)
    }

    /// The columns of the coordinates.
    pub(super) fn axes(&self, input: &Input) -> Result<[&Dimension; 3]> {
        let axis = |name: &str| {
            self.dimension(name)
                .ok_or_else(|| input.error("schema", format!("no {name}"), "X, Y and Z"))
        };
        Ok([axis("X")?, axis("Y")?, axis("Z")?])
    }
}

fn bounds(input: &Input, place: &str, b: [f64; 6]) -> Result<[[f64; 3]; 2]> {
    let (low, high) = ([b[0], b[1], b[2]], [b[3], b[4], b[5]]);
    match (0..3).all(|axis| low[axis] <= high[axis] && (high[axis] - low[axis]).is_finite()) {
        true => Ok([low, high]),
        false => Err(input.error(place, format!("{b:?}"), "lowest and highest coordinates")),
    }
}

fn schema(input: &Input, raw: Vec<RawDimension>) -> Result<Vec<Dimension>> {
    let mut at = 0;
    let mut one = |raw: RawDimension| -> Result<Dimension> {
        let place = || format!("schema, {}", raw.name.escape_debug());
        let stored = Stored::of(&raw.kind, raw.size).ok_or_else(|| {
            let found = format!("type {:?} of {} bytes", raw.kind, raw.size);
            input.error(place(), found, "signed, unsigned or float of 1 to 8 bytes")
        })?;
        let transform = match (raw.scale, raw.offset) {
            (None, None) => None,
            (scale, offset) => Some((scale.unwrap_or(1.0), offset.unwrap_or(0.0))),
        };
        if let Some((scale, offset)) = transform
            && !(SCALES.contains(&scale.abs()) && offset.abs() <= LARGEST_OFFSET)
        {
            let found = format!("scale {scale:e}, offset {offset:e}");
            return Err(input.error(place(), found, "numbers that coordinates can have"));
        }
        let start = at;
        at += stored.bytes();
        Ok(Dimension {
            name: raw.name,
            stored,
            transform,
            at: start,
        })
    };
    raw.into_iter().map(&mut one).collect()
}

/// An error of a file beside `ept.json`.
pub(super) fn damaged(
    input: &Input,
    name: &str,
    found: impl Into<String>,
    expected: &str,
) -> Error {
    Error::input(input.path.with_file_name(name), "content", found, expected)
}

/// An error unless a file has the points that the hierarchy says.
pub(super) fn agrees(input: &Input, name: &str, found: u64, expected: u64) -> Result<()> {
    match found == expected {
        true => Ok(()),
        false => Err(damaged(
            input,
            name,
            format!("{found} points"),
            &format!("{expected}, as the hierarchy says"),
        )),
    }
}
