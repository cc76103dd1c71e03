//! A tile in memory, and as words in a scratch file.

use super::rounding::rounded;
use super::rows::LevelWord;

/// The depth of a vertex that only one cell has.
pub(super) const INNER: u8 = u8::MAX;

/// A tile: the triangles of a cell of the octree.
#[derive(Debug, Clone, Default)]
pub(super) struct Node {
    /// Numbers of the vertices in the mesh.
    pub ids: Vec<u32>,
    /// Their positions on the lattice.
    pub points: Vec<[u32; 3]>,
    /// Depth of the smallest cell of the octree that has all triangles of the full mesh around the vertex;
    /// [`INNER`] if it is a leaf of the tree.
    pub depths: Vec<u8>,
    /// The low bits of each position that tiles do not show.
    pub rounding: Vec<u8>,
    /// Normals, octahedral.
    pub normals: Vec<[i8; 2]>,
    /// The other values, of all vertices one after the other.
    pub values: Vec<u32>,
    /// Corners, as indices in the lists.
    pub triangles: Vec<[u32; 3]>,
    /// Edges with a triangle of another tile, the smaller index first.
    pub seams: Vec<[u32; 2]>,
}

impl Node {
    /// Words for each vertex besides its id, position, depth and normal.
    pub fn value_words(&self) -> usize {
        match self.ids.len() {
            0 => 0,
            count => self.values.len() / count,
        }
    }

    /// True if the vertex has triangles outside of a node at this depth, and must not be removed in it.
    pub fn is_locked(&self, vertex: usize, depth: u32) -> bool {
        u32::from(self.depths[vertex]) < depth
    }

    /// All words.
    pub fn to_words(&self) -> Vec<LevelWord> {
        let counts = [self.ids.len(), self.triangles.len(), self.seams.len()];
        let mut words: Vec<u32> = counts.iter().map(|count| *count as u32).collect();
        words.push(self.value_words() as u32);
        words.extend_from_slice(&self.ids);
        words.extend_from_slice(self.points.as_flattened());
        let packed = self.depths.iter().zip(&self.normals).zip(&self.rounding);
        words.extend(packed.map(|((depth, [x, y]), bits)| {
            u32::from_le_bytes([*depth, x.cast_unsigned(), y.cast_unsigned(), *bits])
        }));
        words.extend_from_slice(&self.values);
        words.extend_from_slice(self.triangles.as_flattened());
        words.extend_from_slice(self.seams.as_flattened());
        bytemuck::allocation::cast_vec(words)
    }

    /// The node of these words, which have a checksum.
    pub fn of_words(words: &[LevelWord]) -> Self {
        let words: &[u32] = bytemuck::cast_slice(words);
        let [vertices, triangles, seams, values, rest @ ..] = words else {
            return Self::default();
        };
        let mut rest = rest;
        let mut take = |count: usize| {
            let (taken, left) = rest.split_at(count.min(rest.len()));
            rest = left;
            taken
        };
        let vertices = *vertices as usize;
        let ids = take(vertices).to_vec();
        let points = take(3 * vertices).as_chunks().0.to_vec();
        let packed: Vec<[u8; 4]> = take(vertices).iter().map(|w| w.to_le_bytes()).collect();
        let normal = |word: &[u8; 4]| [word[1].cast_signed(), word[2].cast_signed()];
        Self {
            ids,
            points,
            depths: packed.iter().map(|word| word[0]).collect(),
            rounding: packed.iter().map(|word| word[3]).collect(),
            normals: packed.iter().map(normal).collect(),
            values: take(vertices * *values as usize).to_vec(),
            triangles: take(3 * *triangles as usize).as_chunks().0.to_vec(),
            seams: take(2 * *seams as usize).as_chunks().0.to_vec(),
        }
    }

    /// The vertices that these triangles use, in the order in which they do, and the triangles.
    pub fn with_triangles(&self, triangles: &[[u32; 3]]) -> Self {
        let mut new = vec![u32::MAX; self.ids.len()];
        let each = self.value_words();
        let mut made = Self {
            triangles: Vec::with_capacity(triangles.len()),
            ..Self::default()
        };
        for triangle in triangles {
            made.triangles.push(triangle.map(|corner| {
                let old = corner as usize;
                if new[old] == u32::MAX {
                    new[old] = made.ids.len() as u32;
                    made.ids.push(self.ids[old]);
                    made.points.push(self.points[old]);
                    made.depths.push(self.depths[old]);
                    made.rounding.push(self.rounding[old]);
                    made.normals.push(self.normals[old]);
                    let values = &self.values[old * each..][..each];
                    made.values.extend_from_slice(values);
                }
                new[old]
            }));
        }
        let seams = self.seams.iter().map(|ends| ends.map(|e| new[e as usize]));
        let seams = seams.filter(|ends| !ends.contains(&u32::MAX));
        made.seams = seams.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        made.seams.sort_unstable();
        made
    }

    /// The least and largest position.
    pub fn bounds(&self) -> Bounds {
        self.points.iter().fold(Bounds::EMPTY, |b, p| b.with(*p))
    }

    /// The positions, rounded as far as each is.
    pub fn rounded(&self) -> impl Iterator<Item = [u32; 3]> {
        let all = self.points.iter().zip(&self.rounding);
        all.map(|(point, bits)| rounded(*point, *bits))
    }
}

/// Squared distance of two positions.
pub(super) fn squared(p: [u32; 3], q: [u32; 3]) -> f64 {
    let sides = (0..3).map(|axis| f64::from(p[axis].abs_diff(q[axis])));
    sides.map(|side| side * side).sum()
}

/// The least and largest position on the lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(super) struct Bounds {
    pub min: [u32; 3],
    pub max: [u32; 3],
}

impl Bounds {
    pub const EMPTY: Self = Self {
        min: [u32::MAX; 3],
        max: [0; 3],
    };

    pub fn with(self, point: [u32; 3]) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(point[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(point[axis])),
        }
    }

    pub fn joined(self, other: Self) -> Self {
        match other.min[0] > other.max[0] {
            true => self,
            false => self.with(other.min).with(other.max),
        }
    }

    /// Half of the longest side, rounded up.
    pub fn half(&self) -> u32 {
        let sides = (0..3).map(|axis| self.max[axis].saturating_sub(self.min[axis]));
        sides.max().unwrap_or(0).div_ceil(2)
    }

    pub fn middle(&self) -> [u32; 3] {
        std::array::from_fn(|axis| {
            self.min[axis] + self.max[axis].saturating_sub(self.min[axis]) / 2
        })
    }
}

/// The edges of triangles that have one triangle, by their ends in its direction. Triangles with two equal corners
/// have none.
pub(super) fn open_edges(vertices: usize, triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
    let whole = |t: &&[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    // The other ends of the edges by their smaller ends.
    let mut starts = vec![0u32; vertices + 1];
    for triangle in triangles.iter().filter(whole) {
        for [a, b] in sides(*triangle) {
            starts[a.min(b) as usize + 1] += 1;
        }
    }
    for vertex in 0..vertices {
        starts[vertex + 1] += starts[vertex];
    }
    let mut next = starts.clone();
    let mut ends = vec![(0u32, false); starts[vertices] as usize];
    for triangle in triangles.iter().filter(whole) {
        for [a, b] in sides(*triangle) {
            let at = &mut next[a.min(b) as usize];
            ends[*at as usize] = (a.max(b), a > b);
            *at += 1;
        }
    }
    let mut open = Vec::new();
    for vertex in 0..vertices {
        let ends = &mut ends[starts[vertex] as usize..starts[vertex + 1] as usize];
        ends.sort_unstable();
        for same in ends.chunk_by(|a, b| a.0 == b.0) {
            if let [(end, turned)] = *same {
                let from = vertex as u32;
                open.push(if turned { [end, from] } else { [from, end] });
            }
        }
    }
    open
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node() -> Node {
        Node {
            ids: vec![7, 9, 4, 8],
            points: vec![[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 5]],
            depths: vec![INNER, 0, 3, INNER],
            rounding: vec![0, 7, 28, 1],
            normals: vec![[1, -1], [0, 127], [-127, 3], [5, 6]],
            values: vec![1, 2, 3, 4, 5, 6, 7, 8],
            triangles: vec![[0, 1, 2], [2, 1, 3]],
            seams: vec![[1, 3]],
        }
    }

    #[test]
    fn words_are_read_as_they_were_written() {
        let node = node();
        let read = Node::of_words(&node.to_words());
        assert_eq!(format!("{node:?}"), format!("{read:?}"));
        assert_eq!(Node::of_words(&[]).ids.len(), 0);
        let part = node.with_triangles(&[[3, 2, 1]]);
        assert_eq!(part.ids, [8, 4, 9]);
        assert_eq!(
            (part.seams, part.values),
            (vec![[0, 2]], vec![7, 8, 5, 6, 3, 4])
        );
        let b = node.bounds();
        assert_eq!((b.half(), b.middle()), (3, [0, 0, 2]));
    }

    #[test]
    fn edges_with_one_triangle_are_open() {
        let mut open = open_edges(4, &[[0, 1, 2], [2, 1, 3]]);
        open.sort_unstable();
        assert_eq!(open, [[0, 1], [1, 3], [2, 0], [3, 2]]);
        assert!(open_edges(3, &[[0, 0, 1]]).is_empty());
        let closed = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
        assert!(open_edges(4, &closed).is_empty());
    }
}
