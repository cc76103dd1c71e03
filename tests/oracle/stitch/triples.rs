//! Arbitrary triples.

use crate::reference::clouds::Random;
use std::collections::BTreeMap;

type Point = [i32; 3];

/// Triples of points that are near in order, with the share `share` of T3.
pub fn random_triples(random: &mut Random, count: usize, share: i64) -> BTreeMap<[u32; 3], u32> {
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
        // The smallest Möbius band, of T3 only.
        let first = random.integer(0, count as i64 - 5) as u32;
        for k in 0..5 {
            let mut t = [k, k + 1, k + 2].map(|v| first + v % 5);
            t.sort_unstable();
            all.insert(t, 3);
        }
    }
    all
}

/// Ids in order except for a few, or in random order.
pub fn some_order(random: &mut Random, count: usize) -> Vec<u32> {
    let mut id: Vec<u32> = (0..count as u32).collect();
    for _ in 0..[0, 4, count][random.integer(0, 3) as usize] {
        let [a, b] = [0; 2].map(|_: i32| random.integer(0, count as i64) as usize);
        id.swap(a, b);
    }
    id
}

/// Triples of a sheet that closes on itself, twisted or not, with tears. For some sheets `places` gives
/// positions: on a band that is nowhere steep.
pub fn twisted_triples(
    random: &mut Random,
    count: usize,
    places: &mut [Point],
) -> BTreeMap<[u32; 3], u32> {
    let high = random.integer(3, 7);
    let wide = count as i64 / high;
    let mut all = BTreeMap::new();
    if wide < 4 {
        return all;
    }
    let id = some_order(random, count);
    if random.integer(0, 2) == 0 {
        for (x, y) in (0..wide).flat_map(|x| (0..high).map(move |y| (x, y))) {
            let turn = std::f64::consts::TAU * x as f64 / wide as f64;
            let out = 40.0 * (y as f64 - 0.5 * (high - 1) as f64);
            let flat = 40.0 * wide as f64 + out * (turn / 2.0).cos();
            let p = [
                flat * turn.cos(),
                flat * turn.sin(),
                out * (turn / 2.0).sin(),
            ];
            places[id[(x * high + y) as usize] as usize] = p.map(|x| 5000 + x.round() as i32);
        }
    }
    let (twist, whole) = (random.integer(0, 3) > 0, random.integer(5, 11));
    let at = |x: i64, y: i64| {
        let y = if x >= wide && twist { high - 1 - y } else { y };
        id[(x % wide * high + y) as usize]
    };
    for (x, y) in (0..wide).flat_map(|x| (1..high).map(move |y| (x, y))) {
        let [a, b, c, d] = [at(x, y - 1), at(x, y), at(x + 1, y - 1), at(x + 1, y)];
        let halves = match random.integer(0, 2) {
            0 => [[a, b, c], [b, c, d]],
            _ => [[a, b, d], [a, c, d]],
        };
        for mut t in halves {
            t.sort_unstable();
            let seen = match random.integer(0, 10) {
                n if n < whole => 3,
                _ => random.integer(0, 3) as u32,
            };
            if seen > 0 {
                all.insert(t, seen);
            }
        }
    }
    all
}

/// Triples of a flat sheet with a few folds, a little noise and tears, and with walls on it, and the
/// positions of their points. At an edge at the foot of a wall two or all of the three triangles are T3 in
/// some cases.
pub fn walled_triples(random: &mut Random, count: usize) -> (BTreeMap<[u32; 3], u32>, Vec<Point>) {
    let wide = if count < 1000 {
        random.integer(3, 9)
    } else {
        54
    };
    let rows = count as i64 / wide;
    let walls = random.integer(0, 3).min(rows / 4);
    let high = if walls > 0 {
        random.integer(1, 4).min(rows / 4)
    } else {
        0
    };
    let deep = rows - walls * high;
    let id = some_order(random, count);
    let (noise, whole) = (random.integer(1, 12), random.integer(6, 11));
    let mut places: Vec<Point> = (0..count)
        .map(|_| [0; 3].map(|_: i32| random.integer(0, 400) as i32))
        .collect();
    let folds = [0; 2].map(|_: i32| random.integer(0, 2 * deep));
    let mut put = |row: i64, [y, z]: [i64; 2]| {
        for x in 0..wide {
            let p = [40 * x, 40 * y, z].map(|c| (100 + c + random.integer(0, noise)) as i32);
            places[id[(row * wide + x) as usize] as usize] = p;
        }
    };
    // Up at the first fold, and down again at the second.
    let turn = |y: i64| (y.min(2 * folds[0] - y), 35 * (y - folds[1]).max(0));
    for row in 0..deep {
        let (y, z) = turn(row);
        put(row, [y + deep, z]);
    }
    let foot = |wall: i64| (wall + 1) * deep / (walls + 1);
    for (wall, up) in (0..walls).flat_map(|wall| (0..high).map(move |up| (wall, up))) {
        let (y, z) = turn(foot(wall));
        put(deep + wall * high + up, [y + deep, z + 40 * (up + 1)]);
    }
    let mut all = BTreeMap::new();
    let mut strip = |low: i64, up: i64, foot: bool| {
        for x in 1..wide {
            let at = |row: i64, x: i64| id[(row * wide + x) as usize];
            let [a, b, c, d] = [at(low, x - 1), at(low, x), at(up, x - 1), at(up, x)];
            for (n, mut t) in [[a, b, c], [b, c, d]].into_iter().enumerate() {
                t.sort_unstable();
                let torn =
                    random.integer(0, 10) >= whole || foot && n == 0 && random.integer(0, 3) > 0;
                all.insert(t, if torn { random.integer(1, 3) as u32 } else { 3 });
            }
        }
    };
    for row in 1..deep {
        strip(row - 1, row, false);
    }
    for wall in 0..walls {
        for up in 0..high {
            let first = deep + wall * high + up;
            let below = if up == 0 { foot(wall) } else { first - 1 };
            strip(below, first, up == 0);
        }
        // The strip before the foot of a wall.
        strip(foot(wall), foot(wall) - 1, true);
    }
    (all, places)
}

/// For each point the number of its scanner, from 1, or 0; and the places of the scanners, one of which is too far
/// to be real. They change from point to point, or not.
pub fn some_scanners(random: &mut Random, count: usize) -> (Vec<u32>, Vec<Option<[i64; 3]>>) {
    let all = random.integer(1, 5);
    let mut place = || Some([0; 3].map(|_: i64| random.integer(-3000, 9000)));
    let mut places: Vec<_> = (0..all).map(|_| place()).collect();
    places.push(None);
    let share = [10, 10, 7][random.integer(0, 3) as usize];
    let run = [1, 200][random.integer(0, 2) as usize];
    let mut number = 0;
    let numbers = (0..count).map(|id| {
        if id % run == 0 {
            let seen = random.integer(0, 10) < share;
            number = if seen {
                random.integer(1, all + 2) as u32
            } else {
                0
            };
        }
        number
    });
    (numbers.collect(), places)
}
