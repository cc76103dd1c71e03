//! Runs in stores in a build without the feature `cloud`: they are refused.

use crate::features::CLOUD;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::away::Store;
use std::path::Path;
use std::sync::Arc;

pub fn open(_: &Path) -> Result<Arc<dyn Store>> {
    Err(CLOUD.missing())
}

pub fn names(_: &Path) -> Result<Vec<String>> {
    Err(CLOUD.missing())
}
