//! Samples of meshes, uniform in area.

use oorandom::Rand64;
use outcrop_ply::Mesh;

/// A vector.
pub(crate) type V3 = [f64; 3];

/// A place on a mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) place: V3,
    pub(crate) normal: V3,
}

pub(crate) fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Twice the area, and the unit normal.
fn normal([a, b, c]: &[V3; 3]) -> (f64, V3) {
    let [u, v]: [V3; 2] = [b, c].map(|p| std::array::from_fn(|k| p[k] - a[k]));
    let n = [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ];
    let length = dot(n, n).sqrt();
    (length, n.map(|c| c / length.max(f64::MIN_POSITIVE)))
}

/// As many samples as are asked for; none of a mesh without an area.
pub(crate) fn sample(mesh: &Mesh, count: usize, seed: u128) -> Vec<Sample> {
    let corners = |t: &[u32; 3]| t.map(|v| mesh.vertices[v as usize]);
    let mut sums = Vec::with_capacity(mesh.triangles.len());
    let mut total = 0.0;
    for triangle in &mesh.triangles {
        total += normal(&corners(triangle)).0;
        sums.push(total);
    }
    if !(total > 0.0 && total.is_finite()) {
        return Vec::new();
    }
    let mut random = Rand64::new(seed);
    let mut one = || {
        let at = random.rand_float() * total;
        let number = sums.partition_point(|sum| *sum <= at).min(sums.len() - 1);
        let triangle = corners(&mesh.triangles[number]);
        let (root, v) = (random.rand_float().sqrt(), random.rand_float());
        let weights = [1.0 - root, root * (1.0 - v), root * v];
        let sum = |k: usize| {
            (0..3)
                .map(|corner| weights[corner] * triangle[corner][k])
                .sum()
        };
        Sample {
            place: [0, 1, 2].map(sum),
            normal: normal(&triangle).1,
        }
    };
    (0..count).map(|_| one()).collect()
}
