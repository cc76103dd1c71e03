//! Points of a cloud of any size, to be shown beside a mesh: an even part of them, in a tileset of one tile.

mod file;
mod thinned;

use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::lattice::Lattice;
use outcrop_points::{Attributes, Ingest, READ_BUFFERS, Selection, Spool, VALUE_BUFFERS};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::Path;
use thinned::{Even, Thinned, bytes};

/// The columns of the colours.
const COLORS: [&str; 3] = ["red", "green", "blue"];

/// Points that were thinned.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CloudReport {
    /// Points in the tileset.
    pub points: u64,
    /// Points of the cloud.
    pub of_points: u64,
    /// Longest side of the boxes of which one point each is kept, in the unit of the cloud.
    pub side: f64,
    /// True if the points have colours.
    pub colors: bool,
}

/// Makes the tileset `folder` of at most `most` points of a cloud, a file or folder, which is called `source` in it.
/// `ingest` reads it. The points are spread evenly over space: one in each box of a grid that is as fine as the limit allows. They do not
/// depend on memory, threads and order of the files.
///
/// # Errors
/// [`Error::Input`] for what is no cloud, or has no point; [`Error::Parameter`] for a limit that no file can hold;
/// [`Error::Memory`], [`Error::Io`], [`Error::Disk`], [`Error::Corrupt`], [`Error::Cancelled`].
pub fn tileset(
    path: &Path,
    source: &str,
    folder: &Path,
    most: u64,
    ingest: Ingest,
    workspace: &Workspace,
) -> Result<CloudReport> {
    if !(1..=file::MOST).contains(&most) {
        return Err(Error::Parameter {
            name: "points_limit",
            found: most.to_string(),
            expected: format!("1 to {}", file::MOST),
        });
    }
    let spool = read(path, ingest, workspace)?;
    let lattice = spool.choose_lattice(0).map_err(|error| match error {
        Error::Degenerate { found } => Error::input(path, "points", found, "smaller ones"),
        other => other,
    })?;
    let noted = noted(&spool, &lattice, source);
    let of_points = spool.points();
    let _held = workspace.reserve("points: kept", bytes(most, of_points))?;
    let (even, colors) = thin(&spool, &lattice, most, workspace)?;
    spool.release(workspace)?;
    let report = CloudReport {
        points: even.len() as u64,
        of_points,
        side: even.side() * lattice.step,
        colors,
    };
    let noted = described(noted, &report);
    file::write(folder, &even, colors, &lattice, &noted)?;
    Ok(report)
}

/// Reads the cloud with its colours.
fn read(path: &Path, ingest: Ingest, workspace: &Workspace) -> Result<Spool> {
    let observer = &workspace.observer;
    observer.begin("read cloud", "points", 0);
    let selection = Selection {
        attributes: Attributes::Auto,
        ..Selection::default()
    };
    let spool = ingest(&[path.to_path_buf()], &selection, workspace)?;
    observer.end();
    let stats = spool.stats();
    stats.warnings.iter().for_each(|w| observer.warn(w));
    if stats.kept == 0 {
        let found = match stats.read {
            0 => "none".to_owned(),
            n => format!("none of {n} usable"),
        };
        return Err(Error::input(path, "points", found, "one or more"));
    }
    Ok(spool)
}

/// The points that stay, and whether they have colours.
fn thin(
    spool: &Spool,
    lattice: &Lattice,
    most: u64,
    workspace: &Workspace,
) -> Result<(Even, bool)> {
    let observer = &workspace.observer;
    let names = COLORS.map(str::to_owned).to_vec();
    let carried = spool.carried(&Attributes::List(names), false);
    let colors = carried.columns.len() == COLORS.len();
    let mut thinned = Thinned::new(most, spool.points());
    observer.begin("thin", "points", spool.points());
    if colors {
        carried.warnings.iter().for_each(|w| observer.warn(w));
        let _held = workspace.reserve("points: frames", VALUE_BUFFERS)?;
        let frames: Vec<u32> = spool.frames().into_iter().map(|(frame, _)| frame).collect();
        spool.for_values(workspace, lattice, &frames, &carried, |points, rows| {
            let rows = rows.as_chunks::<3>().0;
            points
                .iter()
                .zip(rows)
                .for_each(|(p, color)| thinned.push(*p, *color));
            observer.advance(points.len() as u64);
            Ok(())
        })?;
    } else {
        let _held = workspace.reserve("points: frames", READ_BUFFERS)?;
        spool.for_each(workspace, lattice, |points| {
            points.iter().for_each(|p| thinned.push(*p, [0; 3]));
            observer.advance(points.len() as u64);
            Ok(())
        })?;
    }
    let even = thinned.finish();
    observer.end();
    Ok((even, colors))
}

/// The facts of the cloud that the tileset names: the same as of a mesh.
fn noted(spool: &Spool, lattice: &Lattice, source: &str) -> Value {
    let crs = spool.stats().crs.as_ref();
    let text = spool.wkt().map(str::to_owned);
    json!({
        "version": 1,
        "made_by": concat!("outcrop ", env!("CARGO_PKG_VERSION")),
        "origin": lattice.position([0; 3]),
        "crs": text.or_else(|| crs.map(|crs| crs.line())),
        "epsg": crs.and_then(|crs| crs.horizontal),
        "height_unit": crs.and_then(|crs| crs.height_unit),
        "step": vec![lattice.step; 3],
        "exact": lattice.exact,
        "source": source,
    })
}

/// The same with what was thinned.
fn described(mut noted: Value, report: &CloudReport) -> Value {
    noted["points"] = report.points.into();
    noted["of_points"] = report.of_points.into();
    noted["side"] = report.side.into();
    noted["colors"] = report.colors.into();
    noted
}
