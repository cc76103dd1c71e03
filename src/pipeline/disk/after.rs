//! Disk need of the steps after the whole mesh: they make a smaller or closed one, or levels of detail, and read the
//! whole one from a hidden file beside the output.

use super::Known;
use crate::params::Params;
use crate::pipeline::Reconstruction;
use std::path::Path;

/// Scratch bytes for each byte of the whole mesh, beside the stores, while a smaller one of it is made and the distance
/// between both is measured: if the vertices fit into a quarter of the memory, and if not. Measured: 5.0 to 5.2, and
/// 9.1. The closing takes little.
const SIMPLIFIED: [f64; 2] = [5.1, 9.1];

/// Bytes of memory for a vertex in that quarter.
const VERTEX: u64 = 24;

/// The same while levels of detail are made. Measured: 2.2.
const TILED: f64 = 2.2;

/// Bytes of a tileset for each triangle of the mesh, with every bit and lossy (docs/tiles.md).
const TILES: [f64; 2] = [8.4, 3.8];

/// The files that a run writes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Files<'a> {
    /// The whole mesh.
    pub mesh: &'a Path,
    /// The smaller or closed mesh that is made of it.
    pub made: Option<&'a Path>,
    /// Levels of detail are made of it.
    pub tiles: bool,
    /// The memory of the run, in bytes.
    pub memory: u64,
}

impl<'a> Files<'a> {
    /// The whole mesh alone.
    pub fn of(mesh: &'a Path) -> Self {
        Self {
            mesh,
            made: None,
            tiles: false,
            memory: u64::MAX,
        }
    }

    /// Those of a run.
    pub fn of_job(job: &'a Reconstruction) -> Self {
        Self {
            mesh: &job.mesh,
            made: job.made.as_deref(),
            tiles: job.tiles.is_some(),
            memory: job.memory.budget(),
        }
    }
}

impl Known {
    /// Scratch bytes for each byte of the whole mesh, beside the stores, after that is written.
    pub(super) fn factor(&self, params: &Params, files: &Files<'_>) -> f64 {
        let fit = VERTEX * self.points <= files.memory / 4;
        match params.triangles {
            Some(_) => SIMPLIFIED[usize::from(!fit)],
            None if files.tiles => TILED,
            None => 0.0,
        }
    }

    /// The size of what is made of the whole mesh.
    pub(super) fn made(&self, params: &Params, files: &Files<'_>) -> f64 {
        if files.tiles {
            let triangles = self.surface(params).2 * self.points as f64;
            return TILES[usize::from(params.lossy)] * triangles;
        }
        files
            .made
            .map_or(0.0, |made| self.mesh_bytes(params, made, params.triangles))
    }
}
