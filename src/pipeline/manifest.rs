//! The manifest: parameters, output and the identity of every input of a run. It ensures that a run is
//! resumed only with the same ones.

use super::Reconstruction;
use super::format::FORMAT;
use super::identity::{Identity, Name, difference, identities};
use crate::params::Params;
use outcrop_disk::error::{Error, Result};
use outcrop_mesh::surface::evidence::Division;
use outcrop_paper::method::{Constants, METHOD, method_version};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The version of the method, and a checksum of its constants: another build may have others.
fn method() -> String {
    let constants: &Constants = &METHOD;
    let constants = crc32fast::hash(format!("{constants:?}").as_bytes());
    format!("{} {constants:08x}", method_version!())
}

/// The manifest of a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Manifest {
    /// The format of scratch files.
    format: String,
    version: String,
    /// The version of the method, and a checksum of its constants.
    method: String,
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
            format: FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            method: method(),
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
            let found = value["format"]
                .as_str()
                .map_or_else(|| value["format"].to_string(), ToString::to_string);
            return Err(not(format!(
                "another build of the program began it: its format is {found}, this program writes and reads {FORMAT}"
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
            "method",
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

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest() -> Manifest {
        let params = Params::default();
        Manifest {
            format: FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            method: method(),
            output: Name::Text("/mesh.ply".into()),
            block: params.block,
            division: params.division,
            params,
            tile_points: 1,
            page_points: 2,
            inputs: vec![Name::Text("/cloud.laz".into())],
            files: Vec::new(),
        }
    }

    #[test]
    fn another_format_is_refused() {
        let (folder, mut other) = (Path::new("/scratch"), manifest());
        let read = |bytes: &[u8]| Manifest::from_bytes(folder, bytes);
        read(&other.to_bytes().unwrap()).unwrap();
        other.format = "0123abcd".into();
        let bytes = other.to_bytes().unwrap();
        let numbered = String::from_utf8(bytes.clone()).unwrap();
        let numbered = numbered.replace("\"0123abcd\"", "15");
        for (bytes, found) in [(&bytes[..], "0123abcd"), (numbered.as_bytes(), "15")] {
            let error = read(bytes).unwrap_err();
            assert!(matches!(error, Error::NotResumable { .. }));
            let text = error.to_string();
            let end = format!("its format is {found}, this program writes and reads {FORMAT}");
            assert!(text.starts_with("/scratch: another build"), "{text}");
            assert!(text.ends_with(&end), "{text}");
            assert_eq!(text.lines().count(), 1);
        }
    }

    #[test]
    fn another_method_is_refused() {
        let (was, mut now) = (manifest(), manifest());
        was.check(&now, Path::new("/scratch")).unwrap();
        now.method = "3 01234567".into();
        let error = was.check(&now, Path::new("/scratch")).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("the method was \"3 "), "{text}");
        assert!(text.contains("now it is \"3 01234567\""), "{text}");
    }
}
