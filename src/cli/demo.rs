//! `outcrop demo`: a cloud that is generated, and its mesh.

use super::args::Demo;
use super::jobs::{memory, threads};
use super::output::{print, summary, write_report};
use super::{stop, style};
use crate::pipeline::{Reconstruction, Start};
use outcrop_cloudgen::{Cloud, Format, Kind};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_inspect::verify;
use std::path::Path;
use std::sync::Arc;

/// Generates a cloud, reconstructs it and verifies the mesh.
pub fn run(args: &Demo) -> Result<bool> {
    let folder = &args.folder;
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "make the folder", e))?;
    let cloud = folder.join("bumpy.laz");
    let format = Format::from_path(&cloud).map_err(|e| generator_error(&cloud, &e))?;
    print(&format!(
        "making {} points on a closed surface",
        style::grouped(args.points)
    ))?;
    Cloud::new(Kind::Bumpy)
        .points(args.points)
        .write(&cloud, format)
        .map_err(|e| generator_error(&cloud, &e))?;
    let mesh = folder.join("bumpy.ply");
    let (observer, cancel) = stop::watched(args.limits.quiet);
    let report = Reconstruction::builder()
        .input(&cloud)
        .output(&mesh)
        .threads(threads(&args.limits))
        .memory(memory(&args.limits))
        .observer(observer)
        .start(Start::Restart)
        .cancel(cancel)
        .build()?
        .run()?;
    let path = folder.join("report.json");
    write_report(&path, &report, &mesh)?;
    print(&summary(&report, &mesh))?;
    let memory = MemoryPool::new(memory(&args.limits))?;
    let threads = threads(&args.limits);
    let workspace = Workspace::new(folder, memory, threads, Arc::new(Silent), Cancel::new())?;
    let verdict = verify::verify(&mesh, &workspace)?;
    print(&verdict.to_string())?;
    print(&format!(
        "the cloud is {}, the mesh {} (open it in MeshLab, CloudCompare or Blender), the report {}",
        cloud.display(),
        mesh.display(),
        path.display()
    ))?;
    Ok(verdict.manifold)
}

fn generator_error(path: &Path, error: &outcrop_cloudgen::Error) -> Error {
    let error = std::io::Error::other(error.to_string());
    Error::io(path, "make the demo cloud", error)
}
