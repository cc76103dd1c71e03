//! Two meshes in one place and points beside them: what the page is told, and what the program refuses.

use super::bench::{Bench, get, root};
use super::program;
use outcrop::Silent;
use outcrop_view::{Part, Server};
use serde_json::Value;
use std::fmt::Write;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

fn scene(server: &Server) -> Value {
    let answer = get(server, &format!("{}scene.json", root(server)));
    assert_eq!(answer.status, 200);
    assert!(
        answer.head.contains("content-type: application/json"),
        "{}",
        answer.head
    );
    serde_json::from_slice(&answer.body).unwrap()
}

#[test]
fn a_single_folder_is_there_at_once() {
    let bench = Bench::new();
    let server = Server::start(&bench.mesh(), None).unwrap();
    let part = &scene(&server)["parts"][0];
    assert_eq!(
        (&part["state"], &part["path"], &part["name"]),
        (&"ready".into(), &"mesh/".into(), &"mesh".into())
    );
}

#[test]
fn parts_come_one_by_one_to_a_page_that_is_there() {
    let bench = Bench::new();
    let parts = [
        (Part::First, "before.ply".to_owned()),
        (Part::Points, "scan.laz".to_owned()),
    ];
    let server = Server::open(&parts, None).unwrap();
    let (root, states) = (root(&server), |json: &Value| {
        let parts = json["parts"].as_array().unwrap();
        parts
            .iter()
            .map(|part| part["state"].as_str().unwrap().to_owned())
            .collect::<Vec<_>>()
    });
    assert_eq!(get(&server, &root).status, 200);
    assert_eq!(states(&scene(&server)), ["waiting", "waiting"]);
    assert_eq!(
        get(&server, &format!("{root}mesh/tileset.json")).status,
        404
    );
    let observer = server.observer(Part::First, Arc::new(Silent));
    observer.begin("cells", "triangles", 200);
    observer.advance(50);
    let json = scene(&server);
    assert_eq!(states(&json), ["making", "waiting"]);
    assert_eq!(
        (
            &json["parts"][0]["work"]["stage"],
            &json["parts"][0]["work"]["done"]
        ),
        (&"cells".into(), &50.into())
    );
    server.show(Part::First, &bench.mesh()).unwrap();
    assert_eq!(states(&scene(&server)), ["ready", "waiting"]);
    assert_eq!(
        get(&server, &format!("{root}mesh/tileset.json")).status,
        200
    );
    for path in [
        "points/tileset.json",
        "second/tileset.json",
        "mesh/../points",
        "scene.json/x",
    ] {
        assert_eq!(get(&server, &format!("{root}{path}")).status, 404, "{path}");
    }
    server.show(Part::Points, &bench.mesh()).unwrap();
    assert_eq!(
        get(&server, &format!("{root}points/tiles/0.glb")).status,
        200
    );
    assert_eq!(
        get(&server, "/scene.json").status,
        404,
        "without the secret"
    );
    // The page learns why there is no more, and the program does not wait for a page that is not there.
    server.fail("no triangle");
    assert_eq!(scene(&server)["failed"], "no triangle");
}

/// A mesh of two triangles and a cloud of `count` points beside it, with a reference system.
fn files(folder: &Path, name: &str, x: f64, epsg: Option<u32>) -> PathBuf {
    let path = folder.join(name);
    let system = epsg.map_or(String::new(), |code| format!("comment epsg {code}\n"));
    let corners =
        [[0, 0], [9, 0], [9, 9], [0, 9]].map(|[a, b]| format!("{} {b} 1.5\n", x + f64::from(a)));
    let text = format!(
        "ply\nformat ascii 1.0\n{system}element vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
         element face 2\nproperty list uchar int vertex_indices\nend_header\n{}3 0 1 2\n3 0 2 3\n",
        corners.concat()
    );
    std::fs::write(&path, text).unwrap();
    path
}

/// A running program with the line that it wrote.
struct Running(Child, String);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn running(args: &[&Path]) -> Running {
    let mut child = Command::new(env!("CARGO_BIN_EXE_outcrop"))
        .args(["view", "--no-browser", "--quiet"])
        .args(args)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut url = String::new();
    let mut lines = BufReader::new(child.stdout.take().unwrap());
    lines.read_line(&mut url).unwrap();
    Running(child, url.trim().to_owned())
}

/// What the program shows when all of it is there.
fn shown(running: &Running) -> Value {
    let (_, rest) = running.1.split_once("http://").unwrap();
    let (host, path) = rest.split_once('/').unwrap();
    let since = Instant::now();
    loop {
        let mut stream = std::net::TcpStream::connect(host).unwrap();
        let head =
            format!("GET /{path}scene.json HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        std::io::Write::write_all(&mut stream, head.as_bytes()).unwrap();
        let mut answer = String::new();
        std::io::Read::read_to_string(&mut stream, &mut answer).unwrap();
        let json: Value = serde_json::from_str(answer.split_once("\r\n\r\n").unwrap().1).unwrap();
        let parts = json["parts"].as_array().unwrap();
        if parts.iter().all(|part| part["state"] == "ready") {
            return json;
        }
        assert!(
            since.elapsed() < Duration::from_secs(60) && json["failed"].is_null(),
            "{json}"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn two_meshes_and_a_cloud_are_in_one_place() {
    let place = tempfile::tempdir().unwrap();
    let before = files(place.path(), "before.ply", 500_000.0, Some(25832));
    let after = files(place.path(), "after.ply", 500_002.5, Some(25832));
    let cloud = place.path().join("cloud.xyz");
    let mut text = String::new();
    (0..500).for_each(|n| writeln!(text, "{} {} 1", 500_004 + n % 9, n / 9).unwrap());
    std::fs::write(&cloud, text).unwrap();
    let program = running(&[
        &before,
        &after,
        "--points".as_ref(),
        &cloud,
        "--points-limit".as_ref(),
        "100".as_ref(),
    ]);
    let json = shown(&program);
    let matrix = |n: usize| &json["parts"][n]["matrix"];
    assert_eq!(matrix(0), &Value::Null);
    assert_eq!((&matrix(1)[12], &matrix(1)[13]), (&2.5.into(), &0.0.into()));
    assert_eq!(
        (&matrix(2)[12], &matrix(2)[14]),
        (&4.0.into(), &(-0.5).into())
    );
    assert_eq!(json["parts"][1]["name"], "after.ply");
    drop(program);
}

#[test]
fn what_cannot_be_shown_together_gets_one_line() {
    let place = tempfile::tempdir().unwrap();
    let path = |name: &str| place.path().join(name);
    let tiles = |name: &str, epsg| {
        let mesh = files(place.path(), &format!("{name}.ply"), 500_000.0, epsg);
        let made = outcrop::Tiles::new(&mesh, path(name)).run();
        made.unwrap();
        path(name)
    };
    let (here, there) = (tiles("here", Some(25832)), tiles("there", Some(25833)));
    let mesh = files(place.path(), "mesh.ply", 500_000.0, Some(25833));
    std::fs::write(path("empty.xyz"), "").unwrap();
    let option = |text: &'static str| Path::new(text);
    let cases: [(&[&Path], &str); 9] = [
        (&[&here, &there], "EPSG:25833, expected EPSG:25832"),
        (&[&here, &mesh], "EPSG:25833, expected EPSG:25832"),
        (&[&here, &path("absent.ply")], "absent.ply"),
        (&[&here, place.path()], "no tileset.json"),
        (
            &[&here, option("--points"), &path("absent.laz")],
            "absent.laz",
        ),
        (
            &[&here, option("--points"), &path("empty.xyz")],
            "empty.xyz",
        ),
        (
            &[
                &here,
                option("--points"),
                option("x"),
                option("--points-limit"),
                option("0"),
            ],
            "points-limit",
        ),
        (
            &[&here, option("--points-limit"), option("9")],
            "--points <CLOUD>",
        ),
        (&[&mesh, &path("here.ply"), option("--keep=x")], "keep"),
    ];
    for (args, word) in cases {
        let (code, out, err) = program(args);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{err}");
        assert!(err.contains(word), "{word}: {err}");
    }
    for more in [
        &[there.as_path()][..],
        &[option("--points"), &path("mesh.ply")],
    ] {
        let page = path("page.html");
        let args = [&[here.as_path(), option("--html"), &page], more].concat();
        let output = Command::new(env!("CARGO_BIN_EXE_outcrop"))
            .arg("view")
            .args(args)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(!page.exists());
    }
    let left: Vec<_> = std::fs::read_dir(place.path())
        .unwrap()
        .flatten()
        .map(|entry| entry.file_name())
        .collect();
    assert!(
        !left
            .iter()
            .any(|name| name.to_string_lossy().starts_with("outcrop-view-")),
        "{left:?}"
    );
}
