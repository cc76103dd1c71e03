use super::super::Level;
use super::*;
use proptest::prelude::*;

/// All that the kernels of a level compute.
fn all_of(level: Level, columns: [&[i32]; 3], count: usize) -> Vec<f64> {
    let mut all = Weighted::default();
    let mut spread = [[0.0; LANES]; 10];
    take_weighted(
        level,
        &mut all,
        columns,
        count,
        1.0 / 2000.0,
        &mut spread,
        LANE,
    );
    let mut found = lane(&spread);
    let mut sums = [[0.0; LANES]; 23];
    let frame = [[0.6, 0.8, 0.0], [0.0, 0.0, 1.0], [0.8, -0.6, 0.0]];
    turn(level, &mut all, &frame, &mut sums, LANE);
    found.extend(lane(&sums));
    let surface = [0.1, 0.2, -0.1, 0.3, 0.1, -0.2];
    let dropped = drop_beyond(level, &mut all, &surface, 0.1, &mut sums, LANE);
    found.push(f64::from(u8::from(dropped)));
    found.extend(lane(&sums));
    square_weights(level, &all, &mut sums, LANE);
    found.extend(lane(&sums));
    fade(level, &mut all, &surface, 0.2, &mut sums, LANE);
    found.extend(lane(&sums));
    // The other lanes are left alone.
    let others = spread.iter().chain(&sums).flat_map(|of| &of[..LANE]);
    assert!(others.copied().all(|sum| sum == 0.0));
    found
}

const LANE: usize = 5;

fn lane<const N: usize>(sums: &LaneSums<N>) -> Vec<f64> {
    sums.iter().map(|of| of[LANE]).collect()
}

proptest! {
    #[test]
    fn every_level_gives_the_same_sums(
        points in prop::collection::vec(prop::array::uniform3(-1000i32..1000), 1..60),
    ) {
        let whole = points.len().next_multiple_of(GROUP);
        let column = |axis: usize| {
            let mut all: Vec<i32> = points.iter().map(|p| p[axis]).collect();
            all.resize(whole, 0);
            all
        };
        let (x, y, z) = (column(0), column(1), column(2));
        let expected = all_of(Level::BASE, [&x, &y, &z], points.len());
        for level in Level::all() {
            prop_assert_eq!(&all_of(level, [&x, &y, &z], points.len()), &expected);
        }
        // Against plain sums.
        let at = |p: &[i32; 3]| p.map(|c| f64::from(c) / 2000.0);
        let near = |p: &[i32; 3]| 1.0 - at(p).iter().map(|c| c * c).sum::<f64>();
        let close = |found: f64, sum: f64| (found - sum).abs() < 1e-9;
        let weights: f64 = points.iter().map(near).sum();
        let xy: f64 = points.iter().map(|p| near(p) * at(p)[0] * at(p)[1]).sum();
        prop_assert!(close(expected[0], weights) && close(expected[7], xy));
        let turned = |p: &[i32; 3]| {
            let [x, y, z] = at(p);
            [0.6 * x + 0.8 * y, z, 0.8 * x - 0.6 * y]
        };
        let uuvv = points.iter().map(|p| near(p) * (turned(p)[0] * turned(p)[1]).powi(2)).sum();
        let huv = points.iter().map(|p| near(p) * turned(p).iter().product::<f64>()).sum();
        prop_assert!(close(expected[10 + 12], uuvv) && close(expected[10 + 19], huv));
        let over = |p: &[i32; 3]| {
            let [u, v, h] = turned(p);
            h - (0.1 + 0.2 * u - 0.1 * v + 0.3 * u * u + 0.1 * u * v - 0.2 * v * v)
        };
        let kept = points.iter().filter(|p| over(p).powi(2) <= 0.1);
        prop_assert!(close(expected[34], kept.map(near).sum()));
        prop_assert!(close(expected[57], points.iter().map(|p| near(p).powi(2)).sum()));
        let faded = points.iter().map(|p| {
            let rest = (1.0 - over(p).powi(2) / 0.2).max(0.0);
            near(p).powi(2) * rest * rest
        });
        prop_assert!(close(expected[80], faded.sum()));
    }
}
