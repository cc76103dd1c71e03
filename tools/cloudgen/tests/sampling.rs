//! Regular and adaptive sampling.

use std::collections::HashMap;

use outcrop_cloudgen::{Cloud, Kind, Order, Sampling};

fn points(cloud: &Cloud) -> Vec<[f64; 3]> {
    cloud.generator().unwrap().iter().collect()
}

/// Distance of every point to its nearest neighbour; none is beyond `reach`.
fn spacing(points: &[[f64; 3]], reach: f64) -> Vec<f64> {
    let cell = |p: &[f64; 3]| p.map(|c| (c / reach).floor() as i64);
    let mut cells: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
    for (i, p) in points.iter().enumerate() {
        cells.entry(cell(p)).or_default().push(i);
    }
    let nearest = |(i, p): (usize, &[f64; 3])| {
        let at = cell(p);
        let mut best = f64::INFINITY;
        for k in 0..27 {
            let near = [at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1];
            for &j in cells.get(&near).into_iter().flatten() {
                let square = p.iter().zip(points[j]).map(|(a, b)| (a - b).powi(2));
                let square: f64 = square.sum();
                if i != j && square < best {
                    best = square;
                }
            }
        }
        best.sqrt()
    };
    points.iter().enumerate().map(nearest).collect()
}

fn least_mean_most(values: &[f64]) -> [f64; 3] {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let fold = |start, pick: fn(f64, f64) -> f64| values.iter().copied().fold(start, pick);
    [fold(f64::INFINITY, f64::min), mean, fold(0.0, f64::max)]
}

#[test]
fn regular_points_keep_their_distance() {
    for kind in [Kind::Sphere, Kind::Torus, Kind::Bumpy] {
        for order in [Order::Random, Order::Sorted] {
            let cloud = Cloud::new(kind).points(8000).order(order);
            let even = cloud.clone().sampling(Sampling::Regular);
            let all = points(&even);
            assert_eq!(all.len(), 8000);
            assert_eq!(all, points(&even), "{kind}");
            assert_ne!(all, points(&even.clone().seed(1)), "{kind}");
            let generator = even.generator().unwrap();
            assert!(all.iter().all(|&p| generator.distance(p) < 1e-8));
            let [least, mean, most] = least_mean_most(&spacing(&all, 60.0));
            let even = least > 0.7 * mean && most < 2.0 * mean;
            assert!(even, "{kind} {order:?}: {least} {mean} {most}");
            let [least, mean, _] = least_mean_most(&spacing(&points(&cloud), 60.0));
            assert!(least < 0.1 * mean, "uniform points do not: {kind}");
        }
    }
}

#[test]
fn adaptive_points_follow_the_curvature() {
    let cloud = Cloud::new(Kind::Bumpy)
        .points(20_000)
        .sampling(Sampling::Adaptive);
    let all = points(&cloud);
    assert_eq!(all.len(), 20_000);
    let mut gaps = spacing(&all, 100.0);
    gaps.sort_by(f64::total_cmp);
    assert!(
        gaps[19_000] > 2.0 * gaps[1000],
        "{} {}",
        gaps[1000],
        gaps[19_000]
    );
    // A sphere has the same curvature everywhere.
    let sphere = Cloud::new(Kind::Sphere).points(3000);
    let adaptive = points(&sphere.clone().sampling(Sampling::Adaptive));
    let [least, mean, most] = least_mean_most(&spacing(&adaptive, 100.0));
    assert!(least > 0.7 * mean && most < 2.0 * mean);
}

#[test]
fn few_points() {
    for sampling in [Sampling::Regular, Sampling::Adaptive] {
        for n in [0, 1, 2, 3, 7] {
            let cloud = Cloud::new(Kind::Torus).points(n).sampling(sampling);
            assert_eq!(points(&cloud).len() as u64, n);
        }
    }
}
