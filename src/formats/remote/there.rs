//! Remote files, by `outcrop-remote`.

use super::{Fetched, Version};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::compressed::Content;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::{Workspace, lock};
use outcrop_remote::{Counts, GAP, Location, Object, Room, Whole};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Most files below a prefix. Their names are reserved with those of all inputs.
const MOST: usize = 1 << 20;

/// Most memory for parts that are fetched before they are read, and its share of what is free: it keeps eight requests
/// of 4 MiB under way.
const AHEAD: u64 = 32 << 20;
const SHARE: u64 = 8;

/// Memory that requests take besides what they fetch, for as long as the process lives: code and tables of HTTP and TLS,
/// certificates, and what the threads that fetched leave. Measured: 3.6 to 4.2 MiB.
const REQUESTS: u64 = 4 << 20;

/// A remote file that is open.
#[derive(Debug)]
pub(in super::super) struct Remote {
    object: Object,
    /// Memory for what is fetched before it is read.
    held: Mutex<Option<Reservation>>,
}

impl Remote {
    /// Opens a remote file.
    pub(in super::super) fn open(path: &Path) -> Result<Self> {
        let object = Object::open(&location(path)?, &Arc::default());
        Ok(Self {
            object: object.map_err(|e| Error::io(path, "open", e))?,
            held: Mutex::default(),
        })
    }

    /// Reserves what requests take besides what they fetch.
    pub(in super::super) fn count(workspace: &Workspace) -> Result<()> {
        workspace.memory.keep("requests", REQUESTS)
    }

    pub(in super::super) fn version(&self) -> Version {
        self.object.version().clone().into()
    }

    /// True if the server sends parts of the file.
    pub(in super::super) fn has_parts(&self) -> bool {
        self.object.has_parts()
    }

    pub(in super::super) fn read_at(
        &self,
        buffer: &mut [u8],
        offset: u64,
    ) -> std::io::Result<usize> {
        self.object.read_at(buffer, offset)
    }

    /// Says what will be read, in this order, so that it is fetched before.
    pub(in super::super) fn expect(
        &self,
        ranges: impl IntoIterator<Item = Range<u64>>,
        workspace: &Workspace,
    ) -> Result<()> {
        let mut held = lock(&self.held);
        *held = None;
        let ranges: Vec<Range<u64>> = ranges.into_iter().collect();
        let wanted = ranges
            .iter()
            .map(|range| range.end.saturating_sub(range.start) + GAP);
        let room = room(wanted.fold(0, u64::saturating_add), workspace);
        *held = Some(workspace.reserve("fetched ahead", room.bytes)?);
        self.object.expect(ranges, room);
        Ok(())
    }

    /// The whole file in the scratch folder.
    pub(in super::super) fn save(&self, path: &Path, workspace: &Workspace) -> Result<Content> {
        self.expect(std::iter::once(0..self.object.size()), workspace)?;
        let source = Whole::of(&self.object).map_err(|e| Error::io(path, "read", e))?;
        Content::saved(path, source, workspace)
    }

    pub(in super::super) fn fetched(&self) -> Fetched {
        let counts = self.object.counts();
        Fetched {
            requests: counts.requests(),
            bytes: counts.bytes(),
        }
    }

    /// The latest time that the server told, in seconds since 1970.
    pub(in super::super) fn clock(&self) -> Option<i64> {
        self.object.counts().clock()
    }

    /// The files in its folder.
    pub(in super::super) fn beside(&self, path: &Path) -> Result<Beside> {
        let beside = outcrop_remote::Beside::of(&self.object);
        beside.map(Beside).map_err(|e| Error::io(path, "open", e))
    }
}

impl From<outcrop_remote::Version> for Version {
    fn from(version: outcrop_remote::Version) -> Self {
        let outcrop_remote::Version {
            bytes,
            tag,
            modified,
        } = version;
        Self {
            bytes,
            tag,
            modified,
        }
    }
}

/// The files in the folder of a remote file.
#[derive(Debug)]
pub(in super::super) struct Beside(outcrop_remote::Beside);

impl Beside {
    /// The bytes of a file, at most `most`, and its version.
    pub(in super::super) fn read(
        &self,
        name: &str,
        most: u64,
    ) -> std::io::Result<(Vec<u8>, Version)> {
        let (bytes, version) = self.0.read(name, most)?;
        Ok((bytes.into(), version.into()))
    }

    /// Files, each with its largest size, that are fetched before they are read, if the memory suffices. One
    /// that has changed after `begun`, in seconds since 1970, is an error.
    pub(in super::super) fn expect(
        &self,
        files: Vec<(String, u64)>,
        begun: Option<i64>,
        workspace: &Workspace,
    ) -> Result<Expected> {
        let wanted = files.iter().map(|(_, most)| *most);
        let room = room(wanted.fold(0, u64::saturating_add), workspace);
        Ok(Expected {
            _held: workspace.reserve("fetched ahead", room.bytes)?,
            files: self.0.expect(files, room, begun),
        })
    }
}

/// Files that are fetched before they are read.
#[derive(Debug)]
pub(in super::super) struct Expected {
    files: outcrop_remote::Expected,
    _held: Reservation,
}

impl Expected {
    pub(in super::super) fn take(&self, file: usize) -> std::io::Result<Vec<u8>> {
        self.files.take(file).map(Into::into)
    }
}

/// Memory for what is fetched, `wanted` bytes in all. Nothing is fetched before it is read where tasks share the files:
/// each reads parts that are not known before.
fn room(wanted: u64, workspace: &Workspace) -> Room {
    Room {
        bytes: AHEAD.min(workspace.memory.available() / SHARE).min(wanted),
        is_ahead: !workspace.is_shared(),
    }
}

fn location(path: &Path) -> Result<Location> {
    Location::of(path).map_err(|why| {
        let expected = "one such as https://host/scan.laz or s3://bucket/scan.laz, with credentials from the \
                        environment";
        Error::input(Location::masked(path), "URL", why.to_string(), expected)
    })
}

/// The files below a prefix that are `wanted`, with their sizes; none if the path names one file.
pub(in super::super) fn below(
    path: &Path,
    wanted: impl Fn(&Path) -> bool,
) -> Result<Option<Vec<(PathBuf, u64)>>> {
    let prefix = location(path)?;
    if !prefix.is_prefix() {
        return Ok(None);
    }
    if prefix.is_web() {
        let found = "a folder of a web server, which lists no files";
        let expected = "URLs of files, or a file with a list of them";
        return Err(Error::input(path, "URL", found, expected));
    }
    let wanted = |url: &str| wanted(Path::new(url));
    let listed = outcrop_remote::list(&prefix, MOST, wanted, &Arc::<Counts>::default())
        .map_err(|e| Error::io(path, "list", e))?;
    let files = listed.into_iter().map(|file| (file.url.into(), file.bytes));
    Ok(Some(files.collect()))
}
