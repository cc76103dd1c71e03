//! Where the nodes of a scene put its meshes.

use super::document::{Document, Node};

/// A map of positions: three rows of four numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Matrix([[f64; 4]; 3]);

/// From y up to z up.
const Z_UP: Matrix = Matrix([
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, -1.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
]);

impl Matrix {
    /// The map of a node.
    fn of(node: &Node) -> Self {
        if let Some(m) = node.matrix {
            return Self([0, 1, 2].map(|row| [m[row], m[4 + row], m[8 + row], m[12 + row]]));
        }
        let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let scale = node.scale.unwrap_or([1.0; 3]);
        let shift = node.translation.unwrap_or_default();
        let turn = [
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y - z * w),
                2.0 * (x * z + y * w),
            ],
            [
                2.0 * (x * y + z * w),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z - x * w),
            ],
            [
                2.0 * (x * z - y * w),
                2.0 * (y * z + x * w),
                1.0 - 2.0 * (x * x + y * y),
            ],
        ];
        Self([0, 1, 2].map(|row| {
            let [a, b, c] = turn[row];
            [a * scale[0], b * scale[1], c * scale[2], shift[row]]
        }))
    }

    /// This after `inner`.
    fn after(&self, inner: &Self) -> Self {
        Self(self.0.map(|row| {
            std::array::from_fn(|column| {
                let sum = (0..3).fold(0.0, |sum, k| libm::fma(row[k], inner.0[k][column], sum));
                if column == 3 { sum + row[3] } else { sum }
            })
        }))
    }

    pub fn apply(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        self.0.map(|[a, b, c, d]| a * x + b * y + c * z + d)
    }

    /// True if the map turns what is in front of a triangle to its back.
    pub fn mirrors(&self) -> bool {
        let [[a, b, c, _], [d, e, f, _], [g, h, i, _]] = self.0;
        a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0.0
    }
}

/// A mesh at its place.
pub(super) struct Placed {
    pub mesh: usize,
    pub matrix: Matrix,
}

/// Place, what was found, what was expected.
type Wrong = (&'static str, String, &'static str);

/// All meshes of the scene; of a document without scenes, those of all nodes that are no children.
pub(super) fn placed(document: &Document) -> Result<Vec<Placed>, Wrong> {
    let nodes = &document.nodes;
    let roots = match document.scenes.get(document.scene) {
        Some(scene) => scene.nodes.clone(),
        None => {
            let mut is_child = vec![false; nodes.len()];
            let children = nodes.iter().flat_map(|node| &node.children);
            for child in children {
                if let Some(is_child) = is_child.get_mut(*child) {
                    *is_child = true;
                }
            }
            (0..nodes.len()).filter(|node| !is_child[*node]).collect()
        }
    };
    let mut all = Vec::new();
    let mut seen = vec![false; nodes.len()];
    let mut due: Vec<_> = roots.into_iter().rev().map(|root| (root, Z_UP)).collect();
    while let Some((number, above)) = due.pop() {
        let Some(node) = nodes.get(number) else {
            return Err(("nodes", format!("node {number}"), "a node of the document"));
        };
        if std::mem::replace(&mut seen[number], true) {
            let found = format!("node {number} below two nodes");
            return Err(("nodes", found, "a tree"));
        }
        let matrix = above.after(&Matrix::of(node));
        if let Some(mesh) = node.mesh {
            if mesh >= document.meshes.len() {
                return Err(("nodes", format!("mesh {mesh}"), "a mesh of the document"));
            }
            all.push(Placed { mesh, matrix });
        }
        due.extend(node.children.iter().rev().map(|child| (*child, matrix)));
    }
    Ok(all)
}
