//! A slow implementation of `docs/method.md`, in memory and by brute force. Section numbers are those of that
//! document.
//!
//! It is compared with the program, and shares with it only what the method leaves to floating point: planes
//! and cells (`outcrop_geom`). Everything else is written as plainly as possible. Nothing is optimised; a
//! few hundred points are a large cloud.

pub mod base;
pub mod big;
pub mod cells;
pub mod check;
pub mod clouds;
pub mod contract;
pub mod edges;
pub mod evidence;
pub mod holes;
pub mod homes;
pub mod insert;
pub mod mend;
pub mod narrow;
pub mod normals;
pub mod output;
pub mod outside;
pub mod patches;
pub mod relax;
pub mod repair;
pub mod spacing;
pub mod surface;
pub mod weighing;

use holes::Filling;
use outcrop_geom::Point;
use outside::{Facing, Known, Scanner};
use spacing::Density;
use std::collections::{BTreeMap, BTreeSet};
use surface::{Component, Surface, Triangle};
use weighing::Weighing;

/// The radius of the disks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Radius {
    /// Twice the distance of the last neighbour used for the plane.
    Auto,
    /// Percent of the diagonal of the box around the input points (before smoothing).
    Percent(f64),
    /// In lattice steps.
    Length(f64),
}

/// What is done with the normals that points bring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Given {
    Auto,
    Use,
    Ignore,
}

/// The parameters of the method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// `k`.
    pub neighbors: usize,
    /// Rounds of smoothing; the lattice is not refined.
    pub smooth: u32,
    /// Smoothing preserves edges.
    pub edges: bool,
    pub radius: Radius,
    /// Cosine of the largest angle between normals (test G).
    pub cos_max_angle: f64,
    /// Holes with more edges stay open.
    pub max_hole_edges: usize,
    /// Components with fewer triangles are removed.
    pub min_component: usize,
    /// If false, of section 8 only orientation and the splitting of vertices are done.
    pub repair: bool,
    /// `B`.
    pub block: u32,
    /// `P`.
    pub patch: u32,
    /// `C`.
    pub cluster: usize,
    /// `G`.
    pub gain: i64,
    /// Largest number of rounds in which noisy points move.
    pub relax: u32,
    /// They move in the mesh too.
    pub auto: bool,
    /// Orientation by evidence, and ear clipping.
    pub robust: bool,
    pub facing: Facing,
    /// Points off the surface are kept.
    pub keep_all: bool,
    /// Longest side of a triangle, and largest triangle of a filling, in local spacings.
    pub max_edge: f64,
    pub max_fill: f64,
    /// `--input-normals`
    pub given: Given,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            neighbors: 30,
            smooth: 0,
            edges: false,
            radius: Radius::Auto,
            cos_max_angle: 0.5,
            max_hole_edges: 500,
            min_component: 10,
            repair: true,
            block: 65_536,
            patch: 256,
            cluster: 1024,
            gain: 512,
            relax: 0,
            auto: false,
            robust: false,
            facing: Facing::Auto,
            keep_all: true,
            max_edge: f64::INFINITY,
            max_fill: f64::INFINITY,
            given: Given::Use,
        }
    }
}

impl Settings {
    /// The robust method with its defaults.
    pub fn robust() -> Self {
        Self {
            cos_max_angle: outcrop::Params::default().cos_max_angle(),
            relax: 3,
            auto: true,
            edges: true,
            robust: true,
            keep_all: false,
            max_edge: 8.0,
            max_fill: 8.0,
            given: Given::Auto,
            ..Self::default()
        }
    }
}

/// Candidates rejected for good, by test.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Rejected {
    /// I
    pub edges: usize,
    /// II
    pub full_edge: usize,
    /// III
    pub vertex: usize,
    /// G
    pub angle: usize,
    /// IV
    pub orientation: usize,
}

/// Counts of the steps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Distinct points.
    pub points: usize,
    /// Triples with count three, two and one.
    pub t3: usize,
    pub t2: usize,
    pub t1: usize,
    /// Rounds of relaxing, and the noisy points.
    pub rounds: u32,
    pub moved: usize,
    /// Points whose nearest neighbours show noise and which are kept in place by clean ones.
    pub kept: usize,
    /// Points off the surface.
    pub off_surface: usize,
    /// T3 and candidates on a line in the file, or too long.
    pub flat: usize,
    pub flat_candidates: usize,
    /// T3 flagged in section 6.1.
    pub flagged: usize,
    /// T3 removed because they would close a Möbius band.
    pub one_sided: usize,
    /// Robust: counts of the orientation.
    pub met: Weighing,
    /// T3 in the base.
    pub base: usize,
    pub candidates: usize,
    /// Inserted inside blocks; removed tentative merges are counted here.
    pub inserted_interior: usize,
    /// Inserted across blocks, with interior candidates tried again.
    pub inserted_crossing: usize,
    pub merges: usize,
    pub merges_reverted: usize,
    pub rejected: Rejected,
    pub bridges: usize,
    pub small_components: usize,
    /// Triangles of the small components.
    pub small_triangles: usize,
    pub holes: Filling,
    /// Vertices added for the fans of pinched vertices.
    pub copies: usize,
}

/// The mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mesh {
    /// Positions of all distinct points in the order of their ids, after smoothing.
    pub ids: Vec<Point>,
    /// The id of each output vertex, copies of pinched vertices last.
    pub vertices: Vec<u32>,
    /// Indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
    pub counts: Counts,
}

/// Reconstructs the surface of a cloud.
pub fn reconstruct(points: &[Point], settings: &Settings) -> Mesh {
    reconstruct_given(points, |_| None, |_| None, settings)
}

/// As [`reconstruct`], of points that scanners saw, and that have normals; `scanner` and `normal` have those of a
/// position.
pub fn reconstruct_given(
    points: &[Point],
    scanner: impl Fn(&Point) -> Option<Scanner>,
    normal: impl Fn(&Point) -> Option<normals::Short>,
    settings: &Settings,
) -> Mesh {
    let mut points = cells::in_id_order(points);
    let scanners: Vec<Option<Scanner>> = points.iter().map(scanner).collect();
    let wanted = settings.given != Given::Ignore;
    let given: Vec<Option<normals::Short>> = points
        .iter()
        .map(|p| normal(p).filter(|_| wanted))
        .collect();
    let oriented = normals::oriented(&points, &given, settings.block);
    let diagonal = cells::diagonal(&points);
    for _ in 0..settings.smooth {
        let smooth = match settings.edges {
            true => edges::smooth,
            false => cells::smooth,
        };
        points = smooth(&points, settings.neighbors);
    }
    let mut density = settings.robust.then(|| spacing::measure(&points, settings));
    let relaxed = relax::relax(&points, settings);
    if let Some(density) = &mut density {
        density.noise.clone_from(&relaxed.noise);
    }
    if settings.auto {
        points = relaxed.shape.clone();
    }
    let (triples, off_surface) =
        cells::triples_given(&relaxed.shape, &given, settings, diagonal, density.as_mut());
    let density = density.as_ref();
    let told = normals::told(&relaxed.shape, oriented, &scanners, &given, settings);
    let mut mesh = connect(&relaxed.shape, points, &triples, density, &told, settings);
    mesh.counts.off_surface = off_surface;
    (mesh.counts.rounds, mesh.counts.moved) = (relaxed.rounds, relaxed.moved);
    mesh.counts.kept = relaxed.kept;
    mesh
}

/// Sections 6 to 9, from points in the order of their ids and triples with their counts. Triples need not
/// come from cells: those of cells, for example, never have an edge with more than two T3, as each cell has
/// at most two corners on a bisector.
pub fn from_triples(
    points: Vec<Point>,
    triples: &BTreeMap<Triangle, u32>,
    settings: &Settings,
) -> Mesh {
    connect(&points.clone(), points, triples, None, &[], settings)
}

/// As [`from_triples`], with a shape and file positions, and what files tell of the points (robust).
pub fn connect(
    shape: &[Point],
    file: Vec<Point>,
    triples: &BTreeMap<Triangle, u32>,
    density: Option<&Density>,
    told: &[Option<Known>],
    settings: &Settings,
) -> Mesh {
    let known = outside::known(shape, told, settings.facing);
    let mut counts = Counts {
        points: file.len(),
        ..Counts::default()
    };
    let seen_by = |n: u32| triples.values().filter(|&&count| count == n).count();
    (counts.t3, counts.t2, counts.t1) = (seen_by(3), seen_by(2), seen_by(1));

    let on_a_line: BTreeSet<Triangle> = triples
        .keys()
        .copied()
        .filter(|&t| {
            insert::normal(&file, t) == [0; 3] || density.is_some_and(|d| d.is_long(t, &file))
        })
        .collect();
    let usable = triples.iter().filter(|(t, _)| !on_a_line.contains(*t));
    let (t3, open): (BTreeMap<_, _>, BTreeMap<_, _>) = usable.partition(|(_, count)| **count == 3);
    let t3: BTreeSet<Triangle> = t3.into_keys().copied().collect();
    counts.flat = counts.t3 - t3.len();
    counts.flat_candidates = on_a_line.len() - counts.flat;
    let base = if settings.robust {
        let open = open.into_keys().copied().collect();
        base::weighed(shape, &t3, &open, &known, settings)
    } else {
        base::base(&t3, settings.block)
    };
    counts.flagged = base.flagged.len();
    counts.one_sided = base.one_sided.len();
    counts.met = base.met;
    counts.base = base.surface.triangles().len();

    let inserted = insert::insert(shape, triples, &on_a_line, base, settings);
    counts.candidates = inserted.candidates;
    counts.inserted_interior = inserted.interior;
    counts.inserted_crossing = inserted.crossing;
    (counts.merges, counts.merges_reverted) = (inserted.merges, inserted.merges_reverted);
    counts.rejected = inserted.rejected;

    let mut surface = inserted.surface;
    let turned = repair_and_orient(
        shape,
        &file,
        density,
        &known,
        &mut surface,
        settings,
        &mut counts,
    );
    let (vertices, triangles) = output::in_file_order(&surface, &turned, true);
    counts.copies = vertices.len() - surface.vertices().len();
    Mesh {
        ids: file,
        vertices,
        triangles,
        counts,
    }
}

/// Section 8: bridges, small components, orientation of components, holes, in this order. Returns the
/// orientations of the triangles.
fn repair_and_orient(
    shape: &[Point],
    file: &[Point],
    density: Option<&Density>,
    known: &[Option<Known>],
    surface: &mut Surface,
    settings: &Settings,
    counts: &mut Counts,
) -> Component {
    if settings.repair {
        counts.bridges = repair::remove_bridges(surface);
        (counts.small_components, counts.small_triangles) =
            repair::remove_small_components(surface, settings.min_component);
    }
    let components = repair::oriented(shape, known, surface);
    let mut turned: Component = components
        .iter()
        .flatten()
        .map(|(&t, &turned)| (t, turned))
        .collect();
    if settings.repair {
        let (filled, filling) = holes::fill(shape, file, density, surface, &components, settings);
        counts.holes = filling;
        for corners in filled {
            let mut t = corners;
            t.sort_unstable();
            surface.insert(t);
            let first = corners.iter().position(|&v| v == t[0]).expect("sorted");
            turned.insert(t, corners[(first + 1) % 3] != t[1]);
        }
    }
    turned
}
