//! Inputs on a server: read by ranges, or saved first where that cannot be.

use super::super::remote::{Fetched, Remote};
use super::{Input, Source};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::compressed::{Beginning, Content, is_compressed};
use outcrop_disk::workspace::zip::Wanted;
use outcrop_disk::workspace::{IoCounters, Workspace};
use std::fs::File;
use std::io::Write;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Bytes of a compressed file that are fetched to tell its format.
const PACKED: u64 = 1 << 20;

/// Bytes that tell a compression.
const MAGIC: usize = 18;

impl Input {
    /// Opens a file on a server to read all of it. A compressed one, and one that the server does not send in
    /// parts, is saved in the scratch folder.
    pub(super) fn open_remote(
        path: &Path,
        wanted: Wanted<'_>,
        workspace: &Workspace,
    ) -> Result<Self> {
        Remote::count(workspace)?;
        let remote = Remote::open(path)?;
        let mut magic = [0; MAGIC];
        let got = remote.read_at(&mut magic, 0);
        let got = got.map_err(|e| Error::io(path, "read", e))?;
        let read_in_parts = remote.has_parts() && !is_compressed(&magic[..got]);
        let content = match read_in_parts {
            true => None,
            false => Some(remote.save(path, workspace)?),
        };
        let mut input = Self::of_remote(path, remote, workspace.io.clone());
        let Some(mut content) = content else {
            return Ok(input);
        };
        let open = |content: &Content| {
            File::open(&content.path).map_err(|e| Error::io(&content.path, "open", e))
        };
        if let Some(unpacked) = Content::within(path, open(&content)?, wanted, workspace)? {
            content = unpacked;
        }
        input.maps = workspace.maps_inputs();
        input.bytes = content.bytes;
        input.source = Source::Content(open(&content)?, content);
        Ok(input)
    }

    /// Opens a file on a server of which only the first `most` bytes are read.
    pub(super) fn open_remote_head(path: &Path, most: usize) -> Result<Self> {
        let mut input = Self::of_remote(path, Remote::open(path)?, Arc::default());
        if !is_compressed(&input.head(MAGIC)?) {
            return Ok(input);
        }
        let all = input.bytes;
        let head = input.head(PACKED as usize)?;
        let kept = tempfile::tempfile().and_then(|mut file| {
            file.write_all(&head)?;
            Ok(file)
        });
        let kept = kept.map_err(|e| Error::io(path, "save the beginning of", e))?;
        let Some(beginning) = Beginning::within(path, &kept, all, most)? else {
            return Err(input.error(
                "compression",
                "a ZIP archive on a server, whose list is at its end",
                "the cloud itself, a local archive, or a command that reads all points",
            ));
        };
        input.bytes = beginning.likely;
        input.source = Source::Memory(beginning.bytes);
        Ok(input)
    }

    fn of_remote(path: &Path, remote: Remote, io: Arc<IoCounters>) -> Self {
        let bytes = remote.version().bytes;
        Self {
            path: path.to_path_buf(),
            bytes,
            size: bytes,
            source: Source::Remote(remote),
            io,
            maps: false,
        }
    }

    /// Says which parts will be read, in this order: those of a file on a server are fetched before.
    pub(in super::super) fn expect(
        &self,
        ranges: impl IntoIterator<Item = Range<u64>>,
        workspace: &Workspace,
    ) -> Result<()> {
        match &self.source {
            Source::Remote(remote) => remote.expect(ranges, workspace),
            _ => Ok(()),
        }
    }

    /// What was asked of a server so far, if it is on one.
    pub(in super::super) fn fetched(&self) -> Option<Fetched> {
        match &self.source {
            Source::Remote(remote) => Some(remote.fetched()),
            _ => None,
        }
    }
}
