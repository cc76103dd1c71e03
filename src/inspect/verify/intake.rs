//! Reads the mesh into buckets of triangles, one for each range of vertices.

use super::bounds::Bounds;
use super::buckets::Buckets;
use super::places::{Kind, Places};
use super::plan::Plan;
use super::positions::Positions;
use super::verdict::Verdict;
use crate::error::Result;
use crate::inspect::ply_mesh::{PlyMesh, Sink};
use crate::workspace::Workspace;

/// The mesh, ready for the sweep over the ranges.
pub(super) struct Intake<'a> {
    plan: &'a Plan,
    workspace: &'a Workspace,
    /// All that reading can tell.
    pub(super) verdict: Verdict,
    pub(super) positions: Positions,
    /// Where triangles are degenerate.
    pub(super) places: Places,
    /// Triangles with three distinct, valid corners, in the buckets of the ranges of their corners.
    pub(super) triangles: Buckets<[u32; 3]>,
}

/// Reads all of `mesh`.
pub(super) fn read<'a>(
    mesh: PlyMesh,
    plan: &'a Plan,
    workspace: &'a Workspace,
) -> Result<Intake<'a>> {
    let total = mesh.vertices() + mesh.faces();
    workspace
        .observer
        .begin("read mesh", "vertices and faces", total);
    let mut intake = Intake {
        plan,
        workspace,
        verdict: Verdict::default(),
        positions: Positions::new(workspace, plan)?,
        places: Places::default(),
        triangles: Buckets::new(workspace, "verify.triangles", plan.ranges, plan.blocks[0])?,
    };
    mesh.read(&mut intake)?;
    intake.positions.finish()?;
    workspace.observer.end();
    Ok(intake)
}

impl Sink for Intake<'_> {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        self.workspace.check_cancel()?;
        self.verdict.vertices += positions.len() as u64;
        for &position in positions {
            if position.iter().all(|c| c.is_finite()) {
                self.verdict.bounds = Some(Bounds::with(self.verdict.bounds, position));
            } else {
                self.verdict.non_finite_vertices += 1;
            }
        }
        self.positions.append(positions)?;
        self.workspace.observer.advance(positions.len() as u64);
        Ok(())
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        self.workspace.check_cancel()?;
        self.verdict.triangles += triangles.len() as u64;
        for &[x, y, z] in triangles {
            if x.max(y).max(z) >= self.plan.vertices {
                self.verdict.index_out_of_range += 1;
                continue;
            }
            if x == y || y == z || z == x {
                self.verdict.degenerate_triangles += 1;
                self.places.note(Kind::Degenerate, x);
                continue;
            }
            let [a, b, c] = [x, y, z].map(|v| self.plan.range_of(v));
            for (range, new) in [(a, true), (b, b != a), (c, c != a && c != b)] {
                if new {
                    self.triangles.push(range, [x, y, z])?;
                }
            }
        }
        self.workspace.observer.advance(triangles.len() as u64);
        Ok(())
    }

    fn non_triangles(&mut self, count: u64) -> Result<()> {
        self.verdict.non_triangles += count;
        self.workspace.observer.advance(count);
        Ok(())
    }
}
