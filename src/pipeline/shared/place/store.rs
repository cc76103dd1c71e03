//! A run in a store of objects.

use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::away::{Store, Stored, Traffic};
use outcrop_remote::{Found, Location, Scratch};
use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// The objects of a run.
#[derive(Debug)]
struct Objects(Scratch);

fn scratch(url: &Path) -> Result<Scratch> {
    let opened = Location::of(url).and_then(|location| Scratch::new(&location));
    opened.map_err(|why| Error::Parameter {
        name: "scratch",
        found: Location::masked(url).display().to_string(),
        expected: format!("a folder, or a URL such as s3://bucket/runs ({why})"),
    })
}

/// The store behind a URL.
pub fn open(url: &Path) -> Result<Arc<dyn Store>> {
    Ok(Arc::new(Objects(scratch(url)?)))
}

/// The names of what is in a folder.
pub fn names(url: &Path) -> Result<Vec<String>> {
    let found = scratch(url)?.folders();
    found.map_err(|e| Error::io(url, "list", e))
}

fn stored(found: Found) -> Stored {
    let (seconds, nanoseconds) = found.modified;
    let since = Duration::new(u64::try_from(seconds).unwrap_or(0), nanoseconds);
    Stored {
        name: found.name,
        bytes: found.bytes,
        modified: SystemTime::UNIX_EPOCH + since,
    }
}

impl Store for Objects {
    fn list(&self, under: &str) -> io::Result<Vec<Stored>> {
        Ok(self.0.list(under)?.into_iter().map(stored).collect())
    }

    fn look(&self, name: &str) -> io::Result<Option<Stored>> {
        Ok(self.0.look(name)?.map(stored))
    }

    fn read(&self, name: &str, range: Range<u64>) -> io::Result<Vec<u8>> {
        self.0.read(name, range).map(Into::into)
    }

    fn put(&self, name: &str, file: &File, bytes: u64) -> io::Result<()> {
        self.0.put(name, file, bytes)
    }

    fn put_new(&self, name: &str, bytes: Vec<u8>) -> io::Result<bool> {
        self.0.put_new(name, bytes)
    }

    fn delete(&self, name: &str) -> io::Result<()> {
        self.0.delete(name)
    }

    fn part(&self) -> u64 {
        self.0.part()
    }

    fn traffic(&self) -> Traffic {
        let (requests, fetched, sent) = self.0.traffic();
        Traffic {
            requests,
            fetched,
            sent,
        }
    }
}
