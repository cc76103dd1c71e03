//! The sweep over all ranges of vertices, from the last to the first.

use super::area::Areas;
use super::buckets::Buckets;
use super::contract::{Contraction, Forest};
use super::corners::Corners;
use super::homes::Shared;
use super::intake::Intake;
use super::places::Places;
use super::plan::Plan;
use super::star::{Inspector, Tally, scratch_bytes};
use super::verdict::Verdict;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;

/// The name of the memory for a star that is too large for the plan.
const STAR: &str = "verify: star of one vertex";

struct Sweep<'a> {
    plan: &'a Plan,
    workspace: &'a Workspace,
    triangles: Buckets<[u32; 3]>,
    corners: Corners,
    areas: Areas,
    forest: Forest,
    surface: Contraction,
    boundary: Contraction,
    tally: Tally,
    places: Places,
    /// The vertices to be examined; all if there are none.
    shared: Option<Shared>,
}

/// Processes all ranges of the mesh; completes the counts of the verdict.
pub(super) fn run(
    intake: Intake<'_>,
    plan: &Plan,
    workspace: &Workspace,
) -> Result<(Verdict, Places)> {
    let (shared, _held) = intake.shared.unzip();
    let mut sweep = Sweep {
        plan,
        workspace,
        areas: Areas::new(
            workspace,
            plan,
            intake.positions,
            (intake.zero_area, intake.volume),
        )?,
        triangles: intake.triangles,
        corners: Corners::default(),
        forest: Forest::default(),
        surface: intake.surface,
        boundary: intake.boundary,
        tally: intake.tally,
        places: intake.places,
        shared,
    };
    let vertices = u64::from(plan.vertices);
    workspace.observer.begin("check mesh", "vertices", vertices);
    for k in (0..plan.ranges).rev() {
        workspace.check_cancel()?;
        sweep.visit(k)?;
        workspace.observer.advance(plan.range(k).1 as u64);
    }
    workspace.observer.end();
    let tally = sweep.tally;
    let verdict = Verdict {
        repeated_triangles: tally.repeated_triangles,
        non_manifold_edges: tally.non_manifold_edges,
        inconsistent_edges: tally.inconsistent_edges,
        pinched_vertices: tally.pinched_vertices,
        unreferenced_vertices: intake.verdict.vertices - tally.referenced,
        zero_area_triangles: sweep.areas.zero,
        volume: sweep.areas.volume.value(),
        edges: tally.edges,
        boundary_edges: tally.boundary_edges,
        boundary_loops: sweep.boundary.complete,
        components: sweep.surface.complete,
        ..intake.verdict
    };
    Ok((verdict, sweep.places))
}

impl Sweep<'_> {
    fn visit(&mut self, k: usize) -> Result<()> {
        let (first, length) = self.plan.range(k);
        self.corners.reset(first, length);
        self.forest.reset(first, length);
        self.join_surface(k)?;
        if let Some(shared) = &self.shared {
            self.corners.keep(|vertex| shared.has(vertex));
        }
        self.forest.reset(first, length);
        self.areas.enter(k, first)?;
        let mut start = 0;
        while start < length {
            let (part, corners) = self.corners.part_from(start, self.plan.corners);
            let end = part.end;
            let more = corners.saturating_sub(self.plan.corners) as u64;
            let _held = self.workspace.reserve(STAR, 8 * more)?;
            self.corners.begin(part, corners);
            self.gather(k, start == 0)?;
            self.inspect()?;
            self.corners.trim(self.plan.corners);
            start = end;
        }
        self.boundary.close(&mut self.forest, k)?;
        self.triangles.clear(k);
        Ok(())
    }

    /// Counts the triangles at each vertex and joins the vertices of each triangle.
    fn join_surface(&mut self, k: usize) -> Result<()> {
        let (first, length) = self.plan.range(k);
        let mut cursor = self.triangles.cursor(k);
        while let Some(block) = self.triangles.next(&mut cursor)? {
            self.workspace.check_cancel()?;
            let corners = &mut self.corners;
            let (surface, forest) = (&mut self.surface, &mut self.forest);
            let join = || {
                for triangle in block {
                    let [x, y, z] = *triangle;
                    let high = x.max(y).max(z);
                    // Any other triangle was joined in the range of its highest corner.
                    if high.wrapping_sub(first) as usize >= length {
                        continue;
                    }
                    for &low in triangle.iter().filter(|v| **v != high) {
                        surface.connect(forest, low, high)?;
                    }
                }
                Ok(())
            };
            rayon::join(|| corners.count(block), join).1?;
        }
        for vertex in self.corners.referenced() {
            self.forest.touch(vertex);
        }
        self.surface.close(&mut self.forest, k)
    }

    /// Collects the stars of the current part; examines the areas the `first_time`.
    fn gather(&mut self, k: usize, first_time: bool) -> Result<()> {
        let (first, length) = self.plan.range(k);
        let mut cursor = self.triangles.cursor(k);
        while let Some(block) = self.triangles.next(&mut cursor)? {
            self.workspace.check_cancel()?;
            let (corners, areas) = (&mut self.corners, &mut self.areas);
            if first_time {
                let look = || areas.look(block, first, length);
                rayon::join(|| corners.fill(block), look).1?;
            } else {
                corners.fill(block);
            }
        }
        Ok(())
    }

    /// Examines the stars of the current part.
    fn inspect(&mut self) -> Result<()> {
        let (tally, places) = self.corners.inspect(self.plan.large_star);
        self.tally = self.tally + tally;
        self.places = std::mem::take(&mut self.places).with(places);
        let (first, mut from) = (self.corners.first(), 0);
        while let Some((at, star)) = self.corners.large(from, self.plan.large_star) {
            self.workspace.check_cancel()?;
            let bytes = scratch_bytes(star.len());
            let _held = self.workspace.reserve(STAR, bytes)?;
            let mut inspector = Inspector::default();
            inspector.inspect(first + at as u32, star);
            self.tally = self.tally + inspector.tally;
            self.places = std::mem::take(&mut self.places).with(inspector.places);
            from = at + 1;
        }
        for (vertex, others) in self.corners.boundaries() {
            self.forest.touch(vertex);
            for &other in others.iter().filter(|other| **other < vertex) {
                self.boundary.connect(&mut self.forest, other, vertex)?;
            }
        }
        Ok(())
    }
}
