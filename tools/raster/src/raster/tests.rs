use super::*;
use crate::camera::Framing;
use crate::vec3::{cross, dot};

fn scene() -> (Camera, [Vec3; 4]) {
    let corners = [
        [-1.0, -1.0, 0.0],
        [1.0, -1.0, 0.0],
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
    ];
    let framing = Framing {
        size: [100, 100],
        zoom: 1.0,
        centre: None,
        crop: 0.0,
    };
    (
        Camera::new("top".parse().unwrap(), framing, &corners),
        corners,
    )
}

fn draw(
    raster: &Raster,
    camera: &Camera,
    positions: &[Vec3],
    triangles: &[[usize; 3]],
    cull: bool,
) {
    for (number, t) in triangles.iter().enumerate() {
        let corners = t.map(|v| positions[v]);
        let [a, b, c] = corners;
        let facing = dot(cross(sub(b, a), sub(c, a)), camera.towards) > 0.0;
        if facing || !cull {
            raster.triangle(corners.map(|p| camera.project(p)), || number as u32);
        }
    }
}

fn values(raster: &Raster) -> Vec<Option<u32>> {
    (0..raster.width * raster.height)
        .map(|pixel| raster.value(pixel))
        .collect()
}

fn marked(raster: &Raster, mark: Mark) -> usize {
    let all = 0..raster.width * raster.height;
    all.filter(|pixel| raster.mark(*pixel) == mark).count()
}

#[test]
fn square_fills_its_pixels_once() {
    let (camera, corners) = scene();
    let raster = Raster::new(100, 100);
    draw(&raster, &camera, &corners, &[[0, 1, 2], [0, 2, 3]], true);
    assert_eq!(values(&raster).iter().flatten().count(), 90 * 90);
    let culled = Raster::new(100, 100);
    draw(&culled, &camera, &corners, &[[0, 2, 1]], true);
    assert!(values(&culled).iter().all(Option::is_none));
}

#[test]
fn depths_are_ordered() {
    let all = [
        f32::NEG_INFINITY,
        -2.0,
        -1e-30,
        -0.0,
        0.0,
        1e-30,
        3.0,
        f32::INFINITY,
    ];
    for pair in all.windows(2) {
        assert!(ascending(pair[0]) < ascending(pair[1]));
    }
    assert!(
        all.iter()
            .all(|x| float(ascending(*x)).to_bits() == x.to_bits())
    );
    assert!(ascending(f32::NEG_INFINITY) > 0, "0 stands for nothing");
}

#[test]
fn nearer_wins_and_hides_lines() {
    let (camera, corners) = scene();
    let mut all = corners.to_vec();
    all.extend(corners.map(|[x, y, _]| [x, y, 5.0]));
    let raster = Raster::new(100, 100);
    draw(
        &raster,
        &camera,
        &all,
        &[[4, 5, 6], [0, 1, 2], [0, 2, 3]],
        false,
    );
    let seen = values(&raster);
    assert!(seen.contains(&Some(0)) && seen.contains(&Some(2)));
    assert!(!seen.contains(&Some(1)));
    let below = [[-0.9, -0.95, 0.0], [0.9, -0.95, 0.0]];
    raster.line(&camera, below, Mark::Boundary, 3.0);
    let above = below.map(|[x, y, _]| [x, y, 5.0]);
    raster.line(&camera, above, Mark::NonManifold, 3.0);
    let found = marked(&raster, Mark::NonManifold);
    assert!((200..300).contains(&found), "{found}");
    assert!(marked(&raster, Mark::Boundary) < 10);
}

#[test]
fn the_order_of_drawing_does_not_matter() {
    let (camera, corners) = scene();
    let (one, other) = (Raster::new(100, 100), Raster::new(100, 100));
    let at = corners.map(|p| camera.project(p));
    let flat = |n: u32| move || n;
    for n in 0..4 {
        one.triangle([at[0], at[1], at[2]], flat(n));
        other.triangle([at[1], at[2], at[0]], flat(3 - n));
        one.point(at[3], 9.0, n);
        other.point(at[3], 9.0, 3 - n);
    }
    assert_eq!(values(&one), values(&other));
    assert!(values(&one).contains(&Some(3)) && !values(&one).contains(&Some(0)));
}

#[test]
fn what_is_said_to_miss_is_not_drawn() {
    let (camera, _) = scene();
    let mut random = 1u32;
    let mut next = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(random >> 8) / f64::from(1 << 24)
    };
    let (mut missed, mut drawn) = (0, 0);
    for _ in 0..20_000 {
        let middle = [2.4 * next() - 1.2, 2.4 * next() - 1.2];
        let size = 0.05 * next();
        let mut corner =
            || camera.project([middle[0] + size * next(), middle[1] + size * next(), 0.0]);
        let at = [corner(), corner(), corner()];
        let raster = Raster::new(100, 100);
        let mut seen = false;
        raster.triangle(at, || {
            seen = true;
            1
        });
        let misses = Raster::misses(at.map(Raster::cell));
        assert!(!(seen && misses), "{at:?}");
        missed += usize::from(misses);
        drawn += usize::from(seen);
    }
    assert!(missed > 2000 && drawn > 2000, "{missed} {drawn}");
}

#[test]
fn strange_numbers_do_no_harm() {
    let (camera, _) = scene();
    let raster = Raster::new(100, 100);
    let bad = [
        [f64::NAN; 3],
        [f64::INFINITY; 3],
        [1e300, -1e300, 1e300],
        [1e9, 1e9, 0.0],
    ];
    for k in 0..4 {
        let triangles = [[k, (k + 1) % 4, (k + 2) % 4], [k, k, k]];
        draw(&raster, &camera, &bad, &triangles, false);
        let ends = [bad[k], bad[(k + 1) % 4]];
        raster.line(&camera, ends, Mark::Wire, 2.0);
        raster.point(camera.project(bad[k]), 3.0, 1);
        let _ = Raster::cell(camera.project(bad[k]));
    }
}
