//! The result of a check.

use super::Options;
use super::bounds::Bounds;
use super::intake::Counts;
use super::sweep::Swept;
use std::fmt;

/// Counts and defects of a mesh file.
///
/// A *sound* triangle has three distinct corners that all exist. Edges, components and all other topological
/// properties refer to sound triangles only.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Verdict {
    /// True if the mesh has none of the defects. Zero-area triangles are no defect, nor are unreferenced
    /// vertices if they were allowed.
    pub manifold: bool,
    /// Defect: faces that do not have exactly three corners.
    pub non_triangles: u64,
    /// Defect: triangles with an index that is no vertex of the file.
    pub index_out_of_range: u64,
    /// Defect: triangles with existing corners, two of which are the same vertex.
    pub degenerate_triangles: u64,
    /// Defect: sound triangles with the same three corners, in any order, as an earlier one.
    pub repeated_triangles: u64,
    /// Defect: edges with more than two triangles.
    pub non_manifold_edges: u64,
    /// Defect: edges whose two triangles run along it in the same direction.
    pub inconsistent_edges: u64,
    /// Defect: vertices, all of whose edges have at most two triangles, whose triangles form
    /// neither one disk nor one half-disk.
    pub pinched_vertices: u64,
    /// Defect: vertices with a coordinate that is infinite or not a number.
    pub non_finite_vertices: u64,
    /// Defect unless allowed: vertices without sound triangle.
    pub unreferenced_vertices: u64,
    /// True if unreferenced vertices were allowed.
    pub unreferenced_allowed: bool,
    /// Sound triangles whose corners have finite positions exactly on one line, or coincident.
    pub zero_area_triangles: u64,
    /// Vertices in the file.
    pub vertices: u64,
    /// Faces with three corners in the file, sound or not.
    pub triangles: u64,
    /// Edges of sound triangles.
    pub edges: u64,
    /// Edges with exactly one triangle.
    pub boundary_edges: u64,
    /// Connected components of the boundary edges: the number of holes and outer borders. Loops
    /// that meet at a pinched vertex count as one.
    pub boundary_loops: u64,
    /// Sets of sound triangles connected through common vertices.
    pub components: u64,
    /// Vertices − edges + triangles, of sound triangles and their vertices.
    pub euler_characteristic: i64,
    /// Handles, summed over all components, each boundary loop taken as filled by a disk. Absent
    /// without triangles, and if the mesh is not an oriented manifold.
    pub genus: Option<u64>,
    /// Box around the finite vertices; absent if there is none.
    pub bounds: Option<Bounds>,
}

impl Verdict {
    pub(super) fn new(
        counts: &Counts,
        bounds: Option<Bounds>,
        swept: &Swept,
        options: &Options,
    ) -> Self {
        let tally = swept.tally;
        let unsound = counts.index_out_of_range + counts.degenerate_triangles;
        let sound = counts.triangles - unsound;
        let euler = tally.referenced as i64 - tally.edges as i64 + sound as i64;
        let surface_defects = counts.non_triangles
            + unsound
            + tally.repeated_triangles
            + tally.non_manifold_edges
            + tally.inconsistent_edges
            + tally.pinched_vertices;
        let unreferenced = counts.vertices - tally.referenced;
        let counted = if options.allow_unreferenced {
            0
        } else {
            unreferenced
        };
        // χ = 2 (components − genus) − boundary loops
        let twice = 2 * swept.components as i64 - swept.boundary_loops as i64 - euler;
        let genus = (surface_defects == 0 && sound > 0).then_some(twice.max(0) as u64 / 2);
        Self {
            manifold: surface_defects + counts.non_finite_vertices + counted == 0,
            non_triangles: counts.non_triangles,
            index_out_of_range: counts.index_out_of_range,
            degenerate_triangles: counts.degenerate_triangles,
            repeated_triangles: tally.repeated_triangles,
            non_manifold_edges: tally.non_manifold_edges,
            inconsistent_edges: tally.inconsistent_edges,
            pinched_vertices: tally.pinched_vertices,
            non_finite_vertices: counts.non_finite_vertices,
            unreferenced_vertices: unreferenced,
            unreferenced_allowed: options.allow_unreferenced,
            zero_area_triangles: swept.zero_area_triangles,
            vertices: counts.vertices,
            triangles: counts.triangles,
            edges: tally.edges,
            boundary_edges: tally.boundary_edges,
            boundary_loops: swept.boundary_loops,
            components: swept.components,
            euler_characteristic: euler,
            genus,
            bounds,
        }
    }

    /// Name and number of every defect, 0 included.
    #[must_use]
    pub fn defects(&self) -> [(&'static str, u64); 9] {
        let unreferenced = match self.unreferenced_allowed {
            true => 0,
            false => self.unreferenced_vertices,
        };
        [
            ("faces that are not triangles", self.non_triangles),
            (
                "triangles with an index out of range",
                self.index_out_of_range,
            ),
            ("degenerate triangles", self.degenerate_triangles),
            ("repeated triangles", self.repeated_triangles),
            ("non-manifold edges", self.non_manifold_edges),
            ("inconsistently oriented edges", self.inconsistent_edges),
            ("pinched vertices", self.pinched_vertices),
            ("non-finite vertices", self.non_finite_vertices),
            ("unreferenced vertices", unreferenced),
        ]
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "manifold: {}", if self.manifold { "yes" } else { "no" })?;
        for (name, count) in self.defects().into_iter().filter(|(_, count)| *count > 0) {
            writeln!(f, "  {name:<38}{count:>14}")?;
        }
        let genus = self.genus.map_or("-".to_owned(), |g| g.to_string());
        let mut counts = vec![
            ("vertices", self.vertices.to_string()),
            ("triangles", self.triangles.to_string()),
            ("edges", self.edges.to_string()),
            ("boundary edges", self.boundary_edges.to_string()),
            ("boundary loops", self.boundary_loops.to_string()),
            ("components", self.components.to_string()),
            (
                "Euler characteristic",
                self.euler_characteristic.to_string(),
            ),
            ("genus", genus),
            (
                "zero-area triangles (not a defect)",
                self.zero_area_triangles.to_string(),
            ),
        ];
        if self.unreferenced_allowed {
            let count = self.unreferenced_vertices.to_string();
            counts.push(("unreferenced vertices (allowed)", count));
        }
        for (name, count) in counts {
            writeln!(f, "{name:<40}{count:>14}")?;
        }
        match self.bounds {
            Some(Bounds {
                min: [a, b, c],
                max: [x, y, z],
            }) => {
                write!(f, "box  {a} {b} {c}  to  {x} {y} {z}")
            }
            None => write!(f, "box  empty"),
        }
    }
}
