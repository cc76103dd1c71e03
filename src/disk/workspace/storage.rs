//! How scratch files are read and written.

use super::mapped::Io;
use std::str::FromStr;

/// How files are read and written; it changes no result.
#[derive(Debug, Clone, Copy, Default)]
pub struct Storage {
    /// The way in which files are read.
    pub io: Io,
    /// The compression of rows.
    pub compression: Compression,
}

/// Compression of rows in scratch files with Zstandard.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Compression {
    /// At level 1 where the disk is not local, or is slower than compression; else none.
    #[default]
    Auto,
    /// None.
    None,
    /// At a level of Zstandard, 1 to 3: higher ones take several MiB for each thread to save little.
    Level(i32),
}

impl FromStr for Compression {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match (text, text.parse()) {
            ("auto", _) => Ok(Self::Auto),
            ("none", _) => Ok(Self::None),
            (_, Ok(level @ 1..=3)) => Ok(Self::Level(level)),
            _ => Err(format!("{text:?} is not auto, none or a level from 1 to 3")),
        }
    }
}
