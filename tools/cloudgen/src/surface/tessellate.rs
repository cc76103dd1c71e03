//! Triangles of an implicit surface by marching tetrahedra, which have no ambiguous case: the result is a
//! closed manifold if the surface is inside the box.

use std::collections::HashMap;

use crate::vec3::{Vec3, add, scale, sub};

/// A welded triangle mesh. Marching leaves its triangles without a consistent orientation.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tessellation {
    pub vertices: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Tessellation {
    /// Corners of the bounding box.
    pub(crate) fn bounds(&self) -> [Vec3; 2] {
        let fold = |start: f64, pick: fn(f64, f64) -> f64| {
            std::array::from_fn(|k| self.vertices.iter().map(|v| v[k]).fold(start, pick))
        };
        [
            fold(f64::INFINITY, f64::min),
            fold(f64::NEG_INFINITY, f64::max),
        ]
    }
}

/// The six tetrahedra of a cube around its main diagonal. Bit `k` of a corner number is the step along axis
/// `k`. All cubes are divided alike, so neighbours have the same diagonals on common faces.
const TETRAHEDRA: [[usize; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 1, 5, 7],
    [0, 2, 3, 7],
    [0, 2, 6, 7],
    [0, 4, 5, 7],
    [0, 4, 6, 7],
];

/// Zero set of `function` in the cube with half side `half`, with `cells` per side.
pub(crate) fn tessellate(function: impl Fn(Vec3) -> f64, half: f64, cells: usize) -> Tessellation {
    Marching::new(function, half, cells).run()
}

struct Marching<F> {
    function: F,
    half: f64,
    cells: usize,
    values: Vec<f64>,
    /// Mesh vertex on each lattice edge that the surface crosses.
    crossings: HashMap<(usize, usize), u32>,
    out: Tessellation,
}

impl<F: Fn(Vec3) -> f64> Marching<F> {
    fn new(function: F, half: f64, cells: usize) -> Self {
        let mut marching = Marching {
            function,
            half,
            cells,
            values: Vec::new(),
            crossings: HashMap::new(),
            out: Tessellation::default(),
        };
        let nodes = (cells + 1).pow(3);
        marching.values = (0..nodes)
            .map(|n| (marching.function)(marching.place(n)))
            .collect();
        marching
    }

    fn place(&self, node: usize) -> Vec3 {
        let side = self.cells + 1;
        let step = 2.0 * self.half / self.cells as f64;
        [node % side, node / side % side, node / (side * side)].map(|k| k as f64 * step - self.half)
    }

    fn run(mut self) -> Tessellation {
        let side = self.cells + 1;
        for z in 0..self.cells {
            for y in 0..self.cells {
                for x in 0..self.cells {
                    let first = (z * side + y) * side + x;
                    let corners: [usize; 8] = std::array::from_fn(|c| {
                        first + (c & 1) + (c >> 1 & 1) * side + (c >> 2) * side * side
                    });
                    self.cube(corners);
                }
            }
        }
        self.out
    }

    fn cube(&mut self, corners: [usize; 8]) {
        let below = corners.iter().filter(|&&c| self.values[c] < 0.0).count();
        if below == 0 || below == 8 {
            return;
        }
        for tetrahedron in TETRAHEDRA {
            self.tetrahedron(tetrahedron.map(|c| corners[c]));
        }
    }

    fn tetrahedron(&mut self, nodes: [usize; 4]) {
        // Nodes below zero first; otherwise the order is kept.
        let mut sorted = nodes;
        sorted.sort_by_key(|&n| self.values[n] >= 0.0);
        let [a, b, c, d] = sorted;
        match nodes.iter().filter(|&&n| self.values[n] < 0.0).count() {
            1 => self.triangle([(a, b), (a, c), (a, d)]),
            2 => {
                self.triangle([(a, c), (a, d), (b, d)]);
                self.triangle([(a, c), (b, d), (b, c)]);
            }
            3 => self.triangle([(a, d), (b, d), (c, d)]),
            _ => {}
        }
    }

    fn triangle(&mut self, edges: [(usize, usize); 3]) {
        let triangle = edges.map(|edge| self.crossing(edge));
        self.out.triangles.push(triangle);
    }

    fn crossing(&mut self, (inner, outer): (usize, usize)) -> u32 {
        let key = (inner.min(outer), inner.max(outer));
        if let Some(&vertex) = self.crossings.get(&key) {
            return vertex;
        }
        let place = self.root(inner, outer);
        let vertex = self.out.vertices.len() as u32;
        self.out.vertices.push(place);
        self.crossings.insert(key, vertex);
        vertex
    }

    /// The zero between two nodes, by the Illinois variant of regula falsi.
    fn root(&self, inner: usize, outer: usize) -> Vec3 {
        let (start, end) = (self.place(inner), self.place(outer));
        let along = |t: f64| add(start, scale(sub(end, start), t));
        let (mut low, mut high) = ((0.0, self.values[inner]), (1.0, self.values[outer]));
        let mut last_low = None;
        let mut t = 0.0;
        for _ in 0..12 {
            t = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let value = (self.function)(along(t));
            if value.abs() < 1e-12 {
                break;
            }
            let moves_low = value < 0.0;
            if moves_low {
                low = (t, value);
                high.1 *= if last_low == Some(true) { 0.5 } else { 1.0 };
            } else {
                high = (t, value);
                low.1 *= if last_low == Some(false) { 0.5 } else { 1.0 };
            }
            last_low = Some(moves_low);
        }
        along(t)
    }
}

/// Vertices minus edges plus faces; true if each edge has exactly two triangles.
#[cfg(test)]
pub(crate) fn topology(mesh: &Tessellation) -> (i64, bool) {
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *edges.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    let euler = mesh.vertices.len() as i64 - edges.len() as i64 + mesh.triangles.len() as i64;
    (euler, edges.values().all(|&n| n == 2))
}
