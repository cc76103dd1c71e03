//! The result of a check.

use super::Options;
use super::bounds::Bounds;
use std::fmt;

/// Counts and defects of a mesh file.
///
/// A *sound* triangle has three distinct corners that all exist. Edges, components and all other topological
/// properties refer to sound triangles only.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Verdict {
    /// True if the mesh has none of the defects. Zero-area triangles are no defect, nor are unreferenced
    /// vertices if they were allowed.
    pub manifold: bool,
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
    /// Triangles in the file, sound or not; polygons count as the triangles that they are divided into.
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
    /// True if every edge has two triangles, which run along it in opposite directions.
    pub closed: bool,
    /// The volume that a closed mesh encloses, in the cube of its unit: negative if its triangles face inwards, and
    /// counted twice where it overlaps itself. Absent for meshes that are not closed.
    pub volume: Option<f64>,
    /// Box around the finite vertices, in the coordinates of the cloud; absent if there is none.
    pub bounds: Option<Bounds>,
    /// The position of the cloud that is the origin of the coordinates in the file; absent if the header gives
    /// none.
    pub origin: Option<[f64; 3]>,
}

impl Verdict {
    /// Fills in what follows from the counts.
    pub(super) fn judged(self, options: &Options) -> Self {
        let unsound = self.index_out_of_range + self.degenerate_triangles;
        let sound = self.triangles - unsound;
        let referenced = self.vertices - self.unreferenced_vertices;
        let euler = referenced as i64 - self.edges as i64 + sound as i64;
        let surface_defects = unsound
            + self.repeated_triangles
            + self.non_manifold_edges
            + self.inconsistent_edges
            + self.pinched_vertices;
        // χ = 2 (components − genus) − boundary loops
        let twice = 2 * self.components as i64 - self.boundary_loops as i64 - euler;
        let is_oriented = surface_defects == 0 && sound > 0;
        // A pinched vertex opens nothing.
        let closed = self.boundary_edges == 0
            && sound > 0
            && surface_defects == self.pinched_vertices + self.repeated_triangles;
        let verdict = Self {
            closed,
            volume: self
                .volume
                .filter(|_| closed && self.non_finite_vertices == 0),
            unreferenced_allowed: options.allow_unreferenced,
            euler_characteristic: euler,
            genus: is_oriented.then_some(twice.max(0) as u64 / 2),
            ..self
        };
        let manifold = verdict.defects().iter().all(|(_, count)| *count == 0);
        Self {
            manifold,
            ..verdict
        }
    }

    /// Name and number of every defect, 0 included.
    #[must_use]
    pub fn defects(&self) -> [(&'static str, u64); 8] {
        let unreferenced = match self.unreferenced_allowed {
            true => 0,
            false => self.unreferenced_vertices,
        };
        [
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
        let counts: [(&str, &dyn fmt::Display); 9] = [
            ("vertices", &self.vertices),
            ("triangles", &self.triangles),
            ("edges", &self.edges),
            ("boundary edges", &self.boundary_edges),
            ("boundary loops", &self.boundary_loops),
            ("components", &self.components),
            ("Euler characteristic", &self.euler_characteristic),
            ("genus", &genus),
            (
                "zero-area triangles (not a defect)",
                &self.zero_area_triangles,
            ),
        ];
        for (name, count) in counts {
            writeln!(f, "{name:<40}{count:>14}")?;
        }
        let closed = if self.closed { "yes" } else { "no" };
        writeln!(f, "{:<40}{closed:>14}", "closed")?;
        if let Some(volume) = self.volume {
            writeln!(f, "{:<40}{volume:>14.6}", "volume")?;
        }
        if self.unreferenced_allowed {
            let (name, count) = (
                "unreferenced vertices (allowed)",
                self.unreferenced_vertices,
            );
            writeln!(f, "{name:<40}{count:>14}")?;
        }
        if let Some([x, y, z]) = self.origin {
            writeln!(
                f,
                "origin  {x} {y} {z}  (the box is in the cloud's coordinates)"
            )?;
        }
        match self.bounds {
            Some(Bounds { min, max }) => {
                let ([a, b, c], [x, y, z]) = (min, max);
                write!(f, "box  {a} {b} {c}  to  {x} {y} {z}")
            }
            None => write!(f, "box  empty"),
        }
    }
}
