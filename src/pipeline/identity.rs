//! The identity of inputs: a run is resumed only with the same ones.

use outcrop_disk::error::{Error, Result};
use outcrop_platform::{FileAt, modified, path_bytes, path_of_bytes};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Bytes of each sample of an input.
const SAMPLE: u64 = 64 << 10;

/// A path, as text if it is valid UTF-8.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Name {
    Text(String),
    Bytes(Vec<u8>),
}

impl Name {
    /// The absolute path.
    pub fn of(path: &Path) -> Result<Self> {
        let path = match outcrop_points::is_remote(path) {
            true => path.to_path_buf(),
            false => std::path::absolute(path).map_err(|e| Error::io(path, "find", e))?,
        };
        Ok(match path.as_os_str().to_str() {
            Some(text) => Self::Text(text.to_owned()),
            None => Self::Bytes(path_bytes(&path)),
        })
    }

    pub fn path(&self) -> PathBuf {
        match self {
            Self::Text(text) => text.into(),
            Self::Bytes(bytes) => path_of_bytes(bytes.clone()),
        }
    }
}

/// The identity of an input file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Identity {
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

/// The identities of all files that inputs stand for, and of the files with their coordinate systems.
pub(super) fn identities(inputs: &[PathBuf]) -> Result<Vec<Identity>> {
    let mut files = outcrop_formats::expand(inputs)?;
    // What they say is in the mesh.
    let beside = files.iter().map(|file| outcrop_points::prj_of(file));
    let mut beside: Vec<PathBuf> = beside.filter(|path| path.is_file()).collect();
    beside.sort();
    beside.dedup();
    files.extend(beside);
    files.iter().map(|path| Identity::of(path)).collect()
}

/// The first difference: what differs, what it was, and what it is now.
pub(super) fn difference(was: &[Identity], now: &[Identity]) -> Option<(String, String, String)> {
    for (was, now) in was.iter().zip(now) {
        if was.path != now.path {
            let shown = |name: &Name| name.path().display().to_string();
            return Some(("an input".into(), shown(&was.path), shown(&now.path)));
        }
        for ((what, was_so), (_, is_so)) in was.facts().into_iter().zip(now.facts()) {
            if was_so != is_so {
                let path = was.path.path();
                return Some((format!("the {what} of {}", path.display()), was_so, is_so));
            }
        }
    }
    let what = || "the number of inputs".into();
    let (was, now) = (was.len(), now.len());
    (was != now).then(|| (what(), was.to_string(), now.to_string()))
}
