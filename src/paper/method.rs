//! All constants of the method: everything that decides the mesh besides the points and the parameters
//! (`outcrop::Params`), including the defaults of the parameters. `docs/method.md` defines their use (section
//! 10 lists them), and `docs/ablation.md` shows the effect of other values.
//!
//! Constants that only concern speed, memory, rounding or files are next to the code that uses them.

#[cfg(feature = "ablation")]
mod ablation;
mod constants;

#[cfg(feature = "ablation")]
pub use ablation::{METHOD, report};
use constants::constants;

/// The version of the method, as a literal: it grows whenever the mesh of any cloud changes, by a constant, a
/// rule or a correction. docs/versions.md lists all versions, and `tests/program/end_to_end/versions.rs` holds it.
#[doc(hidden)]
#[macro_export]
macro_rules! __method_version {
    () => {
        3
    };
}
pub use __method_version as method_version;

/// The constants, as a `const` so that the compiler can fold them.
#[cfg(not(feature = "ablation"))]
pub const METHOD: Constants = VALUES;

constants! {
    /// Intervals of the curve that orders the points: small pieces of surface.
    curve: Curve {
        /// Length of a patch. Local spacings are measured for patches, and flat parts of the surface are joined
        /// inside patches before the rest is oriented.
        patch: usize = 256, "ids";
        /// Length of a run: its points are sampled together.
        run: usize = 16, "ids";
        /// One in this number of runs is sampled to find the regions with noise. More samples cost time on clean
        /// clouds.
        sample: usize = 8, "runs";
        /// Length of a block, in which T12 triangles are inserted, and of a region, whose points are
        /// examined if its samples show noise.
        block: u32 = 1 << 16, "ids";
    }
    /// The plane fitted to a point's neighbours.
    plane: PlaneFit {
        /// Neighbours (paper: 30). With 20 there are 17 % more holes in a terrestrial scan after two rounds
        /// of relaxing.
        neighbors: usize = 30, "points";
        /// If the middle eigenvalue is a smaller share of the largest, the neighbours lie on a line and their
        /// number is doubled.
        line: f64 = 1.0 / 400.0, "share of the largest eigenvalue";
        /// If it is a smaller share than this, they lie on a band, such as two scan lines, whose normal is
        /// unreliable; their number is doubled (robust).
        band: f64 = 1.0 / 25.0, "share of the largest eigenvalue";
        /// Most doublings of the number of neighbours that lie on a line or a band.
        doublings: u32 = 3, "times";
    }
    /// The disk to which a cell is restricted.
    disk: Disk {
        /// Radius. On uniform samples, including their boundaries, disks of this size see 99.9 % of the
        /// triangles that very large disks see. A point whose neighbours reach farther than the disks of its
        /// region can be off the surface.
        reach: f64 = 2.0, "distances of the last neighbour";
    }
    /// Normals that points bring.
    normals: Normals {
        /// A normal suits the points if their scatter along it is at most this many times that along the estimated
        /// normal (and a share of `plane.line` of all scatter besides): at edges, between layers and in noise it may
        /// be farther from the estimate than on a clean surface.
        scatter: f64 = 4.0, "times";
        /// Points beside a point agree with the side of its normal if at most one in this number does not; they are
        /// beside it if their height over its plane is at most one part in this number of their distance; and the
        /// normals of a cloud are oriented if at least one point in this number has such neighbours. Of true
        /// normals nearly all have, with a fifth flipped nearly half, with random signs one in 50.
        sides: u64 = 4, "one in", [3, 8];
        /// At least so many points beside a point must have a normal. Of fewer, those with random signs agree too
        /// often.
        beside: u64 = 6, "points", [3, 9];
    }
    /// Outliers, which are dropped on request.
    outliers: Outliers {
        /// Most rounds. Another round finds outliers for which even the reference consists of outliers.
        rounds: u32 = 4, "rounds";
    }
    /// Points off the surface, such as birds and dust, and coarse points.
    off_surface: OffSurface {
        /// This share of the neighbours, the nearer ones, tells whether a point whose neighbours reach far is off
        /// the surface, and whether a coarse one may have longer triangles: if they lie neither on a line nor on a
        /// band, unlike those of a wire. With 0.75 triangles hang between wires and birds. All neighbours of a point
        /// of a thin sheet fill space, the nearer ones do not.
        nearer: f64 = 0.67, "of the neighbours", [0.5, 0.75];
        /// It is off the surface if they fill space: their scatter along the normal is more than one part in this
        /// number of the total scatter; or if it is beside the plane of its neighbours, which needs no constant.
        /// With 8, a cloud with 1 % of strewn points has F 98.2 instead of 99.5.
        space: f64 = 10.0, "one part in", [8.0, 12.0];
    }
    /// Smoothing by a curved surface, which also distinguishes edges from noise.
    smoothing: Smoothing {
        /// Neighbours for a curved surface: it has more unknowns than a plane and needs more points. With 3, each
        /// round takes a quarter longer, and fine details go: of a part with thin fins a hundredth more is lost.
        neighbors: usize = 2, "times those of a plane", [1, 3];
        /// Squared distance at which weights vanish.
        reach2: f64 = 1.1, "squared distances of the last neighbour", [1.05, 1.4];
        /// Squared height over a surface of second order above which a neighbour counts as a stray and is left
        /// out.
        stray2: f64 = 9.0, "mean squares";
        /// A plane is enough up to this: what second order explains, by unknown, against what it leaves, by
        /// degree of freedom. In noise it is 1, and more than 4 for one point in a hundred.
        enough: f64 = 1.5, "times", [1.0, 2.5];
        /// From here on only the curved surface counts; between, the foot is between both.
        needed: f64 = 4.0, "times", [3.0, 6.0];
        /// The plane counts if the mean squared height is at least this share of that over the first surface
        /// after weights were lowered. In noise it is 0.44, and less than 0.33 for one point in 20.
        alike: f64 = 0.35, "share", [0.3, 0.4];
        /// Down from here only the surface of the lowered weights counts: there are two layers.
        apart: f64 = 0.25, "share", [0.2, 0.3];
        /// Squared height over the first surface at which weights vanish: points across an edge lose their
        /// weight.
        height2: f64 = 4.0, "mean squares";
        /// A point whose foot is farther away is an outlier and does not move.
        farthest: f64 = 0.5, "distances of the last neighbour", [0.35, 0.7];
        /// Ridge that keeps a surface bounded where the points do not determine it.
        ridge: f64 = 1e-3, "weights of all points";
        /// A curved surface is used if the squared heights over a plane are more than this many times those
        /// over it: in noise a plane is more accurate.
        gain: f64 = 1.25, "times", [1.1, 1.5];
    }
    /// Noise: which points are smoothed, and how often.
    noise: Noise {
        /// Nearest neighbours whose heights over a surface of second order are the noise at a point, and whose
        /// mean distance is the spacing by which outliers are told. So few that they lie on one sheet of a plate
        /// 1.5 spacings thick; with 12, a tenth of the points of such a plate seem noisy.
        nearest: usize = 8, "points", [7, 12];
        /// Noise is measured at one point in this number, and is that of the points behind it in the order of the
        /// ids. At every point, an aerial scan takes a twelfth longer.
        every: usize = 4, "ids", [1, 8];
        /// A point is clean if its noise is at most this. A region is examined if there is twice as much in a
        /// sampled run: a clean scan of a face has 0.031 at one point of 120 000, a scan with noise of a quarter
        /// of the spacing less than 0.083 at one point of 20. With 0.035 a carved lion has a sixth more boundary.
        floor: f64 = 0.02, "local spacings";
        /// Noise above which there is a second round; twice as much asks for a third. A point with more of it has
        /// no wider limits of length if it is coarse. With 0.075 an aerial scan takes a tenth longer; with 0.15
        /// façades scanned from a car face inwards.
        round: f64 = 0.1, "local spacings", [0.075, 0.15];
        /// Root mean square height of the neighbours over their surface, for each round that the noise asks for,
        /// above which they lie in layers or show details: then fewer neighbours are used.
        layers: f64 = 0.4, "local spacings", [0.3, 0.6];
        /// A point stays where it is if at least one in this number of its neighbours is clean: they tell
        /// edges, details and thin sheets from noise.
        few: usize = 10, "one in";
        /// Root mean square height of a point's neighbours over their surface up to which the next point may follow
        /// it, that is move by others in its last round only. So a landscape with noise of half a spacing is
        /// smoothed in 0.75 of the time. With 0.8 there are some holes in noise of a spacing, and beside birds and
        /// wires.
        follow: f64 = 0.7, "local spacings";
        /// Most rounds, by default.
        rounds: u32 = 3, "rounds", [2, 4];
    }
    /// Orientation of the surface, and the cuts where it is one-sided.
    orientation: Orientation {
        /// Weight of an edge where the surface is flat, and of the square root of the evidence that a part faces
        /// up; the weight of a fold is 1. With 48 for the evidence an aerial scan has 6 % more boundary, with 0
        /// three quarters more of its area faces down.
        flattest: i64 = 16, "weight";
        /// Where the cosine between triangles is larger, the surface is not cut.
        flat: f64 = 0.9, "cosine", [0.8, 0.95];
        /// An edge between two triangles has the weight of this number of candidates.
        edge: i64 = 8, "candidates";
        /// Most triangles joined in a block where turning them could still reduce the cut weight in the rest
        /// of the cloud. Up to 4096 open ground is cut nowhere, with 16 384 it is; smaller values need more
        /// memory.
        cluster: u64 = 1024, "triangles";
        /// Points for each vertical column of space, whose highest point faces up.
        column: u64 = 64, "points";
        /// Least evidence that fixes the orientation of a piece without connections. With 0 an aerial scan
        /// loses 0.1 % of its points, and 5 % more triangles are cut. A part is turned again for more than its
        /// upward weight, 512. For any gain, lone-star has 5 % more boundary.
        held: i64 = 1024, "evidence";
    }
    /// Admissible triangles.
    admissibility: Admissibility {
        /// Default longest side, and side of the equilateral triangle with the largest area allowed in a filling
        /// (robust).
        edge: f64 = 8.0, "local spacings";
        /// Default largest angle between the normals of a T12 triangle and its neighbours (paper: 60).
        angle: f64 = 143.0, "degrees", [100.0, 180.0];
    }
    /// Holes that are filled.
    filling: Filling {
        /// Default number of edges of the longest loop (paper: 500). What is too wide for the surface stays
        /// open, so long loops are filled where they are narrow. With 500 an aerial scan has a fifth more
        /// boundary.
        longest: usize = 1500, "edges";
        /// Longest side of a triangle of a filling, which may be slender. With 2 an aerial scan has a twelfth
        /// more boundary; without a limit one in 1000 points of the mesh is half as far again from the scan.
        slender: f64 = 2.5, "widths";
        /// A loop is an opening if its area, or that of its filling, is larger for each edge: the limit is a
        /// round hole of some 55 edges.
        opening: f64 = 4.5, "mean squares of its edges";
        /// A loop of at most this number of edges is a hole and not an outline: pieces with such short
        /// outlines were removed.
        sure: usize = 6, "edges";
        /// A loop is an outline if its vector area points away from the triangles along it by more than this
        /// cosine.
        outline: f64 = 0.5, "cosine", [0.25, 0.75];
    }
    /// Ear clipping along a torn boundary.
    ear_clipping: EarClipping {
        /// Longest chord of an ear.
        reach: f64 = 6.0, "widths of the triangles around";
        /// Cosine of the largest angle between an ear and its neighbours: 100 degrees.
        fold: f64 = -0.173_648_177_666_930_36, "cosine", [-0.642_787_609_686_539_3, 0.342_020_143_325_668_8];
        /// Corners along the loop, in both directions, that must not lie over or under an ear.
        look: usize = 6, "corners";
    }
    /// Components: removal of small ones, and orientation.
    components: Components {
        /// Least number of triangles (paper: 10).
        least: u64 = 10, "triangles";
        /// A component half of whose triangles are at noisy points needs one triangle for each of this number of
        /// points of the cloud.
        each_if_noisy: u64 = 5000, "points";
        /// Largest number of triangles that a noisy component needs.
        most_if_noisy: u64 = 150, "triangles";
        /// An open component is oriented by its vector area if this is at least one part in this number of
        /// its area; else outwards.
        open: f64 = 4.0, "one part in";
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_document_has_all_as_they_are() {
        let document = include_str!("../../docs/ablation.md");
        for entry in Constants::list() {
            let row = format!("| {} | {} | {} |", entry.name, entry.value, entry.unit);
            let described = format!("{row} {} |", entry.why);
            assert!(
                document.contains(&described),
                "scripts/ablation --constants: {described}"
            );
            assert!(
                document.matches(&row).count() == 3,
                "scripts/ablation: {row}"
            );
        }
    }

    #[test]
    fn all_are_described_and_have_two_other_values() {
        for entry in Constants::list() {
            let (name, [less, more]) = (entry.name, &entry.tried);
            assert!(!entry.unit.is_empty() && entry.why.ends_with('.'), "{name}");
            assert!(
                ![less, more].contains(&&entry.value) && less != more,
                "{name}"
            );
        }
    }
}
