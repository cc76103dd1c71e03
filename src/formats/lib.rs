//! Reads the input formats: files and folders of point clouds into a spool of [`outcrop_points`].
//!
//! [`ingest`] decodes every input once into a [`Spool`]: one scratch file with all points in their native
//! precision, and exact statistics of each file.
//!
//! Formats are detected by content: LAS 1.0 to 1.4 with point formats 0 to 10, LAZ (COPC included), E57,
//! PLY, PCD, PTX, OFF, and text with one point in a line; any of them may be compressed with gzip or Zstandard, or
//! the only cloud of a ZIP archive. Each format is a module that implements `PointFormat`, and an entry of the list in
//! `formats.rs`.

mod contain;
mod e57;
mod ept;
mod expand;
mod folder;
mod foreign;
mod formats;
mod input;
mod las;
mod lines;
mod off;
mod pcd;
mod ply;
mod point_format;
mod probe;
mod ptx;
mod reading;
mod reads;
mod remote;
mod scalar;
mod taken;
mod text;

pub use contain::hide_caught_panics;
pub use expand::expand;
pub use probe::{Probe, probe, probe_as, probe_near};
pub use reads::Reads;
pub use remote::{Version, version};

use input::Input;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_points::frames::values_of;
use outcrop_points::systems::Systems;
use outcrop_points::{Attributes, IngestStats, Layout, Selection, Spool};
use reading::{Opened, read_all};
use std::path::PathBuf;

/// Inputs whose names and figures are not reserved, and what each of more takes besides its name.
const FEW_INPUTS: usize = 1 << 10;
const PER_INPUT: u64 = 1 << 10;

/// Decodes all inputs, which may be files and folders, into a spool.
///
/// Progress is reported to the observer; the caller begins and ends the stage. Memory is reserved for each
/// unit of work, a few MiB for each thread.
///
/// # Errors
/// [`outcrop_disk::error::Error::Input`] for a file that is not what it claims to be; [`outcrop_disk::error::Error::Io`],
/// [`outcrop_disk::error::Error::Disk`], [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn ingest(inputs: &[PathBuf], workspace: &Workspace) -> Result<Spool> {
    ingest_selected(inputs, &Selection::default(), workspace)
}

/// As [`ingest`], but reads only what is selected.
///
/// # Errors
/// See [`ingest`]; [`outcrop_disk::error::Error::Parameter`] for columns that no file has.
pub fn ingest_selected(
    inputs: &[PathBuf],
    selection: &Selection,
    workspace: &Workspace,
) -> Result<Spool> {
    let expanded = expand::expanded(inputs)?;
    let paths = &expanded.files;
    keep_names(paths, workspace)?;
    check_columns(paths, selection)?;
    let name = format!("ingest-{}.spool", workspace.number());
    let mut stats = IngestStats::default();
    let spool = read_all(paths, selection, &name, &mut stats, workspace).map(|mut spool| {
        let said = expanded.warning();
        let stats = spool.stats_mut();
        stats.warnings.splice(0..0, said);
        stats.left_out = expanded.left_out;
        spool
    });
    if let Err(Error::Input { .. } | Error::Parameter { .. }) = spool
        && !workspace.is_task()
    {
        // They may explain the error.
        let warnings = stats.warnings.iter();
        warnings.for_each(|w| workspace.observer.warn(w));
    }
    if spool.is_err() && !workspace.is_resumable() {
        workspace.files.release(&name)?;
        workspace.files.release(&values_of(&name))?;
    }
    spool
}

/// Reserves what is kept of many inputs, for as long as the process lives.
fn keep_names(paths: &[PathBuf], workspace: &Workspace) -> Result<()> {
    if paths.len() <= FEW_INPUTS {
        return Ok(());
    }
    let names = paths.iter().map(|path| path.as_os_str().len() as u64);
    let bytes = paths.len() as u64 * PER_INPUT + 4 * names.sum::<u64>();
    workspace.memory.keep("inputs", bytes)
}

/// Refuses columns that are in none of the files.
fn check_columns(paths: &[PathBuf], selection: &Selection) -> Result<()> {
    let attributes = &selection.attributes;
    if !matches!(attributes, Attributes::List(_)) {
        return Ok(());
    }
    let mut present = Vec::new();
    for path in paths {
        let probe = probe_as(path, &selection.layout)?;
        if !probe.is_described {
            // Checked when all files were read.
            return Ok(());
        }
        present.extend(probe.columns);
    }
    attributes.check(&present)
}

/// Checks that the headers of all files give one reference system. Files that cannot be read are passed over:
/// their error comes when they are read.
///
/// # Errors
/// [`Error::Input`] with two files whose systems are different.
pub fn check_systems(inputs: &[PathBuf]) -> Result<()> {
    let mut systems = Systems::default();
    for path in expand(inputs)? {
        let head = Input::open_head(&path, &formats::is_cloud, formats::LONG_HEAD);
        let opened = head.and_then(|input| Opened::new(input, &Layout::default()));
        if let Some(crs) = opened.ok().and_then(|opened| opened.crs().0) {
            systems.add(&path, crs);
        }
    }
    match systems.common() {
        Ok(_) => Ok(()),
        Err(mixed) => Err(mixed.refused()),
    }
}
