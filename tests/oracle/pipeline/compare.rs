//! A run of the pipeline, and its mesh beside that of the reference.

use super::seen::Seen;
use crate::reference::{self, Counts, Given, Mesh, Settings};
use outcrop::{
    Division, Error, Facing, InputNormals, MaxWidth, Method, Params, Radius, Reconstruction,
    Report, Smooth, Smoothing,
};
use outcrop_ply::Mesh as ReadBack;

type Point = [i32; 3];

/// The division of the work; it must not affect the mesh.
#[derive(Debug, Clone, Copy)]
pub struct Cut {
    tile: u32,
    page: usize,
    threads: usize,
}

/// The angle with this cosine, among those used here.
pub fn angle_of(cosine: f64) -> f64 {
    let has = |max_angle: &f64| {
        let params = Params {
            max_angle: *max_angle,
            ..Params::paper()
        };
        params.cos_max_angle() == cosine
    };
    [60.0, 120.0, 143.0]
        .into_iter()
        .find(has)
        .expect("a known angle")
}

/// A number of local spacings, or none.
pub fn width(spacings: f64) -> MaxWidth {
    if spacings.is_finite() {
        MaxWidth::Spacings(spacings)
    } else {
        MaxWidth::None
    }
}

pub fn pipeline(
    points: &[Point],
    seen: &Seen,
    settings: &Settings,
    cut: Cut,
) -> outcrop::Result<(ReadBack, Report)> {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("mesh.ply");
    let inputs = seen.write(points, folder.path());
    let params = Params {
        neighbors: settings.neighbors,
        smooth: match settings.auto {
            true => Smooth::Auto,
            false => Smooth::Rounds(settings.smooth),
        },
        radius: match settings.radius {
            reference::Radius::Auto => Radius::Auto,
            reference::Radius::Percent(x) => Radius::Percent(x),
            reference::Radius::Length(x) => Radius::Length(x),
        },
        smoothing: if settings.edges {
            Smoothing::Edges
        } else {
            Smoothing::Plain
        },
        max_angle: angle_of(settings.cos_max_angle),
        relax: settings.relax,
        method: if settings.robust {
            Method::Robust
        } else {
            Method::Paper
        },
        max_hole_edges: settings.max_hole_edges,
        min_component: Some(settings.min_component as u64),
        facing: match settings.facing {
            reference::outside::Facing::Auto => Facing::Auto,
            reference::outside::Facing::In => Facing::In,
            reference::outside::Facing::Out => Facing::Out,
            reference::outside::Facing::At(place) => Facing::At(place.map(|x| x as f64)),
        },
        keep_all: settings.keep_all,
        input_normals: match settings.given {
            Given::Auto => InputNormals::Auto,
            Given::Use => InputNormals::Use,
            Given::Ignore => InputNormals::Ignore,
        },
        max_edge: width(settings.max_edge),
        max_fill: width(settings.max_fill),
        repair: settings.repair,
        block: settings.block,
        division: Division {
            patch: settings.patch,
            cluster: settings.cluster as u64,
            gain: settings.gain,
        },
        ..Params::paper()
    };
    assert_eq!(params.cos_max_angle(), settings.cos_max_angle);
    let builder = inputs
        .iter()
        .fold(Reconstruction::builder(), |b, path| b.input(path));
    let report = builder
        .output(&output)
        .params(params)
        .memory(192 << 20)
        .threads(cut.threads)
        .tile_points(cut.tile)
        .page_points(cut.page)
        .build()?
        .run()?;
    let file = std::fs::read(&output).unwrap();
    let mesh = ReadBack::read(&file[..], file.len() as u64).unwrap();
    Ok((mesh, report))
}

/// The cloud moved to the origin of the lattice, as the pipeline does, without successive duplicates.
pub fn at_origin(points: &[Point]) -> Vec<Point> {
    let least: Point =
        std::array::from_fn(|axis| points.iter().map(|p| p[axis]).min().unwrap_or(0));
    points
        .iter()
        .map(|p| std::array::from_fn(|axis| p[axis] - least[axis]))
        .collect()
}

pub fn compare(name: &str, points: &[Point], settings: &Settings, cuts: &[Cut]) -> Counts {
    compare_seen(name, points, None, settings, cuts)
}

/// As [`compare`], of points that scanners saw, if there is a seed for these.
pub fn compare_seen(
    name: &str,
    points: &[Point],
    scanners: Option<u64>,
    settings: &Settings,
    cuts: &[Cut],
) -> Counts {
    let points = at_origin(points);
    let seen = scanners.map_or_else(Seen::default, |seed| Seen::some(&points, seed));
    compare_with(name, &points, &seen, settings, cuts)
}

/// As [`compare`], of points at the origin of the lattice with these scanners and normals.
pub fn compare_with(
    name: &str,
    points: &[Point],
    seen: &Seen,
    settings: &Settings,
    cuts: &[Cut],
) -> Counts {
    // Moved points lie on a lattice whose step was halved ten times.
    let scale = if settings.smooth + settings.relax > 0 {
        1024
    } else {
        1
    };
    let fine: Vec<Point> = points.iter().map(|p| p.map(|x| x * scale)).collect();
    let fine_settings = Settings {
        radius: match settings.radius {
            reference::Radius::Length(x) => reference::Radius::Length(x * f64::from(scale)),
            other => other,
        },
        facing: match settings.facing {
            reference::outside::Facing::At(place) => {
                reference::outside::Facing::At(place.map(|x| x * i64::from(scale)))
            }
            other => other,
        },
        ..*settings
    };
    let at = seen.at_positions(points);
    let scanner = |p: &Point| {
        let scanner = at.get(&p.map(|x| x / scale)).copied().flatten();
        scanner.map(|s| s.map(|x| i64::from(x) * i64::from(scale)))
    };
    let normals = seen.normals_at(points);
    let normal = |p: &Point| normals.get(&p.map(|x| x / scale)).copied();
    let expected = reference::reconstruct_given(&fine, scanner, normal, &fine_settings);
    for &cut in cuts {
        let what = format!("{name}, {} points, {settings:?}, {cut:?}", points.len());
        match pipeline(points, seen, settings, cut) {
            Ok((mesh, report)) => same(&what, &mesh, &report, &expected, f64::from(scale)),
            Err(Error::NoTriangles { .. } | Error::Degenerate { .. }) => {
                assert!(expected.triangles.is_empty(), "{what}: nothing was made");
            }
            Err(error) => panic!("{what}: {error}"),
        }
    }
    expected.counts
}

pub fn same(what: &str, mesh: &ReadBack, report: &Report, expected: &Mesh, scale: f64) {
    let counts = &expected.counts;
    let relax = report.relax.unwrap_or_default();
    assert_eq!(
        (relax.rounds, relax.moved as usize),
        (counts.rounds, counts.moved),
        "{what}: relaxing"
    );
    let t = &report.triples;
    assert_eq!(
        (t.t3 as usize, t.t2 as usize, t.t1 as usize),
        (counts.t3, counts.t2, counts.t1),
        "{what}: triples"
    );
    let b = &report.base;
    assert_eq!(
        [b.flagged, b.unfit, b.mobius, b.triangles].map(|x| x as usize),
        [counts.flagged, counts.flat, counts.one_sided, counts.base],
        "{what}: base"
    );
    let i = &report.insertion;
    assert_eq!(
        [i.unconnected, i.full_edge, i.excess, i.angle, i.orientation].map(|x| x as usize),
        {
            let r = &counts.rejected;
            [r.edges, r.full_edge, r.vertex, r.angle, r.orientation]
        },
        "{what}: rejected"
    );
    assert_eq!(
        [i.merges_reverted, i.unfit].map(|x| x as usize),
        [counts.merges_reverted, counts.flat_candidates],
        "{what}: joints removed, on a line"
    );
    assert_eq!(
        i.accepted as usize,
        counts.inserted_interior + counts.inserted_crossing,
        "{what}: accepted"
    );
    let r = &report.repair;
    assert_eq!(
        r.bridges_removed as usize, counts.bridges,
        "{what}: bridges"
    );
    assert_eq!(
        r.components_removed as usize, counts.small_components,
        "{what}: components"
    );
    assert_eq!(
        r.holes_filled as usize, counts.holes.filled,
        "{what}: holes filled"
    );
    assert_eq!(
        r.gaps_closed as usize, counts.holes.gaps,
        "{what}: gaps closed"
    );
    assert_eq!(
        r.holes_outline as usize, counts.holes.outlines,
        "{what}: outlines"
    );
    assert_eq!(
        (r.holes_clipped as usize, r.hole_triangles as usize),
        (counts.holes.clipped, counts.holes.triangles),
        "{what}: clipped"
    );
    let differ = mesh.triangles.iter().zip(&expected.triangles);
    let first = differ.into_iter().find(|(a, b)| a != b);
    assert_eq!(first, None, "{what}: the first triangles that differ");
    assert_eq!(mesh.triangles.len(), expected.triangles.len(), "{what}");
    let position = |id: &u32| {
        // Coordinates in the file are in single precision where that suffices for the input.
        expected.ids[*id as usize].map(|x| f64::from(x) / scale)
    };
    let close = |a: &[f64; 3], b: &[f64; 3]| (0..3).all(|k| (a[k] - b[k]).abs() <= 0.05);
    let expected: Vec<_> = expected.vertices.iter().map(position).collect();
    assert_eq!(mesh.vertices.len(), expected.len(), "{what}: vertices");
    for (a, b) in mesh.vertices.iter().zip(&expected) {
        assert!(close(a, b), "{what}: vertex at {a:?}, expected {b:?}");
    }
}

pub const CUTS: [Cut; 3] = [
    Cut {
        tile: u32::MAX,
        page: 256,
        threads: 2,
    },
    Cut {
        tile: 30,
        page: 16,
        threads: 1,
    },
    Cut {
        tile: 4,
        page: 3,
        threads: 2,
    },
];
