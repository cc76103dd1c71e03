use super::*;
use crate::order::{Rewriter, order};
use outcrop_formats::ingest_selected;
use outcrop_geom::Point;
use outcrop_points::Selection;
use std::collections::BTreeMap;
use std::fmt::Write;

/// A cloud in text with three columns; many points share a position.
fn cloud(points: u32, side: u32, seed: u64) -> (String, BTreeMap<[u32; 3], [i32; 3]>) {
    let mut random = oorandom::Rand32::new(seed);
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {points}\nproperty int x\nproperty int y\nproperty int z\n\
         property uchar intensity\nproperty short depth\nproperty int serial\nend_header\n"
    );
    let mut least: BTreeMap<[u32; 3], [i32; 3]> = BTreeMap::new();
    for _ in 0..points {
        let place = [0, 1, 2].map(|_| random.rand_range(0..side));
        let values = [
            random.rand_range(0..3) as i32,
            random.rand_range(0..5) as i32 - 2,
            random.rand_range(0..100_000) as i32 - 50_000,
        ];
        let ([x, y, z], [a, b, c]) = (place, values);
        writeln!(text, "{x} {y} {z} {a} {b} {c}").unwrap();
        let least = least.entry(place).or_insert(values);
        *least = values.min(*least);
    }
    (text, least)
}

/// The columns of a cloud of which only positions with an even sum are in the store.
fn check<R: Row>(points: u32, side: u32, block: u32, page: usize, keep_all: bool) {
    let folder = tempfile::tempdir().unwrap();
    let (text, least) = cloud(points, side, u64::from(points));
    let path = folder.path().join("cloud.ply");
    std::fs::write(&path, text).unwrap();
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let selection = Selection {
        attributes: "intensity,depth,serial".parse().unwrap(),
        ..Selection::default()
    };
    let spool = ingest_selected(&[path], &selection, &workspace).unwrap();
    let lattice = spool.choose_lattice(0).unwrap();
    let carried = spool.carried(&selection.attributes, false);
    assert_eq!(carried.bytes(), 7);
    let (all, _, spool) = order(spool, &lattice, page, &workspace).unwrap();
    let all = all.open(&workspace).unwrap();
    let kept = |p: &Point| keep_all || p.iter().sum::<i32>() % 2 == 0;
    let ids = all.slice(0..all.len()).unwrap();
    let some: Vec<Point> = ids.into_iter().filter(kept).collect();
    let writer = Rewriter::new("kept", some.len(), page, &workspace).unwrap();
    writer.put(&workspace.unit(), 0, &some).unwrap();
    let store = writer.finish(&workspace).unwrap();
    let blocks = Blocks::new(store.len(), block);
    let job = Job {
        spool: spool.expect("its values are still to be read"),
        lattice: &lattice,
        carried: &carried,
        // A frame is a unit.
        rows: 1,
        workspace: &workspace,
    };
    let columns = job.run::<R>(&store, blocks).unwrap().columns.unwrap();
    let opened = store.open(&workspace).unwrap();
    let base = least.keys().fold([u32::MAX; 3], |low, p| {
        std::array::from_fn(|a| low[a].min(p[a]))
    });
    let mut seen = 0;
    // All ids of a block, and some of them that do not begin with a section.
    for (block, few) in (0..blocks.count()).flat_map(|block| [(block, 0), (block, 1), (block, 2)]) {
        let ids = blocks.ids(block);
        let ids: Vec<_> = ids.iter().skip(few).step_by(1 + few).collect();
        let values = columns.open(&workspace.unit(), &ids).unwrap();
        let mut places = Vec::new();
        opened.fetch(&ids, &mut places).unwrap();
        for (number, place) in places.into_iter().enumerate() {
            let mut bytes = Vec::new();
            values.put(number, &[true; 3], &mut bytes);
            let place: [u32; 3] = std::array::from_fn(|a| place[a] as u32 + base[a]);
            let [a, b, c] = least[&place];
            let want = [&[a as u8][..], &(b as i16).to_le_bytes(), &c.to_le_bytes()].concat();
            assert_eq!(bytes, want, "{place:?}");
            seen += usize::from(few == 0);
        }
    }
    assert_eq!(seen, some.len());
    assert!(keep_all || seen < least.len());
}

#[test]
fn of_points_at_one_position_the_smallest_values_count() {
    for keep_all in [true, false] {
        check::<Row2>(30_000, 40, 1000, 16, keep_all);
        check::<Row6>(3_000, 9, 1 << 16, 256, keep_all);
        check::<Row12>(50_000, 1000, 333, 7, keep_all);
    }
    check::<Row2>(1, 1, 10, 4, true);
}
