//! The stage that tells how well each vertex is supported.

use super::Stages;
use super::values::Values;
use outcrop_disk::error::Result;
use outcrop_mesh::confidence::confidence;
use outcrop_mesh::repair::Repaired;
use outcrop_mesh::triples::Triples;
use outcrop_points::{Attribute, Column};
use outcrop_stages::blocks::Blocks;

impl Stages<'_> {
    /// The triples, if they are needed after stitching.
    pub fn kept(&self, triples: &Triples) -> Option<Triples> {
        let keeps = self.job.params.attributes.has_confidence();
        keeps.then(|| triples.clone())
    }

    /// Adds the column with the confidence of the vertices, if the triples were kept for it.
    pub fn confidence(
        &mut self,
        triples: Option<Triples>,
        repaired: &Repaired,
        blocks: Blocks,
        values: &mut Values,
    ) -> Result<()> {
        let Some(triples) = triples else {
            return Ok(());
        };
        let (workspace, points) = (self.workspace, blocks.points() as u64);
        let make = || confidence(&triples, repaired, blocks, workspace);
        let (columns, range) = self.clock.stage("confidence", "points", points, make)?;
        triples.release(workspace)?;
        let Column { name, scalar } = Column::confidence();
        self.report.attributes.push(Attribute {
            name,
            scalar,
            range,
            files_without: 0,
        });
        values.append(columns);
        Ok(())
    }
}
