//! Inputs behind URLs: what `info` says of them, sets of tiles that change, and what is refused.

use crate::ingest::bench::{Bench, cloud};
use crate::ingest::point_tiles;
use crate::ingest::regions::{copc, within};
use crate::ingest::server::{Server, age, renew};
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::Cancel;
use outcrop_formats::{Reads, ingest, ingest_selected, probe_near};
use outcrop_points::Layout;
use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// What a run reads of a region of a file.
fn reads(file: &Path, region: Option<(&str, f64)>) -> Reads {
    let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    let crop = region.and_then(|(region, margin)| within(region, margin).crop);
    let probe = probe_near(
        file,
        &Layout::default(),
        crop.as_ref(),
        &memory,
        &Cancel::new(),
    );
    assert_eq!(memory.available(), memory.capacity());
    probe.unwrap().reads.unwrap()
}

fn run<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>, fault: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_outcrop"));
    command.args(arguments).stdin(Stdio::null());
    command.env("OUTCROP_FAULT", fault).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn of_copc_the_chunks_are_told_that_a_run_reads() {
    let bench = Bench::new();
    let file = bench.write("a.copc.laz", copc(|_| {}));
    let server = Server::of(file.parent().unwrap());
    for (region, margin, chunks) in [
        ("10,10,90,90", 0.0, 2),
        ("10,10,90,90", 170.0, 5),
        ("10,10,400,90", 5.0, 3),
        ("1000,1000,1400,1090", 5.0, 0),
    ] {
        let here = reads(&file, Some((region, margin)));
        let there = reads(&server.url("a.copc.laz"), Some((region, margin)));
        assert_eq!(here, there);
        assert_eq!(here.points, 400 * chunks, "{region}");
        assert!(!here.is_estimated && here.bytes_of_all == file.metadata().unwrap().len());
        if chunks == 0 {
            assert_eq!(here.bytes, 0);
            continue;
        }
        let spool = ingest_selected(
            std::slice::from_ref(&file),
            &within(region, margin),
            &bench.workspace,
        );
        assert_eq!(spool.unwrap().stats().read, here.points, "{region}");
        // Five chunks of equal size, and the header.
        let chunk = here.bytes / chunks;
        assert!(chunk * 5 < here.bytes_of_all && chunk * 6 > here.bytes_of_all / 2);
    }
    let all = reads(&file, None);
    assert_eq!((all.bytes, all.points), (all.bytes_of_all, 2000));
    // A damaged hierarchy makes a run read all.
    let file = bench.write("b.copc.laz", copc(|root| root[32] = 200));
    let damaged = reads(&file, Some(("10,10,90,90", 0.0)));
    assert_eq!(damaged.bytes, damaged.bytes_of_all);
}

#[test]
fn a_hierarchy_on_a_server_sizes_no_allocation() {
    let bench = Bench::new();
    let sized = |size: u32| {
        copc(move |root: &mut Vec<u8>| root[96 + 24..96 + 28].copy_from_slice(&size.to_le_bytes()))
    };
    // A page of almost 2 GiB in a file that is as large, and has nothing there.
    let path = bench.write("a.copc.laz", sized(0x7fff_ffe0));
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    file.set_len(3 << 30).unwrap();
    let whole = reads(&path, Some(("10,10,90,90", 0.0)));
    assert!(whole.bytes <= whole.bytes_of_all);
}

#[test]
fn of_tiles_those_are_told_that_a_run_reads() {
    let bench = Bench::new();
    let all = cloud(20_000, 4);
    let server = Server::of(bench.path("").as_path());
    for data in ["laszip", "binary", "zstandard"] {
        point_tiles::write(&bench.path(data), data, &all);
        let ept = server.url(&format!("{data}/ept.json"));
        let size = |name: &str| -> u64 {
            let files = std::fs::read_dir(bench.path(data).join(name)).unwrap();
            files
                .map(|file| file.unwrap().metadata().unwrap().len())
                .sum()
        };
        let region = ("400010,5000010,400050,5000060", 2.0);
        let (some, whole) = (reads(&ept, Some(region)), reads(&ept, None));
        let stored = size("ept-data");
        // Small files of LAZ and Zstandard have heads and tables.
        let exact = data == "binary";
        assert_eq!(whole.is_estimated, !exact);
        let near = |found: u64, is: u64| match exact {
            true => found == is,
            false => found * 3 > is && found < is * 3,
        };
        assert!(near(whole.bytes, stored), "{data}: {whole:?} {stored}");
        assert_eq!((whole.points, whole.parts), (20_000, None));
        server.sent();
        let selection = within(region.0, region.1);
        let spool = ingest_selected(&[ept], &selection, &bench.workspace).unwrap();
        assert_eq!(spool.stats().read, some.points, "{data}");
        let sent = server.sent();
        assert!(some.parts.unwrap() > 2 && some.points < 10_000, "{some:?}");
        if exact {
            let about = size("ept-hierarchy") + 4096;
            assert!(sent >= some.bytes && sent < some.bytes + about);
        }
    }
}

#[test]
fn info_tells_it_in_one_line_and_as_numbers() {
    let bench = Bench::new();
    bench.write("a.copc.laz", copc(|_| {}));
    let server = Server::of(bench.path("").as_path());
    let url = server.url("a.copc.laz");
    let url = url.to_str().unwrap();
    let said = run(
        ["info", url, "--crop", "10,10,90,90", "--crop-margin", "0"],
        "",
    );
    let said = text(&said.stdout);
    let line = said.lines().find(|line| line.starts_with("a run "));
    let line = line.unwrap_or_else(|| panic!("{said}"));
    assert!(
        line.starts_with("a run with this --crop reads ")
            && line.ends_with(": 800 points in 2 chunks or tiles"),
        "{line}"
    );
    let json = run(
        [
            "info",
            url,
            "--json",
            "--crop",
            "10,10,90,90",
            "--crop-margin",
            "0",
        ],
        "",
    );
    let json: Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(
        (&json["reads"]["points"], &json["reads"]["parts"]),
        (&800.into(), &2.into())
    );
    assert_eq!(json["reads"], json["headers"][0]["reads"]);
    assert!(json["reads"]["bytes"].as_u64() < json["reads"]["bytes_of_all"].as_u64());
    let said = text(&run(["info", url], "").stdout);
    assert!(said.contains("\na run reads all: "), "{said}");
}

/// A set of tiles on a server, of a surface; and the arguments of a run.
fn surface(bench: &Bench, data: &str, mesh: &Path) -> (PathBuf, Vec<String>, Server) {
    let points: Vec<[i32; 3]> = (0..10_000)
        .map(|n| [n % 100 * 1000, n / 100 * 1000, n * 7 % 50])
        .collect();
    let folder = bench.path("set");
    point_tiles::write(&folder, data, &points);
    let files = walk(&folder);
    files.iter().for_each(|file| age(file));
    let server = Server::of(&folder);
    let url = server.url("ept.json").to_str().unwrap().to_owned();
    let mesh = mesh.to_str().unwrap().to_owned();
    let arguments = [
        "reconstruct",
        &url,
        "-o",
        &mesh,
        "--threads",
        "1",
        "--quiet",
    ];
    (folder, arguments.map(str::to_owned).to_vec(), server)
}

fn walk(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let files = entries.flat_map(|entry| match entry.unwrap().path() {
        path if path.is_dir() => walk(&path),
        path => vec![path],
    });
    files.collect()
}

/// A run that is killed after its eighth record, in the middle of reading, and goes on after a change.
fn gone_on(data: &str, change: impl Fn(&Path)) -> Output {
    let bench = Bench::new();
    let mesh = bench.path("mesh.ply");
    let (folder, arguments, _server) = surface(&bench, data, &mesh);
    let killed = run(&arguments, "recorded:8");
    assert!(killed.status.code().is_none(), "{}", text(&killed.stderr));
    change(&folder);
    let again = run(arguments.iter().map(String::as_str).chain(["--resume"]), "");
    let stayed = bench.path("mesh.ply.outcrop-scratch").exists();
    assert_eq!(stayed, !again.status.success(), "{}", text(&again.stderr));
    again
}

#[test]
fn a_tile_that_changes_ends_the_run() {
    for data in ["laszip", "binary"] {
        let same = gone_on(data, |_| {});
        assert!(same.status.success(), "{}", text(&same.stderr));
        for (name, later) in [
            ("ept-data/3-", "newest"),
            ("ept-hierarchy/1-0-0-0", ""),
            ("ept-data/0-", "root"),
        ] {
            if (later, data) == ("root", "binary") {
                // It is read once.
                continue;
            }
            let changed = gone_on(data, |folder| {
                let mut files = walk(folder);
                files.sort();
                let is = |file: &&PathBuf| file.to_str().unwrap().contains(name);
                // The last of them is read at the end.
                let file = files.iter().rfind(is).unwrap();
                renew(file);
            });
            let said = text(&changed.stderr);
            assert_eq!(changed.status.code(), Some(2), "{data} {name}: {said}");
            assert!(
                said.contains(name)
                    && said.contains("has changed on the server since the run began"),
                "{said}"
            );
        }
    }
}

#[test]
fn what_is_refused_behind_urls_is_told_in_one_line() {
    let bench = Bench::new();
    let server = Server::of(bench.path("").as_path());
    let mut zip = b"PK\x03\x04".to_vec();
    zip.resize(4000, 0);
    bench.write("a.zip", zip);
    bench.write("a.prj", "PROJCS[\"x\"]");
    bench.write("mesh.ply", "ply\nformat ascii 1.0\nend_header\n");
    let url = |name: &str| server.url(name).to_str().unwrap().to_owned();
    let host = url("").trim_start_matches("http://").to_owned();
    let mesh = url("mesh.ply");
    let page = bench.path("page.html");
    let page = page.to_str().unwrap();
    let local = "clouds are read from servers, meshes from this machine";
    let cloud = bench.write("a.xyz", "0 0 0\n1 0 0\n0 1 0\n");
    let cloud = cloud.to_str().unwrap();
    for (arguments, expected) in [
        (&["info", &url("a.zip")][..], "a ZIP archive on a server"),
        (&["info", &url("a.prj")], "text that is no list of points"),
        (
            &["info", &url("folder/")],
            "a folder of a web server, which lists no files",
        ),
        (&["info", &url("absent.laz")], "404"),
        (&["info", "s3:///a.laz"], "the URL has no host or bucket"),
        (
            &["info", &format!("http://me:hush@{host}a.laz")],
            "the URL has a password",
        ),
        (
            &["info", &url("a.laz?X-Amz-Signature=hush")],
            "the URL has a credential in it",
        ),
        (
            &[
                "plan",
                cloud,
                "-o",
                "m.ply",
                "--scratch",
                "s3://me:hush@bucket/a",
            ],
            "the URL has a password",
        ),
        (&["verify", &mesh], local),
        (&["volume", &mesh], local),
        (&["tiles", &mesh, "-o", page], local),
        (&["simplify", &mesh, "-o", page, "--ratio", "0.5"], local),
        (&["close", &mesh, "-o", page], local),
        (&["view", &mesh, "--html", page], local),
        (
            &["reconstruct", "a.laz", "-o", &mesh],
            "web servers take no files",
        ),
        (
            &["plan", "a.laz", "-o", "s3://bucket/mesh.ply"],
            "is sent to a store afterwards",
        ),
    ] {
        let said = run(arguments, "");
        let (text, out) = (text(&said.stderr), text(&said.stdout));
        assert_eq!(said.status.code(), Some(2), "{arguments:?}: {text}{out}");
        assert!(text.contains(expected), "{arguments:?}: {text}");
        assert_eq!(text.lines().count(), 1, "{arguments:?}: {text}");
        assert!(!text.contains("hush"), "{text}");
    }
}

#[test]
fn reference_systems_beside_files_on_servers_are_not_looked_for() {
    let bench = Bench::new();
    let file = bench.write("a.xyz", "0 0 0\n1 0 0\n0 1 0\n");
    bench.write("a.prj", "LOCAL_CS[\"site\",UNIT[\"metre\",1]]");
    let server = Server::of(file.parent().unwrap());
    let crs = |path: PathBuf| {
        let spool = ingest(&[path], &bench.workspace).unwrap();
        spool.stats().crs.clone()
    };
    assert!(crs(file).is_some());
    for _ in 0..2 {
        assert!(crs(server.url("a.xyz")).is_none());
    }
    // Requests are counted once, and to the end.
    let memory = &bench.workspace.memory;
    assert_eq!(memory.capacity() - memory.available(), 4 << 20);
}
