//! Reads the mesh into buckets of triangles, one for each range of vertices.

use super::bounds::Bounds;
use super::buckets::Buckets;
use super::contract::Contraction;
use super::homes::Shared;
use super::places::{Kind, Places};
use super::plan::Plan;
use super::positions::Positions;
use super::star::Tally;
use super::verdict::Verdict;
use super::volume::Volume;
use outcrop_codecs::ply_mesh::{PlyMesh, Sink};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;

/// The mesh, ready for the sweep over the ranges.
pub(super) struct Intake<'a> {
    pub(super) plan: &'a Plan,
    pub(super) workspace: &'a Workspace,
    /// All that reading can tell.
    pub(super) verdict: Verdict,
    pub(super) positions: Positions,
    /// Where triangles are degenerate.
    pub(super) places: Places,
    /// Triangles with three distinct, valid corners, in the buckets of the ranges of their corners.
    pub(super) triangles: Buckets<[u32; 3]>,
    /// Components of the triangles, and of the boundary edges.
    pub(super) surface: Contraction,
    pub(super) boundary: Contraction,
    /// Counts of the vertices that are examined already, and triangles without area there.
    pub(super) tally: Tally,
    pub(super) zero_area: u64,
    /// The volume of these triangles.
    pub(super) volume: Volume,
    /// The vertices that are not examined yet, with their memory; all if there is none.
    pub(super) shared: Option<(Shared, Reservation)>,
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
    let mut intake = Intake::new(plan, workspace, Positions::new(workspace, plan)?)?;
    mesh.read(&mut intake)?;
    intake.positions.finish()?;
    workspace.observer.end();
    Ok(intake)
}

impl<'a> Intake<'a> {
    fn new(plan: &'a Plan, workspace: &'a Workspace, positions: Positions) -> Result<Self> {
        let (ranges, block) = (plan.ranges, plan.blocks[0]);
        Ok(Intake {
            plan,
            workspace,
            verdict: Verdict::default(),
            positions,
            places: Places::default(),
            triangles: Buckets::new(workspace, "verify.triangles", ranges, block)?,
            surface: Contraction::new(workspace, plan, "verify.surface")?,
            boundary: Contraction::new(workspace, plan, "verify.boundary")?,
            tally: Tally::default(),
            zero_area: 0,
            volume: Volume::default(),
            shared: None,
        })
    }

    /// An empty one, for a mesh that is read by pieces.
    pub(super) fn of_pieces(plan: &'a Plan, workspace: &'a Workspace) -> Result<Self> {
        let mut intake = Self::new(plan, workspace, Positions::of_some(workspace, plan)?)?;
        intake.verdict.vertices = plan.vertices.into();
        Ok(intake)
    }

    /// Takes note of the positions of further vertices.
    pub(super) fn note(&mut self, positions: &[[f64; 3]]) {
        for &position in positions {
            if position.iter().all(|c| c.is_finite()) {
                self.verdict.bounds = Some(Bounds::with(self.verdict.bounds, position));
            } else {
                self.verdict.non_finite_vertices += 1;
            }
        }
    }

    /// Sends a triangle with three distinct, valid corners to the ranges of its corners.
    pub(super) fn send(&mut self, triangle: [u32; 3]) -> Result<()> {
        let [a, b, c] = triangle.map(|v| self.plan.range_of(v));
        for (range, new) in [(a, true), (b, b != a), (c, c != a && c != b)] {
            if new {
                self.triangles.push(range, triangle)?;
            }
        }
        Ok(())
    }
}

impl Sink for Intake<'_> {
    fn vertices(&mut self, positions: &[[f64; 3]]) -> Result<()> {
        self.workspace.check_cancel()?;
        if let (0, Some(first)) = (self.verdict.vertices, positions.first()) {
            self.volume = Volume::from(*first);
        }
        self.verdict.vertices += positions.len() as u64;
        self.note(positions);
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
            self.send([x, y, z])?;
        }
        self.workspace.observer.advance(triangles.len() as u64);
        Ok(())
    }
}
