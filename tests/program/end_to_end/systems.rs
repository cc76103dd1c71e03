//! Reference systems that are given or told, files beside the mesh, and scanners far from the origin of coordinates.

use crate::end_to_end::scanners::{facing, ptx, room, run};
use crate::end_to_end::util::{self, Bench, Said};
use e57::{E57Writer, Quaternion, Record, RecordValue, Transform, Translation};
use outcrop::params::Params;
use outcrop_cloudgen::{Cloud, Kind};
use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// A scan as E57, of a scanner at `to`; its points are moved there by its pose.
fn e57(path: &Path, to: [f64; 3], points: &[[f64; 3]]) {
    let fields = [
        Record::CARTESIAN_X_F64,
        Record::CARTESIAN_Y_F64,
        Record::CARTESIAN_Z_F64,
        Record {
            name: e57::RecordName::RowIndex,
            data_type: e57::RecordDataType::Integer {
                min: 0,
                max: 1 << 20,
            },
        },
        Record {
            name: e57::RecordName::ColumnIndex,
            data_type: e57::RecordDataType::Integer {
                min: 0,
                max: 1 << 20,
            },
        },
    ];
    let mut writer = E57Writer::from_file(path, "file").unwrap();
    let mut scan = writer.add_pointcloud("scan", fields.to_vec()).unwrap();
    scan.set_transform(Some(Transform {
        rotation: Quaternion {
            w: 1.0,
            x: 0.0,
            y: 0.0,
            z: 0.0,
        },
        translation: Translation {
            x: to[0],
            y: to[1],
            z: to[2],
        },
    }));
    for (number, point) in points.iter().enumerate() {
        let mut row: Vec<_> = point.iter().map(|c| RecordValue::Double(*c)).collect();
        row.push(RecordValue::Integer(number as i64));
        row.push(RecordValue::Integer(0));
        scan.add_point(row).unwrap();
    }
    scan.finalize().unwrap();
    writer.finalize().unwrap();
}

#[test]
fn rooms_in_national_coordinates_face_their_scanners() {
    let bench = Bench::new();
    let points = room([0.0; 3], &[], 1);
    // A zone of UTM, geocentric coordinates, and a site with large numbers.
    for (number, to) in [
        [691_000.0, 5_334_000.0, 515.0],
        [4_156_305.5, -671_404.25, 4_774_508.75],
        [-1.2e7, 3.0, 6.5e7],
    ]
    .into_iter()
    .enumerate()
    {
        let text = bench.write(&format!("{number}.ptx"), ptx(to, to, &points));
        let binary = bench.path(&format!("{number}.e57"));
        e57(&binary, to, &points);
        for cloud in [text, binary] {
            let mesh = bench.path("mesh.ply");
            let report = run(std::slice::from_ref(&cloud), &mesh, &Params::default());
            let shown = cloud.display();
            assert_eq!(report.scanners, [to], "{shown}");
            assert_eq!(report.warnings, [""; 0], "{shown}");
            let share = facing(&mesh, to, 9.0);
            assert!(share > 0.99, "{shown}: {share} face the scanner");
        }
    }
}

const UTM: &str = "PROJCS[\"ETRS89 / UTM zone 32N\",GEOGCS[\"ETRS89\"],UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"25832\"]]";

/// A cloud with a `.prj` file beside it, and one without, in a folder for clouds.
fn clouds(bench: &Bench) -> [PathBuf; 2] {
    bench.subfolder("in");
    let cloud = Cloud::new(Kind::Terrain).points(2_000);
    let with = bench.cloud("in/with.ply", &cloud);
    bench.write("in/with.prj", UTM);
    [with, bench.cloud("in/without.ply", &cloud.seed(2))]
}

/// The program with these words.
fn say(words: &[&OsStr]) -> Said {
    util::run(words)
}

/// Makes a mesh with more options; returns what was said.
fn made(cloud: &Path, mesh: &Path, more: &[&str]) -> Said {
    let words = [
        "reconstruct".as_ref(),
        cloud.as_os_str(),
        "-o".as_ref(),
        mesh.as_os_str(),
    ];
    let more = more.iter().map(AsRef::<OsStr>::as_ref);
    let said = say(&words.into_iter().chain(more).collect::<Vec<_>>());
    assert_eq!(said.code, Some(0), "{said:?}");
    said
}

#[test]
fn no_file_beside_a_mesh_outlives_it() {
    let bench = Bench::new();
    let [with, without] = clouds(&bench);
    let (mesh, prj) = (bench.path("mesh.ply"), bench.path("mesh.prj"));
    assert_eq!(made(&with, &mesh, &["--origin", "1,2,0"]).err, "");
    assert!(prj.exists() && bench.path("mesh.origin.json").exists());
    let said = made(&without, &mesh, &[]).err;
    assert!(
        said.contains("mesh.prj: deleted, it was of an earlier mesh of this name, in EPSG:25832"),
        "{said}"
    );
    assert_eq!(util::listing(bench.folder()), ["in", "mesh.ply"]);
    // Another system by its code alone: the text of the first is not that of the mesh.
    made(&with, &mesh, &[]);
    made(&without, &mesh, &["--crs", "EPSG:32633"]);
    assert!(!prj.exists());
    // The same by its code alone: the text stays true.
    made(&with, &mesh, &[]);
    assert_eq!(made(&without, &mesh, &["--crs", "EPSG:25832"]).err, "");
    assert!(prj.exists());
}

#[test]
fn files_of_others_beside_a_mesh_stay() {
    let bench = Bench::new();
    let [with, without] = clouds(&bench);
    let prj = bench.write("own.prj", format!("\n{UTM}"));
    let said = made(&without, &bench.path("own.ply"), &[]).err;
    assert!(
        said.contains("own.prj: it gives EPSG:25832, and stays, for it is not of outcrop"),
        "{said}"
    );
    assert!(prj.exists());
    // Two meshes of one name: what belongs to the first stays while that is there.
    made(&with, &bench.path("two.ply"), &["--origin", "1,2,0"]);
    let said = made(&without, &bench.path("two.glb"), &[]).err;
    assert!(
        said.contains("two.prj: it gives EPSG:25832, and stays for "),
        "{said}"
    );
    assert!(said.contains("two.origin.json: it stays for "), "{said}");
    assert!(bench.path("two.prj").exists() && bench.path("two.origin.json").exists());
    std::fs::remove_file(bench.path("two.ply")).unwrap();
    made(&without, &bench.path("two.glb"), &[]);
    assert!(!bench.path("two.prj").exists() && !bench.path("two.origin.json").exists());
}

/// `info --json` of a cloud.
fn info(cloud: &Path, more: &[&str]) -> (Value, String) {
    let words = ["info".as_ref(), "--json".as_ref(), cloud.as_os_str()];
    let more = more.iter().map(AsRef::<OsStr>::as_ref);
    let said = say(&words.into_iter().chain(more).collect::<Vec<_>>());
    assert_eq!(said.code, Some(0), "{said:?}");
    (serde_json::from_str(&said.out).unwrap(), said.err)
}

fn header(mesh: &Path) -> String {
    let bytes = std::fs::read(mesh).unwrap();
    let end = outcrop_ply::Header::read(&mut &bytes[..]).unwrap().bytes;
    String::from_utf8(bytes[..end as usize].to_vec()).unwrap()
}

#[test]
fn the_system_that_is_given_goes_before_that_of_files() {
    let bench = Bench::new();
    let [with, without] = clouds(&bench);
    let mesh = bench.path("mesh.ply");
    let said = made(&with, &mesh, &["--crs", "EPSG:6543+5703"]).err;
    assert!(
        said.contains("--crs: EPSG:6543+5703 is taken instead of EPSG:25832, which "),
        "{said}"
    );
    let text = header(&mesh);
    assert!(
        text.contains("\ncomment epsg 6543\ncomment crs EPSG:6543+5703\ncomment heightunit 1\n"),
        "{text}"
    );
    assert!(!bench.path("mesh.prj").exists());
    // A text is beside the mesh as it is.
    let file = bench.write("site.wkt", UTM);
    assert_eq!(
        made(&without, &mesh, &["--crs", file.to_str().unwrap()]).err,
        ""
    );
    assert_eq!(
        std::fs::read_to_string(bench.path("mesh.prj")).unwrap(),
        format!("{UTM}\n")
    );
    // Files of several systems are no error then.
    bench.write("in/without.prj", UTM.replace("25832", "32633"));
    let said = made(&bench.path("in"), &mesh, &["--crs", "EPSG:25833"]).err;
    assert!(
        said.contains("--crs: EPSG:25833 is taken for all files, though "),
        "{said}"
    );
    let (info, said) = info(&with, &["--crs", "EPSG:2994+6360"]);
    assert!(
        said.contains("EPSG:2994+6360 is taken instead of EPSG:25832"),
        "{said}"
    );
    let crs = &info["input"]["crs"];
    assert_eq!(
        (&crs["horizontal"], &crs["vertical"]),
        (&2994.into(), &6360.into())
    );
    assert_eq!(
        (&crs["source"], &crs["kind"]),
        (&"given".into(), &"projected".into())
    );
    assert_eq!(
        (&crs["unit"], &crs["height_unit"]),
        (&0.3048.into(), &(1200.0 / 3937.0).into())
    );
    assert_eq!(info["input"]["files"][0]["crs"]["horizontal"], 25832);
    let said = say(&[
        "info".as_ref(),
        with.as_os_str(),
        "--crs".as_ref(),
        "epsg:2994+6360".as_ref(),
    ]);
    let line = "system       EPSG:2994+6360 (--crs), in feet, heights in US survey feet\n";
    assert!(said.out.contains(line), "{}", said.out);
    for (wrong, part) in [
        ("EPSG:", "is no code like EPSG:25832"),
        ("25832", "nor a file that can be read"),
        (
            without.to_str().unwrap(),
            "no well-known text of a reference system",
        ),
    ] {
        let words = [
            "reconstruct",
            with.to_str().unwrap(),
            "-o",
            mesh.to_str().unwrap(),
            "--crs",
            wrong,
        ];
        let said = util::run(words);
        assert_eq!(said.code, Some(2));
        assert!(said.err.contains(part), "{}", said.err);
    }
}

#[test]
fn degrees_are_no_lengths_and_it_is_said() {
    let bench = Bench::new();
    let text = |x: f64, y: f64| -> String {
        let point = |n: u32| {
            let [i, j] = [n % 20, n / 20].map(f64::from);
            let z = 400.0 + (i * 0.3).sin();
            format!("{:.7} {:.7} {z:.3}\n", x + i * 1e-5, y + j * 1e-5)
        };
        (0..400).map(point).collect()
    };
    for (code, at, wanted) in [
        (4326, [9.0, 48.0], "out_srs=EPSG:32632`"),
        (4326, [-70.6, -33.4], "out_srs=EPSG:32719`"),
        (4258, [11.5, 53.1], "out_srs=EPSG:32632`"),
    ] {
        let cloud = bench.write("cloud.xyz", text(at[0], at[1]));
        bench.write(
            "cloud.prj",
            format!("GEOGCS[\"x\",UNIT[\"degree\",0.0174],AUTHORITY[\"EPSG\",\"{code}\"]]"),
        );
        let said = [
            info(&cloud, &[]).1,
            made(&cloud, &bench.path("mesh.ply"), &[]).err,
        ];
        for said in said {
            let words = format!(
                "its reference system EPSG:{code} is in degrees, so the mesh would be in degrees by metres: \
                 reproject the cloud first, as with `pdal translate "
            );
            assert!(said.contains(&words) && said.contains(wanted), "{said}");
        }
    }
    // Numbers that cannot be degrees: the system is wrong.
    let cloud = bench.write("cloud.xyz", text(691_000.0, 5_334_000.0));
    let (_, said) = info(&cloud, &[]);
    assert!(
        said.contains("is in degrees, but coordinates reach 5334000.00019: it is wrong"),
        "{said}"
    );
    assert_eq!(info(&cloud, &["--crs", "EPSG:25832"]).1.lines().count(), 1);
    bench.write(
        "cloud.prj",
        "GEOCCS[\"x\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"4978\"]]",
    );
    let (_, said) = info(&cloud, &[]);
    assert!(
        said.contains("its coordinates are geocentric (EPSG:4978), so z is not up"),
        "{said}"
    );
}

#[test]
fn meshes_of_all_formats_keep_small_coordinates() {
    let bench = Bench::new();
    let far = Cloud::new(Kind::Terrain)
        .points(3_000)
        .offset([691_000.0, 5_334_000.0, 300.0]);
    let cloud = bench.cloud("cloud.laz", &far);
    let mesh = |name: &str, more: &[&str]| {
        let path = bench.path(name);
        made(&cloud, &path, &[&["--origin", "auto"], more].concat());
        std::fs::read(path).unwrap()
    };
    let ply = mesh("mesh.ply", &[]);
    let ply = outcrop_ply::Mesh::read(&ply[..], ply.len() as u64).unwrap();
    let most = |k: usize| ply.vertices.iter().map(|p| p[k].abs()).fold(0.0, f64::max);
    for (name, more) in [("plain.glb", &[][..]), ("packed.glb", &["--compress-glb"])] {
        let bytes = mesh(name, more);
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        let translation = &json["nodes"][1]["translation"];
        for k in 0..3 {
            let moved = translation[k].as_f64().unwrap();
            assert!(moved.abs() <= most(k), "{name}: {translation}");
        }
        let comments = json["asset"]["extras"]["comments"].to_string();
        assert!(comments.contains("offsetx 69"), "{comments}");
        let beside = bench.path(name).with_extension("origin.json");
        let beside: Value = serde_json::from_slice(&std::fs::read(beside).unwrap()).unwrap();
        assert!(beside["origin"][1].as_f64().unwrap() >= 5_000_000.0);
    }
    // Without an origin of its own, the coordinates of the node are those of the cloud.
    let path = bench.path("none.glb");
    made(&cloud, &path, &[]);
    let bytes = std::fs::read(path).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    assert!(json["nodes"][1]["translation"][1].as_f64().unwrap() > 5e6);
}
