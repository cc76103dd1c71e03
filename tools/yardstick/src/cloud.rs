//! The cloud of a measurement, and its points in the form for the k-d tree.

use crate::Result;
use outcrop_cloudgen::{Cloud, Format, Kind};
use outcrop_disk::workspace::Workspace;
use outcrop_stages::order::{self, PointStore};
use std::path::{Path, PathBuf};

/// A generated cloud: a uniform sample of a surface.
#[derive(Debug, clap::Args)]
pub struct Sample {
    /// Surface to sample, by its name in cloudgen
    #[arg(
        long,
        value_name = "NAME",
        default_value = "bumpy",
        conflicts_with = "input"
    )]
    kind: Kind,
    /// Number of points, e.g. 1e6
    #[arg(long, value_name = "N", default_value = "1e6", value_parser = count)]
    points: u64,
    /// Format of the cloud, by its name in cloudgen
    #[arg(
        long,
        value_name = "NAME",
        default_value = "ply-le-f32",
        conflicts_with = "input"
    )]
    format: Format,
}

fn count(text: &str) -> std::result::Result<u64, String> {
    match text.replace('_', "").parse::<f64>() {
        Ok(x) if (1.0..=4e9).contains(&x) && x.fract() == 0.0 => Ok(x as u64),
        _ => Err(format!(
            "{text:?} is not a number of points like 200000 or 1e6"
        )),
    }
}

impl Sample {
    /// Writes the cloud into `folder`; returns its path.
    pub fn write(&self, folder: &Path) -> Result<PathBuf> {
        let extension = match self.format {
            Format::Las(_) => "las",
            Format::Laz(_) => "laz",
            Format::Ply(..) => "ply",
            Format::Xyz => "xyz",
        };
        let path = folder.join(format!("{}.{extension}", self.kind.name()));
        Cloud::new(self.kind)
            .points(self.points)
            .write(&path, self.format)?;
        // Otherwise the disk would be busy with it during the measurement.
        std::fs::File::open(&path)?.sync_all()?;
        Ok(path)
    }
}

/// The distinct points of a cloud along the Hilbert curve, by the pipeline's own ingest and order; and the
/// length of a lattice step.
pub fn ordered(cloud: &Path, workspace: &Workspace) -> Result<(PointStore, f64)> {
    let spool = outcrop_formats::ingest(&[cloud.to_owned()], workspace)?;
    let lattice = spool.choose_lattice(0)?;
    let orderer = order::Orderer::new(workspace)?;
    spool.for_each(workspace, &lattice, |points| {
        orderer.push(workspace, points)
    })?;
    let (stored, _) = orderer.finish(workspace, order::PAGE)?;
    Ok((stored.open(workspace)?, lattice.step))
}

/// The same points in the form for the k-d tree, relative to the cloud's lowest corner.
pub fn points(store: &PointStore, step: f64) -> Result<Vec<[f32; 3]>> {
    let scaled = |p: [i32; 3]| p.map(|c| (f64::from(c) * step) as f32);
    Ok(store
        .slice(0..store.len())?
        .into_iter()
        .map(scaled)
        .collect())
}
