//! Fine triangle meshes of surfaces with a closed form.

use rustc_hash::{FxHashMap, FxHashSet};

use super::tessellate::Tessellation;
use crate::vec3::{Vec3, add, cross, dot, length, scale, sub};

/// Every round halves edges. The limit stops a few slivers that alternate between two shapes with a long
/// edge.
const ROUNDS: usize = 12;

/// Bisects edges, and their triangles, until the middle of every edge is within `tolerance` of the surface.
/// New vertices are on it.
pub(super) fn refine(
    mut mesh: Tessellation,
    tolerance: f64,
    project: impl Fn(Vec3) -> Vec3,
) -> Tessellation {
    // Edges that are flat enough, so that they are not examined again.
    let mut flat: FxHashSet<[u32; 2]> = FxHashSet::default();
    for _ in 0..ROUNDS {
        let mut middles: FxHashMap<[u32; 2], u32> = FxHashMap::default();
        for &[a, b, c] in &mesh.triangles {
            for edge in [[a, b], [b, c], [c, a]].map(sorted) {
                if middles.contains_key(&edge) || flat.contains(&edge) {
                    continue;
                }
                let [p, q] = edge.map(|v| mesh.vertices[v as usize]);
                let middle = scale(add(p, q), 0.5);
                let place = project(middle);
                let bulge = length(sub(place, middle));
                // An arc of more than half a circle is not on this surface: the projection failed.
                if bulge > tolerance && bulge < length(sub(p, q)) / 2.0 {
                    middles.insert(edge, mesh.vertices.len() as u32);
                    mesh.vertices.push(place);
                } else {
                    flat.insert(edge);
                }
            }
        }
        if middles.is_empty() {
            break;
        }
        let mut triangles = Vec::with_capacity(2 * mesh.triangles.len());
        for &[a, b, c] in &mesh.triangles {
            let middles = [[a, b], [b, c], [c, a]].map(|e| middles.get(&sorted(e)).copied());
            cut([a, b, c], middles, &mut triangles);
        }
        mesh.triangles = triangles;
    }
    mesh
}

fn sorted([p, q]: [u32; 2]) -> [u32; 2] {
    [p.min(q), p.max(q)]
}

/// Divides a triangle at the new vertices on its edges, if there are any.
fn cut([a, b, c]: [u32; 3], [ab, bc, ca]: [Option<u32>; 3], out: &mut Vec<[u32; 3]>) {
    match (ab, bc, ca) {
        (None, None, None) => out.push([a, b, c]),
        (Some(ab), None, None) => out.extend([[a, ab, c], [ab, b, c]]),
        (Some(ab), Some(bc), None) => out.extend([[ab, b, bc], [a, ab, bc], [a, bc, c]]),
        (Some(ab), Some(bc), Some(ca)) => {
            out.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        // Rotated until it is one of the cases above.
        _ => cut([b, c, a], [bc, ca, ab], out),
    }
}

/// Orients the triangles of a connected closed surface anticlockwise as seen from outside. Uses neighbours
/// only, since the normals of slivers are unreliable.
pub(super) fn orient(mesh: &mut Tessellation) {
    let mut beside: FxHashMap<[u32; 2], Vec<usize>> = FxHashMap::default();
    for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        for edge in [[a, b], [b, c], [c, a]] {
            beside.entry(sorted(edge)).or_default().push(t);
        }
    }
    let runs = |[a, b, c]: [u32; 3], edge| [[a, b], [b, c], [c, a]].contains(&edge);
    let mut done = vec![false; mesh.triangles.len()];
    let mut next: Vec<usize> = (0..mesh.triangles.len().min(1)).collect();
    done.iter_mut().take(1).for_each(|first| *first = true);
    while let Some(t) = next.pop() {
        let [a, b, c] = mesh.triangles[t];
        for edge in [[a, b], [b, c], [c, a]] {
            for &other in beside.get(&sorted(edge)).into_iter().flatten() {
                if !std::mem::replace(&mut done[other], true) {
                    if runs(mesh.triangles[other], edge) {
                        mesh.triangles[other].swap(1, 2);
                    }
                    next.push(other);
                }
            }
        }
    }
    let volume = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
        dot(a, cross(b, c))
    };
    if mesh.triangles.iter().map(volume).sum::<f64>() < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

/// A grid of `cells` quadrilaterals over the unit square, each divided in two; anticlockwise as seen along
/// `-(du x dv)`. An axis that is `closed` is periodic.
pub(crate) fn patch(
    cells: [usize; 2],
    closed: [bool; 2],
    place: impl Fn(f64, f64) -> Vec3,
) -> Tessellation {
    let nodes = [0, 1].map(|k| cells[k] + usize::from(!closed[k]));
    let mut mesh = Tessellation::default();
    for j in 0..nodes[1] {
        for i in 0..nodes[0] {
            let at = [i, j].map(|k| k as f64);
            mesh.vertices
                .push(place(at[0] / cells[0] as f64, at[1] / cells[1] as f64));
        }
    }
    let node = |i: usize, j: usize| ((j % nodes[1]) * nodes[0] + i % nodes[0]) as u32;
    for j in 0..cells[1] {
        for i in 0..cells[0] {
            let [a, b] = [node(i, j), node(i + 1, j)];
            let [c, d] = [node(i + 1, j + 1), node(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// A flat rectangle with one corner at `low` and sides `u` and `v`, added to a mesh.
pub(super) fn rectangle(mesh: &mut Tessellation, low: Vec3, u: Vec3, v: Vec3) {
    let first = mesh.vertices.len() as u32;
    let far = add(add(low, u), v);
    mesh.vertices.extend([low, add(low, u), far, add(low, v)]);
    let corner = |k| first + k;
    mesh.triangles.extend([
        [corner(0), corner(1), corner(2)],
        [corner(0), corner(2), corner(3)],
    ]);
}

#[cfg(test)]
mod tests {
    use super::super::tessellate::topology;
    use super::*;
    use crate::vec3::normalize;
    use std::f64::consts::TAU;

    #[test]
    fn a_closed_patch_is_a_torus() {
        let mesh = patch([7, 5], [true, true], |u, v| [u, v, 0.0]);
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (35, 70));
        assert_eq!(topology(&mesh), (0, true));
    }

    #[test]
    fn refining_keeps_the_topology() {
        let round = |u: f64, v: f64| {
            let ring = 2.0 + libm::cos(TAU * v);
            [
                ring * libm::cos(TAU * u),
                ring * libm::sin(TAU * u),
                libm::sin(TAU * v),
            ]
        };
        let onto = |p: Vec3| {
            let ring = libm::hypot(p[0], p[1]);
            let middle = [2.0 * p[0] / ring, 2.0 * p[1] / ring, 0.0];
            add(middle, normalize(sub(p, middle)))
        };
        let fine = refine(patch([9, 7], [true, true], round), 1e-3, onto);
        assert_eq!(topology(&fine), (0, true));
        let count = fine.triangles.len();
        assert!((1000..100_000).contains(&count), "{count}");
        for t in &fine.triangles {
            let [a, b, c] = t.map(|v| fine.vertices[v as usize]);
            let centre = scale(add(add(a, b), c), 1.0 / 3.0);
            assert!(length(sub(centre, onto(centre))) < 2e-3);
        }
    }
}
