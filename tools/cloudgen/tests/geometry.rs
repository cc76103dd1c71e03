//! Points agree with the ground truth.

use outcrop_cloudgen::{Cloud, Error, Kind, NoiseMode, Order, Sampling};

fn points(cloud: &Cloud) -> Vec<[f64; 3]> {
    cloud.generator().unwrap().iter().collect()
}

fn length(p: [f64; 3]) -> f64 {
    p.iter().map(|c| c * c).sum::<f64>().sqrt()
}

#[test]
fn point_depends_on_description_and_index_only() {
    for kind in Kind::ALL {
        let cloud = Cloud::new(kind)
            .points(500)
            .seed(9)
            .noise(0.5)
            .outliers(0.1)
            .duplicates(0.2);
        let all = points(&cloud);
        assert_eq!(all.len(), 500);
        assert_eq!(all, points(&cloud), "{kind}");
        let generator = cloud.generator().unwrap();
        let mut piece = [[0.0; 3]; 20];
        generator.fill(333, &mut piece);
        assert_eq!(piece, all[333..353], "{kind}");
        assert_ne!(all, points(&cloud.seed(10)), "{kind}");
    }
}

#[test]
fn clean_points_lie_on_the_surface() {
    for kind in Kind::ALL {
        for rotated in [false, true] {
            let offset = [5e5, 5.4e6, 300.0];
            let mut cloud = Cloud::new(kind)
                .points(3000)
                .rotated(rotated)
                .offset(offset);
            for scanlines in [None, Some(8.0)] {
                cloud.scanlines = scanlines.filter(|_| kind != Kind::Grid);
                let generator = cloud.generator().unwrap();
                for p in generator.iter() {
                    let distance = generator.distance(p);
                    assert!(
                        distance < 1e-8,
                        "{kind} {rotated} {scanlines:?}: {distance}"
                    );
                }
            }
        }
    }
}

#[test]
fn size_is_the_diagonal() {
    for kind in Kind::ALL {
        let all = points(&Cloud::new(kind).points(40_000).size(500.0));
        let span = |k: usize| {
            let values = || all.iter().map(|p| p[k]);
            values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
        };
        let diagonal = length([span(0), span(1), span(2)]);
        assert!(
            (0.97..1.15).contains(&(diagonal / 500.0)),
            "{kind}: {diagonal}"
        );
    }
}

#[test]
fn noise_has_the_given_sigma() {
    for mode in [NoiseMode::Normal, NoiseMode::Isotropic] {
        let cloud = Cloud::new(Kind::Torus)
            .points(20_000)
            .noise(0.5)
            .noise_mode(mode);
        let generator = cloud.generator().unwrap();
        let square: f64 = generator
            .iter()
            .map(|p| generator.distance(p).powi(2))
            .sum();
        let sigma = (square / 20_000.0).sqrt();
        assert!((sigma - 0.5).abs() < 0.02, "{mode:?}: {sigma}");
    }
}

#[test]
fn sphere_is_uniform() {
    // 4 longitudes x 8 heights of equal area; chi-squared with 31 degrees of freedom.
    for order in [Order::Random, Order::Sorted] {
        let n = 64_000;
        let mut cells = [0u32; 32];
        for [x, y, z] in points(&Cloud::new(Kind::Sphere).points(n).order(order)) {
            let height = ((z / (1000.0 / 12f64.sqrt()) + 1.0) * 4.0) as usize;
            let quarter = usize::from(x > 0.0) + 2 * usize::from(y > 0.0);
            cells[height.min(7) * 4 + quarter] += 1;
        }
        let expected = n as f64 / 32.0;
        let chi: f64 = cells
            .iter()
            .map(|&c| (f64::from(c) - expected).powi(2) / expected)
            .sum();
        assert!(chi < 70.0, "{order:?}: {chi}");
    }
}

#[test]
fn torus_is_uniform() {
    // The outer half of the tube has the fraction 1/2 + 0.4 / pi of the area.
    let n = 50_000;
    let all = points(&Cloud::new(Kind::Torus).points(n));
    let radius = |p: &[f64; 3]| p[0].hypot(p[1]);
    let top = all.iter().map(radius).fold(0.0, f64::max);
    let outer = all.iter().filter(|p| radius(p) > top / 1.4).count() as f64 / n as f64;
    assert!(
        (outer - (0.5 + 0.4 / std::f64::consts::PI)).abs() < 0.01,
        "{outer}"
    );
}

#[test]
fn grid_is_integer_and_equidistant() {
    for (rotated, unit) in [(false, 1.0), (true, 3.0)] {
        for order in [Order::Random, Order::Sorted] {
            let cloud = Cloud::new(Kind::Grid)
                .points(90)
                .rotated(rotated)
                .order(order);
            let cloud = cloud.offset([500_000.0, 5_400_000.0, 7.0]);
            let all = points(&cloud);
            assert!(all.iter().flatten().all(|c| c.fract() == 0.0));
            let mut nearest = vec![f64::INFINITY; all.len()];
            for (i, p) in all.iter().enumerate() {
                for (j, q) in all.iter().enumerate() {
                    if i != j {
                        let square: f64 = p.iter().zip(q).map(|(a, b)| (a - b) * (a - b)).sum();
                        nearest[i] = nearest[i].min(square);
                    }
                }
            }
            let step = nearest[0].sqrt();
            assert!(step > 0.0 && step % unit == 0.0, "{step}");
            assert!(nearest.iter().all(|&d| d == nearest[0]), "not one distance");
        }
    }
}

#[test]
fn outliers_and_duplicates_have_their_share() {
    let cloud = Cloud::new(Kind::Sphere).points(20_000).outliers(0.1);
    let generator = cloud.generator().unwrap();
    let far = generator
        .iter()
        .filter(|&p| generator.distance(p) > 1.0)
        .count();
    assert!((1850..2100).contains(&far), "{far}");

    let mut all = points(&Cloud::new(Kind::Sphere).points(20_000).duplicates(0.25));
    all.sort_by(|a, b| a.partial_cmp(b).unwrap());
    all.dedup();
    assert!((14_700..15_300).contains(&all.len()), "{}", all.len());
}

#[test]
fn layers_share_the_points() {
    for rotated in [false, true] {
        let cloud = Cloud::new(Kind::Torus)
            .points(2000)
            .rotated(rotated)
            .layers(2, 3.0);
        let generator = cloud.generator().unwrap();
        let near = |p: &[f64; 3], at: f64| (generator.distance(*p) - at).abs() < 1e-8;
        let all: Vec<[f64; 3]> = generator.iter().collect();
        let count = |at| all.iter().filter(|p| near(p, at)).count();
        assert_eq!((count(0.0), count(3.0)), (1000, 1000));
        // The second point is outside.
        let outside = |p: &[f64; 3]| length(*p) > 0.0 && near(p, 3.0);
        let farthest = |points: &mut dyn Iterator<Item = &[f64; 3]>| {
            points.map(|p| length(*p)).fold(0.0, f64::max)
        };
        let inner = farthest(&mut all.iter().filter(|p| near(p, 0.0)));
        assert!(farthest(&mut all.iter().filter(|p| outside(p))) > inner + 2.0);
    }
}

#[test]
fn corner_has_three_equal_plates() {
    let cloud = Cloud::new(Kind::Corner).points(30_000);
    let generator = cloud.generator().unwrap();
    let mut counts = [0; 3];
    for index in 0..generator.len() {
        let normal = generator.sample(index).normal;
        counts[normal.iter().position(|&c| c == 1.0).unwrap()] += 1;
    }
    assert!(
        counts.iter().all(|c| (9700..10_300).contains(c)),
        "{counts:?}"
    );
}

#[test]
fn falloff_follows_the_squared_distance() {
    let cloud = Cloud::new(Kind::Plane)
        .points(60_000)
        .falloff(true)
        .scanner([0.5, 0.5, 0.0]);
    let in_ring = |points: &[[f64; 3]], low: f64, high: f64| {
        points
            .iter()
            .filter(|&&p| (low..high).contains(&length(p)))
            .count() as f64
    };
    let all = points(&cloud);
    // Two rings with the same ratio of radii have the same density times area.
    let (inner, outer) = (in_ring(&all, 60.0, 120.0), in_ring(&all, 150.0, 300.0));
    assert!((inner / outer - 1.0).abs() < 0.05, "{inner} {outer}");
}

#[test]
fn scan_lines_are_denser_along() {
    let ratio = 16.0;
    let all = points(&Cloud::new(Kind::Plane).points(40_000).scanlines(ratio));
    let mut rows: Vec<f64> = all.iter().map(|p| p[1]).collect();
    rows.sort_by(f64::total_cmp);
    rows.dedup();
    // 50 rows of 800 points.
    assert_eq!(rows.len(), 50);
}

#[test]
fn few_points_of_any_kind() {
    for kind in Kind::ALL {
        for n in [0, 1, 2, 3] {
            let mut cloud = Cloud::new(kind).points(n).outliers(0.5);
            assert_eq!(points(&cloud).len() as u64, n);
            cloud.scanlines = Some(1e6).filter(|_| kind != Kind::Grid);
            assert_eq!(points(&cloud).len() as u64, n);
        }
    }
}

#[test]
fn impossible_settings_are_refused() {
    let base = Cloud::new(Kind::Sphere);
    let mut with_mesh = base.clone();
    with_mesh.mesh = Some("some.ply".into());
    let bad = [
        base.clone().size(0.0),
        base.clone().size(f64::NAN),
        base.clone().noise(-1.0),
        base.clone().noise(f64::INFINITY),
        base.clone().outliers(1.0),
        base.clone().duplicates(-0.1),
        base.clone().scanlines(0.5),
        base.clone().offset([0.0, f64::NAN, 0.0]),
        base.clone().points(u64::MAX),
        base.clone().scanner([0.0; 3]),
        base.clone().falloff(true).order(Order::Sorted),
        Cloud::new(Kind::Grid).falloff(true),
        Cloud::new(Kind::Grid).scanlines(2.0),
        Cloud::new(Kind::Grid).size(1e60),
        Cloud::new(Kind::Mesh),
        base.clone().layers(0, 1.0),
        base.clone().layers(2, f64::NAN),
        base.clone().layers(1, 0.5),
        base.clone().sampling(Sampling::Regular).points(1 << 40),
        base.clone().sampling(Sampling::Regular).scanlines(4.0),
        base.clone().sampling(Sampling::Adaptive).falloff(true),
        Cloud::new(Kind::Plane).sampling(Sampling::Adaptive),
        Cloud::new(Kind::Grid).sampling(Sampling::Regular),
        with_mesh,
    ];
    for cloud in bad {
        let error = cloud.generator().unwrap_err();
        let expected = matches!(error, Error::Parameter { .. } | Error::Conflict { .. });
        assert!(expected && !error.to_string().contains('\n'), "{error}");
    }
}
