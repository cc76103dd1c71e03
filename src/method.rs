//! All constants of the method: what decides the mesh beside the points and what is asked for
//! ([`crate::Params`]). The defaults of what can be asked for are here as well. docs/method.md says
//! what each is used for; `docs/ablation.md` what happens with other values.
//!
//! Constants that only concern speed, memory, rounding or files are where they are used.

#[cfg(feature = "ablation")]
mod ablation;
mod constants;

#[cfg(feature = "ablation")]
pub(crate) use ablation::{METHOD, report};
use constants::constants;

/// The constants; a `const`, so that the compiler knows them everywhere.
#[cfg(not(feature = "ablation"))]
pub(crate) const METHOD: Constants = VALUES;

constants! {
    /// Pieces of the curve that orders the points: small pieces of surface.
    curve: Curve {
        /// Length of a patch. The spacing is measured by patches, those that are rough are relaxed, and flat
        /// parts of the surface are joined inside them before anything else is oriented.
        patch: usize = 256, "ids";
        /// Length of a run: its points are looked at, and moved again, together.
        run: usize = 16, "ids";
        /// Every so many runs one is looked at before it is known what moves. More cost time on clean clouds.
        sample: usize = 8, "runs";
        /// Length of a block, in which T12 triangles are decided and edges flipped, and of a region, in which
        /// it is decided whether noise or edges make patches rough.
        block: u32 = 1 << 16, "ids";
    }
    /// The plane of a point's neighbours.
    plane: PlaneFit {
        /// Neighbours (paper: 30). With 20 there are 17 % more holes in a terrestrial scan after two rounds of
        /// relaxing.
        neighbors: usize = 30, "points";
        /// Neighbours with a middle eigenvalue below this share of the largest lie on a line: more are taken.
        line: f64 = 1.0 / 400.0, "share of the largest eigenvalue";
        /// Below this share they lie on a band as of two scan lines, whose normal is a matter of chance: more are
        /// taken (robust).
        band: f64 = 1.0 / 25.0, "share of the largest eigenvalue";
        /// How often the neighbours are doubled while they lie on a line or a band.
        doublings: u32 = 3, "times";
        /// Most steps of Newton's method to the least eigenvalue.
        newton_steps: usize = 40, "steps";
    }
    /// The disk that a cell is restricted to.
    disk: Disk {
        /// Radius. On uniform samples, borders included, such disks see 99.9 % of the triangles that very large
        /// ones see.
        reach: f64 = 2.0, "distances of the last neighbour";
    }
    /// Outliers, dropped if asked for.
    outliers: Outliers {
        /// Neighbours whose mean distance is the spacing of a point.
        nearest: usize = 8, "points";
        /// Neighbours whose median spacing it is compared with: so many that the most are on the surface, where
        /// the nearest of an outlier are outliers too.
        around: usize = 64, "points";
        /// Most rounds: where even these are outliers, another one finds them.
        rounds: u32 = 4, "rounds";
    }
    /// Points off the surface, such as birds, dust and wires.
    off_surface: OffSurface {
        /// A point is off the surface if its neighbours reach so many times as far as usual in its patch. With
        /// 4, three times as many points of terrestrial scans are left out; with 6, points in the air are joined
        /// over a twentieth of the ground of a generated world.
        far: u128 = 5, "usual reaches";
        /// The usual reach of a patch is that below which one in so many of its points are: its lower quartile.
        quantile: usize = 4, "one in";
        /// A neighbourhood fills space if its scatter along the normal is more than one part in so many of all.
        /// On a surface with noise of one spacing it is a sixth.
        space: f64 = 7.0, "one part in", [6.0, 9.0];
        /// A patch that is far for its region is in the air if one in so many of its points fills space. With 2
        /// everywhere, sheets of birds hang over 1.4 % of the ground of a landscape.
        airy: usize = 2, "one in", [1, 4];
        /// The same share where such patches are few. With 16 everywhere, a seventh of a room scanned from its middle
        /// is lost.
        airy_if_few: usize = 16, "one in";
        /// They are few if at most one in so many patches of the region is far for it. Where density falls with
        /// the distance from a scanner many are; of a landscape with one bird for 200 points one in 60.
        few: usize = 16, "one in";
    }
    /// Smoothing by a curved surface, which also tells edges from noise.
    smoothing: Smoothing {
        /// Halvings of the lattice step before points move, so that rounding does not undo it.
        halvings: u32 = 10, "times";
        /// Neighbours of a surface in terms of those of a plane: a curved surface is surer through more.
        neighbors: usize = 3, "times those of a plane";
        /// Squared distance at which weights end.
        reach2: f64 = 1.1, "squared distances of the last neighbour", [1.05, 1.4];
        /// Squared height over the first surface at which weights end: what is across an edge loses its weight.
        height2: f64 = 4.0, "mean squares";
        /// What holds back a surface that the points do not decide.
        ridge: f64 = 1e-3, "weights of all points";
        /// A mean square height that is rounding and nothing else.
        exact2: f64 = 1e-24, "squared reaches";
        /// A curved surface is used if a plane leaves more than so many times the square heights: in noise a
        /// plane is the surer one.
        gain: f64 = 1.25, "times", [1.1, 1.5];
    }
    /// Relaxing: which points move, to connect them.
    relax: Relax {
        /// Most rounds, unless another number is asked for.
        rounds: u32 = 3, "rounds";
        /// A point is rough if it is farther from its plane. With 0.3 noise of 0.15 spacings stays; with 0.15
        /// details of a machine part are relaxed.
        rough: f64 = 0.2, "local spacings";
        /// A patch is rough if more than one in so many of the points looked at is.
        patch: usize = 16, "one in";
        /// So many rough points of a patch tell whether it is curved or noisy.
        telling: usize = 3, "points";
        /// A point is curved if a curved surface leaves less of the square heights over the plane: edges leave
        /// a quarter to half, noise nearly all.
        curved: f64 = 0.5, "share", [0.4, 0.65];
        /// A patch is noisy if fewer than one in so many of the points that tell are curved.
        noisy: usize = 2, "one in";
        /// Nothing moves in a region of which fewer than one patch in so many is noisy.
        region: usize = 8, "one in";
        /// Nothing moves where fewer of the rough patches are noisy: what is rough are edges. A machine part has
        /// 27 % at most, a carved lion 35 % at least.
        edges: usize = 30, "% of the rough patches";
        /// Nothing moves where so many of the fine points are clean: details too fine for the points. Clean
        /// parts have 16 % and more, real scans 4 % at most.
        clean: usize = 10, "% of the fine points";
        /// But where more are clean, they lie in clean layers, of which relaxing makes one surface.
        layers: usize = 70, "% of the fine points", [50, 90];
        /// Fewer fine points than one in so many say nothing.
        fine: usize = 4, "one in";
        /// Nearest neighbours that show what noise there is, whatever the surface.
        nearest: usize = 12, "points", [9, 18];
        /// A point is fine if so many of the coordinates of it and these differ on each axis. What is rounded
        /// coarsely lies in layers, which are smooth, and does not tell.
        different: usize = 9, "values", [5, 12];
        /// A fine point is clean if the root of the mean square height of the nearest over a curved surface, for
        /// each degree of freedom, is less.
        height: f64 = 0.03, "local spacings";
    }
    /// Which way the surface faces, and where it is cut if it is one-sided.
    orientation: Orientation {
        /// Weight of the flattest connection; of a fold it is 1.
        flattest: i64 = 16, "weight";
        /// Where the cosine between triangles is more, the connection is no place to cut.
        flat: f64 = 0.9, "cosine", [0.8, 0.95];
        /// An edge between two triangles counts for so many candidates.
        edge: i64 = 8, "candidates";
        /// Most triangles that are joined in a block where the rest of the cloud could still gain by turning
        /// them. Up to 4096 open ground is cut nowhere, with 16 384 it is; less needs more memory.
        cluster: u64 = 1024, "triangles";
        /// Points for each column of space, of which the highest point faces up.
        column: u64 = 64, "points";
        /// Weight of the square root of the evidence that a part faces up. With 48 an aerial scan has 6 % more
        /// boundary, with 0 three quarters more of its area is seen from behind.
        upward: i64 = 16, "weight";
        /// Least evidence that holds a piece which nothing connects. With 0 an aerial scan loses 0.1 % of its
        /// points, and 5 % more triangles are cut.
        held: i64 = 1024, "evidence";
    }
    /// Which triangles may be a part of the surface.
    admissibility: Admissibility {
        /// Longest side, unless another one is asked for (robust).
        edge: f64 = 8.0, "local spacings";
        /// Largest angle between the normals of a T12 triangle and those beside it, unless another one is asked
        /// for (paper: 60).
        angle: f64 = 143.0, "degrees", [100.0, 180.0];
    }
    /// Flips of edges where points were moved.
    flips: Flips {
        /// Least sum of bends, the distances of unit normals, at the five edges of a quadrilateral for which
        /// a flip is looked at.
        bent: f32 = 1.2, "sum of bends";
        /// What a flip must save of this sum.
        gain: f32 = 0.1, "sum of bends";
        /// Least sine, about, of the smallest angle of new triangles, unless those before were more slender.
        slender: f64 = 0.2, "sine";
        /// Most sweeps over a block.
        sweeps: usize = 3, "sweeps";
    }
    /// Holes that are filled.
    filling: Filling {
        /// Longest loop, unless another one is asked for (paper: 500).
        longest: usize = 500, "edges";
        /// Sides of the equilateral triangle that no filling triangle is larger than, unless others are asked
        /// for (robust).
        width: f64 = 8.0, "local spacings";
        /// Longest side of a filling triangle, which may be slender. With 2 an aerial scan has a twelfth more
        /// boundary, without it one in 1000 points of the mesh is half as far again from the scan.
        slender: f64 = 2.5, "widths";
        /// A loop is an opening if its area, or that of its filling, is larger for each edge: a round hole of
        /// some 55 edges.
        opening: f64 = 4.5, "mean squares of its edges";
        /// A loop of so few edges is a hole and no outline: pieces with so short an outline were removed.
        sure: usize = 6, "edges";
        /// A loop is an outline if its vector area looks away from the triangles along it by more.
        outline: f64 = 0.5, "cosine", [0.25, 0.75];
    }
    /// Ears that are closed along a torn boundary.
    ear_clipping: EarClipping {
        /// Longest loop, so that memory does not follow the boundary.
        longest: usize = 100_000, "edges";
        /// Longest third side of an ear.
        reach: f64 = 6.0, "widths of the triangles around";
        /// Cosine of the largest angle between an ear and its neighbours: 100 degrees.
        fold: f64 = -0.173_648_177_666_930_36, "cosine", [-0.642_787_609_686_539_3, 0.342_020_143_325_668_8];
        /// Corners along the loop, either way, that must not lie under an ear.
        look: usize = 6, "corners";
    }
    /// Components: which stay, and which way they face.
    components: Components {
        /// Least triangles (paper: 10).
        least: u64 = 10, "triangles";
        /// A cloud is noisy if points moved once for so many points.
        noisy: u64 = 2, "one in";
        /// In a noisy cloud a component needs a triangle for each so many points of the cloud.
        each_if_noisy: u64 = 5000, "points";
        /// More triangles than this are not asked of it in a noisy cloud.
        most_if_noisy: u64 = 150, "triangles";
        /// Where points are smoothed a component needs a triangle for each so many points of the cloud.
        each_if_smoothed: u64 = 2500, "points";
        /// More triangles than this are not asked of it where points are smoothed.
        most_if_smoothed: u64 = 1000, "triangles";
        /// An open component faces along its vector area if this is at least one part in so many of its area;
        /// else it faces outwards.
        open: f64 = 4.0, "one part in";
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_document_has_all_as_they_are() {
        let document = include_str!("../docs/ablation.md");
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
