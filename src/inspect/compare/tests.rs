use super::triangle::distance2;
use super::vector::{Box3, V3, add, dot, scale, sub};
use proptest::prelude::*;

/// Halves the parameters' box again and again around the best of a grid: no algebra about regions.
fn searched(triangle: &[V3; 3], p: V3) -> f64 {
    let [a, b, c] = *triangle;
    let at = |u: f64, v: f64| add(a, add(scale(sub(b, a), u), scale(sub(c, a), v)));
    let far = |u: f64, v: f64| {
        let d = sub(at(u, v), p);
        dot(d, d)
    };
    let (mut best, mut centre, mut reach) = (far(0.0, 0.0), [0.0, 0.0], 1.0);
    for _ in 0..80 {
        let around = centre;
        for i in -8..=8 {
            for j in -8..=8 {
                let u = (around[0] + f64::from(i) * reach / 8.0).clamp(0.0, 1.0);
                let v = (around[1] + f64::from(j) * reach / 8.0).clamp(0.0, 1.0);
                // On the long side as well.
                for (u, v) in [(u, v), (u, 1.0 - u)] {
                    if u + v <= 1.0 && far(u, v) < best {
                        best = far(u, v);
                        centre = [u, v];
                    }
                }
            }
        }
        reach *= 0.7;
    }
    best.sqrt()
}

fn check(triangle: &[V3; 3], p: V3) {
    let got = distance2(triangle, p).sqrt();
    let want = searched(triangle, p);
    let size = 1.0
        + triangle
            .iter()
            .flatten()
            .chain(&p)
            .fold(0.0, |m: f64, c| m.max(c.abs()));
    assert!(
        (got - want).abs() <= 1e-7 * size,
        "{triangle:?} {p:?}: {got} {want}"
    );
}

fn lattice() -> impl Strategy<Value = V3> {
    prop::array::uniform3(-3i32..4).prop_map(|p| p.map(f64::from))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]
    #[test]
    fn distance_is_that_of_the_nearest_point(
        triangle in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)),
        p in prop::array::uniform3(-2.0..2.0f64),
    ) {
        check(&triangle, p);
    }

    #[test]
    fn also_of_segments_and_points(triangle in prop::array::uniform3(lattice()), p in lattice()) {
        check(&triangle, p);
    }

    #[test]
    fn also_of_needles(
        a in lattice(), b in lattice(), t in -0.5..1.5f64, thin in 1e-12..1e-3f64, p in lattice(),
    ) {
        let c = add(add(a, scale(sub(b, a), t)), [0.0, 0.0, thin]);
        for triangle in [[a, b, c], [b, c, a], [c, a, b]] {
            check(&triangle, p);
            // Corners are at no distance at all.
            prop_assert_eq!(distance2(&triangle, triangle[1]), 0.0);
        }
    }
}

#[test]
fn every_region_of_a_triangle() {
    let triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    let at = |p| distance2(&triangle, p);
    assert_eq!(at([1.0, 1.0, 3.0]), 9.0);
    assert_eq!(at([1.0, 1.0, 0.0]), 0.0);
    assert_eq!(at([-3.0, -4.0, 0.0]), 25.0);
    assert_eq!(at([7.0, -4.0, 0.0]), 25.0);
    assert_eq!(at([-3.0, 8.0, 0.0]), 25.0);
    assert_eq!(at([1.0, -2.0, 1.0]), 5.0);
    assert_eq!(at([-2.0, 1.0, 1.0]), 5.0);
    assert_eq!(at([4.0, 4.0, 1.0]), 9.0);
}

#[test]
fn a_box_of_any_shape_has_keys() {
    let shapes = [
        Box3::of(&[[0.0; 3], [1.0, 2.0, 3.0]]),
        Box3::of(&[[5.0; 3]]),
        Box3::of(&[[-1e70; 3], [1e70; 3]]),
        Box3::EMPTY,
    ];
    for bounds in shapes {
        for p in [[0.0; 3], [1e70; 3], [-1e70; 3], bounds.min, bounds.max] {
            let key = bounds.key(p);
            assert!(key.iter().all(|w| *w < 1 << 30));
        }
    }
}
