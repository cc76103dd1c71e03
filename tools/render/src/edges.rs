//! Edges that do not have exactly two triangles.

/// Edges by number of triangles.
#[derive(Debug, Default)]
pub(crate) struct Edges {
    /// With one triangle.
    pub boundary: Vec<[u32; 2]>,
    /// With three or more.
    pub non_manifold: Vec<[u32; 2]>,
}

/// Counts the triangles of each edge. The edges are grouped by their smaller vertex with a counting sort,
/// which takes a quarter of the memory of sorting all edges.
pub(crate) fn find(vertices: usize, triangles: &[[u32; 3]]) -> Edges {
    let sides = |t: &[u32; 3]| {
        let [a, b, c] = *t;
        [(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b)))
    };
    let mut ends = vec![0usize; vertices + 1];
    for (low, high) in triangles.iter().flat_map(sides) {
        if low != high {
            ends[low as usize + 1] += 1;
        }
    }
    for v in 1..ends.len() {
        ends[v] += ends[v - 1];
    }
    let mut partners = vec![0u32; ends[vertices]];
    // Filling moves each start to the start of the next group.
    for (low, high) in triangles.iter().flat_map(sides) {
        if low != high {
            partners[ends[low as usize]] = high;
            ends[low as usize] += 1;
        }
    }
    let mut edges = Edges::default();
    let mut start = 0;
    for low in 0..vertices {
        let group = &mut partners[start..ends[low]];
        start = ends[low];
        group.sort_unstable();
        for run in group.chunk_by(|a, b| a == b) {
            match run.len() {
                1 => edges.boundary.push([low as u32, run[0]]),
                2 => {}
                _ => edges.non_manifold.push([low as u32, run[0]]),
            }
        }
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_triangles_per_edge() {
        // A tetrahedron is closed; an open fan of three triangles shares edge 0-1.
        let closed = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let edges = find(4, &closed);
        assert!(edges.boundary.is_empty() && edges.non_manifold.is_empty());
        let edges = find(5, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
        assert_eq!(edges.non_manifold, [[0, 1]]);
        assert_eq!(edges.boundary.len(), 6);
        assert!(find(0, &[]).boundary.is_empty());
    }
}
