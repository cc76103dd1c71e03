//! Tests of filling and ear clipping of single loops, on synthetic surfaces.

use super::boundary::LoopRules;
use super::ear_clipping::zip;
use super::fill::{Corner, Filling};
use outcrop_geom::{Point, distance2};
use outcrop_stages::ids::{Id, Triangle, triangle};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// A surface near a plane, with oriented triangles.
#[derive(Debug, Clone)]
struct Sheet {
    points: Vec<Point>,
    triangles: Vec<Triangle>,
}

type HalfEdges = BTreeMap<(Id, Id), Id>;

fn around([a, b, c]: Triangle) -> [(Id, Id, Id); 3] {
    [(a, b, c), (b, c, a), (c, a, b)]
}

fn sorted(mut t: Triangle) -> Triangle {
    t.sort_unstable();
    t
}

impl Sheet {
    /// A grid of `wide` by `high` points ten steps apart, displaced by `off`, without the squares in `gap`.
    fn grid(
        [wide, high]: [i32; 2],
        off: impl Fn(usize) -> Point,
        gap: impl Fn(i32, i32) -> bool,
    ) -> Self {
        let place = |n: i32| {
            let at = [n % wide * 10 + 50, n / wide * 10 + 50, 50];
            let off = off(n as usize);
            std::array::from_fn(|k| at[k] + off[k])
        };
        let squares = (0..high - 1).flat_map(|y| (0..wide - 1).map(move |x| (x, y)));
        let halves = |(x, y): (i32, i32)| {
            let a = (y * wide + x) as u32;
            let w = wide as u32;
            [[a, a + 1, a + w], [a + 1, a + w + 1, a + w]].map(triangle)
        };
        Self {
            points: (0..wide * high).map(place).collect(),
            triangles: squares
                .filter(|&(x, y)| !gap(x, y))
                .flat_map(halves)
                .collect(),
        }
    }

    fn half_edges(&self) -> HalfEdges {
        let all = self.triangles.iter().flat_map(|t| around(*t));
        all.map(|(a, b, c)| ((a, b), c)).collect()
    }

    /// Boundary loops that visit no vertex twice, in the orientation of the hole.
    fn loops(&self) -> Vec<Vec<Corner>> {
        let edges = self.half_edges();
        let open = edges
            .iter()
            .filter(|((a, b), _)| !edges.contains_key(&(*b, *a)));
        let mut next: BTreeMap<Id, Vec<(Id, Id)>> = BTreeMap::new();
        for (&(a, b), &apex) in open {
            next.entry(b).or_default().push((a, apex));
        }
        let pinched = |v: Id| next[&v].len() > 1;
        let mut seen = BTreeSet::new();
        let mut loops = Vec::new();
        for &first in next.keys() {
            let mut ring = Vec::new();
            let mut v = first;
            while seen.insert(v) && !pinched(v) {
                let (to, apex) = next[&v][0];
                ring.push(Corner {
                    id: to,
                    at: self.points[to.index()],
                    apex: self.points[apex.index()],
                    file: self.points[to.index()],
                    pinched: pinched(to),
                });
                v = to;
            }
            if v == first && ring.len() >= 3 {
                loops.push(ring);
            }
        }
        loops
    }

    fn has_edge(&self) -> impl Fn(Id, Id) -> bool + use<> {
        let edges = self.half_edges();
        move |a, b| edges.contains_key(&(a, b)) || edges.contains_key(&(b, a))
    }

    fn area(&self, t: Triangle) -> f64 {
        let [a, b, c] = t.map(|v| self.points[v.index()]);
        outcrop_geom::triangle::area([a, b, c])
    }

    /// Mends the loop for which `which` is largest.
    fn close(&self, which: impl Fn(&Vec<Corner>) -> usize) -> (Filling, usize) {
        let ring = self.loops().into_iter().max_by_key(which).unwrap();
        let edges = ring.len();
        (MENDING.close(ring, self.has_edge()), edges)
    }
}

const MENDING: LoopRules<'static> = LoopRules {
    density: None,
    longest: 500,
    clip_ears: true,
};

/// Sheets with random gaps, with points on or near the plane.
fn torn() -> impl Strategy<Value = Sheet> {
    let side = 12;
    let off = prop::collection::vec(prop::array::uniform3(-3..=3), (side * side) as usize);
    let gaps = prop::collection::vec((1..side - 2, 1..side - 2), 1..50);
    (off, gaps, 0..8).prop_map(move |(off, gaps, rough)| {
        let off = |n: usize| [off[n][0], off[n][1], off[n][2] * rough];
        Sheet::grid([side, side], off, |x, y| gaps.contains(&(x, y)))
    })
}

/// Adds `sign` for each edge of a closed path.
fn count(edges: &mut BTreeMap<(Id, Id), i32>, way: &[Id], sign: i32) {
    for (k, &a) in way.iter().enumerate() {
        let b = way[(k + 1) % way.len()];
        *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { sign } else { -sign };
    }
}

proptest! {
    #[test]
    fn clipping_closes_a_part_of_the_loop_and_leaves_the_rest(sheet in torn()) {
        for ring in sheet.loops() {
            let ids: Vec<Id> = ring.iter().map(|c| c.id).collect();
            let clipped = zip(ring, sheet.has_edge());
            let left: Vec<Id> = clipped.left.iter().map(|c| c.id).collect();

            let mut chain = BTreeMap::new();
            count(&mut chain, &ids, 1);
            count(&mut chain, &left, -1);
            clipped.triangles.iter().for_each(|t| count(&mut chain, t, -1));
            prop_assert!(chain.values().all(|n| *n == 0), "{chain:?}");

            let mut edges = sheet.half_edges();
            for (a, b, c) in clipped.triangles.iter().flat_map(|t| around(*t)) {
                prop_assert!(edges.insert((a, b), c).is_none(), "two triangles run from {a:?} to {b:?}");
            }
            let all = sheet.triangles.iter().chain(&clipped.triangles);
            let mut different = BTreeSet::new();
            prop_assert!(all.map(|t| sorted(*t)).all(|t| different.insert(t)));
        }
    }

    #[test]
    fn a_loop_is_mended_alike_wherever_it_begins(sheet in torn(), turn in 0usize..100, rough in any::<bool>()) {
        let rules = LoopRules { longest: if rough { 3 } else { 500 }, ..MENDING };
        for mut ring in sheet.loops() {
            let first = rules.close(ring.clone(), sheet.has_edge());
            let turn = turn % ring.len();
            ring.rotate_left(turn);
            prop_assert_eq!(rules.close(ring, sheet.has_edge()), first);
        }
    }
}

/// With all points exactly on a grid, many ears are equally sharp.
#[test]
fn a_loop_on_a_grid_is_mended_alike_wherever_it_begins() {
    let gap = |x, y| (4..7).contains(&x) && (3..9).contains(&y);
    let sheet = Sheet::grid([12, 12], |_| [0; 3], gap);
    let clipping = LoopRules {
        longest: 3,
        ..MENDING
    };
    for ring in sheet.loops() {
        let first = clipping.close(ring.clone(), sheet.has_edge());
        for turn in 1..ring.len() {
            let mut ring = ring.clone();
            ring.rotate_left(turn);
            assert_eq!(clipping.close(ring, sheet.has_edge()), first);
        }
    }
}

/// A sheet rolled to a tube with a slit: its only boundary loop goes around both ends in opposite directions.
#[test]
fn the_ends_of_a_slit_tube_stay_open() {
    let (long, high) = (80, 8);
    let roll = |n: usize| {
        let (x, y) = (n as i32 % long, n as i32 / long);
        let (sine, cosine) = (f64::from(x) * std::f64::consts::TAU / 80.0).sin_cos();
        let [a, b] = [cosine, sine].map(|c| (127.0 * c).round() as i32 + 200);
        [a - 10 * x, b - 10 * y, 10 * y]
    };
    let tube = Sheet::grid([long, high], roll, |_, _| false);
    let ring = tube.loops().remove(0);
    assert_eq!(ring.len() as i32, 2 * (long - 1) + 2 * (high - 1));
    let longest = |filling: Filling| {
        let (Filling::Filled(new) | Filling::Clipped(new, _)) = filling else {
            return 0.0;
        };
        let edges = new.iter().flat_map(|t| around(*t));
        let length = |(a, b, _): (Id, Id, Id)| {
            let [a, b] = [a, b].map(|v| tube.points[v.index()]);
            (distance2(a, b) as f64).sqrt()
        };
        edges.map(length).fold(0.0, f64::max)
    };
    let plain = LoopRules {
        clip_ears: false,
        ..MENDING
    };
    assert!(longest(plain.close(ring.clone(), tube.has_edge())) > 200.0);
    assert!(longest(MENDING.close(ring, tube.has_edge())) < 80.0);
}

#[test]
fn the_outline_of_a_disk_stays_open() {
    for count in 7..60 {
        let turn = |k: i32| f64::from(k) * std::f64::consts::TAU / f64::from(count);
        let at = |k: i32| {
            let (sine, cosine) = turn(k).sin_cos();
            [cosine, sine, 1.0].map(|x| (1000.0 * x) as i32 + 1000)
        };
        let middle = count as u32;
        let sheet = Sheet {
            points: (0..count).map(at).chain([[1000, 1000, 2000]]).collect(),
            triangles: (0..middle)
                .map(|k| triangle([middle, k, (k + 1) % middle]))
                .collect(),
        };
        let (mended, edges) = sheet.close(Vec::len);
        assert_eq!(mended, Filling::Clipped(Vec::new(), edges));
    }
}

#[test]
fn the_outline_of_a_lone_triangle_stays_open() {
    let sheet = Sheet {
        points: vec![[0, 0, 0], [9, 0, 0], [0, 9, 1]],
        triangles: vec![triangle([0, 1, 2])],
    };
    let (mended, _) = sheet.close(Vec::len);
    assert_eq!(mended, Filling::Clipped(Vec::new(), 3));
}

#[test]
fn a_long_narrow_tear_is_closed() {
    let off = |n: usize| {
        [
            (n * 7 % 5) as i32 - 2,
            (n * 11 % 5) as i32 - 2,
            (n % 3) as i32,
        ]
    };
    let sheet = Sheet::grid([400, 7], off, |x, y| y == 3 && (1..398).contains(&x));
    let (mended, edges) = sheet.close(|ring| usize::from(ring.iter().all(|c| inside(c, 400, 7))));
    assert!(edges > MENDING.longest);
    let Filling::Filled(triangles) = mended else {
        panic!("{mended:?}");
    };
    assert_eq!(triangles.len(), edges - 2);
}

/// True if a corner is not on the outer boundary of a grid.
fn inside(corner: &Corner, wide: i32, high: i32) -> bool {
    let within = |x: i32, count: i32| (55..10 * (count - 1) + 45).contains(&x);
    within(corner.at[0], wide) && within(corner.at[1], high)
}

/// Ear clipping rounds the boundary slightly and leaves longer edges; it must still not count as a hole.
#[test]
fn a_wide_door_stays_open() {
    let door = |x, y| (5..65).contains(&x) && (5..65).contains(&y);
    for rough in 0..3 {
        let off = |n: usize| [0, 0, (n % 3) as i32 * rough];
        let sheet = Sheet::grid([70, 70], off, door);
        let (mended, edges) = sheet.close(|r| usize::from(r.iter().all(|c| inside(c, 70, 70))));
        let Filling::Clipped(triangles, left) = mended else {
            panic!("filled");
        };
        assert_eq!((edges, left), (240, edges - triangles.len()));
        let area: f64 = triangles.iter().map(|t| sheet.area(*t)).sum();
        assert!(area < 0.05 * 600.0 * 600.0, "{area}");
    }
}
