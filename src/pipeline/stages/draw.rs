//! The report, and its pictures.

use super::Stages;
use super::shape::Shape;
use crate::report::Report;
#[cfg(feature = "pages")]
use crate::report::{Details, Drawn};
#[cfg(feature = "pages")]
use outcrop_disk::error::Error;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::course::Course;
use outcrop_disk::workspace::limits;
use outcrop_geom::lattice::Lattice;
use outcrop_mesh::repair::Repaired;
use outcrop_mesh_files::cut::StoredPieces;
#[cfg(feature = "pages")]
use outcrop_pictures::mesh::{Finished, Subject, draw};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::order::PointStore;

impl Stages<'_> {
    /// Draws the mesh, if pictures are wanted. What it reads is deleted with the folder: a run that was resumed
    /// may want pictures when all else is finished.
    #[cfg(feature = "pages")]
    pub fn draw(
        &mut self,
        store: &PointStore,
        shape: &Shape,
        repaired: &Repaired,
        pieces: Option<&StoredPieces>,
        blocks: Blocks,
        lattice: &Lattice,
    ) -> Result<()> {
        if !self.job.pictures {
            return Ok(());
        }
        let workspace = self.workspace;
        let neighbors = self.job.params.neighbors;
        let (finished, items) = match pieces {
            Some(pieces) => (Finished::Cut(pieces), pieces.count()),
            None => (Finished::Whole(repaired), blocks.count()),
        };
        let subject = Subject {
            store,
            finished,
            blocks,
            step: lattice.step,
            spacings: shape.spacings.as_ref().map(|s| (s, neighbors)),
        };
        workspace.trim();
        let work = || draw(subject, workspace);
        let drawn = match self.clock.stage("draw", "blocks", items as u64, work) {
            // The mesh is finished, and its report can be written without them.
            Err(error @ Error::Memory { .. }) => {
                self.warn(format!("no pictures in the report: {error}"));
                return Ok(());
            }
            drawn => drawn?,
        };
        let Drawn {
            pictures,
            edges,
            loops,
            many_loops,
            components,
            spacings,
        } = drawn;
        self.report.pictures = pictures;
        self.report.details = Some(Details {
            edges,
            loops,
            many_loops,
            components,
            spacings,
            ..Details::default()
        });
        Ok(())
    }

    /// Draws nothing: a build without pages refuses pictures before the run.
    #[cfg(not(feature = "pages"))]
    pub fn draw(
        &mut self,
        _: &PointStore,
        _: &Shape,
        _: &Repaired,
        _: Option<&StoredPieces>,
        _: Blocks,
        _: &Lattice,
    ) -> Result<()> {
        Ok(())
    }

    /// The report of the run.
    pub fn report(mut self) -> Report {
        let memory = &self.job.memory;
        if let Some(details) = &mut self.report.details {
            details.begun = std::mem::take(&mut self.clock.begun);
            details.course = self.course.as_ref().map_or_else(Vec::new, Course::samples);
        }
        Report {
            peak_resident_bytes: limits::peak_resident(),
            resident_file_bytes: limits::resident_file(),
            peak_held_bytes: memory.peak_held(),
            held_at_peak: memory.held_at_peak(),
            peak_reserved_bytes: memory.peak(),
            reserved_at_peak: memory.at_peak(),
            peak_scratch_bytes: self.workspace.io.scratch_peak(),
            seconds: self.begin.elapsed().as_secs_f64() + self.clock.earlier,
            stages: self.clock.stages,
            ..self.report
        }
    }
}
