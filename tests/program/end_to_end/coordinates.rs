//! The origin of coordinates and reference systems, from the files to the mesh.

use crate::end_to_end::util::{self, Bench};
use outcrop::inspect::compare::{Comparison, Options, compare};
use outcrop::params::{Origin, Params};
use outcrop::report::CoordinateType;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_ply::{Header, Mesh};
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;

/// Text of a hilly square in national coordinates, with three decimals: lines that can be divided.
fn hills(step: f64, decimals: usize) -> Vec<String> {
    let points = (0..70).flat_map(|i| (0..70).map(move |j| (f64::from(i), f64::from(j))));
    let wave = |t: f64| (t * 0.37).sin() * 3.0;
    let line = |(i, j): (f64, f64)| {
        let x = 637_012.345 + step * (i + 0.3 * wave(j + 1.0));
        let y = 5_151_200.001 + step * (j + 0.3 * wave(i));
        let z = 421.5 + step * wave(i + j);
        format!("{x:.decimals$} {y:.decimals$} {z:.decimals$}\n")
    };
    points.map(line).collect()
}

fn with(origin: Origin) -> Params {
    Params {
        origin,
        ..Params::default()
    }
}

fn mesh(path: &Path) -> Mesh {
    let bytes = std::fs::read(path).unwrap();
    Mesh::read(&bytes[..], bytes.len() as u64).unwrap()
}

fn header(path: &Path) -> (Header, String) {
    let bytes = std::fs::read(path).unwrap();
    let header = Header::read(&mut &bytes[..]).unwrap();
    let text = String::from_utf8(bytes[..header.bytes as usize].to_vec()).unwrap();
    (header, text)
}

/// The `f32` nearest to `count` times `step`, with integers only; of two the one with an even last bit.
fn nearest(count: i64, step: f64) -> f32 {
    let bits = step.to_bits();
    let exponent = (bits >> 52) as i32 - 1075;
    let mantissa = bits & ((1 << 52) - 1) | 1 << 52;
    let product = u128::from(count.unsigned_abs()) * u128::from(mantissa);
    let cut = (128 - product.leading_zeros()).saturating_sub(24);
    let (mut whole, rest) = (product >> cut, product & ((1 << cut) - 1));
    let half = (1u128 << cut) / 2;
    whole += u128::from(cut > 0 && (rest > half || rest == half && whole & 1 == 1));
    let value = whole as f64 * 2f64.powi(cut as i32 + exponent);
    (value.copysign(count as f64)) as f32
}

#[test]
fn every_float_is_the_exact_lattice_position_rounded_once() {
    let bench = Bench::new();
    for (decimals, step) in [(3, 0.35), (2, 2.0), (4, 0.01)] {
        let cloud = bench.write("cloud.xyz", hills(step, decimals).concat());
        let (far, near) = (bench.path("far.ply"), bench.path("near.ply"));
        let plain = util::reconstruct(&cloud, &far, &with(Origin::None));
        let auto = util::reconstruct(&cloud, &near, &with(Origin::Auto));
        assert_eq!(
            (plain.coordinates, plain.origin),
            (CoordinateType::Double, None)
        );
        assert_eq!(auto.coordinates, CoordinateType::Float);
        let origin = auto.origin.unwrap();
        let unit = 10f64.powi(-(decimals as i32));
        let count = |x: f64| (x / unit).round() as i64;
        let (far, near) = (mesh(&far), mesh(&near));
        assert!(!far.vertices.is_empty() && far.triangles == near.triangles);
        for (global, local) in far.vertices.iter().zip(&near.vertices) {
            for axis in 0..3 {
                let steps = count(global[axis]) - count(origin[axis]);
                assert_eq!(local[axis] as f32, nearest(steps, unit), "{global:?}");
            }
        }
        let distinct = |mesh: &Mesh| {
            let mut all: Vec<_> = mesh.vertices.iter().map(|p| p.map(f64::to_bits)).collect();
            all.sort_unstable();
            all.dedup();
            all.len()
        };
        assert_eq!(distinct(&far), distinct(&near));
    }
}

#[test]
fn given_origins_are_rounded_and_said() {
    let bench = Bench::new();
    let cloud = bench.write("cloud.xyz", hills(0.35, 3).concat());
    let output = bench.path("mesh.ply");
    let at = [637_000.000_4, 5_151_200.0, 0.0];
    let report = util::reconstruct(&cloud, &output, &with(Origin::At(at)));
    assert_eq!(report.origin, Some([637_000.0, 5_151_200.0, 0.0]));
    let said =
        "origin: 637000,5151200,0 is used, the nearest position on the lattice of steps of 0.001";
    assert_eq!(report.warnings, [said]);
    let (_, text) = header(&output);
    for line in [
        "offsetx 637000",
        "offsety 5151200",
        "offsetz 0",
        "gridstep 0.001",
    ] {
        assert!(text.contains(&format!("\ncomment {line}\n")), "{text}");
    }
    let beside = std::fs::read(bench.path("mesh.origin.json")).unwrap();
    let beside: Value = serde_json::from_slice(&beside).unwrap();
    assert_eq!(
        beside["origin"],
        serde_json::json!([637_000.0, 5_151_200.0, 0.0])
    );
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["parameters"]["origin"]["at"][1], 5_151_200.0);
    // Far from the cloud, floats do not keep the steps; then doubles do.
    let report = util::reconstruct(&cloud, &output, &with(Origin::At([-1e9, 0.0, 0.0])));
    assert_eq!(report.coordinates, CoordinateType::Double);
    // An earlier origin is not left beside a mesh without one.
    let report = util::reconstruct(&cloud, &output, &with(Origin::None));
    assert_eq!(report.warnings, [""; 0]);
    assert!(!bench.path("mesh.origin.json").exists());
    for (text, part) in [
        ("1e40,0,0", "--origin: 1"),
        ("1,2", "\"1,2\" is not auto, none, or three numbers"),
        ("nan,0,0", "is not auto"),
    ] {
        let said = util::run([
            "reconstruct".as_ref(),
            cloud.as_os_str(),
            "-o".as_ref(),
            output.as_os_str(),
            "--origin".as_ref(),
            text.as_ref(),
        ]);
        assert_eq!(said.code, Some(2));
        assert!(said.err.contains(part), "{}", said.err);
    }
}

#[test]
fn nothing_but_points_and_parameters_decides_the_file() {
    let bench = Bench::new();
    let mut lines = hills(0.35, 3);
    let whole = bench.write("whole.xyz", lines.concat());
    lines.reverse();
    let parts = [("a.xyz", 0..1234), ("b.xyz", 1234..4900)];
    let parts = parts.map(|(name, range)| bench.write(name, lines[range].concat()));
    let mut meshes = Vec::new();
    for (inputs, threads, memory) in [
        (vec![whole.clone()], 1, MINIMUM_BUDGET),
        (vec![whole], 3, 4 * MINIMUM_BUDGET),
        (parts.to_vec(), 2, MINIMUM_BUDGET),
        (parts.iter().rev().cloned().collect(), 2, 2 * MINIMUM_BUDGET),
    ] {
        let output = bench.path("mesh.ply");
        let builder = util::builder(&inputs, &output, &with(Origin::Auto));
        let run = builder.threads(threads).memory(memory).build().unwrap();
        run.run().unwrap();
        let beside = util::hash(&bench.path("mesh.origin.json"));
        meshes.push((util::hash(&output), beside));
    }
    assert!(meshes.iter().all(|mesh| *mesh == meshes[0]), "{meshes:?}");
}

fn compared(a: &Path, b: &Path) -> Comparison {
    let folder = tempfile::tempdir().unwrap();
    let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    let workspace =
        Workspace::new(folder.path(), memory, 2, Arc::new(Silent), Cancel::new()).unwrap();
    compare(a, b, &Options::default(), &workspace).unwrap()
}

#[test]
fn verify_and_compare_add_the_origin_back() {
    let bench = Bench::new();
    let cloud = bench.write("cloud.xyz", hills(0.35, 3).concat());
    let (far, near) = (bench.path("far.ply"), bench.path("near.ply.zst"));
    util::reconstruct(&cloud, &far, &with(Origin::None));
    util::reconstruct(&cloud, &near, &with(Origin::Auto));
    let (one, other) = (util::verdict(&far), util::verdict(&near));
    assert_eq!(one.origin, None);
    let [x, y, z] = other.origin.unwrap();
    assert_eq!([x, y, z], [637_000.0, 5_151_000.0, 0.0]);
    let (a, b) = (one.bounds.unwrap(), other.bounds.unwrap());
    let close = |a: [f64; 3], b: [f64; 3], most: f64| (0..3).all(|i| (a[i] - b[i]).abs() <= most);
    assert!(
        close(a.min, b.min, 2e-9) && close(a.max, b.max, 2e-9),
        "{a:?} {b:?}"
    );
    // The rest is the same.
    let rest = outcrop::inspect::verify::Verdict {
        bounds: one.bounds,
        origin: None,
        ..other
    };
    assert_eq!(one, rest);
    let (one, other) = (compared(&far, &cloud), compared(&near, &cloud));
    assert!(one.symmetric.figures.mean > 0.0);
    for (one, other) in [(one.a_to_b, other.a_to_b), (one.b_to_a, other.b_to_a)] {
        assert_eq!(one.samples, other.samples);
        let pairs = [
            (one.figures.max, other.figures.max),
            (one.figures.mean, other.figures.mean),
            (one.figures.p99, other.figures.p99),
        ];
        for (one, other) in pairs {
            assert!((one - other).abs() < 1e-8, "{one} {other}");
        }
    }
    let both = compared(&far, &near);
    assert!(both.symmetric.figures.max < 1e-8, "{both:?}");
}

fn wkt(code: u32) -> String {
    format!("PROJCS[\"UTM\n zone\",GEOGCS[\"WGS 84\"],AUTHORITY[\"EPSG\",\"{code}\"]]")
}

#[test]
fn reference_systems_are_carried_and_not_mixed() {
    let bench = Bench::new();
    let lines = hills(0.35, 3);
    let inputs = [
        bench.write("a.xyz", lines[..2000].concat()),
        bench.write("b.xyz", lines[2000..].concat()),
    ];
    bench.write("a.prj", wkt(32617));
    let output = bench.subfolder("out").join("mesh.ply");
    let run = |params: &Params| {
        util::builder(&inputs, &output, params)
            .build()
            .unwrap()
            .run()
    };
    let report = run(&Params::default()).unwrap();
    let crs = report.input.crs.clone().unwrap();
    assert_eq!((crs.horizontal, crs.vertical), (Some(32617), None));
    assert_eq!(report.warnings.len(), 1, "{:?}", report.warnings);
    assert!(report.warnings[0].contains("b.xyz: it gives no reference system, as 1 of 2 files"));
    let (_, text) = header(&output);
    assert!(
        text.contains("\ncomment epsg 32617\ncomment crs EPSG:32617\n"),
        "{text}"
    );
    let beside = std::fs::read_to_string(output.with_extension("prj")).unwrap();
    assert_eq!(beside.trim_end(), wkt(32617));
    std::fs::remove_dir_all(output.parent().unwrap()).unwrap();
    bench.subfolder("out");
    // Two systems: no work is begun.
    bench.write("b.prj", wkt(32618));
    let [a, b] = &inputs;
    let program = |more: &[&str]| {
        let mut arguments: Vec<&std::ffi::OsStr> = vec!["reconstruct".as_ref()];
        arguments.extend(inputs.iter().map(|path| path.as_os_str()));
        arguments.extend(["-o".as_ref(), output.as_os_str()]);
        arguments.extend(more.iter().map(AsRef::<std::ffi::OsStr>::as_ref));
        util::run(arguments)
    };
    let said = program(&[]);
    let expected = format!(
        "outcrop: {}: reference system: found EPSG:32618, expected EPSG:32617, that of {}; --ignore-crs",
        b.display(),
        a.display()
    );
    assert_eq!(said.code, Some(2));
    assert!(said.err.starts_with(&expected), "{}", said.err);
    assert_eq!(util::listing(output.parent().unwrap()), [""; 0]);
    let said = program(&["--ignore-crs"]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert!(
        said.err
            .contains("coordinates are taken as they are, in no system"),
        "{}",
        said.err
    );
    let (_, text) = header(&output);
    assert!(!text.contains("crs") && !text.contains("epsg"), "{text}");
    assert_eq!(util::listing(output.parent().unwrap()), ["mesh.ply"]);
    let said = util::run(["info".as_ref(), a.as_os_str()]);
    assert!(
        said.out.contains("EPSG:32617 UTM zone (.prj file)"),
        "{}",
        said.out
    );
    let said = util::run([
        "info".as_ref(),
        "--json".as_ref(),
        a.as_os_str(),
        b.as_os_str(),
    ]);
    let info: Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!(info["input"]["crs"], Value::Null);
    assert_eq!(info["input"]["files"][1]["crs"]["horizontal"], 32618);
    assert_eq!(info["input"]["files"][1]["crs"]["source"], "prj");
}

#[test]
fn the_system_of_an_input_is_not_overwritten() {
    let bench = Bench::new();
    let cloud = bench.write("site.xyz", hills(0.35, 3).concat());
    let prj = bench.write("site.prj", wkt(32617));
    util::reconstruct(&cloud, &bench.path("site.ply"), &Params::default());
    assert_eq!(std::fs::read_to_string(&prj).unwrap(), wkt(32617));
}

#[test]
fn far_points_are_left_out_and_said() {
    let bench = Bench::new();
    let mut lines = hills(0.35, 3);
    let (near, alone) = (
        bench.write("near.xyz", lines.concat()),
        bench.path("alone.ply"),
    );
    util::reconstruct(&near, &alone, &Params::default());
    lines.insert(1000, "0.000 0.000 0.000\n".into());
    lines.push("1.5 2.25 -12345678.125\n".into());
    let cloud = bench.write("cloud.xyz", lines.concat());
    let output = bench.path("mesh.ply");
    let report = util::reconstruct(&cloud, &output, &Params::default());
    assert_eq!((report.input.dropped_far, report.input.kept), (2, 4900));
    assert_eq!(report.duplicates_folded, 0);
    assert!(report.warnings[0].starts_with("2 points left out, far from all others (one at "));
    assert_eq!(util::hash(&output), util::hash(&alone));
    let keep = Params {
        keep_far: true,
        ..Params::default()
    };
    let report = util::reconstruct(&cloud, &output, &keep);
    assert_eq!(report.input.dropped_far, 0);
    assert!(report.lattice.step > 0.001 && !report.lattice.exact);
}

#[test]
fn values_stay_with_their_points_when_others_are_left_out() {
    let bench = Bench::new();
    let header = |count: usize| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex {count}\nproperty double x\nproperty double y\n\
             property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
        )
    };
    let coloured = |(number, line): (usize, &String)| {
        format!("{} {} {} 9\n", line.trim_end(), number % 256, number / 256)
    };
    let mut lines: Vec<String> = hills(0.35, 3).iter().enumerate().map(coloured).collect();
    let write =
        |name: &str, lines: &[String]| bench.write(name, header(lines.len()) + &lines.concat());
    let params = Params {
        attributes: outcrop_points::Attributes::Auto,
        ..Params::default()
    };
    let (near, alone) = (write("near.ply", &lines), bench.path("alone.ply"));
    util::reconstruct(&near, &alone, &params);
    lines.insert(17, "0.000 0.000 0.000 1 2 3\n".into());
    let output = bench.path("mesh.ply");
    let report = util::reconstruct(&write("far.ply", &lines), &output, &params);
    assert_eq!(report.input.dropped_far, 1);
    assert_eq!(util::hash(&output), util::hash(&alone));
    assert!(header_text(&output).contains("property uchar red"));
}

fn header_text(path: &Path) -> String {
    header(path).1
}
