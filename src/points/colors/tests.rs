use super::*;
use proptest::prelude::*;

fn tally(points: &[[f64; 3]]) -> Tally {
    let mut tally = Tally::default();
    points.iter().for_each(|p| tally.add(p.iter().copied()));
    tally
}

fn columns(scalar: Scalar) -> Vec<Column> {
    COLORS.map(|name| Column::new(name, scalar)).into()
}

/// The points as colours of 8 bits.
fn seen(scalar: Scalar, said: Option<Depth>, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let scale = Scale::of(&[scalar; 3], said, &tally(points));
    let tone = Tone::new(scale, &columns(scalar), false);
    let of = |point: &[f64; 3]| {
        let mut values = Vec::new();
        point.iter().for_each(|c| scalar.put(*c, &mut values));
        let depth = tone.of_point(&values);
        point.map(|c| tone.shade(c, scalar, depth).clamp(0.0, 255.0))
    };
    points.iter().map(of).collect()
}

#[test]
fn one_white_point_blackens_nothing() {
    let mut points: Vec<[f64; 3]> = (0..99).map(|n| [f64::from(n), 200.0, 3.0]).collect();
    let plain = seen(Scalar::U16, None, &points);
    assert_eq!(plain, points);
    for white in [[65535.0; 3], [65280.0; 3], [256.0; 3], [300.0; 3]] {
        points.push(white);
        let all = seen(Scalar::U16, None, &points);
        assert_eq!(all[..99], plain);
        assert_eq!(all[99], [255.0; 3], "{white:?}");
        points.pop();
    }
}

#[test]
fn half_a_file_of_each_depth_is_as_one() {
    for factor in [256.0, 257.0] {
        let eight: Vec<[f64; 3]> = (0..40).map(|n| [f64::from(n), 9.0, 250.0]).collect();
        let wide = eight.iter().map(|p| p.map(|c| c * factor));
        let mixed: Vec<[f64; 3]> = eight.iter().copied().chain(wide.clone()).collect();
        assert_eq!(
            seen(Scalar::U16, None, &mixed),
            [&eight[..], &eight].concat()
        );
        let mostly: Vec<[f64; 3]> = eight[..4].iter().copied().chain(wide).collect();
        assert_eq!(
            seen(Scalar::U16, None, &mostly),
            [&eight[..4], &eight].concat()
        );
    }
}

#[test]
fn what_was_taken_is_one_line() {
    let scale = |depth, stray| Scale {
        depth,
        wide_from: 256.0,
        certain: false,
        stray,
    };
    assert_eq!(said(&[scale(Depth::Eight, 0)]), "colours 8 bits");
    let mixed = [
        scale(Depth::Sixteen, 0),
        scale(Depth::Eight, 2),
        scale(Depth::Eight, 0),
    ];
    let wanted = "colours 8 bits in 2 files, 16 bits in 1 file; 2 points have numbers above 255 there, taken as of \
        16 bits";
    assert_eq!(said(&mixed), wanted);
    assert_eq!(depths_shown(&[]), None);
}

#[test]
fn what_a_file_says_goes_before_its_numbers() {
    let dark = [[3.0, 7.0, 200.0]; 5];
    assert_eq!(
        seen(Scalar::U16, Some(Depth::Sixteen), &dark),
        [[0.0; 3]; 5]
    );
    assert_eq!(seen(Scalar::U16, None, &dark), dark);
    assert_eq!(
        seen(Scalar::F32, Some(Depth::One), &[[0.2, 0.4, 1.0]]),
        [[51.0, 102.0, 255.0]]
    );
    assert!(Scale::of(&[Scalar::U8; 3], None, &Tally::default()).certain);
    assert!(!Scale::of(&[Scalar::U16; 3], None, &tally(&dark)).certain);
    assert!(Scale::of(&[Scalar::U16; 3], None, &tally(&[[65535.0; 3]])).certain);
}

/// A way to write colours of 8 bits: the type, and the factor.
fn ways() -> impl Strategy<Value = (Scalar, f64)> {
    prop::sample::select(vec![
        (Scalar::U8, 1.0),
        (Scalar::U16, 1.0),
        (Scalar::U16, 256.0),
        (Scalar::U16, 257.0),
        (Scalar::I32, 1.0),
        (Scalar::F32, 1.0),
        (Scalar::F64, 1.0),
        (Scalar::F64, 257.0),
        (Scalar::F32, 1.0 / 255.0),
        (Scalar::F64, 1.0 / 255.0),
    ])
}

proptest! {
    /// Whatever the way of writing, with a few white points of 16 bits or none, the colours are the same.
    #[test]
    fn all_ways_to_write_a_colour_give_the_same(
        (scalar, factor) in ways(),
        points in prop::collection::vec(prop::array::uniform3(0u8..), 40..200),
        white in 0usize..3,
    ) {
        let wanted: Vec<[f64; 3]> = points.iter().map(|p| p.map(f64::from)).collect();
        let most = wanted.iter().filter(|p| p.iter().any(|c| *c > 1.0)).count();
        prop_assume!(most * 2 > wanted.len());
        let mut written: Vec<[f64; 3]> = wanted.iter().map(|p| p.map(|c| c * factor)).collect();
        let white = if scalar == Scalar::U8 { 0 } else { white };
        written.extend(vec![[65535.0; 3]; white]);
        let found = seen(scalar, None, &written);
        prop_assert_eq!(&found[..wanted.len()], &wanted[..]);
        prop_assert!(found[wanted.len()..].iter().all(|p| *p == [255.0; 3]));
    }

    /// Tallies of parts, in any order, are that of the whole.
    #[test]
    fn tallies_of_parts_are_that_of_the_whole(
        points in prop::collection::vec(prop::array::uniform3(-9.0..70000.0), 0..60),
        cut in 0usize..60,
    ) {
        let (one, two) = points.split_at(cut.min(points.len()));
        let mut all = tally(two);
        all.merge(&tally(one));
        prop_assert_eq!(all, tally(&points));
    }
}
