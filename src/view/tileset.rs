//! `tileset.json`: the tree of tiles.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::io::Read;
use std::path::Path;

/// Name of the file in its folder.
pub const NAME: &str = "tileset.json";

/// Longest `tileset.json` in bytes: some 100 000 tiles, 6 G triangles.
const LONGEST: u64 = 64 << 20;

/// The tree of tiles with all that is said about it.
#[derive(Debug, Serialize, Deserialize)]
pub struct Tileset {
    pub asset: Asset,
    /// The tile that shows the whole mesh.
    pub root: Tile,
    /// Everything else.
    #[serde(flatten)]
    pub more: Map<String, Value>,
}

/// Version of the format.
#[derive(Debug, Serialize, Deserialize)]
pub struct Asset {
    pub version: String,
    #[serde(flatten)]
    pub more: Map<String, Value>,
}

/// A part of the mesh at one level of detail.
#[derive(Debug, Serialize, Deserialize)]
pub struct Tile {
    /// Largest distance from the full mesh.
    #[serde(rename = "geometricError")]
    pub error: f64,
    /// Its file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content: Option<Content>,
    /// The same part in more detail.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub children: Vec<Tile>,
    /// Everything else.
    #[serde(flatten)]
    pub more: Map<String, Value>,
}

/// The file of a tile.
#[derive(Debug, Serialize, Deserialize)]
pub struct Content {
    /// Path relative to `tileset.json`.
    pub uri: String,
    #[serde(flatten)]
    pub more: Map<String, Value>,
}

impl Tileset {
    /// Reads the tileset of a folder.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join(NAME);
        let opened = std::fs::File::open(&path).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound if folder.is_dir() => Error::input(
                folder,
                "folder",
                "no tileset.json",
                "a folder that `outcrop tiles` made",
            ),
            _ => Error::io(&path, "open", e),
        })?;
        let mut text = Vec::new();
        let read = opened.take(LONGEST + 1).read_to_end(&mut text);
        read.map_err(|e| Error::io(&path, "read", e))?;
        if text.len() as u64 > LONGEST {
            let found = format!("more than {LONGEST} bytes");
            return Err(Error::input(&path, "length", found, "a shorter tileset"));
        }
        serde_json::from_slice(&text).map_err(|e| {
            let place = format!("line {}, column {}", e.line(), e.column());
            Error::input(&path, place, e.to_string(), "a tileset of 3D Tiles")
        })
    }

    /// A property of the mesh that `outcrop tiles` notes, by its name in `extras.outcrop`.
    pub fn property(&self, name: &str) -> Option<&Value> {
        self.more.get("extras")?.get("outcrop")?.get(name)
    }
}

impl Tile {
    /// Number of triangles, if it is noted.
    pub fn triangles(&self) -> u64 {
        let noted = self.more.get("extras").and_then(|e| e.get("outcrop"));
        noted
            .and_then(|noted| noted.get("triangles")?.as_u64())
            .unwrap_or(0)
    }
}
