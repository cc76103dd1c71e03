//! Options of a tileset, and the report on it.

use super::cells::MOST;
use outcrop_disk::error::Setting;
use outcrop_points::{Crs, GivenCrs};
use serde::{Deserialize, Serialize};

/// Options that decide the tileset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Options {
    /// Place the tileset on the globe, by the reference system of the mesh.
    pub geo: bool,
    /// The reference system of the mesh, instead of what it says of it.
    pub crs: Option<GivenCrs>,
    /// Round positions, normals, colours and other values, so that tiles are smaller.
    pub lossy: bool,
    /// Most triangles of a leaf, unless it cannot be divided: for tests.
    #[doc(hidden)]
    pub most_triangles: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            geo: false,
            crs: None,
            lossy: false,
            most_triangles: MOST,
        }
    }
}

/// What a lossy tileset has lost at its leaves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Lossy {
    /// Largest distance of the leaves from the mesh, at most, in the mesh's unit.
    pub leaf_error: f64,
    /// Triangles of the mesh that rounding left without an area, and that no leaf has.
    pub collapsed: u64,
}

/// Counts and sizes of a tileset.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TilesReport {
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Triangles of the mesh: those of the leaves, unless rounding left some out.
    pub triangles: u64,
    /// Edges of the mesh with one triangle.
    pub boundary_edges: u64,
    /// Number of tiles.
    pub tiles: u64,
    /// Tiles without children.
    pub leaves: u64,
    /// Levels of the tree.
    pub levels: u32,
    /// Bytes of all files.
    pub bytes: u64,
    /// Bytes of the root's file.
    pub root_bytes: u64,
    /// Triangles of the root.
    pub root_triangles: u64,
    /// Largest distance of the root from the mesh, at most, in the mesh's unit.
    pub root_error: f64,
    /// Step of the coordinates, in the mesh's unit.
    pub step: f64,
    /// True if all coordinates are multiples of the step.
    pub exact: bool,
    /// What was lost, if the tileset is lossy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lossy: Option<Lossy>,
    /// The reference system of the mesh.
    pub crs: Option<Crs>,
}

impl std::fmt::Display for TilesReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.told(Setting::to_string))
    }
}

impl TilesReport {
    /// As text, for a front that spells options so.
    #[must_use]
    pub fn told(&self, spell: impl Fn(&Setting) -> String) -> String {
        let megabytes = |bytes: u64| bytes as f64 / 1e6;
        let system = self.crs.as_ref().map(|crs| crs.described(spell));
        let system = system.map_or_else(String::new, |system| format!("system: {system}\n"));
        let lossy = self.lossy.map_or_else(String::new, |lossy| {
            format!(
                "rounded: all triangles within {:.6} of the mesh, {} without area left out\n",
                lossy.leaf_error, lossy.collapsed
            )
        });
        format!(
            "{} triangles in {} tiles of {} levels, {:.1} MB\n\
             {system}{lossy}\
             coarsest tile: {} triangles, {:.2} MB, at most {:.6} from the mesh",
            self.triangles,
            self.tiles,
            self.levels,
            megabytes(self.bytes),
            self.root_triangles,
            megabytes(self.root_bytes),
            self.root_error
        )
    }
}
