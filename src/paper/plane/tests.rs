use super::*;
use crate::kernels::Level;
use proptest::prelude::*;

fn moments(points: &[[i64; 3]]) -> Moments {
    let mut m = Moments::default();
    points.iter().for_each(|&p| m.add(p));
    m
}

proptest! {
    #[test]
    fn finds_the_plane_of_points_on_a_plane(
        u in prop::array::uniform3(-1000i64..1000),
        v in prop::array::uniform3(-1000i64..1000),
        steps in prop::collection::vec((-50i64..50, -50i64..50), 8..30),
    ) {
        let points: Vec<_> = steps.iter()
            .map(|(a, b)| std::array::from_fn(|i| a * u[i] + b * v[i])).collect();
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
            .map(|x| x as f64);
        let plane = moments(&points).plane();
        if plane.spans {
            let got = plane.normal.unwrap().map(f64::from);
            let dot = (0..3).map(|i| got[i] * n[i]).sum::<f64>();
            let len = |x: [f64; 3]| x.iter().map(|c| c * c).sum::<f64>().sqrt();
            prop_assert!((dot.abs() / (len(got) * len(n)) - 1.0).abs() < 1e-9, "{got:?} {n:?}");
        }
    }

    #[test]
    fn scatter_is_that_of_wide_words(
        points in prop::collection::vec(prop::array::uniform3(-(1i64 << 30)..1 << 30), 1..40),
        shift in 0u32..31,
    ) {
        let points: Vec<_> = points.iter().map(|p| p.map(|c| c >> shift)).collect();
        let m = moments(&points);
        prop_assert_eq!(m.scatter(), m.wide_scatter(m.count + 1).map(|x| x as f64));
    }

    #[test]
    fn several_planes_are_those_of_each(
        points in prop::collection::vec(prop::array::uniform3(-(1i64 << 30)..1 << 30), 8..120),
        shift in prop::array::uniform3(0u32..32),
        step in 1i64..4,
    ) {
        // Points on a plane, on a line, in one place, or anywhere.
        let points: Vec<_> = points.iter().map(|p| {
            std::array::from_fn(|axis| (p[axis] >> shift[axis]) / step * step)
        }).collect();
        let some: [Moments; PLANES] =
            std::array::from_fn(|n| moments(&points[..points.len() * n / (PLANES - 1)]));
        let expected = some.map(|m| m.plane());
        for level in Level::all() {
            prop_assert_eq!(planes(level, &some), expected);
        }
    }

    #[test]
    fn several_directions_are_those_of_each(
        rows in prop::collection::vec(prop::array::uniform3(-1000.0f64..1000.0), 8 * 4),
        shrink in prop::array::uniform3(0i32..80),
        odd in 0usize..3,
    ) {
        // Points that fill space or lie near a plane, a line or one place, and values that are no scatter.
        let mut scatters = [[0.0; LANES]; 6];
        for (lane, rows) in rows.chunks(4).enumerate() {
            for row in rows {
                let row: [f64; 3] = std::array::from_fn(|axis| row[axis] * 0.5f64.powi(shrink[axis]));
                for (to, (a, b)) in scatters.iter_mut().zip(PAIRS) {
                    to[lane] += row[a] * row[b];
                }
            }
        }
        scatters[0][1] = [f64::NAN, f64::INFINITY, -1.0][odd];
        scatters.iter_mut().for_each(|of| of[2] = 0.0);
        let expected = std::array::from_fn(|lane| least_direction(&lane_of(&scatters, lane)));
        for level in Level::all() {
            prop_assert_eq!(least_directions(level, &scatters), expected);
        }
    }

    #[test]
    fn the_residual_is_least(
        points in prop::collection::vec(prop::array::uniform3(-1000i64..1000), 4..20),
        tilt in prop::array::uniform3(-0.05f64..0.05),
    ) {
        let m = moments(&points);
        let Some(n) = m.plane().normal else { return Ok(()) };
        let s = m.scatter();
        let cost = |n: [f64; 3]| {
            let l = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
            (s[0] * n[0] * n[0] + s[1] * n[1] * n[1] + s[2] * n[2] * n[2]
                + 2.0 * (s[3] * n[0] * n[1] + s[4] * n[0] * n[2] + s[5] * n[1] * n[2])) / l
        };
        let n = n.map(|x| f64::from(x) / NORMAL_SCALE);
        let tilted = std::array::from_fn(|i| n[i] + tilt[i]);
        prop_assert!(cost(n) <= cost(tilted) + 1e-6 * (s[0] + s[1] + s[2]));
    }
}

#[test]
fn a_line_has_no_plane() {
    let line: Vec<_> = (1..20).map(|i| [i, 2 * i, -3 * i]).collect();
    assert_eq!(
        moments(&line).plane(),
        Plane {
            normal: None,
            spans: false,
            wide: false
        }
    );
    assert_eq!(moments(&[]).plane().normal, None);
}
