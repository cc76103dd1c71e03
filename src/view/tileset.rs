//! `tileset.json`: the tree of tiles.

use outcrop_disk::error::{Error, Result};
use serde::de::{DeserializeOwned, IgnoredAny};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

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

/// The parts of a tileset that a viewer cannot do without, for a check that keeps little.
#[derive(Deserialize)]
struct Outline {
    asset: Version,
    root: Branch,
    #[serde(default)]
    extras: Value,
}

#[derive(Deserialize)]
struct Version {
    version: String,
}

#[derive(Deserialize)]
struct Branch {
    #[serde(rename = "geometricError")]
    error: f64,
    #[serde(rename = "content")]
    _content: Option<Uri>,
    #[serde(default)]
    children: Vec<Branch>,
    transform: Option<Box<[f64; 16]>>,
}

#[derive(Deserialize)]
struct Uri {
    #[serde(rename = "uri")]
    _uri: IgnoredAny,
}

/// What tells where a tileset lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Facts {
    /// Its `tileset.json`.
    pub path: PathBuf,
    /// True for points of a cloud.
    pub is_cloud: bool,
    /// True if this program made it: its coordinates are those of the scan less the origin.
    pub is_ours: bool,
    /// The origin of its coordinates.
    pub origin: [f64; 3],
    /// EPSG code of its reference system.
    pub epsg: Option<u64>,
    /// The map from its coordinates to the globe, by columns.
    pub transform: Option<Box<[f64; 16]>>,
}

impl Branch {
    /// True if all errors are numbers that a viewer can compare.
    fn is_fine(&self) -> bool {
        self.error >= 0.0 && self.children.iter().all(Branch::is_fine)
    }
}

/// Reads `tileset.json` of a folder.
fn read<T: DeserializeOwned>(folder: &Path) -> Result<T> {
    let path = folder.join(NAME);
    let file = std::fs::File::open(&path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound if folder.is_dir() => Error::input(
            folder,
            "folder",
            "no tileset.json",
            "a folder that `outcrop tiles` made",
        ),
        _ => Error::io(&path, "open", e),
    })?;
    let length = file
        .metadata()
        .map_err(|e| Error::io(&path, "read", e))?
        .len();
    if length > LONGEST {
        let found = format!("{length} bytes");
        return Err(Error::input(
            &path,
            "length",
            found,
            format!("at most {LONGEST} bytes"),
        ));
    }
    serde_json::from_reader(BufReader::new(file.take(length))).map_err(|e| {
        let place = format!("line {}, column {}", e.line(), e.column());
        Error::input(&path, place, e.to_string(), "a tileset of 3D Tiles")
    })
}

/// A tileset, or a mesh of which one is made later.
#[derive(Debug, Clone, Copy)]
pub enum Place<'a> {
    /// The folder of a tileset.
    Folder(&'a Path),
    /// A mesh, and the EPSG code of its reference system, if that is known.
    Mesh(&'a Path, Option<u32>),
}

impl Place<'_> {
    fn facts(&self) -> Result<Facts> {
        match *self {
            Self::Folder(folder) => Tileset::check(folder),
            Self::Mesh(path, epsg) => Ok(Facts {
                path: path.to_path_buf(),
                is_cloud: false,
                is_ours: true,
                origin: [0.0; 3],
                epsg: epsg.map(u64::from),
                transform: None,
            }),
        }
    }
}

/// An error unless all tilesets are valid, and all places can be shown together, as far as that is known.
///
/// # Errors
/// [`Error::Input`], [`Error::Io`].
pub fn check(places: &[Place<'_>]) -> Result<()> {
    let facts = places.iter().map(Place::facts);
    match &facts.collect::<Result<Vec<Facts>>>()?[..] {
        [first, others @ ..] => others
            .iter()
            .try_for_each(|other| other.beside(first).map(|_| ())),
        [] => Ok(()),
    }
}

impl Tileset {
    /// Reads the tileset of a folder. It takes some ten times its length of memory.
    pub fn open(folder: &Path) -> Result<Self> {
        read(folder)
    }

    /// Where the tileset of a folder lies. An error if the folder has no valid one; less memory is taken than the file
    /// is long.
    pub fn check(folder: &Path) -> Result<Facts> {
        let outline: Outline = read(folder)?;
        let invalid = |place: &str, found: String, expected: &str| {
            Err(Error::input(folder.join(NAME), place, found, expected))
        };
        let version = outline.asset.version;
        if version != "1.0" && version != "1.1" {
            return invalid("asset", format!("version {version:?}"), "1.0 or 1.1");
        }
        if !outline.root.is_fine() {
            return invalid(
                "root",
                "a negative geometricError".into(),
                "errors of at least 0",
            );
        }
        let noted = &outline.extras["outcrop"];
        let origin = serde_json::from_value(noted["origin"].clone()).ok();
        Ok(Facts {
            path: folder.join(NAME),
            is_cloud: noted["of_points"].is_number(),
            is_ours: origin.is_some(),
            origin: origin.unwrap_or_default(),
            epsg: noted["epsg"].as_u64(),
            transform: outline.root.transform,
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
