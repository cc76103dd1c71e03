//! A mesh that turns out to be too large for its format is written in another one, without its work being done again.

use crate::end_to_end::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use std::path::{Path, PathBuf};

struct Case {
    bench: Bench,
    input: PathBuf,
    options: Vec<&'static str>,
}

impl Case {
    /// A closed surface: it has more triangles than are expected of most clouds.
    fn new(options: &[&'static str]) -> Self {
        let bench = Bench::new();
        let cloud = Cloud::new(Kind::Sphere).points(20_000);
        let input = bench.cloud("cloud.laz", &cloud);
        let parts = ["--block-points", "4096"];
        let options = parts.iter().chain(options).copied().collect();
        Self {
            bench,
            input,
            options,
        }
    }

    /// Makes a mesh; GLB holds this number of bytes.
    fn make(&self, mesh: &Path, most: u64) -> Said {
        let mut command = util::program(["reconstruct".as_ref(), self.input.as_os_str()]);
        command.arg("-o").arg(mesh).args(&self.options);
        command.env("OUTCROP_FAULT", format!("most:{most}"));
        command.output().unwrap().into()
    }

    fn resume(&self, scratch: &Path, output: Option<&Path>, fault: Option<&str>) -> Said {
        let mut command = util::program(["resume".as_ref(), scratch.as_os_str()]);
        if let Some(output) = output {
            command.arg("--output").arg(output);
        }
        if let Some(fault) = fault {
            command.env("OUTCROP_FAULT", fault);
        }
        command.output().unwrap().into()
    }
}

const ANY: u64 = u32::MAX as u64;

fn check(options: &[&'static str], splits: bool) {
    let case = Case::new(options);
    let (glb, ply) = (case.bench.path("mesh.glb"), case.bench.path("other.ply"));
    let scratch = case.bench.path("mesh.glb.outcrop-scratch");
    let compressed = options.contains(&"--compress-glb");
    let files = |start: &str| -> Vec<(String, u64)> {
        let names = util::listing(case.bench.folder()).into_iter();
        let mine = names.filter(|name| name.starts_with(start) && !name.ends_with("scratch"));
        mine.map(|name| (name.clone(), util::hash(&case.bench.path(&name))))
            .collect()
    };
    let clear = |start: &str| {
        for (name, _) in files(start) {
            std::fs::remove_file(case.bench.path(&name)).unwrap();
        }
    };
    // What the meshes are without the limit.
    assert_eq!(case.make(&glb, ANY).code, Some(0));
    let expected = files("mesh");
    let largest = expected.iter().filter(|(name, _)| name.ends_with(".glb"));
    let largest = largest.map(|(name, _)| case.bench.path(name).metadata().unwrap().len());
    let most = largest.max().unwrap() - 1;
    clear("mesh");
    let plain = Case {
        options: case
            .options
            .iter()
            .copied()
            .filter(|option| *option != "--compress-glb")
            .collect(),
        ..Case::new(&[])
    };
    let made = plain.make(&plain.bench.path("other.ply"), ANY);
    assert_eq!(made.code, Some(0), "{made:?}");
    let other = |bench: &Bench| -> Vec<u64> {
        let names = util::listing(bench.folder()).into_iter();
        let mine = names.filter(|name| name.starts_with("other") && name.ends_with(".ply"));
        mine.map(|name| util::hash(&bench.path(&name))).collect()
    };
    let wanted = other(&plain.bench);
    assert_eq!(wanted.len() > 1, splits);

    let too_large = |said: &Said| {
        assert_eq!(said.code, Some(2), "{said:?}");
        let end = format!(
            "outcrop resume {} --output {}\n",
            scratch.display(),
            glb.with_extension("ply").display()
        );
        assert!(said.err.contains("GLB holds at most"), "{said:?}");
        // The name of a square has its number.
        assert!(splits || said.err.ends_with(&end), "{said:?} {end:?}");
        assert!(scratch.exists());
        assert!(files(".mesh").is_empty() || splits, "{:?}", files(".mesh"));
    };
    too_large(&case.make(&glb, most));
    // The same again, without any other work.
    too_large(&case.resume(&scratch, None, Some(&format!("most:{most}"))));
    // Killed while it writes in the other format.
    let said = case.resume(&scratch, Some(&ply), Some("rename:1"));
    assert_eq!(said.code, None, "{said:?}");
    assert!(scratch.exists() && other(&case.bench).is_empty());
    let said = case.resume(&scratch, Some(&ply), None);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert_eq!(other(&case.bench), wanted);
    assert!(!scratch.exists() && files(".mesh").is_empty() && files(".other").is_empty());

    // Or where it was to be, once that is possible.
    too_large(&case.make(&glb, most));
    let said = case.resume(&scratch, Some(&ply), Some("rename:1"));
    assert_eq!(said.code, None, "{said:?}");
    let said = case.resume(&scratch, None, None);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert_eq!(files("mesh"), expected, "compressed {compressed}");
}

#[test]
fn a_mesh_is_written_in_another_format() {
    check(&[], false);
}

#[test]
fn a_compressed_mesh_is_written_in_another_format() {
    check(&["--compress-glb", "--normals"], false);
}

#[test]
fn squares_are_written_in_another_format() {
    check(&["--split", "300"], true);
}
