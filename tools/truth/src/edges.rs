//! Edges, pieces and the Euler characteristic of a mesh.

use rustc_hash::FxHashMap;

/// Counts of a mesh's edges and pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Topology {
    pub(crate) boundary: u64,
    pub(crate) nonmanifold: u64,
    pub(crate) turned: u64,
    pub(crate) components: u64,
    pub(crate) euler: i64,
}

/// Triangles at an edge, and in how many more it runs forwards than backwards.
#[derive(Clone, Copy, Debug, Default)]
struct Edge {
    count: u32,
    balance: i32,
}

/// Of triangles with three different corners; others are left out.
pub(crate) fn topology(vertices: usize, triangles: &[[u32; 3]]) -> Topology {
    let mut edges: FxHashMap<[u32; 2], Edge> = FxHashMap::default();
    let mut pieces = Pieces((0..vertices as u32).collect());
    let mut used = vec![false; vertices];
    let mut faces = 0;
    for &[a, b, c] in triangles {
        if a == b || b == c || c == a {
            continue;
        }
        faces += 1;
        for [p, q] in [[a, b], [b, c], [c, a]] {
            let edge = edges.entry([p.min(q), p.max(q)]).or_default();
            edge.count += 1;
            edge.balance += if p < q { 1 } else { -1 };
            pieces.join(p, q);
            used[p as usize] = true;
        }
    }
    let count = |what: fn(&Edge) -> bool| edges.values().filter(|e| what(e)).count() as u64;
    let corners = (0..vertices as u32).filter(|v| used[*v as usize]);
    let corners: Vec<u32> = corners.collect();
    let roots = corners.iter().filter(|v| pieces.root(**v) == **v);
    Topology {
        boundary: count(|e| e.count == 1),
        nonmanifold: count(|e| e.count > 2),
        turned: count(|e| e.count == 2 && e.balance != 0),
        components: roots.count() as u64,
        euler: corners.len() as i64 - edges.len() as i64 + faces,
    }
}

/// Sets of vertices, each named by its least one.
struct Pieces(Vec<u32>);

impl Pieces {
    fn root(&mut self, mut v: u32) -> u32 {
        while self.0[v as usize] != v {
            let above = self.0[self.0[v as usize] as usize];
            self.0[v as usize] = above;
            v = above;
        }
        v
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_tetrahedra_of_which_one_is_open() {
        let closed = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let mut triangles = closed.to_vec();
        triangles.extend(closed[..3].iter().map(|t| t.map(|v| v + 5)));
        triangles.push([1, 1, 4]);
        let found = topology(9, &triangles);
        let expected = Topology {
            boundary: 3,
            nonmanifold: 0,
            turned: 0,
            components: 2,
            euler: 3,
        };
        assert_eq!(found, expected);
        triangles[0].swap(0, 1);
        triangles.push([0, 1, 4]);
        let found = topology(9, &triangles);
        assert_eq!((found.turned, found.nonmanifold), (2, 1));
    }
}
