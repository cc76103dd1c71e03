use super::*;

use proptest::prelude::*;

fn spacings(usual2: Vec<u64>) -> Spacings {
    let workspace = Workspace::for_tests(1).expect("a scratch folder");
    let mut stored = StoredSpacings::new(METHOD.curve.patch * usual2.len());
    stored.put(0, &usual2, 0);
    stored.open(&workspace).unwrap()
}

proptest! {
    #[test]
    fn the_quick_look_at_sides_misses_none(
        usual2 in prop::array::uniform3(0u64..5000),
        at in prop::array::uniform3(prop::array::uniform3(0i32..100)),
        limit in 0.5f64..12.0,
        steps in any::<bool>(),
    ) {
        let spacings = spacings(usual2.to_vec());
        let edge = if steps { Width::Steps(limit) } else { Width::Spacings(limit) };
        let limits = Limits { off_surface: true, edge, fill: Width::Any };
        let density = Density { spacings: &spacings, noise: None, coarse: None, neighbors: 30, limits };
        let t = [0, 1, 2].map(|patch| Id::at(patch * METHOD.curve.patch + 7));
        prop_assert_eq!(density.is_long()(t, at), density.exceeds(edge, t, at));
    }
}

/// How a point at the origin, of the first patch, lies to its neighbours, where they usually reach a tenth as far.
fn standing_among(near: &[Point]) -> Standing {
    standing_in(near, 1, None)
}

/// As [`standing_among`]; the neighbours are of another patch, where they usually reach `there` tenths as far.
fn standing_in(near: &[Point], there: u64, noise: Option<u8>) -> Standing {
    let axis = |k: usize| near.iter().map(|at| at[k]).collect::<Vec<i32>>();
    let axes = [0, 1, 2].map(axis);
    let mut moments = Moments::default();
    near.iter().for_each(|at| moments.add(at.map(i64::from)));
    let last2 = near.iter().map(|at| distance2(*at, [0; 3])).max();
    let last2 = last2.expect("neighbours");
    let limits = Limits {
        off_surface: true,
        edge: Width::Any,
        fill: Width::Any,
    };
    let spacings = spacings(vec![last2 / 100, there * there * last2 / 100]);
    let levels = noise.map(|level| {
        let mut levels = Levels::new(1);
        levels.set(0, level);
        levels
    });
    let density = Density {
        spacings: &spacings,
        noise: levels.as_ref(),
        coarse: None,
        neighbors: near.len(),
        limits,
    };
    let ids: Vec<Id> = (0..near.len())
        .map(|k| Id::at(METHOD.curve.patch + k))
        .collect();
    let near = Nearby {
        ids: &ids,
        differences: axes.each_ref().map(Vec::as_slice),
    };
    density.standing(Id::at(0), last2, &moments, near)
}

/// 25 points on a square patch with this place of its centre.
fn patch([x, y, z]: Point) -> Vec<Point> {
    let side = || (-2..=2).map(|i| 10 * i);
    side()
        .flat_map(|u| side().map(move |v| [x + u, y + v, z + (u * v) / 100]))
        .collect()
}

#[test]
fn a_bird_is_off_the_surface_and_a_coarse_point_beside_a_dense_patch_is_not() {
    assert_eq!(standing_among(&patch([0, 0, -100])), Standing::Off);
    assert_eq!(standing_among(&patch([30, 0, -100])), Standing::Off);
    assert_eq!(standing_among(&patch([150, 0, 0])), Standing::Coarse(2));
}

#[test]
fn a_point_of_a_wire_is_not_coarse() {
    let wire: Vec<Point> = (-12..=12)
        .filter(|i| *i != 0)
        .map(|i| [20 * i, 3 * i, i % 2])
        .collect();
    assert_eq!(standing_among(&wire), Standing::Usual);
}

#[test]
fn a_point_of_a_thin_sheet_is_not_off_it() {
    let sheet = (-3i32..=3).flat_map(|u| (-3i32..=3).map(move |v| [10 * u, 10 * v, 0]));
    let own = sheet
        .clone()
        .filter(|at| *at != [0; 3] && at[0].abs() + at[1].abs() <= 30);
    let other = sheet.filter(|at| at[0].abs() + at[1].abs() <= 10);
    let near: Vec<Point> = own.chain(other.map(|[x, y, _]| [x, y, 29])).collect();
    assert_ne!(standing_among(&near), Standing::Off);
    assert_eq!(standing_among(&strewn()), Standing::Off);
}

/// Neighbours all around.
fn strewn() -> Vec<Point> {
    (0..27)
        .map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1].map(|c| 20 * c))
        .filter(|at| *at != [0; 3])
        .collect()
}

#[test]
fn a_point_among_coarse_points_is_off_only_with_the_noise_of_strewn_points() {
    assert_eq!(standing_in(&strewn(), 4, None), Standing::Off);
    assert_ne!(standing_in(&strewn(), 6, None), Standing::Off);
    assert_ne!(standing_in(&strewn(), 6, Some(2)), Standing::Off);
    assert_eq!(standing_in(&strewn(), 6, Some(3)), Standing::Off);
}
