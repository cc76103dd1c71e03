//! The manifest: parameters, output and the identity of every input of a run. It ensures that a run is
//! resumed only with the same ones.

use super::Reconstruction;
use super::identity::{Identity, Name, difference, identities};
use crate::params::Params;
use outcrop_disk::error::{Error, Result};
use outcrop_mesh::surface::evidence::Division;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The format of scratch folders that this program writes and reads.
const FORMAT: u32 = 15;

/// The manifest of a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Manifest {
    format: u32,
    version: String,
    output: Name,
    params: Params,
    block: u32,
    division: Division,
    pub tile_points: u32,
    pub page_points: usize,
    /// Inputs as given.
    inputs: Vec<Name>,
    files: Vec<Identity>,
}

impl Manifest {
    /// Makes the manifest of a run; samples every input.
    pub fn of(job: &Reconstruction) -> Result<Self> {
        Ok(Self {
            format: FORMAT,
            version: env!("CARGO_PKG_VERSION").into(),
            output: Name::of(job.output())?,
            params: job.params.clone(),
            block: job.params.block,
            division: job.params.division,
            tile_points: job.tile_points,
            page_points: job.page_points,
            inputs: job
                .inputs
                .iter()
                .map(|p| Name::of(p))
                .collect::<Result<_>>()?,
            files: identities(&job.inputs)?,
        })
    }

    /// Path of the mesh.
    pub fn output(&self) -> PathBuf {
        self.output.path()
    }

    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        serde_json::to_vec_pretty(self)
            .map_err(|e| Error::io(self.output.path(), "write the manifest", e.into()))
    }

    pub fn from_bytes(folder: &Path, bytes: &[u8]) -> Result<Self> {
        let not = |why: String| Error::not_resumable(folder, why);
        let value: serde_json::Value = serde_json::from_slice(bytes)
            .map_err(|e| not(format!("its manifest cannot be read: {e}")))?;
        if value["format"] != FORMAT {
            return Err(not(format!(
                "its format is {}, this program writes and reads {FORMAT}",
                value["format"]
            )));
        }
        serde_json::from_value(value).map_err(|e| not(format!("its manifest cannot be read: {e}")))
    }

    /// The parameters of the run.
    pub fn params(&self) -> Params {
        Params {
            block: self.block,
            division: self.division,
            ..self.params.clone()
        }
    }

    /// The inputs, as they were given.
    pub fn inputs(&self) -> impl Iterator<Item = PathBuf> {
        self.inputs.iter().map(Name::path)
    }

    /// Takes the output of `now`, if that is another one. Nothing but the export depends on it.
    pub fn write_elsewhere(&mut self, now: &Self) {
        if self.output != now.output {
            self.output = now.output.clone();
            self.params.compress_glb = now.params.compress_glb;
            self.params.lossy = now.params.lossy;
        }
    }

    /// # Errors
    /// [`Error::Mismatch`] with the first difference to `now`.
    pub fn check(&self, now: &Self, folder: &Path) -> Result<()> {
        let differ = |what: String, was: String, now: String| {
            Err(Error::Mismatch {
                path: folder.to_path_buf(),
                what,
                was,
                now,
            })
        };
        let (was_json, now_json) = (self.json(), now.json());
        for key in [
            "version",
            "output",
            "block",
            "division",
            "tile_points",
            "page_points",
        ] {
            if was_json[key] != now_json[key] {
                let what = format!("the {}", key.replace('_', " "));
                return differ(what, was_json[key].to_string(), now_json[key].to_string());
            }
        }
        if let (Some(was), Some(now)) = (
            was_json["params"].as_object(),
            now_json["params"].as_object(),
        ) {
            for (key, value) in was {
                if now.get(key) != Some(value) {
                    let what = format!("the parameter {key}");
                    let now = now.get(key).map_or("none".into(), ToString::to_string);
                    return differ(what, value.to_string(), now);
                }
            }
        }
        match difference(&self.files, &now.files) {
            Some((what, was, now)) => differ(what, was, now),
            None => Ok(()),
        }
    }

    fn json(&self) -> serde_json::Value {
        // All fields can be represented in JSON.
        serde_json::to_value(self).unwrap_or_default()
    }
}
