//! Checks between the stages.

use crate::params::{Params, Radius};
use crate::report::DiskEstimate;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::{Workspace, limits};
use outcrop_geom::lattice::Lattice;
use outcrop_mesh_files::export::{folder_of, is_square_of};
use outcrop_platform::{canonical, device, no_name};
use outcrop_points::Classes;
use outcrop_stages::cells::{CellStats, DiskRadius};
use outcrop_stages::order::StoredPoints;
use std::path::{Path, PathBuf};

/// Larger disks, in steps, contain any cloud.
const LARGEST_RADIUS: f64 = (1u64 << 34) as f64;

/// The radius in lattice steps.
pub(super) fn disk_radius(radius: Radius, store: &StoredPoints, lattice: &Lattice) -> DiskRadius {
    match radius {
        Radius::Auto => DiskRadius::Auto,
        Radius::Length(length) => DiskRadius::Steps((length / lattice.step).min(LARGEST_RADIUS)),
        Radius::Percent(percent) => {
            let bounds = store.bounds();
            let diagonal = (outcrop_geom::distance2(bounds.min, bounds.max) as f64).sqrt();
            DiskRadius::Steps((percent / 100.0 * diagonal).min(LARGEST_RADIUS))
        }
    }
}

/// True if no option leaves out points.
pub(super) fn all_are_kept(params: &Params) -> bool {
    let filters = [params.thin, params.drop_outliers];
    let whole = params.crop.is_none() && params.split.is_none();
    whole && params.classes == Classes::All && filters.iter().all(Option::is_none)
}

/// Checks that a file can be created in the output's folder.
pub(super) fn writable(output: &Path) -> Result<()> {
    if output.is_dir() {
        let error = std::io::Error::from(std::io::ErrorKind::IsADirectory);
        return Err(Error::io(output, "write the mesh", error));
    }
    let name = output.file_name().unwrap_or_default().to_string_lossy();
    if let Some(why) = no_name(&name) {
        return Err(Error::Parameter {
            name: "output",
            found: format!("{} ({why})", output.display()),
            expected: "another name".into(),
        });
    }
    tempfile::tempfile_in(folder_of(output))
        .map(drop)
        .map_err(|e| Error::io(output, "write the mesh into this folder", e))
}

/// Checks that the scratch folder and the mesh, possibly on one disk, have enough free space; a part of it
/// may be in use by this run already.
pub(super) fn room(
    scratch: &Path,
    output: &Path,
    estimate: DiskEstimate,
    workspace: &Workspace,
) -> Result<()> {
    let shared = device(scratch) == device(folder_of(output));
    let needed = match shared {
        true => estimate.together,
        false => estimate.scratch,
    };
    workspace.expect_scratch(needed);
    let needed = workspace.more_scratch();
    match limits::disk_free(scratch) {
        Some(free) if free < needed => Err(Error::Disk {
            path: scratch.to_path_buf(),
            needed,
            free,
        }),
        _ => Ok(()),
    }
}

/// Checks that the output is not an input file.
pub(super) fn not_an_input(output: &Path, split: bool, inputs: &[PathBuf]) -> Result<()> {
    let absolute = |path: &Path| canonical(path).ok();
    let folder = absolute(folder_of(output));
    let several = folder.map(|folder| folder.join(output.file_name().unwrap_or_default()));
    for input in outcrop_formats::expand(inputs)?.iter().filter(|_| split) {
        let taken = |input: PathBuf| is_square_of(several.as_deref()?, &input).then_some(input);
        if let Some(input) = absolute(input).and_then(taken) {
            return Err(Error::Parameter {
                name: "output",
                found: format!(
                    "a name from which that of the input {} can be made",
                    input.display()
                ),
                expected: "another name".into(),
            });
        }
    }
    if split {
        return Ok(());
    }
    let Ok(output) = canonical(output) else {
        return Ok(());
    };
    for input in outcrop_formats::expand(inputs)? {
        if canonical(&input).is_ok_and(|input| input == output) {
            return Err(Error::Parameter {
                name: "output",
                found: format!("{} (an input)", output.display()),
                expected: "another file".into(),
            });
        }
    }
    Ok(())
}

/// Checks that the inputs do not have different reference systems, as far as their headers tell.
pub(super) fn one_system(params: &Params, inputs: &[PathBuf]) -> Result<()> {
    match params.ignore_crs || params.crs.is_some() {
        true => Ok(()),
        false => outcrop_formats::check_systems(inputs),
    }
}

pub(super) fn enough(store: &StoredPoints) -> Result<()> {
    if store.len() >= 3 {
        return Ok(());
    }
    let found = match store.len() {
        0 => "no points".to_owned(),
        1 => "one distinct point".to_owned(),
        n => format!("{n} distinct points"),
    };
    Err(Error::Degenerate { found })
}

pub(super) fn not_a_line(stats: &CellStats, points: u64) -> Result<()> {
    if stats.no_plane < points {
        return Ok(());
    }
    Err(Error::Degenerate {
        found: format!("{points} distinct points, all on one line"),
    })
}
