//! The manifest: parameters, output and the identity of every input of a run. It ensures that a run is
//! resumed only with the same ones.

use super::{Builder, Reconstruction};
use crate::params::Params;
use outcrop_disk::error::{Error, Result};
use outcrop_mesh::surface::evidence::Division;
use outcrop_platform::{FileAt, modified, path_bytes, path_of_bytes};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};

/// The format of scratch folders that this program writes and reads.
const FORMAT: u32 = 15;

/// Bytes of each sample of an input.
const SAMPLE: u64 = 64 << 10;

/// A path, as text if it is valid UTF-8.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum Name {
    Text(String),
    Bytes(Vec<u8>),
}

impl Name {
    /// The absolute path.
    fn of(path: &Path) -> Result<Self> {
        let path = match outcrop_points::is_remote(path) {
            true => path.to_path_buf(),
            false => std::path::absolute(path).map_err(|e| Error::io(path, "find", e))?,
        };
        Ok(match path.as_os_str().to_str() {
            Some(text) => Self::Text(text.to_owned()),
            None => Self::Bytes(path_bytes(&path)),
        })
    }

    fn path(&self) -> PathBuf {
        match self {
            Self::Text(text) => text.into(),
            Self::Bytes(bytes) => path_of_bytes(bytes.clone()),
        }
    }
}

/// The identity of an input file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Identity {
    path: Name,
    bytes: u64,
    /// Seconds and nanoseconds of its last change.
    modified: (i64, i64),
    /// CRC-32 of four samples: the beginning, the end, and two places between; of a remote file 0.
    sample: u32,
    /// The entity tag of a remote file.
    tag: Option<String>,
}

impl Identity {
    fn of(path: &Path) -> Result<Self> {
        if outcrop_points::is_remote(path) {
            let version = outcrop_formats::version(path)?;
            let (seconds, nanoseconds) = version.modified;
            return Ok(Self {
                path: Name::of(path)?,
                bytes: version.bytes,
                modified: (seconds, nanoseconds.into()),
                sample: 0,
                tag: version.tag,
            });
        }
        let io = |action: &'static str| move |e| Error::io(path, action, e);
        let file = File::open(path).map_err(io("open"))?;
        let meta = file.metadata().map_err(io("read the size of"))?;
        let mut crc = crc32fast::Hasher::new();
        // Pipes and devices are refused later, with a clearer message.
        if meta.is_file() {
            let last = meta.len().saturating_sub(SAMPLE);
            let mut buffer = vec![0; SAMPLE.min(meta.len()) as usize];
            for at in [0, last / 3, last / 3 * 2, last] {
                file.read_exact_at(&mut buffer, at).map_err(io("read"))?;
                crc.update(&buffer);
            }
        }
        Ok(Self {
            path: Name::of(path)?,
            bytes: meta.len(),
            modified: modified(&meta),
            sample: crc.finalize(),
            tag: None,
        })
    }
}

impl Identity {
    /// All but the path, each with its name.
    fn facts(&self) -> [(&'static str, String); 4] {
        let (seconds, nanoseconds) = self.modified;
        [
            ("size", format!("{} bytes", self.bytes)),
            ("content", format!("checksum {:08x}", self.sample)),
            (
                "time of last change",
                format!("{seconds}.{nanoseconds:09} s"),
            ),
            ("entity tag", self.tag.clone().unwrap_or_default()),
        ]
    }
}

/// The manifest of a run.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Manifest {
    format: u32,
    version: String,
    output: Name,
    params: Params,
    block: u32,
    division: Division,
    tile_points: u32,
    page_points: usize,
    /// Inputs as given.
    inputs: Vec<Name>,
    files: Vec<Identity>,
}

impl Manifest {
    /// Makes the manifest of a run; samples every input.
    pub fn of(job: &Reconstruction) -> Result<Self> {
        let mut files = outcrop_formats::expand(&job.inputs)?;
        // What they say is in the mesh.
        let beside = files.iter().map(|file| outcrop_points::prj_of(file));
        let mut beside: Vec<PathBuf> = beside.filter(|path| path.is_file()).collect();
        beside.sort();
        beside.dedup();
        files.extend(beside);
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
            files: files
                .iter()
                .map(|p| Identity::of(p))
                .collect::<Result<_>>()?,
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

    /// The settings of the run.
    pub fn settings(self) -> Builder {
        let params = Params {
            block: self.block,
            division: self.division,
            ..self.params
        };
        let inputs = self.inputs.iter().map(Name::path);
        inputs
            .fold(Reconstruction::builder(), Builder::input)
            .output(self.output.path())
            .params(params)
            .tile_points(self.tile_points)
            .page_points(self.page_points)
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
        for (was, now) in self.files.iter().zip(&now.files) {
            if was.path != now.path {
                let shown = |name: &Name| name.path().display().to_string();
                return differ("an input".into(), shown(&was.path), shown(&now.path));
            }
            for ((what, was_so), (_, is_so)) in was.facts().into_iter().zip(now.facts()) {
                if was_so != is_so {
                    let path = was.path.path();
                    return differ(format!("the {what} of {}", path.display()), was_so, is_so);
                }
            }
        }
        let (was, now) = (self.files.len(), now.files.len());
        if was != now {
            return differ(
                "the number of inputs".into(),
                was.to_string(),
                now.to_string(),
            );
        }
        Ok(())
    }

    fn json(&self) -> serde_json::Value {
        // All fields can be represented in JSON.
        serde_json::to_value(self).unwrap_or_default()
    }
}
