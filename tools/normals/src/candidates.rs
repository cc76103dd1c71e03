//! Other methods for normals, for comparison.

use outcrop_paper::kernels::Level;
use outcrop_paper::plane::{Moments, Plane, least_direction};
use outcrop_stages::tiles::neighbors::Neighbors;

/// A method for normals.
pub(crate) struct Candidate {
    pub(crate) name: &'static str,
    /// Largest number of neighbours, in units of `k`.
    pub(crate) most: usize,
    pub(crate) normal: fn(&Neighbors, usize) -> Option<[f64; 3]>,
}

/// All methods.
pub(crate) const ALL: &[Candidate] = &[
    Candidate {
        name: "wide at 1/9",
        most: 8,
        normal: |near, k| widened(near, k, 1.0 / 9.0, 0.0),
    },
    Candidate {
        name: "wide until flat (4)",
        most: 8,
        normal: |near, k| widened(near, k, 1.0 / 25.0, 4.0),
    },
    Candidate {
        name: "wide until flat (9)",
        most: 8,
        normal: |near, k| widened(near, k, 1.0 / 25.0, 9.0),
    },
    Candidate {
        name: "sectors",
        most: 8,
        normal: sectors,
    },
    Candidate {
        name: "weights of distance",
        most: 8,
        normal: |near, k| reweighted(near, k, 0, Height::None),
    },
    Candidate {
        name: "weights of height, once",
        most: 8,
        normal: |near, k| reweighted(near, k, 1, Height::Plane),
    },
    Candidate {
        name: "weights of height, 3 times",
        most: 8,
        normal: |near, k| reweighted(near, k, 3, Height::Plane),
    },
    Candidate {
        name: "own layer",
        most: 8,
        normal: |near, k| reweighted(near, k, 2, Height::Own),
    },
];

fn differences(near: &Neighbors, count: usize) -> impl Iterator<Item = [f64; 3]> + '_ {
    near.iter()
        .take(count)
        .map(|n| n.difference.map(|c| c as f64))
}

fn taken(near: &Neighbors, count: usize) -> (Moments, Plane) {
    let moments = near.moments(count.min(near.len()), Level::best());
    (moments, moments.plane())
}

/// Number of neighbours for the plane of a cell in the robust method.
fn count_on_lines(near: &Neighbors, k: usize) -> usize {
    let mut count = k;
    while count < 8 * k && !taken(near, count).1.wide {
        count *= 2;
    }
    count.min(near.len())
}

/// Eigenvalues, ascending.
fn eigenvalues(near: &Neighbors, count: usize) -> [f64; 3] {
    let mut s = scatter(
        differences(near, count)
            .map(|d| (d, 1.0))
            .chain([([0.0; 3], 1.0)]),
    )
    .0;
    let largest = s[0].max(s[1]).max(s[2]);
    s = s.map(|x| x / largest);
    // The trigonometric solution is accurate enough for a measurement.
    let q = (s[0] + s[1] + s[2]) / 3.0;
    let off = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
    let p2 = (s[0] - q).powi(2) + (s[1] - q).powi(2) + (s[2] - q).powi(2) + 2.0 * off;
    let p = (p2 / 6.0).sqrt();
    if p == 0.0 {
        return [q; 3];
    }
    let b = [
        (s[0] - q) / p,
        (s[1] - q) / p,
        (s[2] - q) / p,
        s[3] / p,
        s[4] / p,
        s[5] / p,
    ];
    let det = b[0] * (b[1] * b[2] - b[5] * b[5]) - b[3] * (b[3] * b[2] - b[5] * b[4])
        + b[4] * (b[3] * b[5] - b[1] * b[4]);
    let phi = (det / 2.0).clamp(-1.0, 1.0).acos() / 3.0;
    let top = q + 2.0 * p * phi.cos();
    let least = q + 2.0 * p * (phi + 2.0 * std::f64::consts::FRAC_PI_3).cos();
    [least.max(0.0), 3.0 * q - top - least, top]
}

/// As for cells, but until the middle eigenvalue is `line` times the largest, and `flat` times the least.
fn widened(near: &Neighbors, k: usize, line: f64, flat: f64) -> Option<[f64; 3]> {
    let mut count = k;
    while count < 8 * k {
        let [least, middle, top] = eigenvalues(near, count.min(near.len()));
        if middle >= line * top && middle >= flat * least {
            break;
        }
        count *= 2;
    }
    taken(near, count).1.normal.map(|n| n.map(f64::from))
}

/// Weighted scatter about the weighted mean, and that mean.
fn scatter(points: impl Iterator<Item = ([f64; 3], f64)>) -> ([f64; 6], [f64; 3]) {
    let (mut weight, mut sum, mut products) = (0.0, [0.0; 3], [0.0; 6]);
    for (d, w) in points {
        weight += w;
        (0..3).for_each(|k| sum[k] += w * d[k]);
        let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
        (0..6).for_each(|k| products[k] += w * d[pairs[k].0] * d[pairs[k].1]);
    }
    let mean = sum.map(|s| s / weight);
    let crossed = [
        sum[0] * mean[0],
        sum[1] * mean[1],
        sum[2] * mean[2],
        sum[0] * mean[1],
        sum[0] * mean[2],
        sum[1] * mean[2],
    ];
    (std::array::from_fn(|k| products[k] - crossed[k]), mean)
}

#[derive(Clone, Copy, PartialEq)]
enum Height {
    None,
    /// Heights over the plane.
    Plane,
    /// Heights over the point itself.
    Own,
}

/// Planes with weights that fall with distance and with the height over the plane before.
fn reweighted(near: &Neighbors, k: usize, times: u32, height: Height) -> Option<[f64; 3]> {
    let count = count_on_lines(near, k);
    let (moments, plane) = taken(near, count);
    let normal = plane.normal?;
    let reach2 = near.get(count.checked_sub(1)?)?.distance2 as f64 * 1.2;
    let near_weight = |d: [f64; 3]| {
        let t = 1.0 - (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / reach2;
        t * t
    };
    let all = || differences(near, count).chain([[0.0; 3]]);
    if height == Height::None {
        let (s, _) = scatter(all().map(|d| (d, near_weight(d))));
        return least_direction(&s).map(|n| n.map(f64::from));
    }
    let mut centre = moments.project(normal);
    let mut normal = normal.map(f64::from);
    for _ in 0..times {
        let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
        let over = |d: [f64; 3]| {
            let base = if height == Height::Plane {
                centre
            } else {
                [0.0; 3]
            };
            ((d[0] - base[0]) * normal[0]
                + (d[1] - base[1]) * normal[1]
                + (d[2] - base[2]) * normal[2])
                / length
        };
        let mean2 = all().map(|d| over(d).powi(2)).sum::<f64>() / (count + 1) as f64;
        let limit2 = if height == Height::Plane { 4.0 } else { 2.0 } * mean2;
        let weight = |d: [f64; 3]| {
            let t = 1.0 - over(d).powi(2) / limit2;
            if t > 0.0 { t * t } else { 0.0 }
        };
        if mean2 == 0.0 {
            break;
        }
        let (s, mean) = scatter(all().map(|d| (d, weight(d))));
        let Some(n) = least_direction(&s) else { break };
        normal = n.map(f64::from);
        centre = mean;
    }
    Some(normal)
}

/// The nearest point in each of eight sectors around the normal of the widest plane.
fn sectors(near: &Neighbors, k: usize) -> Option<[f64; 3]> {
    if taken(near, k).1.wide {
        return taken(near, k).1.normal.map(|n| n.map(f64::from));
    }
    let count = count_on_lines(near, k);
    let n = taken(near, count).1.normal?.map(f64::from);
    let axis = if n[0].abs() < n[1].abs() {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let u = cross(n, axis);
    let v = cross(n, u);
    let scale = (dot(u, u) / dot(v, v)).sqrt();
    let most = k.div_ceil(8);
    let mut held = [0; 8];
    let mut kept = Vec::new();
    for d in differences(near, 8 * k) {
        let (x, y) = (dot(d, u), dot(d, v) * scale);
        let sector =
            usize::from(x > 0.0) + 2 * usize::from(y > 0.0) + 4 * usize::from(x.abs() > y.abs());
        if held[sector] < most {
            held[sector] += 1;
            kept.push((d, 1.0));
        }
    }
    kept.push(([0.0; 3], 1.0));
    least_direction(&scatter(kept.into_iter()).0).map(|n| n.map(f64::from))
}
