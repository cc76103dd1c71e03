//! Sections 1, 2, 3.1 and 5: ids, neighbours, planes, cells and their triples.

use super::normals::{self, Short};
use super::spacing::Density;
use super::surface::Triangle;
use super::{Radius, Settings};
use outcrop_geom::lattice::COORDINATE_LIMIT;
use outcrop_geom::{Point, distance2, hilbert, sub};
use outcrop_paper::clip::Cell;
use outcrop_paper::plane::{Moments, Plane};
use std::collections::{BTreeMap, BTreeSet};

/// All different points in the order of their ids.
pub fn in_id_order(points: &[Point]) -> Vec<Point> {
    let different: BTreeSet<Point> = points.iter().copied().collect();
    let mut ordered: Vec<Point> = different.into_iter().collect();
    ordered.sort_by_key(|&p| hilbert::encode(p));
    ordered
}

/// The diagonal of the box around the points, in steps.
pub fn diagonal(points: &[Point]) -> f64 {
    let side = |axis: usize| {
        let along = points.iter().map(|p| i64::from(p[axis]));
        along.clone().max().unwrap_or(0) - along.min().unwrap_or(0)
    };
    let squares: i64 = (0..3).map(|axis| side(axis) * side(axis)).sum();
    (squares as f64).sqrt()
}

/// All ids but `i` by (squared distance, id).
pub fn by_distance(points: &[Point], i: usize) -> Vec<usize> {
    let mut others: Vec<usize> = (0..points.len()).filter(|&j| j != i).collect();
    others.sort_by_key(|&j| (distance2(points[i], points[j]), j));
    others
}

pub fn plane_of(points: &[Point], i: usize, neighbors: &[usize]) -> (Moments, Plane) {
    let mut moments = Moments::default();
    for &j in neighbors {
        moments.add(sub(points[j], points[i]));
    }
    (moments, moments.plane())
}

/// One round of smoothing with the plane of exactly the `k` nearest; a point without a plane stays. The
/// rounded offset is added to the position, which is kept on the lattice.
pub fn smooth(points: &[Point], k: usize) -> Vec<Point> {
    let moved = |i: usize| {
        let others = by_distance(points, i);
        let (moments, plane) = plane_of(points, i, &others[..k.min(others.len())]);
        let Some(normal) = plane.normal else {
            return points[i];
        };
        let offset = moments.project(normal);
        std::array::from_fn(|axis| {
            let moved = i64::from(points[i][axis]) + offset[axis].round() as i64;
            moved.clamp(0, COORDINATE_LIMIT - 1) as i32
        })
    };
    (0..points.len()).map(moved).collect()
}

/// True if a point lies too far from its neighbours for a point of the surface.
fn is_off_surface(points: &[Point], i: usize, settings: &Settings, density: &mut Density) -> bool {
    let mut others = by_distance(points, i);
    others.truncate(settings.neighbors);
    let nearest: Vec<Point> = others
        .iter()
        .map(|&j| sub(points[j], points[i]).map(|d| d as i32))
        .collect();
    let (moments, plane, _) = widened_plane(points, i, settings.neighbors, settings.robust);
    plane.normal.is_some() && density.is_off_surface(i, &others, &nearest, &moments)
}

/// The plane of a point, through more neighbours than `k` if these lie on a line or, with `bands`, on a band;
/// and the last of them.
pub fn widened_plane(
    points: &[Point],
    i: usize,
    k: usize,
    bands: bool,
) -> (Moments, Plane, Option<usize>) {
    let others = by_distance(points, i);
    let mut wanted = k;
    loop {
        let used = &others[..wanted.min(others.len())];
        let (moments, plane) = plane_of(points, i, used);
        let enough = if bands { plane.wide } else { plane.spans };
        if enough || wanted >= 8 * k {
            return (moments, plane, used.last().copied());
        }
        wanted *= 2;
    }
}

/// The pairs with which the cell of `i`, which has the normal `given`, makes triples. `diagonal` is that of the whole
/// cloud.
fn corners(
    points: &[Point],
    i: usize,
    given: Option<Short>,
    settings: &Settings,
    diagonal: f64,
) -> Vec<(u32, u32)> {
    let others = by_distance(points, i);
    let (moments, plane, last) = widened_plane(points, i, settings.neighbors, settings.robust);
    let Some(last) = last else {
        return Vec::new();
    };
    let reach2 = distance2(points[i], points[last]);
    let Some(normal) = normals::direction(given, settings, (&moments, &plane), reach2) else {
        return Vec::new();
    };
    let radius = match settings.radius {
        Radius::Auto => 2.0 * (reach2 as f64).sqrt(),
        Radius::Percent(percent) => percent / 100.0 * diagonal,
        Radius::Length(steps) => steps,
    };
    let mut cell = Cell::new(i as u32, normal, radius);
    for &j in &others {
        cell.clip(sub(points[j], points[i]), j as u32);
    }
    let mut seen = Vec::new();
    // A point at the position of a point with lower id has no cell.
    if others.iter().any(|&j| j < i && points[j] == points[i]) {
        return seen;
    }
    cell.triples(|j, l| seen.push((j, l)));
    seen
}

/// For each triple the number of its cells, without triples with a point off the surface; and the number of
/// such points.
pub fn triples(
    points: &[Point],
    settings: &Settings,
    diagonal: f64,
    density: Option<&mut Density>,
) -> (BTreeMap<Triangle, u32>, usize) {
    let none = vec![None; points.len()];
    triples_given(points, &none, settings, diagonal, density)
}

/// As [`triples`], of points that have normals.
pub fn triples_given(
    points: &[Point],
    given: &[Option<Short>],
    settings: &Settings,
    diagonal: f64,
    mut density: Option<&mut Density>,
) -> (BTreeMap<Triangle, u32>, usize) {
    let off: Vec<bool> = (0..points.len())
        .map(|i| match &mut density {
            Some(density) => is_off_surface(points, i, settings, density),
            None => false,
        })
        .collect();
    let mut cells_of: BTreeMap<Triangle, BTreeSet<u32>> = BTreeMap::new();
    for i in (0..points.len()).filter(|&i| !off[i]) {
        for (j, l) in corners(points, i, given[i], settings, diagonal) {
            let mut triple = [i as u32, j, l];
            triple.sort_unstable();
            if triple.iter().any(|&v| off[v as usize]) {
                continue;
            }
            cells_of.entry(triple).or_default().insert(i as u32);
        }
    }
    let counted = cells_of
        .into_iter()
        .map(|(triple, cells)| (triple, cells.len() as u32));
    (counted.collect(), off.iter().filter(|off| **off).count())
}
