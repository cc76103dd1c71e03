//! Small clouds that are difficult in various ways, made from a kind, a size and a seed.

use outcrop_geom::Point;

/// A sequence of pseudo-random numbers (SplitMix64).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let a = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let b = (a ^ (a >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        b ^ (b >> 31)
    }

    /// In `low..high`.
    pub fn integer(&mut self, low: i64, high: i64) -> i64 {
        low + (self.bits() % (high - low) as u64) as i64
    }

    /// In `0..1`.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A direction, uniform up to rounding.
    fn direction(&mut self) -> [f64; 3] {
        loop {
            let v: [f64; 3] = std::array::from_fn(|_| 2.0 * self.unit() - 1.0);
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.1 && length <= 1.0 {
                return v.map(|x| x / length);
            }
        }
    }
}

/// Positions before they are moved to the lattice.
type Raw = Vec<[i64; 3]>;
type Maker = fn(&mut Random, usize) -> Raw;

/// All kinds of clouds.
pub const KINDS: &[(&str, Maker)] = &[
    ("box", |r, n| (0..n).map(|_| in_box(r, [1000; 3])).collect()),
    ("dense box", |r, n| {
        (0..n).map(|_| in_box(r, [8; 3])).collect()
    }),
    ("sphere", |r, n| on_sphere(r, n, 5000.0, 0.0)),
    ("coarse sphere", |r, n| on_sphere(r, n, 12.0, 0.0)),
    ("noisy sphere", |r, n| on_sphere(r, n, 2000.0, 0.1)),
    ("bumps", bumps),
    ("terraces", terraces),
    ("grid", |_, n| grid(n, [10, 0, 0], [0, 10, 0])),
    ("turned grid", |_, n| grid(n, [2, 1, 2], [-2, 2, 1])),
    ("skewed grid", |_, n| grid(n, [7, 0, 0], [3, 5, 1])),
    ("grid with gaps", |r, n| {
        thinned(r, grid(2 * n, [4, 0, 0], [0, 4, 0]), n)
    }),
    ("lattice", |_, n| lattice(n)),
    ("line", |r, n| {
        (0..n)
            .map(|_| r.integer(0, 500))
            .map(|t| [t, 2 * t, 5 * t])
            .collect()
    }),
    ("almost a line", |r, n| {
        (0..n).map(|_| near_line(r)).collect()
    }),
    ("rings", rings),
    ("two clusters", two_clusters),
    ("outliers", outliers),
    ("duplicates", |r, n| duplicates(r, n)),
    ("two sheets", |r, n| sheets(r, n, 1)),
    ("two sheets apart", |r, n| sheets(r, n, 12)),
    ("scan lines", scan_lines),
    ("cube", on_cube),
    ("corner of a cube", corner_of_cube),
    ("moebius band", moebius),
    ("bridge", bridge),
    ("tube", tube),
    ("walls", walls),
];

/// A cloud of about `size` points of the kind with this index, moved to coordinates of at least 0.
pub fn cloud(kind: usize, size: usize, seed: u64) -> Vec<Point> {
    let mut random = Random::new(seed ^ (kind as u64) << 32 ^ (size as u64) << 48);
    let mut raw = KINDS[kind].1(&mut random, size);
    // Some clouds are far from the origin, where coordinates are large.
    let base = if random.integer(0, 4) == 0 {
        (1 << 30) - (1 << 20)
    } else {
        3
    };
    let least: [i64; 3] =
        std::array::from_fn(|axis| raw.iter().map(|p| p[axis]).min().unwrap_or(0));
    let far = raw
        .iter()
        .any(|p| (0..3).any(|axis| p[axis] - least[axis] >= 1 << 20));
    let base = if far { 0 } else { base };
    // The order of the points must not affect the mesh.
    for k in (1..raw.len()).rev() {
        raw.swap(k, random.integer(0, k as i64 + 1) as usize);
    }
    raw.into_iter()
        .map(|p| std::array::from_fn(|axis| (p[axis] - least[axis] + base) as i32))
        .collect()
}

/// A cloud of every kind, with its name; sizes from 3 to 400, mostly small.
pub fn one_of_each(seed: u64) -> Vec<(&'static str, Vec<Point>)> {
    let mut random = Random::new(seed);
    let mut size = || match random.integer(0, 4) {
        0 => random.integer(3, 12),
        1 => random.integer(12, 60),
        2 => random.integer(60, 150),
        _ => random.integer(150, 401),
    };
    (0..KINDS.len())
        .map(|kind| (KINDS[kind].0, cloud(kind, size() as usize, seed)))
        .collect()
}

/// Pillars of six by six points with different heights: rough for many neighbours, smooth for few.
pub fn pillars(seed: u64) -> Vec<Point> {
    let mut random = Random::new(seed);
    let heights: Vec<i32> = (0..16).map(|_| random.integer(0, 1200) as i32).collect();
    let height = |a: i32, b: i32| heights[(a / 6 + 4 * (b / 6)) as usize];
    (0..24)
        .flat_map(|a| (0..24).map(move |b| (a, b)))
        .map(|(a, b)| {
            let [x, y] = [100 * a, 100 * b].map(|c| c + random.integer(0, 30) as i32);
            // Their tops slope.
            [x, y, height(a, b) + (3 * x + 5 * y) / 10]
        })
        .collect()
}

/// A frame around a door too wide to be a hole, its points slightly off a grid.
pub fn door(seed: u64) -> Vec<Point> {
    let mut random = Random::new(seed);
    let mut points = Vec::new();
    for (a, b) in (0..61).flat_map(|a| (0..61).map(move |b| (a, b))) {
        if !(3..58).contains(&a) || !(3..58).contains(&b) {
            let base = [20 * a, 20 * b, 0].map(|x| x + 10);
            points.push(base.map(|x| x + random.integer(-2, 3) as i32));
        }
    }
    points
}

/// A sheet with a round hole, whose filling has narrow triangles at its boundary and large ones in its
/// middle, and with enough columns for evidence of facing up.
pub fn wide_hole(seed: u64) -> Vec<Point> {
    let mut random = Random::new(seed);
    let mut points = Vec::new();
    for (a, b) in (0..40).flat_map(|a| (0..40).map(move |b| (a, b))) {
        let p = [12 * a, 12 * b, 0].map(|x| x + 10 + random.integer(-2, 3) as i32);
        let [x, y] = [p[0] - 245, p[1] - 245];
        if x * x + y * y > 92 * 92 {
            points.push(p);
        }
    }
    points
}

/// A sheet that is smooth on one side and rough, with some narrow gaps, on the other.
pub fn half_rough(seed: u64, count: usize) -> Vec<Point> {
    let mut random = Random::new(seed);
    let mut points = Vec::new();
    while points.len() < count {
        let [x, y, _] = in_box(&mut random, [1000, 1000, 1]);
        let thick = if x < 400 { 1 } else { x / 20 };
        let cut = x > 500 && (y % 333 - 160).abs() < 14;
        if !cut {
            let z = 60 + x * x / 5000 + random.integer(-thick, thick + 1);
            points.push([x, y, z].map(|x| x as i32));
        }
    }
    points
}

fn in_box(r: &mut Random, side: [i64; 3]) -> [i64; 3] {
    side.map(|s| r.integer(0, s))
}

fn on_sphere(r: &mut Random, n: usize, radius: f64, noise: f64) -> Raw {
    let mut point = || {
        let length = radius * (1.0 + noise * (r.unit() - 0.5));
        r.direction().map(|x| (x * length).round() as i64)
    };
    (0..n).map(|_| point()).collect()
}

fn bumps(r: &mut Random, n: usize) -> Raw {
    let [fx, fy] = [r.unit() * 0.02, r.unit() * 0.02];
    let mut point = || {
        let [x, y, _] = in_box(r, [1000, 1000, 1]);
        let z = 40.0 * ((x as f64 * fx).sin() + (y as f64 * fy).cos());
        [x, y, z.round() as i64]
    };
    (0..n).map(|_| point()).collect()
}

/// A height field on a coarse raster in all three directions, as quantised scans are.
fn terraces(r: &mut Random, n: usize) -> Raw {
    let side = (n as f64).sqrt().ceil() as i64 + 1;
    let mut point = || {
        let [x, y, _] = in_box(r, [side, side, 1]);
        [x * 5, y * 5, (x * x + 2 * y) / side * 3]
    };
    (0..n).map(|_| point()).collect()
}

fn grid(n: usize, u: [i64; 3], v: [i64; 3]) -> Raw {
    let side = ((n as f64).sqrt().round() as i64).max(2);
    let at = |a: i64, b: i64| std::array::from_fn(|k| a * u[k] + b * v[k]);
    (0..side)
        .flat_map(|a| (0..side).map(move |b| at(a, b)))
        .collect()
}

fn thinned(r: &mut Random, mut points: Raw, n: usize) -> Raw {
    while points.len() > n.max(3) {
        let at = r.integer(0, points.len() as i64) as usize;
        points.swap_remove(at);
    }
    points
}

fn lattice(n: usize) -> Raw {
    let side = ((n as f64).cbrt().round() as i64).max(2);
    let plane = move |a| (0..side).flat_map(move |b| (0..side).map(move |c| [3 * a, 3 * b, 3 * c]));
    (0..side).flat_map(plane).collect()
}

fn near_line(r: &mut Random) -> [i64; 3] {
    let t = r.integer(0, 3000);
    [t, t / 3 + r.integer(0, 2), r.integer(0, 2)]
}

/// Concentric rings of exactly co-circular lattice points, some of them off the plane.
fn rings(r: &mut Random, n: usize) -> Raw {
    let mut circle = Vec::new();
    for a in -25i64..=25 {
        for b in -25i64..=25 {
            if a * a + b * b == 625 {
                circle.push([a, b]);
            }
        }
    }
    let mut ring = 0;
    let mut points = vec![[0; 3]];
    while points.len() < n.max(4) {
        ring += 1;
        let lift = if r.integer(0, 3) == 0 { 1 } else { 0 };
        points.extend(circle.iter().map(|[a, b]| [ring * a, ring * b, lift]));
    }
    thinned(r, points, n)
}

fn two_clusters(r: &mut Random, n: usize) -> Raw {
    let far = (1i64 << 30) - 300;
    let point = |k: usize| {
        let d = r.direction().map(|x| (x * 100.0).round() as i64 + 120);
        if k.is_multiple_of(2) {
            d
        } else {
            d.map(|x| x + far - 300)
        }
    };
    (0..n).map(point).collect()
}

/// A rough plane, and a few points off the surface.
fn outliers(r: &mut Random, n: usize) -> Raw {
    let point = |k: usize| match k % 23 {
        5 => in_box(r, [1 << 29, 1 << 29, 1 << 29]),
        11 => in_box(r, [400, 400, 3000]),
        _ => in_box(r, [400, 400, 3]),
    };
    (0..n).map(point).collect()
}

fn duplicates(r: &mut Random, n: usize) -> Raw {
    let some = on_sphere(r, n / 3 + 2, 30.0, 0.0);
    (0..n)
        .map(|_| some[r.integer(0, some.len() as i64) as usize])
        .collect()
}

fn sheets(r: &mut Random, n: usize, apart: i64) -> Raw {
    let side = (2.0 * (n as f64).sqrt()) as i64 + 2;
    let point = |k: usize| {
        let [x, y, _] = in_box(r, [side, side, 1]);
        [3 * x, 3 * y, apart * (k as i64 % 2)]
    };
    (0..n).map(point).collect()
}

/// Points on lines whose distance is twenty times the spacing on them.
fn scan_lines(r: &mut Random, n: usize) -> Raw {
    let length = ((n as f64).sqrt() * 4.0) as i64 + 2;
    let point = |k: i64| {
        let (line, along) = (k / length, k % length);
        [4 * along, 80 * line, 2 * line * line + r.integer(0, 2)]
    };
    (0..n as i64).map(point).collect()
}

fn on_cube(r: &mut Random, n: usize) -> Raw {
    let mut point = || {
        let mut p = in_box(r, [60; 3]);
        let axis = r.integer(0, 3) as usize;
        p[axis] = 60 * r.integer(0, 2);
        p
    };
    (0..n).map(|_| point()).collect()
}

/// Three exact grids that meet at right angles.
fn corner_of_cube(_: &mut Random, n: usize) -> Raw {
    let faces = [
        [[1, 0, 0], [0, 1, 0]],
        [[0, 1, 0], [0, 0, 1]],
        [[0, 0, 1], [1, 0, 0]],
    ];
    faces
        .iter()
        .flat_map(|[u, v]| grid(n / 3, u.map(|x| 6 * x), v.map(|x| 6 * x)))
        .collect()
}

/// A band with one half twist, a few points across.
fn moebius(_: &mut Random, n: usize) -> Raw {
    let across = 5;
    let along = (n / across).max(6);
    let spread = 60.0 * along as f64 / std::f64::consts::TAU;
    let point = |k: usize| {
        let turn = std::f64::consts::TAU * (k / across) as f64 / along as f64;
        let out = 60.0 * ((k % across) as f64 - 2.0);
        let flat = spread + out * (turn / 2.0).cos();
        let p = [
            flat * turn.cos(),
            flat * turn.sin(),
            out * (turn / 2.0).sin(),
        ];
        p.map(|x| x.round() as i64)
    };
    (0..across * along).map(point).collect()
}

/// Two patches joined by a narrow strip of points.
fn bridge(r: &mut Random, n: usize) -> Raw {
    let point = |k: usize| match k % 8 {
        0 => [r.integer(100, 300), r.integer(48, 52), 0],
        1..=4 => [r.integer(0, 100), r.integer(0, 100), r.integer(0, 3)],
        _ => [r.integer(300, 400), r.integer(0, 100), r.integer(0, 3)],
    };
    (0..n).map(point).collect()
}

/// An open cylinder, its points at random.
fn tube(r: &mut Random, n: usize) -> Raw {
    let mut point = || {
        let turn = std::f64::consts::TAU * r.unit();
        [
            (200.0 * turn.cos()) as i64,
            (200.0 * turn.sin()) as i64,
            r.integer(0, 900),
        ]
    };
    (0..n).map(|_| point()).collect()
}

/// Thin walls on a ground, one of them across the middle: the surface has T-shaped junctions.
fn walls(r: &mut Random, n: usize) -> Raw {
    let side = (6.0 * (n as f64).sqrt()) as i64 + 10;
    let point = |k: usize| {
        let [x, y, z] = in_box(r, [side; 3]);
        let thick = r.integer(0, 2);
        match k % 6 {
            0 => [x, side / 2 + thick, z / 2],
            1 => [side / 3 + thick, y / 2, z / 3],
            _ => [x, y, thick],
        }
    };
    (0..n).map(point).collect()
}
