//! Parts of scenes. All are anticlockwise as seen from outside.

use std::f64::consts::TAU;

use crate::surface::{Sphere, Surface, Tessellation, patch};
use crate::vec3::{Vec3, add};

/// Adds a mesh to another.
pub(super) fn join(mesh: &mut Tessellation, other: &Tessellation) {
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(&other.vertices);
    let moved = other.triangles.iter().map(|t| t.map(|v| first + v));
    mesh.triangles.extend(moved);
}

/// Turned about the z axis, in radians, then moved.
pub(super) fn placed(mut mesh: Tessellation, angle: f64, place: Vec3) -> Tessellation {
    let (sin, cos) = libm::sincos(angle);
    for v in &mut mesh.vertices {
        let [x, y, z] = *v;
        *v = add([cos * x - sin * y, sin * x + cos * y, z], place);
    }
    mesh
}

/// A box.
pub(super) fn block(low: Vec3, high: Vec3) -> Tessellation {
    let mut boxes = super::boxes::Boxes::default();
    boxes.add(low, high);
    boxes.surface()
}

/// A body over a polygon of which the origin sees every corner: from `bottom` to a height that depends on
/// the place.
pub(super) fn prism(
    profile: &[[f64; 2]],
    bottom: f64,
    top: impl Fn([f64; 2]) -> f64,
) -> Tessellation {
    let mut mesh = Tessellation::default();
    let n = profile.len() as u32;
    mesh.vertices.push([0.0, 0.0, bottom]);
    mesh.vertices.push([0.0, 0.0, top([0.0; 2])]);
    for &[x, y] in profile {
        mesh.vertices.push([x, y, bottom]);
        mesh.vertices.push([x, y, top([x, y])]);
    }
    for i in 0..n {
        let [a, b] = [i, (i + 1) % n].map(|k| 2 + 2 * k);
        mesh.triangles.extend([
            [a, b, b + 1],
            [a, b + 1, a + 1],
            [0, b, a],
            [1, a + 1, b + 1],
        ]);
    }
    mesh
}

/// A round column that may narrow.
pub(super) fn column(radii: [f64; 2], height: f64, sides: usize) -> Tessellation {
    let corner = |i: usize| libm::sincos(TAU * i as f64 / sides as f64);
    let profile: Vec<[f64; 2]> = (0..sides)
        .map(corner)
        .map(|(sin, cos)| [cos, sin])
        .collect();
    let mut mesh = prism(&profile, 0.0, |_| height);
    for (n, v) in mesh.vertices.iter_mut().enumerate() {
        *v = [v[0] * radii[n % 2], v[1] * radii[n % 2], v[2]];
    }
    mesh
}

/// A ball around the origin.
pub(super) fn ball(radius: f64) -> Tessellation {
    let sphere = Sphere::new(1.0);
    let mut mesh = sphere.reference(1e-3);
    let [low, high] = sphere.bounds();
    for v in &mut mesh.vertices {
        *v = v.map(|c| 2.0 * radius * c / (high[0] - low[0]));
    }
    mesh
}

/// A house with a gabled roof over the origin, three units deep in the ground.
pub(super) fn house([width, length]: [f64; 2], wall: f64, roof: f64) -> Tessellation {
    let half = width / 2.0;
    let gable = [
        [-half, -3.0],
        [half, -3.0],
        [half, wall],
        [0.0, wall + roof],
        [-half, wall],
    ];
    let mut mesh = Tessellation::default();
    for y in [-length / 2.0, length / 2.0] {
        mesh.vertices.extend(gable.map(|[x, z]| [x, y, z]));
    }
    for k in 1..4 {
        mesh.triangles
            .extend([[0, k, k + 1], [5, 5 + k + 1, 5 + k]]);
    }
    for a in 0..5 {
        let b = (a + 1) % 5;
        mesh.triangles.extend([[a, 5 + b, b], [a, 5 + a, 5 + b]]);
    }
    mesh
}

/// A height field over a rectangle.
pub(super) fn field(
    low: [f64; 2],
    high: [f64; 2],
    cells: [usize; 2],
    height: impl Fn(f64, f64) -> f64,
) -> Tessellation {
    patch(cells, [false, false], |u, v| {
        let x = low[0] + u * (high[0] - low[0]);
        let y = low[1] + v * (high[1] - low[1]);
        [x, y, height(x, y)]
    })
}

/// The volume that a closed surface encloses; negative if it faces inwards.
#[cfg(test)]
pub(super) fn volume(mesh: &Tessellation) -> f64 {
    use crate::vec3::{cross, dot};
    let part = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
        dot(a, cross(b, c)) / 6.0
    };
    mesh.triangles.iter().map(part).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::topology;

    #[test]
    fn bodies_are_closed_and_face_outwards() {
        let square = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        for (mesh, expected) in [
            (block([0.0; 3], [1.0, 2.0, 3.0]), 6.0),
            (prism(&square, 0.0, |_| 2.0), 8.0),
            (column([1.0, 1.0], 2.0, 256), TAU),
            (ball(1.0), 2.0 * TAU / 3.0),
            (house([2.0, 3.0], 1.0, 1.0), 27.0),
            (
                placed(house([2.0, 3.0], 1.0, 1.0), 1.0, [9.0, 8.0, 7.0]),
                27.0,
            ),
        ] {
            assert_eq!(topology(&mesh), (2, true));
            let found = volume(&mesh);
            assert!(
                (found - expected).abs() < 0.01 * expected,
                "{found} {expected}"
            );
        }
    }
}
