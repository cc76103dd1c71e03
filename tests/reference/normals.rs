//! Section 1.6: normals that points bring.

use super::outside::{Known, Scanner};
use super::{Given, Settings};
use outcrop_geom::{Point, sub};
use outcrop_paper::plane::{Moments, Plane};

/// The short form of a normal.
pub type Short = [i32; 3];

/// The short form of a direction, if it is one.
pub fn short(direction: [f64; 3]) -> Option<Short> {
    let most = direction.map(f64::abs).into_iter().fold(0.0, f64::max);
    if direction.iter().any(|x| !x.is_finite()) || most == 0.0 {
        return None;
    }
    let [x, y, z] = direction.map(|x| x / most);
    let length = (x * x + y * y + z * z).sqrt();
    Some([x, y, z].map(|x| (x / length * 32767.0).round() as i32))
}

/// True if a point has a normal and those beside it agree with its side.
fn agrees(points: &[Point], normals: &[Option<Short>], id: usize, block: u32) -> bool {
    let Some(own) = normals[id] else { return false };
    let same_block = |other: &usize| *other as u32 / block == id as u32 / block;
    let run = (id + 1..(id + 16).min(normals.len())).filter(same_block);
    let beside = |other: &usize| {
        let d = sub(points[*other], points[id]).map(i128::from);
        let n = own.map(i128::from);
        let dot = |a: [i128; 3], b: [i128; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        16 * dot(d, n) * dot(d, n) <= dot(d, d) * dot(n, n)
    };
    let others: Vec<Short> = run
        .filter(beside)
        .filter_map(|other| normals[other])
        .collect();
    let dot = |a: Short| {
        (0..3)
            .map(|k| i64::from(own[k]) * i64::from(a[k]))
            .sum::<i64>()
    };
    let against = others.iter().filter(|other| dot(**other) <= 0).count();
    others.len() >= 6 && 4 * against <= others.len()
}

/// True if the normals tell which side is out, of points before smoothing.
pub fn oriented(points: &[Point], normals: &[Option<Short>], block: u32) -> bool {
    let sampled: Vec<usize> = (0..normals.len())
        .filter(|id| id % 64 == 0 && normals[*id].is_some())
        .collect();
    let agreeing = sampled
        .iter()
        .filter(|id| agrees(points, normals, **id, block))
        .count();
    let down = sampled
        .iter()
        .any(|id| normals[*id].is_some_and(|n| n[2] < 0));
    down && 4 * agreeing >= sampled.len()
}

/// What is known of the points that have a scanner or a normal. `shape` has their positions, `oriented` says if the
/// normals are.
pub fn told(
    shape: &[Point],
    oriented: bool,
    scanners: &[Option<Scanner>],
    normals: &[Option<Short>],
    settings: &Settings,
) -> Vec<Option<Known>> {
    let counts = settings.robust && oriented;
    let side = |id: usize| match normals[id].filter(|_| counts) {
        Some(normal) => {
            let n = normal.map(f64::from);
            let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
            let unit = n.map(|x| x / length);
            let sure = agrees(shape, normals, id, settings.block);
            Some(Known::Normal(unit, sure))
        }
        None => scanners[id].map(Known::Place),
    };
    (0..normals.len()).map(side).collect()
}

/// The direction of a disk, and true if it is that of the point's normal although there is a plane.
pub fn direction(
    given: Option<Short>,
    settings: &Settings,
    (moments, plane): (&Moments, &Plane),
    reach2: u64,
) -> Option<[i32; 3]> {
    let given = given.filter(|_| reach2 > 0).map(|n| n.map(|x| 512 * x));
    match (plane.normal, given) {
        (None, given) => given,
        (estimated, None) => estimated,
        (Some(estimated), Some(given)) => {
            let suits = settings.given == Given::Use || moments.suits(estimated, given);
            Some(if suits { given } else { estimated })
        }
    }
}
