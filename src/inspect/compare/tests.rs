use super::pages::{Item, PageWriter, Searcher};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::distance::distance2;
use outcrop_geom::vector::{Box3, V3, add, dot, scale, sub};
use proptest::prelude::*;

/// Minimum of a convex function on `0..=1`.
fn least(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let (m, n) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if f(m) <= f(n) {
            high = n;
        } else {
            low = m;
        }
    }
    f(low).min(f(high)).min(f(0.0)).min(f(1.0))
}

/// Nested search along all segments from the first corner, without a case distinction of regions.
fn searched([a, b, c]: &[V3; 3], p: V3) -> f64 {
    let mix = |x: V3, y: V3, t: f64| add(scale(x, 1.0 - t), scale(y, t));
    let across = |t: f64| {
        let (from, to) = (mix(*a, *b, t), mix(*a, *c, t));
        least(|s| {
            let d = sub(mix(from, to, s), p);
            dot(d, d)
        })
    };
    least(across).sqrt()
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

/// Compares the nearest of `items` in pages with the least of all distances, from points that follow each
/// other as samples do.
fn check_nearest<T: Item + std::fmt::Debug>(items: &[T], from: &[V3]) {
    let workspace = Workspace::for_tests(1).expect("a scratch folder");
    let mut writer = PageWriter::new(&workspace, "items", items.len() as u64, None).unwrap();
    items.iter().for_each(|item| writer.push(*item).unwrap());
    let pages = writer.finish().unwrap();
    let found = pages.distances2(from, &mut Searcher::new(3)).unwrap();
    assert_eq!(found.len(), from.len());
    for (&p, found) in from.iter().zip(found) {
        let least = (items.iter()).fold(f64::INFINITY, |least, item| least.min(item.distance2(p)));
        // A triangle's distance may be rounded to less than that of its box.
        assert!(
            found >= least && found <= least * (1.0 + 1e-12) + 1e-24,
            "{found} {least}"
        );
    }
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
    fn the_nearest_in_pages_is_the_nearest_of_all(
        corners in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 1..900),
        from in prop::collection::vec(prop::array::uniform3(-2.0..2.0f64), 0..100),
        close in 0.0..1.0f64,
    ) {
        // Far from each other, and near each other as samples are.
        let from: Vec<V3> = from.iter().map(|p| scale(*p, close * close)).collect();
        check_nearest(&corners, &from);
        let triangle = |k: usize| [corners[k], corners[k / 2], corners[k / 3]];
        let triangles: Vec<[V3; 3]> = (0..corners.len()).map(triangle).collect();
        check_nearest(&triangles, &from);
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
            // Corners have distance zero.
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
