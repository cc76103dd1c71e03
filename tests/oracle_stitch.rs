//! Stitching, repair and export of arbitrary triples equal the reference: triples that no cells
//! would see reach the parts that clean up edges with many triangles and vertices by excess.

mod reference;

use outcrop::inspect::ply_mesh::{PlyMesh, Sink};
use outcrop::stages::blocks::Blocks;
use outcrop::stages::export::{CoordinateType, export};
use outcrop::stages::located::Places;
use outcrop::stages::order::{Orderer, PointStore};
use outcrop::stages::repair::{RepairOptions, repair};
use outcrop::stages::stitch::{StitchOptions, stitch};
use outcrop::stages::triples::Triples;
use outcrop::workspace::Workspace;
use outcrop::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop::workspace::progress::{Cancel, Silent};
use outcrop::{Error, spill};
use reference::clouds::Random;
use reference::{Mesh, Settings, cells, from_triples};
use std::collections::BTreeMap;
use std::sync::Arc;

type Point = [i32; 3];

#[derive(Default)]
struct Faces(Vec<[u32; 3]>);

impl Sink for Faces {
    fn vertices(&mut self, _: &[[f64; 3]]) -> outcrop::Result<()> {
        Ok(())
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> outcrop::Result<()> {
        self.0.extend_from_slice(triangles);
        Ok(())
    }

    fn non_triangles(&mut self, _: u64) -> outcrop::Result<()> {
        Ok(())
    }
}

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
    orderer.finish(workspace, 16).unwrap().0
}

fn sections(all: &BTreeMap<[u32; 3], u32>, blocks: Blocks, workspace: &Workspace) -> Triples {
    let own = spill::Sections::create(workspace, "own", blocks.count()).unwrap();
    let visiting = spill::Sections::create(workspace, "visiting", blocks.count()).unwrap();
    for block in 0..blocks.count() as u32 {
        let records = all.iter().filter(|(t, _)| blocks.of(t[0]) == block);
        let records: Vec<_> = records
            .map(|(t, count)| [t[0], t[1], t[2], *count])
            .collect();
        own.put(block as usize, &records).unwrap();
        let visits = all
            .iter()
            .filter(|(t, _)| blocks.visited(**t).any(|b| b == block));
        let visits: Vec<_> = visits
            .map(|(t, count)| [block, t[0], t[1], t[2], *count])
            .collect();
        visiting.put(block as usize, &visits).unwrap();
    }
    Triples { own, visiting }
}

fn pipeline(
    points: &[Point],
    all: &BTreeMap<[u32; 3], u32>,
    settings: &Settings,
) -> outcrop::Result<(Vec<[u32; 3]>, [u64; 3])> {
    let workspace = &workspace();
    let store = store_of(points, workspace);
    let blocks = Blocks::new(store.len(), settings.block);
    let triples = sections(all, blocks, workspace);
    let places = Places {
        shape: &store,
        file: &store,
    };
    let extraction = StitchOptions {
        cos_max_angle: settings.cos_max_angle,
        weigh: false,
    };
    let (stitched, base, inserted) = stitch(places, triples, blocks, extraction, workspace)?;
    let options = RepairOptions {
        repair: settings.repair,
        min_component: settings.min_component as u64,
        max_hole_edges: settings.max_hole_edges,
        zip: false,
    };
    let (repaired, _) = repair(places, stitched, blocks, options, workspace)?;
    let lattice = outcrop::geom::lattice::Lattice {
        step: 1.0,
        offset: [0.0; 3],
        base: [0; 3],
        exact: true,
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    export(
        &store,
        &repaired,
        blocks,
        &lattice,
        CoordinateType::Double,
        &path,
        workspace,
    )?;
    let mut faces = Faces::default();
    PlyMesh::open(&path)?.read(&mut faces)?;
    Ok((
        faces.0,
        [base.flagged, base.mobius, inserted.joints_removed],
    ))
}

/// Triples among points that are near in order, as often T3 as `share` says.
fn random_triples(random: &mut Random, count: usize, share: i64) -> BTreeMap<[u32; 3], u32> {
    let mut all = BTreeMap::new();
    for _ in 0..3 * count {
        let middle = random.integer(0, count as i64);
        let mut near = || (middle + random.integer(-4, 5)).clamp(0, count as i64 - 1) as u32;
        let mut t = [near(), near(), near()];
        t.sort_unstable();
        let seen = if random.integer(0, 10) < share {
            3
        } else {
            random.integer(1, 3) as u32
        };
        if t[0] < t[1] && t[1] < t[2] {
            all.insert(t, seen);
        }
    }
    if count > 5 && random.integer(0, 4) == 0 {
        // The smallest Möbius band, trusted as a whole.
        let first = random.integer(0, count as i64 - 5) as u32;
        for k in 0..5 {
            let mut t = [k, k + 1, k + 2].map(|v| first + v % 5);
            t.sort_unstable();
            all.insert(t, 3);
        }
    }
    all
}

#[test]
fn arbitrary_triples() {
    let mut reached = [0u64; 3];
    for seed in 0..400u64 {
        let mut random = Random::new(seed);
        let count = random.integer(5, 60) as usize;
        let cloud: Vec<Point> = (0..count)
            .map(|_| [0; 3].map(|_: i32| random.integer(0, 200) as i32))
            .collect();
        let points = cells::in_id_order(&cloud);
        let share = random.integer(2, 9);
        let mut all = random_triples(&mut random, points.len(), share);
        // Cells never see three points on a line.
        all.retain(|t, _| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            outcrop::stages::located::normal(a, b, c) != [0; 3]
        });
        let settings = Settings {
            block: [4, 9, 25, 1000][seed as usize % 4],
            min_component: [1, 3, 10][seed as usize % 3],
            cos_max_angle: [-1.0, -0.5, 0.5][seed as usize % 3],
            repair: seed % 5 != 0,
            ..Settings::default()
        };
        let expected: Mesh = from_triples(points.clone(), &all, &settings);
        let what = format!("seed {seed}, {} points, {settings:?}", points.len());
        match pipeline(&points, &all, &settings) {
            Ok((triangles, counts)) => {
                assert_eq!(triangles, expected.triangles, "{what}");
                let c = &expected.counts;
                assert_eq!(
                    counts.map(|x| x as usize),
                    [c.flagged, c.one_sided, c.joints_removed],
                    "{what}"
                );
                for (sum, count) in reached.iter_mut().zip(counts) {
                    *sum += count;
                }
            }
            Err(Error::NoTriangles { .. }) => assert!(expected.triangles.is_empty(), "{what}"),
            Err(error) => panic!("{what}: {error}"),
        }
    }
    assert!(
        reached.iter().all(|count| *count > 0),
        "parts not reached: {reached:?}"
    );
}
