//! E57: scans of one or several set-ups, with poses.

#[cfg(feature = "e57")]
mod packets;
#[cfg(feature = "e57")]
mod pages;
#[cfg(feature = "e57")]
mod read;
#[cfg(feature = "e57")]
mod scan;
#[cfg(feature = "e57")]
mod scans;
#[cfg(feature = "e57")]
mod shades;
#[cfg(feature = "e57")]
mod xml;

use super::input::Input;
use super::point_format::{Head, PointFile, PointFormat, Refusal};
#[cfg(not(feature = "e57"))]
use outcrop_disk::error::Error;
use outcrop_disk::error::Result;

const SIGNATURE: &[u8] = b"ASTM-E57";

/// The format E57; without its feature it is recognised, and refused.
pub(super) struct E57;

impl PointFormat for E57 {
    fn names(&self) -> &'static str {
        "E57"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["e57"]
    }

    fn recognize(&self, head: &Head) -> Result<bool, Refusal> {
        Ok(head.bytes.starts_with(SIGNATURE))
    }

    #[cfg(feature = "e57")]
    fn open(&self, input: &Input, head: &Head) -> Result<Box<dyn PointFile>> {
        scans::open(input, head)
    }

    #[cfg(not(feature = "e57"))]
    fn open(&self, input: &Input, _: &Head) -> Result<Box<dyn PointFile>> {
        Err(Error::NotBuilt {
            path: Some(input.path.clone()),
            what: "E57",
            feature: "e57",
        })
    }
}
