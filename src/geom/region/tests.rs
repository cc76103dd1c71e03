use super::*;
use proptest::prelude::*;

fn read(text: &str) -> Result<Region, String> {
    text.parse().map_err(|e: NoRegion| e.to_string())
}

#[test]
fn boxes_are_read_and_odd_ones_are_refused() {
    let min = [1.0, -2.0];
    let max = [3.0, 4.5];
    let flat = Region::Box { min, max, z: None };
    assert_eq!(read(" 1, -2,3,4.5\n"), Ok(flat));
    let z = Some([-1.0, 7.0]);
    assert_eq!(read("1,-2,-1,3,4.5,7"), Ok(Region::Box { min, max, z }));
    for (text, why) in [
        ("1,2", "2 numbers"),
        ("1,2,3,4,5", "5 numbers"),
        ("1,2,3,nan", "NaN"),
        ("1,2,inf,4", "inf"),
        ("1,2,1e16,4", "1e16"),
        ("3,2,1,4", "lowest x of 3"),
        ("1,4,3,4", "lowest y of 4"),
        ("0,0,5,1,1,5", "lowest z of 5"),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.contains(why), "{text}: {error}");
    }
    assert!(Region::is_numbers("1,2") && Region::is_numbers("a,b").eq(&false));
    assert!(!Region::is_numbers("12") && !Region::is_numbers("1,2,a.wkt"));
}

/// A square of 4 with a hole of 2.
const RINGS: [&[[f64; 2]]; 2] = [
    &[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]],
    &[[1.0, 1.0], [1.0, 3.0], [3.0, 3.0], [3.0, 1.0]],
];

#[test]
fn polygons_are_read_from_wkt_and_geojson() {
    let rings: Polygon = RINGS.iter().map(|ring| ring.to_vec()).collect();
    let one = Region::Polygons(vec![rings.clone()]);
    let wkt = "((0 0, 4 0, 4 4, 0 4, 0 0), (1 1, 1 3, 3 3, 3 1, 1 1))";
    let json = "[[[0,0],[4,0],[4,4],[0,4],[0,0]],[[1,1,9],[1,3,9],[3,3,9],[3,1,9],[1,1,9]]]";
    let polygon = format!(r#"{{"type":"Polygon","coordinates":{json}}}"#);
    let feature = format!(r#"{{"type":"Feature","properties":null,"geometry":{polygon}}}"#);
    let nothing = r#"{"type":"Feature","properties":{},"geometry":null}"#;
    for text in [
        format!("POLYGON{wkt}"),
        format!("\u{feff}SRID=2913;polygon {wkt}"),
        format!("MULTIPOLYGON({wkt})"),
        polygon.clone(),
        format!(r#"{{"type":"MultiPolygon","coordinates":[{json}]}}"#),
        feature.clone(),
        format!(r#"{{"type":"FeatureCollection","features":[{nothing},{feature}]}}"#),
    ] {
        assert_eq!(read(&text), Ok(one.clone()), "{text}");
    }
    let two = read("MULTIPOLYGON Z(((0 0 1,1 0 1,0 1 1,0 0 1)),((5 5 1,6 5 1,5 6 1)))").unwrap();
    assert!(matches!(&two, Region::Polygons(two) if two.len() == 2));
    assert_eq!(two.bounds(), [[0.0, 0.0], [6.0, 6.0]]);
}

#[test]
fn what_is_no_polygon_is_refused() {
    let deep = "GEOMETRYCOLLECTION(".repeat(100_000);
    let brackets = format!(r#"{{"type":{}"#, "[".repeat(100_000));
    for (text, why) in [
        ("", "WKT or GeoJSON"),
        ("mesh", "WKT or GeoJSON"),
        ("POINT(1 2)", "polygon or multipolygon"),
        ("POLYGON((0 0, 1 1))", "2 different corners"),
        ("POLYGON((0 0, 1 1, 0 0, 1 1, 0 0))", "without an area of"),
        ("POLYGON((0 0, 1 1, 2 x, 0 0))", "WKT or GeoJSON"),
        ("POLYGON((0 0, 1 0, 0 1", "WKT or GeoJSON"),
        ("POLYGON EMPTY", "no polygon"),
        ("MULTIPOLYGON EMPTY", "no polygon"),
        ("POLYGON((0 0, 1e300 0, 0 1))", "1e300"),
        ("POLYGON((0 0, 5 0, 9 0))", "without an area"),
        (&deep, "deep"),
        ("{}", "invalid GeoJSON"),
        (&brackets, "invalid GeoJSON"),
        (r#"{"type":"Point","coordinates":[1,2]}"#, "a Point"),
        (
            r#"{"type":"Polygon","coordinates":[[[1],[2],[3]]]}"#,
            "GeoJSON",
        ),
        (
            r#"{"type":"FeatureCollection","features":[]}"#,
            "no polygon",
        ),
    ] {
        let shown: String = text.chars().take(50).collect();
        let error = match read(text) {
            Err(error) => error,
            Ok(region) if why == "without an area of" => {
                // A line there and back has an area of nothing, but a box around it.
                assert!(!region.area().contains([0.5, 0.6, 0.0]));
                continue;
            }
            Ok(region) => panic!("{shown}: {region:?}"),
        };
        assert!(error.contains(why), "{shown}: {error}");
        assert!(!error.contains('\n') && error.len() < 300, "{error}");
    }
    let corners: String = (0..MOST_CORNERS + 1)
        .map(|n| format!("{n} {},", n * n))
        .collect();
    let error = read(&format!("POLYGON(({} 0 1))", corners)).unwrap_err();
    assert!(error.contains("simplify"), "{error}");
}

/// Corners and points are small integers, so products are exact.
fn contains_exactly(polygons: &[Polygon], [x, y]: [f64; 2]) -> bool {
    let mut inside = false;
    for rings in polygons {
        let mut odd = false;
        for ring in rings {
            for (n, a) in ring.iter().enumerate() {
                let b = ring[(n + 1) % ring.len()];
                let cross = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
                let between = |k: usize, c: f64| a[k].min(b[k]) <= c && c <= a[k].max(b[k]);
                if cross == 0.0 && between(0, x) && between(1, y) {
                    return true;
                }
                if (a[1] > y) != (b[1] > y) {
                    let at = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
                    odd ^= at > x;
                }
            }
        }
        inside |= odd;
    }
    inside
}

/// The smallest distance of a point from an edge, by many points on each.
fn distance(polygons: &[Polygon], [x, y]: [f64; 2]) -> f64 {
    let mut least = f64::INFINITY;
    for ring in polygons.iter().flatten() {
        for (n, a) in ring.iter().enumerate() {
            let b = ring[(n + 1) % ring.len()];
            for share in 0..=1000 {
                let t = f64::from(share) / 1000.0;
                let p = [0, 1].map(|k| a[k] + t * (b[k] - a[k]));
                least = least.min((p[0] - x).hypot(p[1] - y));
            }
        }
    }
    least
}

fn polygons() -> impl Strategy<Value = Vec<Polygon>> {
    let corner = (-8..9i32, -8..9i32).prop_map(|(x, y)| [f64::from(x), f64::from(y)]);
    let ring = prop::collection::vec(corner, 3..9);
    prop::collection::vec(prop::collection::vec(ring, 1..3), 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn points_and_boxes_are_told_as_by_a_look_at_every_edge(
        polygons in polygons(),
        points in prop::collection::vec((-40..41i32, -40..41i32), 40),
        margin in 0..12u32,
    ) {
        let region = Region::Polygons(polygons.clone());
        let area = region.area();
        let margin = f64::from(margin) / 4.0;
        let at = |(x, y): &(i32, i32)| [f64::from(*x) / 4.0, f64::from(*y) / 4.0];
        let points: Vec<_> = points.iter().map(at).collect();
        for &[x, y] in &points {
            let inside = contains_exactly(&polygons, [x, y]);
            prop_assert_eq!(area.contains([x, y, 1e9]), inside, "{} {}", x, y);
            let near = area.is_near([x, y, 0.0], margin);
            let far = distance(&polygons, [x, y]);
            if inside || far < margin - 1e-9 {
                prop_assert!(near, "{} {}: {}", x, y, far);
            } else if far > margin + 0.05 {
                prop_assert!(!near, "{} {}: {}", x, y, far);
            }
        }
        for pair in points.chunks_exact(2) {
            let low = [pair[0][0].min(pair[1][0]), pair[0][1].min(pair[1][1]), -1.0];
            let high = [pair[0][0].max(pair[1][0]), pair[0][1].max(pair[1][1]), 1.0];
            let within = |p: &&[f64; 2]| (0..2).all(|k| low[k] <= p[k] && p[k] <= high[k]);
            let wanted = points.iter().filter(within).any(|[x, y]| area.is_near([*x, *y, 0.0], margin));
            prop_assert!(!wanted || area.may_meet([low, high], margin));
        }
    }
}

#[test]
fn a_box_contains_its_sides_and_a_margin_widens_it() {
    let region = read("0,0,0,4,2,1").unwrap();
    let area = region.area();
    for (p, inside) in [
        ([0.0, 0.0, 0.0], true),
        ([4.0, 2.0, 1.0], true),
        ([4.0f64.next_up(), 2.0, 1.0], false),
        ([2.0, 1.0, 1.5], false),
        ([2.0, -0.5, 0.5], false),
    ] {
        assert_eq!(area.contains(p), inside, "{p:?}");
        assert!(area.is_near(p, 0.5), "{p:?}");
    }
    assert!(!area.is_near([2.0, 1.0, 1.6], 0.5));
    assert!(!area.may_meet([[0.0, 0.0, 2.0], [4.0, 2.0, 3.0]], 0.5));
    assert!(area.may_meet([[0.0, 0.0, 2.0], [4.0, 2.0, 3.0]], 1.0));
    assert!(!area.may_meet([[4.6, 0.0, 0.0], [9.0, 2.0, 3.0]], 0.5));
}

#[test]
fn orientation_is_exact_where_rounding_would_err() {
    // The point is beside the line by less than the rounding of a product.
    let region = read("POLYGON((0.5 0.5, 12 12, 24 24, 24 0.5))").unwrap();
    let area = region.area();
    let x = 0.5 + f64::EPSILON;
    assert!(area.contains([x, x, 0.0]));
    assert!(area.contains([x.next_up(), x, 0.0]));
    assert!(!area.contains([x, x.next_up(), 0.0]));
}
