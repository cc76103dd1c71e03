//! The distance between a tile and its children, measured both ways.
//!
//! From the finer surface to the coarser it is measured at all vertices, at the centres of all triangles and in the
//! middles of their edges; from the coarser to the finer at points all over its triangles, about as
//! dense as the vertices of the finer. Each is the exact distance of a point to the nearest triangle. Only the
//! largest matters, so points that are certainly nearer are passed over: those near a vertex that both surfaces have.

use super::nearest::{Hint, Surface, Tree, V3};

/// Squared distance of two points.
fn squared(p: V3, q: V3) -> f64 {
    let (x, y, z) = (p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    x * x + y * y + z * z
}

fn longest([a, b, c]: [V3; 3]) -> f64 {
    squared(a, b).max(squared(b, c)).max(squared(c, a)).sqrt()
}

/// A point of a triangle is at most this times its longest edge from the nearest corner.
const REACH: f64 = 0.577_350_27;

/// Most parts into which an edge of a coarse triangle is divided by points.
const PARTS: usize = 6;

/// The largest distance of points of either surface from the other. The coarser has vertices of the finer, in the
/// same list.
pub(super) fn measure(fine: Surface<'_>, coarse: Surface<'_>) -> f64 {
    if fine.triangles.is_empty() {
        return 0.0;
    }
    if coarse.triangles.is_empty() {
        return f64::INFINITY;
    }
    let from_fine = from_fine(fine, coarse);
    from_coarse(fine, coarse, from_fine)
}

fn between(corners: [V3; 3], weights: V3) -> V3 {
    std::array::from_fn(|k| (0..3).map(|n| weights[n] * corners[n][k]).sum())
}

/// The largest distance of points of the coarser surface from the finer one, which has all of its corners; at least
/// `farthest`.
fn from_coarse(fine: Surface<'_>, coarse: Surface<'_>, farthest: f64) -> f64 {
    let mut farthest = farthest;
    let mut search = None;
    let boundary = at_boundary(coarse);
    for number in 0..coarse.triangles.len() {
        let corners = coarse.corners(number);
        let edge = longest(corners);
        if edge * REACH <= farthest {
            continue;
        }
        let (tree, spacing, hint) = search.get_or_insert_with(|| {
            let sides = (0..fine.triangles.len()).map(|number| longest(fine.corners(number)));
            let spacing = sides.sum::<f64>() / fine.triangles.len() as f64;
            (Tree::new(fine), spacing.max(1e-9), Hint::default())
        });
        let parts = ((edge / *spacing).ceil() as usize).clamp(2, PARTS);
        let triangle = coarse.triangles[number];
        let passed = SIDES.map(|ends| is_of_other(ends.map(|k| triangle[k]), &boundary));
        for i in 0..=parts {
            for j in 0..=parts - i {
                let k = parts - i - j;
                let at = [i, j, k];
                let on_passed = |side: usize| passed[side] && at[(side + 2) % 3] == 0;
                if at.contains(&parts) || (0..3).any(on_passed) {
                    continue;
                }
                let p = between(corners, at.map(|w| w as f64 / parts as f64));
                let within2 = farthest * farthest;
                if corners.iter().all(|corner| squared(*corner, p) > within2) {
                    farthest = farthest.max(tree.distance(p, farthest, hint));
                }
            }
        }
    }
    farthest
}

/// Rounds in which distances from vertices that were kept are passed on to neighbours.
const ROUNDS: usize = 3;

/// For each vertex of the finer surface a distance within which there is one that the coarser has, along edges.
fn near_kept(fine: Surface<'_>, beside: &[u32]) -> Vec<f32> {
    let start = |beside: &u32| match *beside {
        NONE => f32::INFINITY,
        _ => 0.0,
    };
    let mut near: Vec<f32> = beside.iter().map(start).collect();
    for _ in 0..ROUNDS {
        for triangle in fine.triangles {
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                let [a, b] = [triangle[a] as usize, triangle[b] as usize];
                let apart = near[a] - near[b];
                // Equal ones, also if both are not known, cannot be nearer by way of each other.
                if apart != 0.0 && !apart.is_nan() {
                    let edge2 = squared(fine.points[a], fine.points[b]) as f32;
                    if apart * apart > edge2 {
                        let least = (near[a].min(near[b]) + edge2.sqrt()) * 1.000_001;
                        near[a] = near[a].min(least);
                        near[b] = near[b].min(least);
                    }
                }
            }
        }
    }
    near
}

/// No triangle.
const NONE: u32 = u32::MAX;

/// For each vertex of the finer surface that the coarser has, one of its triangles there.
fn beside_kept(fine: Surface<'_>, coarse: Surface<'_>) -> Vec<u32> {
    let mut beside = vec![NONE; fine.points.len()];
    for (triangle, number) in coarse.triangles.iter().zip(0..) {
        triangle.iter().for_each(|v| beside[*v as usize] = number);
    }
    beside
}

/// For each vertex whether it is an end of an edge of one triangle: then the next corners of its triangles are not all
/// the last ones of others.
fn at_boundary(fine: Surface<'_>) -> Vec<bool> {
    let mut turns = vec![0u32; fine.points.len()];
    for [a, b, c] in fine.triangles.iter().copied() {
        for [v, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
            let turn = &mut turns[v as usize];
            *turn = turn.wrapping_add(next).wrapping_sub(last);
        }
    }
    turns.into_iter().map(|turn| turn != 0).collect()
}

/// The sides of a triangle: side `n` has no part of corner `n + 2`.
const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// True for a side whose points are those of the triangle on its other side.
fn is_of_other([a, b]: [u32; 2], boundary: &[bool]) -> bool {
    a > b && !(boundary[a as usize] && boundary[b as usize])
}

/// The largest distance of points of the finer surface from the coarser.
///
/// The distance from one triangle is convex: if its triangle is near enough to all ends of an edge, it is to the middle,
/// too. So each vertex has a coarse triangle that is near enough, and most other points need not be looked for.
fn from_fine(fine: Surface<'_>, coarse: Surface<'_>) -> f64 {
    let mut beside = beside_kept(fine, coarse);
    let near = near_kept(fine, &beside);
    let (tree, mut hint) = (Tree::new(coarse), Hint::default());
    let mut farthest = 0.0f64;
    let mut look = |vertex: usize| {
        if f64::from(near[vertex]) > farthest {
            let distance = tree.distance(fine.points[vertex], farthest, &mut hint);
            if distance > farthest {
                farthest = distance;
            } else {
                beside[vertex] = hint.1 as u32;
            }
        }
    };
    // A few first, so that most others can be passed over.
    (0..fine.points.len()).step_by(61).for_each(&mut look);
    (0..fine.points.len()).for_each(&mut look);
    let is_beside = |number: u32, v: u32| {
        number != NONE
            && (beside[v as usize] == number || coarse.triangles[number as usize].contains(&v))
    };
    let boundary = at_boundary(fine);
    for (number, triangle) in fine.triangles.iter().enumerate() {
        let corners = fine.corners(number);
        let nearest = triangle.map(|v| f64::from(near[v as usize]));
        if nearest.into_iter().fold(f64::INFINITY, f64::min) + longest(corners) <= farthest {
            continue;
        }
        for (weights, ends) in SAMPLES {
            let all = ends.iter().map(|k| triangle[*k]);
            let mut found = all.clone().map(|v| beside[v as usize]);
            if found.any(|t| all.clone().all(|v| is_beside(t, v))) {
                continue;
            }
            if let [a, b] = *ends
                && is_of_other([a, b].map(|k| triangle[k]), &boundary)
            {
                continue;
            }
            let p = between(corners, weights);
            let mut bounds = corners.iter().zip(nearest);
            if bounds.all(|(corner, near)| near + squared(*corner, p).sqrt() > farthest) {
                farthest = farthest.max(tree.distance(p, farthest, &mut hint));
            }
        }
    }
    farthest
}

/// Points of a fine triangle, and the corners between which they are: its centre, and the middles of its edges.
const SAMPLES: [(V3, &[usize]); 4] = [
    ([1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0], &[0, 1, 2]),
    ([0.5, 0.5, 0.0], &[0, 1]),
    ([0.0, 0.5, 0.5], &[1, 2]),
    ([0.5, 0.0, 0.5], &[2, 0]),
];
