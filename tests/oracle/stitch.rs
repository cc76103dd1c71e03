//! Stitching, repair and export of arbitrary triples equal the reference: triples that cells never have reach
//! the code for edges with many triangles and for vertices by excess.

mod triples;

use crate::reference::clouds::Random;
use crate::reference::outside::{Facing, Known};
use crate::reference::{Counts, Settings, cells, connect};
use outcrop::{Division, Error};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_mesh::repair::{RepairOptions, repair};
use outcrop_mesh::stitch::{StitchOptions, stitch};
use outcrop_mesh::triples::{Triples, VisitingTriple};
use outcrop_mesh_files::export::{CoordinateType, ExportOptions, export};
use outcrop_ply::Mesh;
use outcrop_stages::attributes::StoredScanners;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::CountedTriple;
use outcrop_stages::ids::{Block, triangle};
use outcrop_stages::located::Places;
use outcrop_stages::order::{Orderer, PointStore, StoreWriter};
use outcrop_stages::outside::{Outside, StoredExtremes, Told};
use outcrop_stages::scanners::Scanners;
use std::collections::BTreeMap;
use std::sync::Arc;
use triples::{random_triples, some_scanners, twisted_triples, walled_triples};

type Point = [i32; 3];

/// One sheet in this number is large.
const LARGE: u64 = 40;

fn workspace() -> Workspace {
    let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    Workspace::new(
        &std::env::temp_dir(),
        memory,
        2,
        Arc::new(Silent),
        Cancel::new(),
    )
    .unwrap()
}

fn store_of(points: &[Point], workspace: &Workspace) -> PointStore {
    let orderer = Orderer::new(workspace).unwrap();
    orderer.push(workspace, points).unwrap();
    let (stored, _) = orderer.finish(workspace, 16).unwrap();
    stored.open(workspace).unwrap()
}

fn tables(all: &BTreeMap<[u32; 3], u32>, blocks: Blocks, workspace: &Workspace) -> Triples {
    let own = outcrop_disk::spill::Table::new("own", blocks.count());
    let visiting = outcrop_disk::spill::Shuffle::new("visiting");
    let unit = workspace.unit();
    let all = || all.iter().map(|(t, &count)| (triangle(*t), count));
    for block in 0..blocks.count() {
        let to = Block::at(block);
        let first = all().filter(|(t, _)| blocks.of(t[0]) == to);
        let first = first.map(|(triple, count)| CountedTriple { triple, count });
        own.put(&unit, block, &first.collect::<Vec<_>>()).unwrap();
        let visits = all().filter(|(t, _)| blocks.visited(*t).any(|b| b == to));
        let visits = visits.map(|(triple, count)| VisitingTriple { to, triple, count });
        visiting.send(&unit, block, visits.collect()).unwrap();
    }
    Triples { own, visiting }
}

/// The shape as a store beside that of the file positions.
fn shape_of(shape: &[Point], workspace: &Workspace) -> PointStore {
    let mut writer = StoreWriter::create(workspace, "shape", 16).unwrap();
    writer.push(shape).unwrap();
    writer.finish().unwrap().open(workspace).unwrap()
}

/// The number of the scanner of each point, and the places of the scanners.
type Seen<'a> = (&'a [u32], &'a [Option<[i64; 3]>]);

/// The triangles, and the counts of [`counted`].
fn pipeline(
    shape: &[Point],
    points: &[Point],
    all: &BTreeMap<[u32; 3], u32>,
    scanners: Option<Seen<'_>>,
    settings: &Settings,
) -> outcrop::Result<(Vec<[u32; 3]>, [u64; 7])> {
    let workspace = &workspace();
    let store = store_of(points, workspace);
    let moved = (shape != points).then(|| shape_of(shape, workspace));
    let blocks = Blocks::new(store.len(), settings.block);
    let triples = tables(all, blocks, workspace);
    let store_scanners = |(numbers, places)| {
        let stored = StoredScanners::new(numbers, blocks, &workspace.unit()).unwrap();
        (stored, places)
    };
    let stored = scanners.map(store_scanners);
    let lie = moved.as_ref().unwrap_or(&store);
    let extremes = |inward| StoredExtremes::of(lie, inward, blocks, workspace).unwrap();
    let extremes = match settings.facing {
        Facing::In => Some(extremes(true)),
        Facing::Out => Some(extremes(false)),
        _ => None,
    };
    let seen = |(stored, places)| {
        Outside::told(Told {
            scanners: Some(Scanners::new(stored, places)),
            normals: None,
        })
    };
    let outside = match (settings.facing, &extremes) {
        (_, Some(extremes)) => Some(Outside::Extremes(extremes)),
        (Facing::At(place), _) => Some(Outside::Position(place)),
        _ => stored
            .as_ref()
            .and_then(|(stored, places)| seen((stored, *places))),
    };
    let places = Places::new(&store, moved.as_ref(), None, outside);
    let division = Division {
        patch: settings.patch,
        cluster: settings.cluster as u64,
        gain: settings.gain,
    };
    let extraction = StitchOptions {
        cos_max_angle: settings.cos_max_angle,
        weigh: settings.robust.then_some(division),
        keep_triples: false,
    };
    let (stitched, base, inserted) = stitch(places, triples, blocks, extraction, workspace)?;
    let options = RepairOptions {
        repair: settings.repair,
        min_component: settings.min_component as u64,
        min_noisy_component: settings.min_component as u64,
        max_hole_edges: settings.max_hole_edges,
        clip_ears: settings.robust,
    };
    let (repaired, mended) = repair(places, stitched, blocks, options, workspace)?;
    let lattice = outcrop_geom::lattice::Lattice {
        step: 1.0,
        offset: [0.0; 3],
        base: [0; 3],
        exact: true,
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let to = ExportOptions::new(&path, CoordinateType::Double);
    export(&store, &repaired, blocks, &lattice, to, workspace)?;
    let file = std::fs::read(&path).unwrap();
    let mesh = Mesh::read(&file[..], file.len() as u64).unwrap();
    let counts = [
        base.flagged,
        base.unfit,
        base.mobius,
        inserted.unfit,
        inserted.merges_reverted,
        mended.holes_filled,
        mended.hole_triangles,
    ];
    Ok((mesh.triangles, counts))
}

fn counted(c: &Counts) -> [u64; 7] {
    let counts = [
        c.flagged,
        c.flat,
        c.one_sided,
        c.flat_candidates,
        c.merges_reverted,
        c.holes.filled,
        c.holes.triangles,
    ];
    counts.map(|x| x as u64)
}

/// Compares for many seeds; `shape` moves a point. Returns sums of the counts that must not stay 0.
fn compare(
    seeds: std::ops::Range<u64>,
    sheets: bool,
    settings: impl Fn(u64) -> Settings,
    side: impl Fn(u64) -> i64,
    shape: impl Fn(Point, &mut Random) -> Point,
) -> Counts {
    let mut reached = Counts::default();
    for seed in seeds {
        let mut random = Random::new(seed);
        // With walls; only sheets of this size have enough evidence of their own for facing up.
        let (least, most) = match seed {
            _ if sheets && seed % LARGE == 2 => (2800, 3500),
            _ if sheets && (seed % 7 == 3 || seed % 16 == 0) => (5, 300),
            _ => (5, 60),
        };
        let count = random.integer(least, most) as usize;
        let cloud: Vec<Point> = (0..count)
            .map(|_| [0; 3].map(|_: i32| random.integer(0, side(seed)) as i32))
            .collect();
        let points = cells::in_id_order(&cloud);
        let share = random.integer(2, 9);
        let mut lie: Vec<Point> = points.iter().map(|p| shape(*p, &mut random)).collect();
        let mut all = match seed % 4 {
            0 if sheets => twisted_triples(&mut random, points.len(), &mut lie),
            1 | 2 if sheets && points.len() > 11 => {
                let (all, places) = walled_triples(&mut random, points.len());
                lie = places;
                all
            }
            _ => random_triples(&mut random, points.len(), share),
        };
        let shape = lie;
        // Cells never have three points on a line.
        all.retain(|t, _| {
            let [a, b, c] = t.map(|v| shape[v as usize]);
            outcrop_geom::triangle::normal(a, b, c) != [0; 3]
        });
        let settings = settings(seed);
        // Of every other cloud some or all points were seen by scanners.
        let (numbers, places) = some_scanners(&mut random, points.len());
        let auto = settings.facing == Facing::Auto;
        let seen = auto && settings.robust && seed % 2 == 0;
        let of = |number: &u32| {
            let place = places.get(number.checked_sub(1)? as usize).copied()?;
            place.map(Known::Place)
        };
        let scanners: Vec<_> = numbers.iter().map(of).collect();
        let scanners = if seen { &scanners[..] } else { &[] };
        let expected = connect(&shape, points.clone(), &all, None, scanners, &settings);
        let seen = seen.then_some((&numbers[..], &places[..]));
        let what = format!("seed {seed}, {} points, {settings:?}", points.len());
        match pipeline(&shape, &points, &all, seen, &settings) {
            Ok((triangles, counts)) => {
                assert_eq!(counts, counted(&expected.counts), "{what}");
                assert_eq!(triangles, expected.triangles, "{what}");
            }
            Err(Error::NoTriangles { .. }) => assert!(expected.triangles.is_empty(), "{what}"),
            Err(error) => panic!("{what}: {error}"),
        }
        let c = expected.counts;
        reached.flagged += c.flagged;
        reached.one_sided += c.one_sided;
        reached.merges_reverted += c.merges_reverted;
        reached.flat += c.flat;
        reached.flat_candidates += c.flat_candidates;
        reached.met.add(&c.met);
        reached.holes.filled += c.holes.filled;
        reached.holes.partly += c.holes.partly;
        reached.holes.clipped_whole += c.holes.clipped_whole;
    }
    reached
}

fn varied(seed: u64) -> Settings {
    Settings {
        block: [4, 9, 25, 1000][seed as usize % 4],
        min_component: [1, 3, 10][seed as usize % 3],
        cos_max_angle: [-1.0, -0.5, 0.5][seed as usize % 3],
        repair: !seed.is_multiple_of(5),
        ..Settings::default()
    }
}

/// As [`varied`], with small blocks, patches and clusters, too.
fn divided(seed: u64) -> Settings {
    Settings {
        block: [4, 9, 25, 1000, 60][seed as usize / 4 % 5],
        patch: [4, 9, 16, 256][seed as usize / 8 % 4],
        cluster: [2, 7, 40, 1024, 15][seed as usize / 3 % 5],
        gain: [0, 512, 30][seed as usize / 5 % 3],
        ..varied(seed)
    }
}

#[test]
fn arbitrary_triples() {
    let reached = compare(0..400, false, varied, |_| 200, |p, _| p);
    let parts = [reached.flagged, reached.one_sided, reached.merges_reverted];
    assert!(parts.iter().all(|n| *n > 0), "parts not reached: {parts:?}");
}

/// As in the two tests around this one, with a side that is out.
#[test]
fn arbitrary_triples_that_face_a_side() {
    let settings = |seed: u64| Settings {
        robust: !seed.is_multiple_of(9),
        facing: [
            Facing::In,
            Facing::Out,
            Facing::At([0, 1000, 300]),
            Facing::At([-1, 1 << 40, -90_000]),
        ][seed as usize / 2 % 4],
        ..divided(seed)
    };
    let side = |seed: u64| [200, 40][seed as usize % 2];
    let reached = compare(1000..1300, true, settings, side, |p, _| p);
    assert!(reached.met.faced > 500, "{reached:?}");
}

#[test]
fn arbitrary_triples_the_robust_way() {
    let settings = |seed: u64| Settings {
        robust: true,
        ..divided(seed)
    };
    // Some long bands are one patch, and the largest sheets consist of large patches.
    let settings = |seed: u64| match (seed % 16, seed % LARGE) {
        (0, _) => Settings {
            block: 1000,
            patch: 256,
            ..settings(seed)
        },
        (_, 2) => Settings {
            block: [1000, 100, 65_536, 300][(seed / LARGE) as usize % 4],
            patch: [256, 16][(seed / LARGE) as usize % 2],
            ..settings(seed)
        },
        _ => settings(seed),
    };
    // Few positions, so that many triples are on a line in the file and not in the shape.
    let side = |seed: u64| [200, 20, 6][seed as usize % 3];
    let shape = |p: Point, random: &mut Random| p.map(|x| 8 * x + random.integer(0, 8) as i32);
    let reached = compare(1000..1800, true, settings, side, shape);
    let holes = &reached.holes;
    let parts = [
        reached.flagged,
        reached.one_sided,
        reached.flat,
        reached.flat_candidates,
        holes.filled,
        holes.partly,
        holes.clipped_whole,
    ];
    assert!(parts.iter().all(|n| *n > 0), "parts not reached: {parts:?}");
    let met = &reached.met;
    assert_eq!(met.missing(&[]), [""; 0], "parts not reached: {met:?}");
}
