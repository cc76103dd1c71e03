//! A small cloud with many blocks and tiles, and interrupted runs of it.

use crate::end_to_end::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use std::collections::HashMap;
use std::hash::{Hash, Hasher};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Blocks, and tiles inside them.
const PARTS: [&str; 4] = ["--block-points", "4096", "--tile-points", "1500"];

/// Options that cover different stages.
pub const ROBUST: &[&str] = &[];
pub const PAPER: &[&str] = &["--method", "paper", "--smooth", "1", "--relax", "1"];
pub const FILTERS: &[&str] = &["--thin", "6", "--drop-outliers", "--origin", "-3,0.5,7"];

/// A cloud, options, and the mesh of an undisturbed run.
pub struct Case {
    pub bench: Bench,
    pub input: PathBuf,
    pub mesh: PathBuf,
    pub scratch: PathBuf,
    options: Vec<String>,
    expected: u64,
    /// The counts of the report.
    pub counts: serde_json::Value,
    /// Number of events of each kind in an undisturbed run.
    pub events: HashMap<String, u64>,
}

/// The result of an attempt.
#[derive(Debug)]
pub struct Ended {
    pub said: Said,
    pub signal: Option<i32>,
}

impl From<Output> for Ended {
    fn from(output: Output) -> Self {
        Self {
            signal: output.status.signal(),
            said: output.into(),
        }
    }
}

impl Case {
    /// A noisy terrain with outliers: every stage has work to do.
    pub fn new(options: &[&str]) -> Self {
        Self::with_mesh("mesh.ply", options)
    }

    /// As [`Case::new`], with this name of the mesh.
    pub fn with_mesh(name: &str, options: &[&str]) -> Self {
        Self::of(Bench::new(), name, options)
    }

    /// As [`Case::new`], with a point so far away that the lattice is chosen without it, and a reference system.
    pub fn with_far_point() -> Self {
        let bench = Bench::new();
        let far = bench
            .write("far.xyz", "1.5 -7e30 2\n")
            .display()
            .to_string();
        bench.write("far.prj", "LOCAL_CS[\"site\"]");
        Self::of(bench, "mesh.ply", &[&far, "--origin", "auto"])
    }

    fn of(bench: Bench, name: &str, options: &[&str]) -> Self {
        let mut cloud = Cloud::new(Kind::Terrain).points(30_000).noise(0.6);
        cloud.outliers = 0.001;
        let input = bench.cloud("cloud.laz", &cloud);
        let mesh = bench.path(name);
        let mut case = Self {
            scratch: bench.path(&format!("{name}.outcrop-scratch")),
            options: options.iter().map(ToString::to_string).collect(),
            expected: 0,
            counts: serde_json::Value::Null,
            events: HashMap::new(),
            bench,
            input,
            mesh,
        };
        let counts = case.bench.path("counts");
        let fault = format!("count:{}", counts.display());
        let report = case.bench.path("report.json").display().to_string();
        let ended = case.attempt(&fault, &["--threads", "2", "--report", &report]);
        assert_eq!(ended.said.code, Some(0), "{ended:?}");
        case.expected = case.meshes();
        case.counts = case.report();
        let counts = std::fs::read_to_string(counts).unwrap();
        let lines = counts.lines().filter_map(|line| line.split_once(' '));
        case.events = lines
            .map(|(name, count)| (name.to_owned(), count.parse().unwrap()))
            .collect();
        case.clear();
        case
    }

    /// The last report, without limits, peaks and times.
    fn report(&self) -> serde_json::Value {
        let text = std::fs::read_to_string(self.bench.path("report.json")).unwrap();
        let mut report: serde_json::Value = serde_json::from_str(&text).unwrap();
        let all = report.as_object_mut().unwrap();
        all.retain(|key, _| {
            let varies = [
                "threads",
                "memory_budget",
                "seconds",
                "stages",
                "reserved_at_peak",
                "held_at_peak",
                "resident_file_bytes",
            ];
            !varies.contains(&key.as_str()) && !key.starts_with("peak_")
        });
        report
    }

    /// Arguments of a run.
    pub fn arguments(&self) -> Vec<String> {
        let paths = [&self.input, &self.mesh].map(|path| path.display().to_string());
        let fixed = ["reconstruct", &paths[0], "-o", &paths[1]];
        let fixed = fixed.iter().chain(&PARTS).map(ToString::to_string);
        fixed.chain(self.options.iter().cloned()).collect()
    }

    /// Runs the program with a fault.
    pub fn attempt(&self, fault: &str, more: &[&str]) -> Ended {
        let mut command = util::program(self.arguments());
        command.args(more).env("OUTCROP_FAULT", fault);
        command.output().unwrap().into()
    }

    /// Removes all files of runs.
    pub fn clear(&self) {
        let _ = std::fs::remove_dir_all(&self.scratch);
        for path in self.outputs() {
            let _ = std::fs::remove_file(path);
        }
    }

    /// Paths of everything that the run wrote, in the order of names.
    pub fn outputs(&self) -> Vec<PathBuf> {
        let names = util::listing(self.bench.folder()).into_iter();
        let mine = names.filter(|name| name.starts_with("mesh") && !name.contains("scratch"));
        mine.map(|name| self.bench.path(&name)).collect()
    }

    /// A hash of all meshes and their names.
    fn meshes(&self) -> u64 {
        let mut hasher = std::collections::hash_map::DefaultHasher::new();
        for path in self.outputs() {
            path.hash(&mut hasher);
            util::hash(&path).hash(&mut hasher);
        }
        hasher.finish()
    }

    /// Makes a run that is killed at this event, with other threads and memory than later attempts.
    pub fn killed(&self, fault: &str) {
        self.clear();
        let ended = self.attempt(fault, &["--threads", "2", "--memory", "192MiB"]);
        // The number of events differs slightly between runs.
        let alive = ended.said.code == Some(0);
        assert!(alive || ended.signal == Some(9), "{fault}: {ended:?}");
    }

    /// Resumes the run, which must succeed; returns its messages.
    pub fn go_on(&self, what: &str) -> String {
        let report = self.bench.path("report.json").display().to_string();
        let more = ["--resume", "--threads", "1", "--memory", "256MiB"].map(String::from);
        let more = more.into_iter().chain(["--report".into(), report]);
        let said = util::run(self.arguments().into_iter().chain(more));
        self.check(&said, what);
        assert_eq!(self.report(), self.counts, "{what}");
        said.err
    }

    /// Checks that an attempt that failed left the whole mesh under its name, or nothing.
    pub fn check_whole_or_none(&self, what: &str) {
        let none = self.outputs().is_empty();
        assert!(
            none || self.meshes() == self.expected,
            "{what}: half a mesh"
        );
    }

    /// Checks that the run succeeded and left only the mesh.
    pub fn check(&self, said: &Said, what: &str) {
        assert_eq!(said.code, Some(0), "{what}: {said:?}");
        assert!(self.meshes() == self.expected, "{what}: another mesh");
        let left = util::listing(self.bench.folder());
        let strange = |name: &&String| name.contains("outcrop");
        assert_eq!(left.iter().find(strange), None, "{what}");
    }
}

/// Copies the files of a folder.
pub fn copy(from: &Path, to: &Path) {
    let _ = std::fs::remove_dir_all(to);
    std::fs::create_dir(to).unwrap();
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o700);
    std::fs::set_permissions(to, mode).unwrap();
    for name in util::listing(from) {
        std::fs::copy(from.join(&name), to.join(&name)).unwrap();
    }
}
