//! The stages that are to come, for the progress.

use super::super::{levels, outlook};
use super::Stages;
use outcrop_mesh_files::export::is_compressed;

impl Stages<'_> {
    /// Tells which stages are to come behind `after`, and how long they take for so many points.
    pub(super) fn plan(&self, points: u64, after: Option<&str>, valued: bool) {
        let (job, workspace) = (self.job, self.workspace);
        if workspace.is_shared() {
            return;
        }
        let compressed = job.params.compress_glb || is_compressed(&job.mesh);
        let mut stages = outlook::plan(&job.params, points, job.threads, valued, compressed);
        if job.tiles.is_some() {
            stages.extend(levels::outlook::of_points(points, job.threads));
        }
        if job.params.triangles.is_some() {
            stages.extend(levels::outlook::of_simplified(points, job.threads));
        }
        if job.params.close.is_some() {
            stages.extend(levels::outlook::of_closed(points, job.threads));
        }
        let first = stages.iter().rposition(|stage| Some(stage.name) == after);
        job.observer.plan(&stages[first.map_or(0, |at| at + 1)..]);
    }
}
