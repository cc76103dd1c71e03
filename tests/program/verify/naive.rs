//! A checker in memory, independent of the program: an edge map, a walk around each vertex, breadth-first
//! searches, and the genus component by component.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Positions (small integers, or not finite) and faces.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    pub positions: Vec<[f64; 3]>,
    pub faces: Vec<Vec<i64>>,
}

#[derive(Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub vertices: u64,
    pub triangles: u64,
    pub edges: u64,
    pub boundary_edges: u64,
    pub boundary_loops: u64,
    pub components: u64,
    pub euler_characteristic: i64,
    pub genus: Option<u64>,
    pub unreferenced_vertices: u64,
    pub degenerate_triangles: u64,
    pub zero_area_triangles: u64,
    pub repeated_triangles: u64,
    pub non_manifold_edges: u64,
    pub inconsistent_edges: u64,
    pub pinched_vertices: u64,
    pub index_out_of_range: u64,
    pub non_finite_vertices: u64,
    pub manifold: bool,
}

type Edge = (usize, usize);

fn edge(a: usize, b: usize) -> Edge {
    (a.min(b), a.max(b))
}

fn has_no_area(mesh: &Mesh, triangle: [usize; 3]) -> bool {
    let p = triangle.map(|v| mesh.positions[v]);
    if p.iter().flatten().any(|c| !c.is_finite()) {
        return false;
    }
    let [p, q, r] = p.map(|p| p.map(|c| c as i128));
    let (u, v) = (
        [0, 1, 2].map(|i| q[i] - p[i]),
        [0, 1, 2].map(|i| r[i] - p[i]),
    );
    u[1] * v[2] == u[2] * v[1] && u[2] * v[0] == u[0] * v[2] && u[0] * v[1] == u[1] * v[0]
}

/// Splits nodes into connected sets.
fn connected<T: Ord + Copy>(links: &BTreeMap<T, Vec<T>>) -> Vec<BTreeSet<T>> {
    let mut sets: Vec<BTreeSet<T>> = Vec::new();
    let mut seen = BTreeSet::new();
    for &start in links.keys() {
        if !seen.insert(start) {
            continue;
        }
        let (mut set, mut queue) = (BTreeSet::from([start]), VecDeque::from([start]));
        while let Some(node) = queue.pop_front() {
            for &next in &links[&node] {
                if seen.insert(next) {
                    set.insert(next);
                    queue.push_back(next);
                }
            }
        }
        sets.push(set);
    }
    sets
}

/// Walks from triangle to triangle across the edges at `v`; true if all triangles are reached.
fn is_one_fan(
    v: usize,
    around: &[usize],
    sound: &[[usize; 3]],
    edges: &BTreeMap<Edge, Vec<usize>>,
) -> bool {
    let (mut reached, mut stack) = (BTreeSet::from([around[0]]), vec![around[0]]);
    while let Some(t) = stack.pop() {
        for &w in sound[t].iter().filter(|w| **w != v) {
            for &next in &edges[&edge(v, w)] {
                if reached.insert(next) {
                    stack.push(next);
                }
            }
        }
    }
    reached.len() == around.len()
}

fn sort_out(mesh: &Mesh, counts: &mut Counts) -> Vec<[usize; 3]> {
    let mut sound = Vec::new();
    for face in &mesh.faces {
        for pair in face.windows(2).skip(1) {
            sort_in([face[0], pair[0], pair[1]], mesh, counts, &mut sound);
        }
    }
    sound
}

fn sort_in([x, y, z]: [i64; 3], mesh: &Mesh, counts: &mut Counts, sound: &mut Vec<[usize; 3]>) {
    counts.triangles += 1;
    if [x, y, z]
        .iter()
        .any(|&i| i < 0 || i >= mesh.positions.len() as i64)
    {
        counts.index_out_of_range += 1;
    } else if x == y || y == z || x == z {
        counts.degenerate_triangles += 1;
    } else {
        sound.push([x as usize, y as usize, z as usize]);
    }
}

/// Counts everything.
pub fn check(mesh: &Mesh) -> Counts {
    let mut counts = Counts {
        vertices: mesh.positions.len() as u64,
        ..Counts::default()
    };
    let finite = |p: &&[f64; 3]| p.iter().all(|c| c.is_finite());
    counts.non_finite_vertices =
        counts.vertices - mesh.positions.iter().filter(finite).count() as u64;
    let sound = sort_out(mesh, &mut counts);
    let mut sets = BTreeSet::new();
    let mut edges: BTreeMap<Edge, Vec<usize>> = BTreeMap::new();
    let mut directed: BTreeMap<Edge, u64> = BTreeMap::new();
    let mut around: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let mut links: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (t, &triangle) in sound.iter().enumerate() {
        let mut sorted = triangle;
        sorted.sort_unstable();
        counts.repeated_triangles += u64::from(!sets.insert(sorted));
        counts.zero_area_triangles += u64::from(has_no_area(mesh, triangle));
        for i in 0..3 {
            let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
            edges.entry(edge(a, b)).or_default().push(t);
            *directed.entry((a, b)).or_default() += 1;
            around.entry(a).or_default().push(t);
            links.entry(a).or_default().push(b);
            links.entry(b).or_default().push(a);
        }
    }
    counts.edges = edges.len() as u64;
    counts.unreferenced_vertices = counts.vertices - around.len() as u64;
    for (&(a, b), triangles) in &edges {
        counts.boundary_edges += u64::from(triangles.len() == 1);
        counts.non_manifold_edges += u64::from(triangles.len() > 2);
        let one_way = directed.get(&(a, b)).is_none_or(|n| *n == 2);
        counts.inconsistent_edges += u64::from(triangles.len() == 2 && one_way);
    }
    for (&v, triangles) in &around {
        let manifold = links[&v].iter().all(|&w| edges[&edge(v, w)].len() <= 2);
        let pinched = manifold && !is_one_fan(v, triangles, &sound, &edges);
        counts.pinched_vertices += u64::from(pinched);
    }
    let mut border: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (&(a, b), _) in edges.iter().filter(|(_, t)| t.len() == 1) {
        border.entry(a).or_default().push(b);
        border.entry(b).or_default().push(a);
    }
    let (parts, loops) = (connected(&links), connected(&border));
    counts.components = parts.len() as u64;
    counts.boundary_loops = loops.len() as u64;
    let surface_defects = counts.index_out_of_range
        + counts.degenerate_triangles
        + counts.repeated_triangles
        + counts.non_manifold_edges
        + counts.inconsistent_edges
        + counts.pinched_vertices;
    let mut genus = 0;
    for part in &parts {
        let faces = sound.iter().filter(|t| part.contains(&t[0])).count() as i64;
        let lines = edges.keys().filter(|e| part.contains(&e.0)).count() as i64;
        let holes = loops
            .iter()
            .filter(|l| part.contains(l.first().unwrap()))
            .count() as i64;
        let euler = part.len() as i64 - lines + faces;
        counts.euler_characteristic += euler;
        if surface_defects == 0 {
            let twice = 2 - euler - holes;
            assert!(twice >= 0 && twice % 2 == 0, "{twice}");
            genus += twice as u64 / 2;
        }
    }
    counts.genus = (surface_defects == 0 && !sound.is_empty()).then_some(genus);
    counts.manifold =
        surface_defects + counts.non_finite_vertices + counts.unreferenced_vertices == 0;
    counts
}
