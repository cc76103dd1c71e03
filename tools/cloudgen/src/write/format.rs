//! The output formats and their names.

use std::{path::Path, str::FromStr};

use crate::error::{Error, Result};

/// LAS point data record format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointFormat {
    /// Format 0 in LAS 1.2, at most 2^32 - 1 points.
    #[default]
    Legacy,
    /// Format 2 in LAS 1.2, with colours of 16 bits and intensities that depend on the position.
    Colored,
    /// Format 6 in LAS 1.4.
    Extended,
    /// Format 7 in LAS 1.4, with the same colours and intensities.
    ExtendedColored,
}

/// Settings of LAS and LAZ files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LasOptions {
    /// Point data record format.
    pub point_format: PointFormat,
    /// Step of the integer coordinates; None for 0.001, or for 1/1024 for a grid, whose nodes are then exact.
    pub scale: Option<f64>,
}

/// Number representation of PLY files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Binary, least significant byte first.
    LittleEndian,
    /// Binary, most significant byte first.
    BigEndian,
    /// Text.
    Ascii,
}

/// Coordinate type of PLY files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 32-bit floats.
    Single,
    /// 64-bit floats.
    Double,
}

/// An output format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    /// LAS.
    Las(LasOptions),
    /// Compressed LAS.
    Laz(LasOptions),
    /// PLY.
    Ply(Encoding, Precision),
    /// Text with three numbers per line, which are read back exactly.
    Xyz,
}

const NAMES: &str = "las, laz, ply (= ply-le-f64), ply-le-f32, ply-be-f32, ply-be-f64, \
                     ply-ascii (= ply-ascii-f64), ply-ascii-f32 or xyz";

impl Format {
    /// The format by the extension of a file name.
    pub fn from_path(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let extension = path
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "las" => Ok(Format::Las(LasOptions::default())),
            "laz" => Ok(Format::Laz(LasOptions::default())),
            "ply" => Ok(Format::Ply(Encoding::LittleEndian, Precision::Double)),
            "xyz" | "txt" => Ok(Format::Xyz),
            _ => Err(Error::UnknownFormat {
                path: path.to_path_buf(),
            }),
        }
    }

    /// The same format with other LAS settings; other formats stay as they are.
    pub fn with_las_options(self, options: LasOptions) -> Self {
        match self {
            Format::Las(_) => Format::Las(options),
            Format::Laz(_) => Format::Laz(options),
            Format::Ply(..) | Format::Xyz => self,
        }
    }
}

impl FromStr for Format {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        use Encoding::{Ascii, BigEndian, LittleEndian};
        use Precision::{Double, Single};
        Ok(match text {
            "las" => Format::Las(LasOptions::default()),
            "laz" => Format::Laz(LasOptions::default()),
            "ply" | "ply-le-f64" => Format::Ply(LittleEndian, Double),
            "ply-le-f32" => Format::Ply(LittleEndian, Single),
            "ply-be-f64" => Format::Ply(BigEndian, Double),
            "ply-be-f32" => Format::Ply(BigEndian, Single),
            "ply-ascii" | "ply-ascii-f64" => Format::Ply(Ascii, Double),
            "ply-ascii-f32" => Format::Ply(Ascii, Single),
            "xyz" => Format::Xyz,
            _ => return Err(Error::parameter("format", text, format!("one of {NAMES}"))),
        })
    }
}
