//! What of a folder is read, and what is left out by name.

use crate::ingest::bench::{Bench, cloud, write_las};
use outcrop_formats::expand;
use outcrop_points::Spool;
use std::path::PathBuf;

const MATRIX: &str = "1 0 0 50\n0 1 0 0\n0 0 1 20\n0 0 0 1\n";

const MESH: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n\
                    property double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
                    0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// A folder with a scan.
fn folder(bench: &Bench) -> PathBuf {
    let folder = bench.path("in");
    std::fs::create_dir(&folder).unwrap();
    write_las(
        &folder.join("tile.las"),
        (1, 2),
        0,
        (0.01, [0.0; 3]),
        &cloud(700, 1),
        false,
    );
    folder
}

/// Lines of points.
fn lines(count: u32) -> String {
    (0..count)
        .map(|n| format!("{n} {} 0.5\n", n * n % 97))
        .collect()
}

/// The names of files that are read, and of those that are left out with the reasons.
fn told(spool: &Spool) -> (Vec<String>, Vec<(String, String)>) {
    let name = |path: &PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
    let stats = spool.stats();
    (
        stats.files.iter().map(|file| name(&file.path)).collect(),
        stats
            .left_out
            .iter()
            .map(|file| (name(&file.path), file.why.clone()))
            .collect(),
    )
}

#[test]
fn only_scans_of_a_folder_are_read_and_the_rest_is_told() {
    let bench = Bench::new();
    let folder = folder(&bench);
    let las = std::fs::read(folder.join("tile.las")).unwrap();
    let others: [(&str, &[u8], &str); 15] = [
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a mesh"),
        ("b.stl", b"solid b\nendsolid b\n", "a mesh"),
        ("c.glb", b"glTF\x02\0\0\0", "a mesh"),
        (
            "control_points.txt",
            b"10 20 30\n40 50 60\n",
            "no scan, by \"control\" in its name",
        ),
        (
            "first.bak",
            &las,
            "a backup or an unfinished copy, by its name",
        ),
        (
            "list.csv",
            b"x,y,z\n1,2,3\n4,5,6\n",
            "3 lines, too short for a scan",
        ),
        (
            "matrix.txt",
            MATRIX.as_bytes(),
            "no scan, by \"matrix\" in its name",
        ),
        ("mesh.ply", MESH.as_bytes(), "a mesh with faces"),
        ("notes.txt", b"A cloudy day.\n", "no list of points"),
        (
            "shape.off",
            b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
            "a mesh with faces",
        ),
        ("t.xyz", MATRIX.as_bytes(), "a matrix"),
        (
            "tile.las.tmp",
            &las[..400],
            "a backup or an unfinished copy, by its name",
        ),
        (
            "tile.xyz~",
            b"1 2 3\n",
            "a backup or an unfinished copy, by its name",
        ),
        (
            "trajectory.txt",
            &[],
            "no scan, by \"trajectory\" in its name",
        ),
        ("x.xyz", b"1 2 3\n", "1 lines, too short for a scan"),
    ];
    for (name, bytes, _) in others {
        let long = lines(5000);
        let bytes = if bytes.is_empty() {
            long.as_bytes()
        } else {
            bytes
        };
        std::fs::write(folder.join(name), bytes).unwrap();
    }
    // These are no clouds by any name, and need no word.
    std::fs::write(folder.join("photo.jpg"), b"\xff\xd8\xff\0").unwrap();
    std::fs::write(
        folder.join("tile.prj"),
        "LOCAL_CS[\"site\",UNIT[\"metre\",1]]",
    )
    .unwrap();
    let spool = bench.read(std::slice::from_ref(&folder)).unwrap();
    let (read, left_out) = told(&spool);
    assert_eq!(read, ["tile.las"]);
    let wanted: Vec<_> = others
        .iter()
        .map(|(name, _, why)| ((*name).to_owned(), (*why).to_owned()))
        .collect();
    assert_eq!(left_out, wanted);
    let warnings = &spool.stats().warnings;
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(
        warnings[0].starts_with("left out 15 files in folders, as no scans: "),
        "{warnings:?}"
    );
    assert!(
        warnings[0].ends_with(" and 7 more; a file that is named itself is read"),
        "{warnings:?}"
    );
    assert!(
        warnings[0].contains("matrix.txt (no scan, by \"matrix\" in its name)"),
        "{warnings:?}"
    );
    // Named themselves, they are read as ever.
    let named = [
        folder.clone(),
        folder.join("mesh.ply"),
        folder.join("control_points.txt"),
    ];
    let spool = bench.read(&named).unwrap();
    assert_eq!(
        told(&spool).0,
        ["tile.las", "mesh.ply", "control_points.txt"]
    );
    assert_eq!(spool.points(), 700 + 3 + 2);
}

#[test]
fn scans_that_are_short_or_stand_for_themselves_are_read() {
    let bench = Bench::new();
    let folder = folder(&bench);
    // A tile at the rim of a survey, with others of its kind.
    std::fs::write(folder.join("1.txt"), lines(2000)).unwrap();
    std::fs::write(folder.join("2.txt"), lines(5)).unwrap();
    // A cloud without faces, and a list that is long enough.
    let cloud = MESH.replace("face 1", "face 0").replace("3 0 1 2\n", "");
    std::fs::write(folder.join("cloud.ply"), cloud).unwrap();
    std::fs::write(folder.join("list.csv"), lines(150).replace(' ', ",")).unwrap();
    let spool = bench.read(&[folder]).unwrap();
    assert_eq!(
        told(&spool).0,
        ["1.txt", "2.txt", "cloud.ply", "list.csv", "tile.las"]
    );
    assert_eq!(
        (spool.stats().left_out.len(), spool.stats().warnings.len()),
        (0, 0)
    );
    // Nothing but short lists: they are the scans.
    let short = bench.path("short");
    std::fs::create_dir(&short).unwrap();
    std::fs::write(short.join("a.txt"), lines(4)).unwrap();
    std::fs::write(short.join("b.csv"), "1,2,3\n").unwrap();
    assert_eq!(
        expand(std::slice::from_ref(&short)).unwrap(),
        [short.join("a.txt"), short.join("b.csv")]
    );
}

#[test]
fn folders_of_runs_and_levels_of_detail_are_not_searched() {
    let bench = Bench::new();
    let folder = folder(&bench);
    for (name, file) in [
        ("town", "tileset.json"),
        ("mesh.ply.outcrop-scratch", "manifest"),
    ] {
        std::fs::create_dir(folder.join(name)).unwrap();
        std::fs::write(folder.join(name).join(file), "{}").unwrap();
        std::fs::write(folder.join(name).join("points.xyz"), lines(900)).unwrap();
    }
    let spool = bench.read(&[folder]).unwrap();
    let (read, left_out) = told(&spool);
    assert_eq!(read, ["tile.las"]);
    let wanted = [("town", "levels of detail")];
    assert_eq!(
        left_out,
        wanted.map(|(name, why)| (name.to_owned(), why.to_owned()))
    );
}

#[test]
fn a_folder_of_meshes_alone_is_refused_with_their_names() {
    let bench = Bench::new();
    std::fs::create_dir(bench.path("in")).unwrap();
    bench.write("in/mesh.ply", MESH);
    let error = bench.error(bench.path("in"));
    assert!(error.contains("no point file, but "), "{error}");
    assert!(error.contains("mesh.ply (a mesh with faces)"), "{error}");
}

#[cfg(unix)]
#[test]
fn links_are_followed_once_and_those_to_nothing_are_told() {
    use std::os::unix::fs::symlink;
    let bench = Bench::new();
    let folder = folder(&bench);
    let tile = std::fs::read(folder.join("tile.las")).unwrap();
    // A folder elsewhere, which leads back; and one inside, with a link that comes first by name.
    std::fs::create_dir(bench.path("elsewhere")).unwrap();
    std::fs::create_dir(folder.join("inside")).unwrap();
    std::fs::write(bench.path("elsewhere/far.las"), &tile).unwrap();
    std::fs::write(folder.join("inside/near.las"), &tile).unwrap();
    for (to, link) in [
        ("../in", "elsewhere/back"),
        ("../elsewhere", "in/linked"),
        ("../elsewhere", "in/twice"),
        ("inside", "in/again"),
        (".", "in/self"),
        ("..", "in/inside/up"),
        ("gone.las", "in/missing.las"),
        ("../gone", "in/missing"),
        ("round", "in/round"),
        ("gone", "in/.hidden"),
    ] {
        symlink(to, bench.path(link)).unwrap();
    }
    let wanted = ["inside/near.las", "linked/far.las", "tile.las"].map(|name| folder.join(name));
    assert_eq!(expand(std::slice::from_ref(&folder)).unwrap(), wanted);
    let spool = bench.read(&[folder]).unwrap();
    let (read, left_out) = told(&spool);
    assert_eq!(read, ["near.las", "far.las", "tile.las"]);
    let names: Vec<&str> = left_out.iter().map(|(name, _)| &name[..]).collect();
    assert_eq!(names, ["missing", "missing.las", "round"]);
    assert_eq!(left_out[0].1, "a link to nothing");
    assert_eq!(left_out[1].1, "a link to nothing");
    assert!(left_out[2].1.starts_with("it cannot be opened: "));
    let warnings = &spool.stats().warnings;
    assert!(
        warnings[0].starts_with("left out 3 files in folders, as no scans: "),
        "{warnings:?}"
    );
}
