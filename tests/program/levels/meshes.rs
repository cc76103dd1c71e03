//! Meshes for tests, and distances between tiles by brute force.

use super::tileset::Tile;
use std::fmt::Write;
use std::path::Path;

#[derive(Clone)]
pub struct Mesh {
    pub vertices: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    values: bool,
}

impl Mesh {
    pub fn of(vertices: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            vertices,
            triangles,
            values: false,
        }
    }

    pub fn add_values(&mut self) {
        self.values = true;
    }

    /// Colour, intensity and time of a vertex.
    pub fn values_of(vertex: usize) -> ([u8; 3], u16, f64) {
        let n = vertex as u32;
        let color = [n % 251, n / 3 % 256, n / 7 % 256].map(|c| c as u8);
        (color, (n * 31 % 65_521) as u16, 1.2e9 + f64::from(n) / 16.0)
    }

    /// Writes ascii PLY: every program can read it.
    pub fn write(&self, path: &Path) {
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
             property double z\n",
            self.vertices.len()
        );
        if self.values {
            text += "property uchar red\nproperty uchar green\nproperty uchar blue\n\
                     property ushort intensity\nproperty double gps_time\n";
        }
        let count = self.triangles.len();
        writeln!(
            text,
            "element face {count}\nproperty list uchar int vertex_indices\nend_header"
        )
        .unwrap();
        for (number, [x, y, z]) in self.vertices.iter().enumerate() {
            write!(text, "{x} {y} {z}").unwrap();
            if self.values {
                let ([r, g, b], intensity, time) = Self::values_of(number);
                write!(text, " {r} {g} {b} {intensity} {time}").unwrap();
            }
            text.push('\n');
        }
        for [a, b, c] in &self.triangles {
            writeln!(text, "3 {a} {b} {c}").unwrap();
        }
        std::fs::write(path, text).unwrap();
    }

    /// Puts vertices and triangles in another order.
    pub fn shuffle(&mut self, seed: u64) {
        let mut rng = oorandom::Rand32::new(seed);
        let mut order: Vec<u32> = (0..self.vertices.len() as u32).collect();
        let mut mix = |n: usize| rng.rand_range(0..n as u32 + 1) as usize;
        (1..order.len()).rev().for_each(|n| order.swap(n, mix(n)));
        let old = self.vertices.clone();
        for (from, to) in order.iter().enumerate() {
            self.vertices[*to as usize] = old[from];
        }
        let corners = self.triangles.as_flattened_mut().iter_mut();
        corners.for_each(|v| *v = order[*v as usize]);
        (1..self.triangles.len())
            .rev()
            .for_each(|n| self.triangles.swap(n, mix(n)));
    }
}

/// A landscape of `side` by `side` vertices in a UTM zone, rounded to centimetres.
pub fn hills(side: u32, holes: bool) -> Mesh {
    let mut rng = oorandom::Rand32::new(1);
    let mut mesh = Mesh::of(Vec::new(), Vec::new());
    for y in 0..side {
        for x in 0..side {
            let [x, y] = [x, y].map(|c| f64::from(c) + f64::from(rng.rand_float()) * 0.4);
            let z = 4.0 * (x / 9.0).sin() * (y / 7.0).cos() + f64::from(rng.rand_float()) * 0.3;
            let position = [635_000.0 + x, 4_848_000.0 + y, 100.0 + z];
            mesh.vertices
                .push(position.map(|c| (c * 100.0).round() / 100.0));
        }
    }
    for y in 0..side - 1 {
        for x in 0..side - 1 {
            // Some round holes, one across the middle, and single squares.
            let hole = |a: u32, b: u32, r: u32| x.abs_diff(a).pow(2) + y.abs_diff(b).pow(2) < r * r;
            let half = side / 2;
            if holes
                && (hole(half, half, 5) || hole(side / 4, 9, 4) || (x * 31 + y * 17) % 211 == 5)
            {
                continue;
            }
            let a = y * side + x;
            mesh.triangles.push([a, a + 1, a + side]);
            mesh.triangles.push([a + 1, a + side + 1, a + side]);
        }
    }
    mesh
}

/// A closed sphere: a cube of `side` by `side` squares on each face, blown up; triangles face outwards.
pub fn sphere(side: u32) -> Mesh {
    let mut mesh = Mesh::of(Vec::new(), Vec::new());
    let mut numbers = std::collections::BTreeMap::new();
    let mut vertex = |p: [i64; 3]| {
        *numbers.entry(p).or_insert_with(|| {
            let v = p.map(|c| c as f64 / f64::from(side) * 2.0 - 1.0);
            let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
            mesh.vertices
                .push(v.map(|c| (c / length * 1e5).round() / 1e3));
            mesh.vertices.len() as u32 - 1
        })
    };
    let mut triangles = Vec::new();
    let n = i64::from(side);
    for axis in 0..3 {
        for end in [0, n] {
            for u in 0..n {
                for v in 0..n {
                    let corner = |a: i64, b: i64| {
                        let mut p = [0; 3];
                        (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (end, u + a, v + b);
                        p
                    };
                    let square = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    let [a, b, c, d] = square.map(&mut vertex);
                    let two = if end == n {
                        [[a, b, c], [a, c, d]]
                    } else {
                        [[a, c, b], [a, d, c]]
                    };
                    triangles.extend(two);
                }
            }
        }
    }
    mesh.triangles = triangles;
    mesh
}

type V = [f64; 3];

fn minus(a: V, b: V) -> V {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: V, b: V) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

/// Squared distance of `p` from a triangle, region by region (Ericson, Real-Time Collision Detection, 5.1.5).
fn distance2(p: V, [a, b, c]: [V; 3]) -> f64 {
    // Two corners at one place may only be the last two.
    let [a, b, c] = match (a == b, a == c) {
        (true, _) => [a, c, c],
        (false, true) => [a, b, b],
        _ => [a, b, c],
    };
    let at = |v: f64, w: f64| {
        let q: V = std::array::from_fn(|k| a[k] + v * (b[k] - a[k]) + w * (c[k] - a[k]));
        dot(minus(p, q), minus(p, q))
    };
    let (ab, ac, ap) = (minus(b, a), minus(c, a), minus(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    let (bp, cp) = (minus(p, b), minus(p, c));
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if d1 <= 0.0 && d2 <= 0.0 {
        at(0.0, 0.0)
    } else if d3 >= 0.0 && d4 <= d3 {
        at(1.0, 0.0)
    } else if d6 >= 0.0 && d5 <= d6 {
        at(0.0, 1.0)
    } else if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        at(d1 / (d1 - d3), 0.0)
    } else if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        at(0.0, d2 / (d2 - d6))
    } else if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        at(1.0 - w, w)
    } else {
        let all = va + vb + vc;
        at(vb / all, vc / all)
    }
}

fn corners<'a>(tiles: &'a [&Tile]) -> impl Iterator<Item = [V; 3]> + 'a {
    tiles.iter().flat_map(|tile| {
        let corner = |v: u32| tile.exact[v as usize].map(|x| x as f64);
        tile.triangles.iter().map(move |t| t.map(corner))
    })
}

/// The largest distance, in steps, of points of some tiles from others: of corners, and random points inside.
pub fn distance(from: &[&Tile], to: &[&Tile]) -> f64 {
    let to: Vec<[V; 3]> = corners(to).collect();
    let boxes: Vec<(V, f64)> = to
        .iter()
        .map(|t| {
            let middle: V = std::array::from_fn(|k| (t[0][k] + t[1][k] + t[2][k]) / 3.0);
            let reach = t.iter().map(|c| dot(minus(*c, middle), minus(*c, middle)));
            (middle, reach.fold(0.0, f64::max).sqrt())
        })
        .collect();
    let mut rng = oorandom::Rand64::new(11);
    let mut farthest: f64 = 0.0;
    let all: Vec<[V; 3]> = corners(from).collect();
    // About 20 000 points: slow, but certain.
    let each = (6000 / all.len()).clamp(1, 20);
    let stride = (all.len() / 3000).max(1);
    for triangle in all.iter().step_by(stride) {
        let mut points = triangle.to_vec();
        for _ in 0..each {
            let (mut u, mut v) = (rng.rand_float(), rng.rand_float());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let [a, b, c] = *triangle;
            points.push(std::array::from_fn(|k| {
                a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k])
            }));
        }
        for p in points {
            let mut best = f64::INFINITY;
            for (triangle, (middle, reach)) in to.iter().zip(&boxes) {
                let least = (dot(minus(p, *middle), minus(p, *middle)).sqrt() - reach).max(0.0);
                if least * least < best {
                    best = best.min(distance2(p, *triangle));
                }
            }
            farthest = farthest.max(best.sqrt());
        }
    }
    farthest
}
