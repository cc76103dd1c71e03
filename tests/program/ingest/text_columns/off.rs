//! Files in the Object File Format.

use super::{lines, points, refusal, want};
use crate::ingest::bench::Bench;

#[test]
fn vertices_of_off_are_points_and_faces_are_none() {
    let bench = Bench::new();
    let faces = "3 0 1 2\n3 0 2 1 255 0 0\n";
    let plain = lines(|_, [x, y, z]| format!("{x} {y} {z}\n"));
    let colored = lines(|_, [x, y, z]| format!("{x} {y} {z} 200 100 50 255\n"));
    let normal = lines(|_, [x, y, z]| format!("{x} {y} {z} 0 0 1\n"));
    for (name, text, list, more) in [
        (
            "a.off",
            format!("OFF\n3 2 0\n{plain}{faces}"),
            "none",
            &[][..],
        ),
        (
            "b.off",
            format!("OFF 3 2 0\r\n{}{faces}", plain.replace('\n', "\r\n")),
            "none",
            &[],
        ),
        (
            "c.off",
            format!("# a mesh\nOFF # b\n\n3 2 0\n# c\n{plain}\n{faces}"),
            "none",
            &[],
        ),
        (
            "d.off",
            format!("COFF\n3 2 0\n{colored}{faces}"),
            "color",
            &[200.0, 100.0, 50.0],
        ),
        (
            "e.off",
            format!("NOFF\n3 2 0\n{normal}{faces}"),
            "nz",
            &[1.0],
        ),
        (
            "f.off",
            format!("OFF\n3 2 0\n{colored}{faces}"),
            "color",
            &[200.0, 100.0, 50.0],
        ),
        ("g", format!("off\n3 0 0\n{plain}"), "none", &[]),
        (
            "h.off",
            format!("OFF\n3 0 0\n{}", plain.trim_end()),
            "none",
            &[],
        ),
    ] {
        let (found, stats) = points(&bench, name, &text, list);
        let want: Vec<Vec<f64>> = want()
            .into_iter()
            .map(|p| [p, more.to_vec()].concat())
            .collect();
        assert_eq!(found, want, "{name}");
        assert_eq!(
            stats.warnings.len(),
            usize::from(name == "f.off"),
            "{:?}",
            stats.warnings
        );
    }
    for (text, said) in [
        (format!("OFF BINARY\n3 0 0\n{plain}"), "found binary OFF"),
        (
            format!("4OFF\n3 0 0\n{plain}"),
            "other than three coordinates",
        ),
        (
            format!("OFF\nthree 0 0\n{plain}"),
            "OFF header: found \"three 0 0\"",
        ),
        (
            format!("OFF\n4 0 0\n{plain}"),
            "found 4 vertices, expected at most 3",
        ),
        (
            format!("OFF\n4 0 0\n{plain}1 2\n"),
            "line 6: found \"1 2\", expected a vertex",
        ),
    ] {
        let found = refusal(&bench, "a.off", &text);
        assert!(found.contains(said), "{found}");
    }
}

/// More than one unit of lines, with faces that look like points.
#[test]
fn a_large_off_ends_where_its_vertices_do() {
    let bench = Bench::new();
    let count = 200_000;
    let vertices: String = (0..count)
        .map(|i| format!("{i}.25 {} -0.5\n", i % 7))
        .collect();
    let faces = "3 900000 900001 900002\n".repeat(100_000);
    let path = bench.write("a.off", format!("OFF\n{count} 100000 0\n{vertices}{faces}"));
    let spool = bench.read(&[path]).unwrap();
    assert_eq!(spool.points(), count);
    assert_eq!(
        spool.stats().files[0].max,
        Some([count as f64 - 0.75, 6.0, -0.5])
    );
}
