//! A cloud as pages of points in curve order.

use super::pages::PageWriter;
use super::shape::{Items, Kind, Shape, side, unusable, usable};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_points::{Ingest, Selection};
use outcrop_stages::order::order;
use std::path::Path;

/// Points per page of the store between ingest and the pages.
const STORE_PAGE: usize = 1 << 12;

/// Reads a cloud by `ingest`; duplicates become one point. If there is a unit, the pages survive the attempt.
pub(super) fn read(
    path: &Path,
    name: &'static str,
    ingest: Ingest,
    unit: Option<&Unit<'_>>,
    workspace: &Workspace,
) -> Result<Shape> {
    let observer = &workspace.observer;
    observer.begin("read cloud", "points", 0);
    let spool = ingest(&[path.to_path_buf()], &Selection::default(), workspace)?;
    observer.end();
    let stats = spool.stats();
    stats.warnings.iter().for_each(|w| observer.warn(w));
    let kept = stats.kept;
    if kept == 0 {
        let found = match stats.read {
            0 => "none".to_owned(),
            n => format!("none of {n} usable"),
        };
        return Err(Error::input(path, "points", found, "one or more"));
    }
    let lattice = spool.choose_lattice(0).map_err(|error| match error {
        Error::Degenerate { found } => Error::input(path, "points", found, "smaller ones"),
        other => other,
    })?;
    observer.begin("order", "points", kept);
    let (stored, ..) = order(spool, &lattice, STORE_PAGE, workspace)?;
    observer.end();
    let store = stored.open(workspace)?;

    let count = store.len() as u64;
    let mut writer = PageWriter::new(workspace, name, count, unit)?;
    let _held = workspace.reserve("compare: points at hand", STORE_PAGE as u64 * 12)?;
    let mut points = Vec::new();
    for page in 0..store.pages() {
        workspace.check_cancel()?;
        points.clear();
        store.read_pages(page..page + 1, &mut points)?;
        for point in &points {
            let position = lattice.position(*point);
            if !usable(position) {
                return Err(unusable(path, "points", position));
            }
            writer.push(position)?;
        }
    }
    if unit.is_none() {
        // A unit that is killed before its end needs them again.
        stored.release(workspace)?;
    }
    let pages = writer.finish()?;
    let mut side = side(path, Kind::Cloud, pages.bounds());
    side.points = count;
    side.exact = lattice.exact;
    Ok(Shape {
        name,
        side,
        items: Items::Cloud(pages),
    })
}
