use super::*;
use crate::order::Orderer;
use outcrop_cloudgen::{Cloud, Generator, Kind, Sampling};
use outcrop_geom::distance2;

/// Lattice steps in a unit, and the shift of a cloud's centre.
const STEPS: f64 = 100_000.0;
const SHIFT: f64 = 2000.0;

fn points(generator: &Generator) -> Vec<Point> {
    let place = |p: [f64; 3]| p.map(|c| ((c + SHIFT) * STEPS) as i32);
    generator.iter().map(place).collect()
}

fn coordinates(point: Point) -> [f64; 3] {
    point.map(|c| f64::from(c) / STEPS - SHIFT)
}

fn kept(points: &[Point], factor: f64, tile: u32, page: usize) -> (Vec<Point>, OutlierStats) {
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let orderer = Orderer::new(&workspace).unwrap();
    orderer.push(&workspace, points).unwrap();
    let (stored, _) = orderer.finish(&workspace, page).unwrap();
    let options = OutlierOptions {
        factor,
        block: 1 << 16,
        tile,
    };
    let (stored, stats) = drop_outliers(stored, options, &workspace).unwrap();
    let store = stored.open(&workspace).unwrap();
    (store.slice(0..store.len()).unwrap(), stats)
}

#[test]
fn far_outliers_go_and_the_surface_stays() {
    for kind in [Kind::Sphere, Kind::Torus, Kind::Bumpy, Kind::Plane] {
        let cloud = Cloud::new(kind).points(60_000).outliers(0.01);
        let generator = cloud.generator().unwrap();
        let all = points(&generator);
        let (left, _) = kept(&all, 5.0, 1 << 16, 256);
        let far = |points: &[Point], least: f64| {
            let far = |p: &&Point| generator.distance(coordinates(**p)) > least;
            points.iter().filter(far).count()
        };
        let (before, after) = (far(&all, 50.0), far(&left, 50.0));
        let lost = (all.len() - far(&all, 0.1)) - (left.len() - far(&left, 0.1));
        assert!(
            after * 100 <= before,
            "{kind}: {after} of {before} far ones left"
        );
        assert!(
            lost * 1000 < all.len(),
            "{kind}: {lost} points of the surface lost"
        );
    }
}

#[test]
fn clean_clouds_stay() {
    for kind in [
        Kind::Sphere,
        Kind::Plane,
        Kind::Terrain,
        Kind::Room,
        Kind::Corner,
    ] {
        for sampling in [Sampling::Uniform, Sampling::Regular] {
            let cloud = Cloud::new(kind).points(30_000).sampling(sampling);
            let all = points(&cloud.generator().unwrap());
            let (left, stats) = kept(&all, 5.0, 1 << 16, 256);
            assert!(
                (all.len() - left.len()) * 1000 <= all.len(),
                "{kind}: {stats:?}"
            );
        }
    }
}

#[test]
fn small_clusters_go_however_they_are_worked_on() {
    let cloud = Cloud::new(Kind::Sphere).points(20_000);
    let surface = points(&cloud.generator().unwrap());
    let mut all = surface.clone();
    for cluster in 0..6 {
        let at = [0, 1, 2].map(|k| ((cluster * 7 + k * 3) % 11) * 30_000_000 + 5_000_000);
        // One to five points, closer together than points of the surface.
        for n in 0..1 + cluster % 5 {
            all.push([at[0] + 9000 * n, at[1] - 7000 * n, at[2] + 100 * n]);
        }
    }
    let (left, stats) = kept(&all, 5.0, 1 << 16, 256);
    assert_eq!(stats.dropped as usize, all.len() - surface.len());
    let mut sorted = [left.clone(), surface];
    sorted.iter_mut().for_each(|points| points.sort_unstable());
    assert_eq!(sorted[0], sorted[1]);
    for (tile, page) in [(700, 256), (5000, 16), (97, 7)] {
        assert_eq!(kept(&all, 5.0, tile, page), (left.clone(), stats));
    }
}

#[test]
fn it_is_what_the_definition_says() {
    let cloud = Cloud::new(Kind::Torus)
        .points(1500)
        .outliers(0.05)
        .noise(4.0);
    let mut all = points(&cloud.generator().unwrap());
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let orderer = Orderer::new(&workspace).unwrap();
    orderer.push(&workspace, &all).unwrap();
    let (stored, _) = orderer.finish(&workspace, 256).unwrap();
    let store = stored.open(&workspace).unwrap();
    all = store.slice(0..store.len()).unwrap();
    loop {
        let near = |i: usize| {
            let others = (0..all.len()).filter(|&j| j != i);
            let mut near: Vec<_> = others.map(|j| (distance2(all[i], all[j]), j)).collect();
            near.sort_unstable();
            near
        };
        let near: Vec<_> = (0..all.len()).map(near).collect();
        let spacing = |i: usize| {
            let sum: f64 = near[i][..8].iter().map(|n| (n.0 as f64).sqrt()).sum();
            (sum / 8.0) as f32
        };
        let stays = |&i: &usize| {
            let mut around: Vec<f32> = near[i][..64].iter().map(|n| spacing(n.1)).collect();
            around.sort_unstable_by(f32::total_cmp);
            f64::from(spacing(i)) <= 2.0 * f64::from(around[32])
        };
        let left: Vec<Point> = (0..all.len()).filter(stays).map(|i| all[i]).collect();
        let done = left.len() == all.len();
        all = left;
        if done {
            break;
        }
    }
    let options = OutlierOptions {
        factor: 2.0,
        block: 1 << 16,
        tile: 400,
    };
    drop(store);
    let (stored, stats) = drop_outliers(stored, options, &workspace).unwrap();
    let store = stored.open(&workspace).unwrap();
    assert!(
        stats.dropped > 50 && stats.rounds < METHOD.outliers.rounds,
        "{stats:?}"
    );
    assert_eq!(store.slice(0..store.len()).unwrap(), all);
}

#[test]
fn too_few_points_have_no_outliers() {
    for count in 3..12i32 {
        let points: Vec<Point> = (0..count).map(|i| [i * i * i, 0, 0]).collect();
        let (left, _) = kept(&points, 1.0, 1 << 16, 256);
        assert!(count > 8 || left.len() == points.len());
    }
}

/// Shows why a point is not compared with its eight nearest: the neighbours of an outlier can be outliers.
#[test]
fn the_eight_nearest_would_not_do() {
    let cloud = Cloud::new(Kind::Torus).points(4000).outliers(0.05);
    let generator = cloud.generator().unwrap();
    let all = points(&generator);
    let nearest = |i: usize| {
        let mut near: Vec<_> = (0..all.len())
            .filter(|&j| j != i)
            .map(|j| (distance2(all[i], all[j]), j))
            .collect();
        near.select_nth_unstable(7);
        near.truncate(8);
        near
    };
    let near: Vec<_> = (0..all.len()).map(nearest).collect();
    let spacing = |i: usize| near[i].iter().map(|n| (n.0 as f64).sqrt()).sum::<f64>();
    let stays = |i: &usize| {
        let mut around: Vec<f64> = near[*i].iter().map(|n| spacing(n.1)).collect();
        around.sort_unstable_by(f64::total_cmp);
        spacing(*i) <= 5.0 * around[4]
    };
    let far = |p: &Point| generator.distance(coordinates(*p)) > 150.0;
    let before = all.iter().filter(|p| far(p)).count();
    let of_eight = (0..all.len())
        .filter(stays)
        .filter(|&i| far(&all[i]))
        .count();
    let of_many = kept(&all, 5.0, 1 << 16, 256).0;
    let of_many = of_many.iter().filter(|p| far(p)).count();
    let told = format!("{before} far: {of_eight} left by eight, {of_many} by more");
    assert!(of_eight * 2 > before && of_many * 20 < before, "{told}");
}
