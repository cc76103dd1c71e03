//! Remote files in a build without the feature `cloud`: they are refused.

use super::{Fetched, Version};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::compressed::Content;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// No remote file is ever open.
#[derive(Debug)]
pub(in super::super) enum Remote {}

impl Remote {
    pub(in super::super) fn open(path: &Path) -> Result<Self> {
        Err(refused(path))
    }

    pub(in super::super) fn count(_: &Workspace) -> Result<()> {
        Ok(())
    }

    pub(in super::super) fn version(&self) -> Version {
        match *self {}
    }

    pub(in super::super) fn has_parts(&self) -> bool {
        match *self {}
    }

    pub(in super::super) fn read_at(&self, _: &mut [u8], _: u64) -> std::io::Result<usize> {
        match *self {}
    }

    pub(in super::super) fn expect(
        &self,
        _: impl IntoIterator<Item = Range<u64>>,
        _: &Workspace,
    ) -> Result<()> {
        match *self {}
    }

    pub(in super::super) fn save(&self, _: &Path, _: &Workspace) -> Result<Content> {
        match *self {}
    }

    pub(in super::super) fn fetched(&self) -> Fetched {
        match *self {}
    }

    pub(in super::super) fn clock(&self) -> Option<i64> {
        match *self {}
    }

    pub(in super::super) fn beside(&self, _: &Path) -> Result<Beside> {
        match *self {}
    }
}

#[derive(Debug)]
pub(in super::super) enum Beside {}

impl Beside {
    pub(in super::super) fn read(&self, _: &str, _: u64) -> std::io::Result<(Vec<u8>, Version)> {
        match *self {}
    }

    pub(in super::super) fn expect(
        &self,
        _: Vec<(String, u64)>,
        _: Option<i64>,
        _: &Workspace,
    ) -> Result<Expected> {
        match *self {}
    }
}

#[derive(Debug)]
pub(in super::super) enum Expected {}

impl Expected {
    pub(in super::super) fn take(&self, _: usize) -> std::io::Result<Vec<u8>> {
        match *self {}
    }
}

pub(in super::super) fn below(
    path: &Path,
    _: impl Fn(&Path) -> bool,
) -> Result<Option<Vec<(PathBuf, u64)>>> {
    Err(refused(path))
}

fn refused(path: &Path) -> Error {
    Error::NotBuilt {
        path: Some(path.to_path_buf()),
        what: "files behind a URL",
        feature: "cloud",
    }
}
