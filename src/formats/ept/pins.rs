//! Tiles on a server that change while a run reads them, or between two attempts at it.
//!
//! `ept.json` is an input, whose version the manifest has. The files of the hierarchy, and the root of LAZ tiles, are
//! read by every attempt and every task: their versions are in the journal, and must stay. All other tiles are read
//! once, so that nothing could be compared, and a request for each would be needed to know them before. But stores
//! say when a file has changed; a tile that is newer than the run is refused.

use super::super::input::Input;
use super::super::remote::Version;
use outcrop_disk::error::{Error, Result};
use outcrop_points::spool::SourceWriter;
use serde::{Deserialize, Serialize};

/// A file with its version.
pub(super) type Pinned = (String, Version);

/// Seconds by which the hierarchy must be older than the run: a server that says of all files that they have changed
/// just now says nothing about changes.
const OLDER: i64 = 2;

/// What the journal keeps.
#[derive(Serialize, Deserialize)]
struct Pins {
    files: Vec<Pinned>,
    /// The time at the server when the run began, if that tells changes.
    begun: Option<i64>,
}

/// Checks that these files are those of earlier attempts. Returns the time, in seconds since 1970, after which no tile
/// may have changed.
///
/// # Errors
/// [`Error::Io`] if one has changed; errors of the journal.
pub(super) fn check(
    input: &Input,
    files: &mut Vec<Pinned>,
    target: &SourceWriter<'_>,
) -> Result<Option<i64>> {
    if files.is_empty() {
        return Ok(None);
    }
    files.sort_by(|a, b| a.0.cmp(&b.0));
    let latest = files.iter().map(|(_, version)| version.modified.0).max();
    let tells = |time: &i64| latest.is_some_and(|latest| latest + OLDER <= *time);
    let was: Pins = target.workspace.once(&target.step("EPT versions"), |_| {
        Ok(Pins {
            files: files.clone(),
            begun: input.clock().filter(tells),
        })
    })?;
    let pairs = was.files.iter().zip(&*files);
    match pairs.into_iter().find(|(was, now)| was != now) {
        None if was.files.len() == files.len() => Ok(was.begun),
        None => {
            let (was, now) = (was.files.len(), files.len());
            let why = format!("it has {now} files now, and had {was} when the run began");
            Err(changed(input, "ept-hierarchy", why))
        }
        Some(((name, was), (_, now))) => {
            let why = format!(
                "the file has changed on the server since the run began: it was {}, and is {}",
                told(was),
                told(now)
            );
            Err(changed(input, name, why))
        }
    }
}

fn told(version: &Version) -> String {
    let Version {
        bytes,
        tag,
        modified: (seconds, _),
    } = version;
    let tag = tag.as_deref().unwrap_or("none");
    format!("tag {tag}, {bytes} bytes, changed at {seconds} s")
}

/// The scratch folder stays: the server may have the file again.
fn changed(input: &Input, name: &str, why: String) -> Error {
    let path = input.path.with_file_name(name);
    let why = std::io::Error::new(std::io::ErrorKind::InvalidData, why);
    Error::io(path, "go on with", why)
}
