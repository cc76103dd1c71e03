//! The reference system of a mesh: that which is given, that of its header, or that of the `.prj` file beside it.

use super::Options;
use outcrop_codecs::ply_mesh;
use outcrop_disk::error::{Result, Setting};
use outcrop_disk::workspace::Workspace;
use outcrop_points::Crs;
use std::path::Path;

/// The system of a mesh, with warnings where what is known of it does not agree.
pub(super) fn of(path: &Path, options: &Options, workspace: &Workspace) -> Result<Option<Crs>> {
    let prj = outcrop_points::prj_of(path);
    let (beside, warning) = outcrop_points::of_prj(&prj);
    let warn = |warning: String| workspace.observer.warn(&warning);
    warning.into_iter().for_each(warn);
    let header = Crs::of_comments(&ply_mesh::system(path)?);
    if let Some(given) = &options.crs {
        let given = given.crs();
        if let Some(header) = header.filter(|header| header.horizontal != given.horizontal) {
            warn(format!(
                "{}: {given} is taken instead of {header}, which the header of {} gives",
                workspace.observer.spell(&Setting::Option("crs")),
                path.display()
            ));
        }
        return Ok(Some(given));
    }
    Ok(match (header, beside) {
        // It tells more.
        (Some(header), Some(mut beside)) if beside.agrees(&header) => {
            beside.height_unit = header.height_unit.or(beside.height_unit);
            Some(beside)
        }
        (Some(header), Some(beside)) => {
            warn(format!(
                "{}: it gives {beside}, but the header of {} gives {header}, which is taken",
                prj.display(),
                path.display()
            ));
            Some(header)
        }
        (header, beside) => header.or(beside),
    })
}

/// The EPSG code of the horizontal system that the header of a mesh, or the `.prj` file beside it, tells.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`].
pub fn epsg(path: &Path) -> Result<Option<u32>> {
    let header = Crs::of_comments(&ply_mesh::system(path)?);
    let found = header.or_else(|| outcrop_points::of_prj(&outcrop_points::prj_of(path)).0);
    Ok(found.and_then(|crs| crs.horizontal))
}
