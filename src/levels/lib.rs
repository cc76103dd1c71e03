//! Levels of detail: a mesh of any size as a tree of tiles, in bounded memory.
//!
//! The triangles are divided into the cells of an octree (`cells`), which are the leaves of the tree (`tree`).
//! Every other tile is made from its children: they are joined, simplified (`simplify`) and measured against the
//! joined surface (`distance`). A vertex that has triangles outside of the tile is not removed, so that tiles of
//! any two levels meet without a crack. `docs/tiles.md` describes the files. `single` makes one mesh with fewer
//! triangles instead, from the same cells, and `close` a mesh without a boundary; `crossed` counts self-intersections,
//! `cloud` thins points, to be shown beside a mesh.

mod cells;
pub mod close;
pub mod cloud;
mod columns;
pub mod crossed;
mod distance;
mod folder;
mod geo;
mod glb;
mod intake;
mod lattice;
mod lengths;
mod lossy;
mod make;
mod meet;
mod nearest;
mod node;
mod order;
pub mod outlook;
mod patch;
mod quadric;
mod remaining;
mod report;
mod rounding;
mod rows;
mod shared;
mod simplify;
pub mod single;
mod source;
mod system;
mod tree;
mod writer;

pub use report::{Lossy, Options, TilesReport};
pub use system::epsg;

use cells::Division;
use folder::About;
pub use folder::{NAME, check_folder, remove_unfinished};
use geo::Globe;
use make::Maker;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::Table;
use outcrop_disk::workspace::Workspace;
use shared::Shared;
use std::path::Path;

/// Makes the tileset `folder` of the mesh `path`, which is called `source` in it.
///
/// # Errors
/// [`Error::Input`] for a file that is no mesh; [`Error::Memory`], [`Error::Io`],
/// [`Error::Disk`], [`Error::Corrupt`], [`Error::Cancelled`].
pub fn tileset(
    path: &Path,
    source: &str,
    folder: &Path,
    options: &Options,
    workspace: &Workspace,
) -> Result<TilesReport> {
    let crs = system::of(path, options, workspace)?;
    // What cannot be placed is refused before the work.
    let globe = match options.geo {
        true => Some(Globe::of(path, crs.as_ref())?),
        false => None,
    };
    let known = crs.clone();
    let about = |origin: [f64; 3], high: [f64; 3]| {
        let middle = std::array::from_fn(|axis| (origin[axis] + high[axis]) / 2.0);
        let globe = globe.as_ref();
        let matrix = globe.map(|globe| globe.matrix(path, origin, middle));
        Ok(About {
            source: source.to_owned(),
            epsg: crs.as_ref().and_then(|crs| crs.horizontal),
            height_unit: crs.as_ref().and_then(|crs| crs.height_unit),
            crs: crs.map(|crs| crs.wkt().map_or_else(|| crs.line(), str::to_owned)),
            transform: matrix.transpose()?,
        })
    };
    let report = make(path, folder, options, about, workspace)?;
    Ok(TilesReport {
        crs: known.map(|crs| crs.without_texts()),
        ..report
    })
}

fn make(
    path: &Path,
    folder: &Path,
    options: &Options,
    about: impl FnOnce([f64; 3], [f64; 3]) -> Result<About>,
    workspace: &Workspace,
) -> Result<TilesReport> {
    let intake = intake::read(path, workspace)?;
    if intake.triangles == 0 {
        return Err(Error::input(
            path,
            "faces",
            "no triangle",
            "a mesh with triangles",
        ));
    }
    let plan = |stages: &[_]| {
        if !workspace.is_shared() {
            workspace.observer.plan(stages);
        }
    };
    // Without the first, which is over.
    plan(&outlook::all(intake.triangles, workspace.threads)[1..]);
    let division = Division {
        most: options.most_triangles,
        thirds: 0,
        step: "cells".into(),
        placed: "levels.placed".into(),
        cells: "levels.cells".into(),
    };
    let cells = cells::divide(&intake, &division, workspace)?;
    intake.sent.release(workspace)?;
    workspace.trim();
    let observer = &workspace.observer;
    let passes = 2 + u64::from(options.lossy);
    observer.begin("share", "triangles", passes * intake.triangles);
    let rounding = match options.lossy {
        true => lengths::rounding(&intake, &cells, workspace)?,
        false => Vec::new(),
    };
    let shared = Shared::find(&intake, &cells, &rounding, workspace)?;
    observer.end();
    let nodes = tree::build(&cells.cells);
    let (most, threads) = (options.most_triangles, workspace.threads);
    plan(&remaining::of_tree(&cells.cells, &nodes, most, threads));
    let bounds = make::bounds(&nodes, &shared.bounds);
    let low_bits = make::low_bits(&nodes, &bounds);
    let mut maker = Maker {
        intake: &intake,
        cells: &cells,
        nodes,
        bounds,
        low_bits,
        lossy: options.lossy,
        most: options.most_triangles,
        files: Table::new("levels.tiles", 0),
        made: Vec::new(),
    };
    workspace.trim();
    maker.make(shared, workspace)?;
    let step = intake.lattice.step;
    let low = intake.lattice.origin();
    let span = maker.bounds.last().map_or([0; 3], |root| root.max);
    let high = std::array::from_fn(|axis| low[axis] + f64::from(span[axis]) * step);
    let about = about(low, high)?;
    let bytes = maker.write_folder(folder, &about, workspace)?;
    let root = maker.made.last().cloned().unwrap_or_default();
    let leaves = &maker.made[..cells.cells.len()];
    Ok(TilesReport {
        vertices: intake.vertices,
        triangles: intake.triangles,
        boundary_edges: leaves.iter().map(|leaf| leaf.boundary).sum(),
        tiles: maker.made.len() as u64,
        leaves: leaves.len() as u64,
        levels: maker.nodes.last().map_or(0, |root| root.level) + 1,
        bytes,
        root_bytes: root.bytes.into(),
        root_triangles: root.triangles.into(),
        root_error: root.error,
        step,
        exact: intake.lattice.exact,
        lossy: maker.lossy(),
        crs: None,
    })
}
