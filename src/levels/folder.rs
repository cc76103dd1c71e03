//! The folder with the tileset: `tileset.json` and the tiles.

use super::make::Maker;
use super::node::Bounds;
use super::report::Lossy;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use serde_json::{Value, json};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Name of the file with the tree.
pub const NAME: &str = "tileset.json";

/// Name of the folder of the tiles.
const TILES: &str = "tiles";

/// Facts about the mesh, for the extras of the tileset.
#[derive(Debug, Clone, Default)]
pub(super) struct About {
    /// Name of the mesh file.
    pub source: String,
    /// Well-known text or name of its reference system.
    pub crs: Option<String>,
    pub epsg: Option<u32>,
    /// Metres in a unit of heights, if that is known.
    pub height_unit: Option<f64>,
    /// The map from the local frame to the globe, by columns.
    pub transform: Option<[f64; 16]>,
}

fn volume(bounds: &Bounds, step: f64) -> Value {
    let side = |axis: usize| (f64::from(bounds.min[axis]), f64::from(bounds.max[axis]));
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let (min, max) = side(axis);
        (min + max) / 2.0 * step
    });
    let [a, b, c] = [0, 1, 2].map(|axis| {
        let (min, max) = side(axis);
        ((max - min) / 2.0 + 0.5) * step
    });
    json!({ "box": [x, y, z, a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c] })
}

impl Maker<'_> {
    fn tile(&self, number: usize) -> Value {
        let (node, made) = (&self.nodes[number], &self.made[number]);
        let mut tile = json!({
            "boundingVolume": volume(&self.bounds[number], self.intake.lattice.step),
            "geometricError": made.error,
            "content": { "uri": format!("{TILES}/{number}.glb") },
            "extras": { "outcrop": { "level": node.level, "triangles": made.triangles } },
        });
        if !node.children.is_empty() {
            let children = node.children.iter().map(|child| self.tile(*child));
            tile["children"] = children.collect();
        }
        tile
    }

    /// The losses in the leaves, if the tileset is lossy.
    pub fn lossy(&self) -> Option<Lossy> {
        let leaves = &self.made[..self.cells.cells.len()];
        self.lossy.then(|| Lossy {
            leaf_error: leaves.iter().map(|leaf| leaf.error).fold(0.0, f64::max),
            collapsed: leaves.iter().map(|leaf| leaf.collapsed).sum(),
        })
    }

    fn json(&self, about: &About) -> Value {
        let (intake, root) = (self.intake, self.nodes.len() - 1);
        let mut tile = self.tile(root);
        tile["refine"] = "REPLACE".into();
        if let Some(transform) = about.transform {
            tile["transform"] = json!(transform);
        }
        let leaves = &self.made[..self.cells.cells.len()];
        let bounds = &self.bounds[root];
        let sides = (0..3).map(|axis| f64::from(bounds.max[axis] - bounds.min[axis]));
        let diagonal = sides.map(|s| s * s).sum::<f64>().sqrt() * intake.lattice.step;
        let columns: Vec<Value> = intake
            .columns
            .others()
            .map(|c| {
                json!({
                    "name": c.name, "type": c.scalar.name(),
                    "attribute": c.attribute, "offset": c.offset,
                })
            })
            .collect();
        let mut json = json!({
            "asset": { "version": "1.1" },
            "geometricError": diagonal.max(self.made[root].error),
            "root": tile,
            "extras": { "outcrop": {
                "version": 1,
                "made_by": concat!("outcrop ", env!("CARGO_PKG_VERSION")),
                "triangles": intake.triangles,
                "vertices": intake.vertices,
                "boundary_edges": leaves.iter().map(|leaf| leaf.boundary).sum::<u64>(),
                "origin": intake.lattice.origin(),
                "crs": about.crs,
                "epsg": about.epsg,
                "height_unit": about.height_unit,
                "step": vec![intake.lattice.step; 3],
                "exact": intake.lattice.exact,
                "colors": intake.columns.has_colors(),
                "columns": columns,
                "source": about.source,
            } },
        });
        if let Some(lossy) = self.lossy() {
            json["extras"]["outcrop"]["lossy"] =
                json!({ "leaf_error": lossy.leaf_error, "collapsed": lossy.collapsed });
        }
        json
    }

    /// Writes the folder. It has its name when all is in it; a tileset that had the name is then deleted.
    pub fn write_folder(&self, folder: &Path, about: &About, workspace: &Workspace) -> Result<u64> {
        // A finished run that was stopped while its scratch files were deleted has nothing to write again.
        workspace.once("folder", |_| self.put_folder(folder, about, workspace))
    }

    fn put_folder(&self, folder: &Path, about: &About, workspace: &Workspace) -> Result<u64> {
        let unfinished = beside(folder, "part");
        let failed = |path: &Path, action: &str| {
            let (path, action) = (path.to_path_buf(), action.to_owned());
            move |e| Error::io(path, action, e)
        };
        remove(&unfinished)?;
        let tiles = unfinished.join(TILES);
        std::fs::create_dir_all(&tiles).map_err(failed(&tiles, "make the folder"))?;
        let observer = &workspace.observer;
        observer.begin("write", "tiles", self.nodes.len() as u64);
        let put = |path: &Path, bytes: &[u8]| {
            let written = File::create_new(path).and_then(|mut file| file.write_all(bytes));
            written.map_err(failed(path, "write"))
        };
        let bytes_of = |n: usize| 2 * u64::from(self.made[n].bytes);
        workspace.for_each_unit("levels: files", self.nodes.len(), bytes_of, |unit| {
            let number = unit.number();
            let words = self.files.get(unit, number)?;
            let bytes: &[u8] = bytemuck::cast_slice(&words);
            put(&tiles.join(format!("{number}.glb")), bytes)?;
            unit.advance(1);
            Ok(())
        })?;
        let json = self.json(about).to_string();
        put(&unfinished.join(NAME), json.as_bytes())?;
        // All files at once: one by one would take long.
        let synced = outcrop_platform::sync_below(&unfinished);
        synced.map_err(failed(&unfinished, "sync"))?;
        let old = beside(folder, "old");
        remove(&old)?;
        if folder.exists() {
            outcrop_platform::rename(folder, &old).map_err(failed(folder, "replace"))?;
        }
        outcrop_platform::rename(&unfinished, folder)
            .map_err(failed(folder, "give its name to"))?;
        remove(&old)?;
        observer.end();
        let tiles = self.made.iter().map(|made| u64::from(made.bytes));
        Ok(tiles.sum::<u64>() + json.len() as u64)
    }
}

/// A hidden folder beside this one.
fn beside(folder: &Path, ending: &str) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(folder.file_name().unwrap_or_default());
    name.push(".outcrop-");
    name.push(ending);
    folder.with_file_name(name)
}

/// Removes what an earlier run left.
fn remove(folder: &Path) -> Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(folder, "delete", e)),
        _ => Ok(()),
    }
}

/// Removes what an unfinished run left beside the folder; it does no harm if it cannot be deleted.
pub fn remove_unfinished(folder: &Path) {
    let _ = remove(&beside(folder, "part"));
}

/// An error unless the folder does not exist, is empty, or has a tileset of this program.
///
/// # Errors
/// [`Error::Parameter`], [`Error::Io`].
pub fn check_folder(folder: &Path) -> Result<()> {
    let refuse = |found: &str| {
        Err(Error::Parameter {
            name: "output",
            found: format!("{} ({found})", folder.display()),
            expected: "a new or empty folder, or one with a tileset of outcrop".into(),
        })
    };
    if folder.file_name().is_none() {
        return refuse("a folder without a name");
    }
    let mut list = match std::fs::read_dir(folder) {
        Ok(list) => list,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(Error::io(folder, "read", e)),
    };
    if list.next().is_none() {
        return Ok(());
    }
    let ours = std::fs::read(folder.join(NAME)).is_ok_and(|json| {
        serde_json::from_slice::<Value>(&json)
            .is_ok_and(|json| json["extras"]["outcrop"]["version"].is_number())
    });
    let others = std::fs::read_dir(folder)
        .map_err(|e| Error::io(folder, "read", e))?
        .flatten()
        .any(|entry| ![NAME, TILES].contains(&&*entry.file_name().to_string_lossy()));
    match ours && !others {
        true => Ok(()),
        false => refuse("it has other files"),
    }
}
