//! Reads a mesh by pieces, on all threads, and leaves only what touches several pieces for the sweep.
//!
//! Possible if the file can be read at any place and vertices with numbers near each other are in faces near
//! each other, as in all meshes that come block by block ([`super::homes`]).

use super::bounds::Bounds;
use super::homes::{AT_A_TIME, Division, Homes, Shared};
use super::intake::Intake;
use super::piece::Piece;
use super::plan::Plan;
use super::verdict::Verdict;
use super::volume::Volume;
use outcrop_codecs::ply_mesh::{AnyPlace, PlyMesh};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::{Workspace, lock};
use std::sync::Mutex;

/// Fewest faces of a mesh that is read by pieces.
const FEWEST: u64 = 1 << 20;

/// Faces of a piece: most, and fewest.
const PIECE: (usize, usize) = (1 << 17, 1 << 13);

/// log2 of the vertices of a group, and most groups with one home for each such number of faces.
const GROUP: (u32, usize) = (12, 1);

/// The division of a mesh for `threads` threads with `free` bytes; none if it is too small, or memory is.
pub(super) fn division(
    mesh: &PlyMesh,
    entries: [usize; 2],
    threads: usize,
    free: u64,
) -> Option<Division> {
    let (vertices, faces) = (u32::try_from(mesh.vertices()).ok()?, mesh.faces());
    let (shift, share) = GROUP;
    let sized = |piece: usize| Division {
        vertices,
        faces,
        piece,
        shift,
        most_groups: (piece >> shift) * share,
        at_home: 3,
    };
    let fits = |division: &Division| {
        let pieces = Piece::bytes(division, entries) * threads as u64;
        division.bytes() + pieces <= free / 2
    };
    let sizes = (PIECE.1.ilog2()..=PIECE.0.ilog2()).rev();
    let found = sizes.map(|log| sized(1 << log)).find(fits)?;
    (faces >= FEWEST && vertices > 0).then_some(found)
}

/// Reads `mesh` by the pieces of `division`; none if it is not fit for that.
pub(super) fn read<'a>(
    mesh: &AnyPlace,
    division: Division,
    plan: &'a Plan,
    workspace: &'a Workspace,
) -> Result<Option<Intake<'a>>> {
    let held = workspace.reserve("verify: homes of vertices", division.bytes())?;
    let Some(homes) = Homes::new(mesh, division, workspace)? else {
        return Ok(None);
    };
    let observer = &workspace.observer;
    observer.begin("look at faces", "faces", division.faces);
    let shared = homes.shared(mesh, workspace)?;
    observer.end();
    let Some(shared) = shared else {
        return Ok(None);
    };
    let total = u64::from(division.vertices) + division.faces;
    observer.begin("read mesh", "vertices and faces", total);
    let mut first = Vec::new();
    mesh.positions((0, 1), &mut Vec::new(), &mut first)?;
    let mut intake = Intake::of_pieces(plan, workspace)?;
    intake.volume = Volume::from(first[0]);
    let origin = intake.volume.origin;
    let intake = Mutex::new(intake);
    let spare = Mutex::new(Vec::<Piece>::new());
    let size = Piece::bytes(&division, mesh.entries());
    let name = "verify: piece of the mesh";
    workspace.for_each_unit(
        name,
        division.pieces(),
        |_| size,
        |unit| {
            let _held = unit.hold(size);
            let mut piece = lock(&spare).pop().unwrap_or_default();
            piece.found.volume.origin = origin;
            let advance = |count| unit.advance(count);
            piece.examine(mesh, (&homes, &shared), unit.number(), advance)?;
            lock(&intake).take(&mut piece, &homes)?;
            lock(&spare).push(piece);
            Ok(())
        },
    )?;
    let mut intake = intake
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    let spare = spare
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    for piece in spare {
        intake.tally = intake.tally + piece.inspector.tally;
        intake.places = std::mem::take(&mut intake.places).with(piece.inspector.places);
    }
    intake.homeless(mesh, &homes, &shared)?;
    observer.end();
    intake.shared = Some((shared, held));
    Ok(Some(intake))
}

impl Intake<'_> {
    /// Takes what was found in a piece.
    fn take(&mut self, piece: &mut Piece, homes: &Homes) -> Result<()> {
        let found = &piece.found;
        for &triangle in &found.open {
            self.send(triangle)?;
        }
        let [triangles, boundary] = &found.edges;
        for &[low, high] in triangles {
            self.surface.send(low, high)?;
        }
        for &[low, high] in boundary {
            self.boundary.send(low, high)?;
        }
        for (vertex, position) in piece.needed(homes) {
            self.positions
                .put(self.plan.range_of(vertex), vertex, position)?;
        }
        self.surface.complete += found.complete[0];
        self.boundary.complete += found.complete[1];
        self.zero_area += found.zero_area;
        self.volume.join(&found.volume);
        let verdict = &mut self.verdict;
        *verdict = Verdict {
            vertices: verdict.vertices,
            triangles: verdict.triangles + found.triangles,
            index_out_of_range: verdict.index_out_of_range + found.out_of_range,
            degenerate_triangles: verdict.degenerate_triangles + found.degenerate,
            non_finite_vertices: verdict.non_finite_vertices + found.non_finite,
            bounds: Bounds::around(verdict.bounds, found.bounds),
            ..*verdict
        };
        Ok(())
    }

    /// Takes the vertices that are at home nowhere.
    fn homeless(&mut self, mesh: &AnyPlace, homes: &Homes, shared: &Shared) -> Result<()> {
        let (mut bytes, mut positions) = (Vec::new(), Vec::new());
        let groups = homes.groups_of(homes.division.pieces());
        for run in Division::runs(groups) {
            let mut vertices = homes.division.vertices_of(run);
            while !vertices.is_empty() {
                self.workspace.check_cancel()?;
                let now = (vertices.end - vertices.start).min(AT_A_TIME as u64) as usize;
                positions.clear();
                mesh.positions((vertices.start, now), &mut bytes, &mut positions)?;
                self.note(&positions);
                for (vertex, &position) in (vertices.start as u32..).zip(&positions) {
                    if shared.has(vertex) {
                        self.positions
                            .put(self.plan.range_of(vertex), vertex, position)?;
                    }
                }
                self.workspace.observer.advance(now as u64);
                vertices.start += now as u64;
            }
        }
        Ok(())
    }
}
