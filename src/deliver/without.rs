//! Outputs behind a URL in a build without the feature `cloud`: they are refused.

use super::{Kind, Uploaded};
use crate::features::CLOUD;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::progress::Observer;
use outcrop_points::is_remote;
use std::path::{Path, PathBuf};

/// No output is delivered.
#[derive(Debug)]
pub(crate) enum Delivery {}

impl Delivery {
    pub(crate) fn of(
        output: &Path,
        _: Kind,
        _: Option<&Path>,
        _: Option<&Path>,
    ) -> Result<Option<Self>> {
        match is_remote(output) {
            true => Err(CLOUD.missing()),
            false => Ok(None),
        }
    }

    pub(crate) fn local(&self) -> &Path {
        match *self {}
    }

    pub(crate) fn url(&self) -> &Path {
        match *self {}
    }

    pub(crate) fn scratch(&self) -> &Path {
        match *self {}
    }

    pub(crate) fn refuse_inputs(&self, _: &[PathBuf]) -> Result<()> {
        match *self {}
    }

    pub(crate) fn prepare(&self) -> Result<()> {
        match *self {}
    }

    pub(crate) fn begin(&self, _: &dyn Observer) -> Result<()> {
        match *self {}
    }

    pub(crate) fn end(&self, _: &dyn Observer) {
        match *self {}
    }

    pub(crate) fn bytes(&self) -> Result<u64> {
        match *self {}
    }

    pub(crate) fn send(&self, _: &Workspace, _: &mut dyn FnMut(String)) -> Result<Uploaded> {
        match *self {}
    }
}

pub(crate) fn check_text(_: &Path) -> Result<()> {
    Err(CLOUD.missing())
}

pub(crate) fn put_text(_: &Path, _: &str) -> Result<()> {
    Err(CLOUD.missing())
}
