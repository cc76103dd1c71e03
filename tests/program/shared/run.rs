//! A small cloud with many blocks and tiles, and a run of it that tasks share.

use crate::end_to_end::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use std::path::PathBuf;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// Blocks, and tiles inside them.
const PARTS: [&str; 4] = ["--block-points", "4096", "--tile-points", "1500"];

/// A cloud, options, and the mesh of one process.
pub struct Case {
    pub bench: Bench,
    pub input: PathBuf,
    pub mesh: PathBuf,
    pub scratch: PathBuf,
    options: Vec<String>,
    expected: u64,
}

/// The answer of `status --json`.
pub struct Status(serde_json::Value);

impl Status {
    pub fn generation(&self) -> u64 {
        self.0["generation"].as_u64().unwrap()
    }

    /// The steps that are open.
    pub fn step(&self) -> String {
        self.0["steps"].to_string()
    }

    pub fn can_advance(&self) -> bool {
        self.0["can_advance"].as_bool().unwrap()
    }

    pub fn missing(&self) -> Vec<u64> {
        let begun = self.0["begun"].as_array().unwrap().iter();
        let begun = begun.map(|begun| &begun["shard"]);
        let new = self.0["new"].as_array().unwrap().iter();
        begun.chain(new).map(|n| n.as_u64().unwrap()).collect()
    }
}

impl Case {
    /// A noisy terrain with outliers, in two files.
    pub fn new(options: &[&str]) -> Self {
        let bench = Bench::new();
        let mut cloud = Cloud::new(Kind::Terrain).points(24_000).noise(0.6);
        cloud.outliers = 0.001;
        let input = bench.subfolder("tiles");
        bench.cloud("tiles/a.laz", &cloud);
        bench.cloud("tiles/b.ply", &cloud.clone().seed(1).points(9_000));
        let mesh = bench.path("mesh.ply");
        let mut case = Self {
            scratch: bench.path("mesh.ply.outcrop-scratch"),
            options: options.iter().map(ToString::to_string).collect(),
            expected: 0,
            bench,
            input,
            mesh,
        };
        let said = util::run(case.arguments("reconstruct"));
        assert_eq!(said.code, Some(0), "{said:?}");
        case.expected = util::hash(&case.mesh);
        std::fs::remove_file(&case.mesh).unwrap();
        case
    }

    fn arguments(&self, command: &str) -> Vec<String> {
        let paths = [&self.input, &self.mesh].map(|path| path.display().to_string());
        let fixed = [command, &paths[0], "-o", &paths[1]];
        let fixed = fixed.iter().chain(&PARTS).map(ToString::to_string);
        fixed.chain(self.options.iter().cloned()).collect()
    }

    /// Plans the run.
    pub fn plan(&self, more: &[&str]) {
        let _ = std::fs::remove_dir_all(&self.scratch);
        let more = more.iter().map(ToString::to_string);
        let said = util::run(self.arguments("plan").into_iter().chain(more));
        assert_eq!(said.code, Some(0), "{said:?}");
    }

    /// A command on the folder of the run.
    pub fn command(&self, command: &str, more: &[&str]) -> std::process::Command {
        let mut program = util::program([command]);
        program.arg(&self.scratch).args(more);
        program
    }

    pub fn say(&self, command: &str, more: &[&str]) -> Said {
        self.command(command, more).output().unwrap().into()
    }

    /// Does the work of a shard of the newest generation, with a fault.
    pub fn start(&self, shard: u64, fault: &str) -> Child {
        let generation = self.status().generation().to_string();
        let more = ["--generation", &generation, "--shard", &shard.to_string()];
        let mut command = self.command("work", &more);
        command.env("OUTCROP_FAULT", fault);
        command.stderr(Stdio::piped()).spawn().unwrap()
    }

    pub fn work(&self, shard: u64) {
        let said = self.say("work", &["--shard", &shard.to_string()]);
        assert_eq!(said.code, Some(0), "{said:?}");
    }

    pub fn status(&self) -> Status {
        let said = self.say("status", &["--json"]);
        assert_eq!(said.code, Some(0), "{said:?}");
        Status(serde_json::from_str(&said.out).unwrap())
    }

    /// Opens the next generation; false if the mesh is finished.
    pub fn advance(&self) -> bool {
        let said = self.say("advance", &[]);
        assert_eq!(said.code, Some(0), "{said:?}");
        self.scratch.exists()
    }

    /// Opens generations until one has a step with this in its name.
    pub fn advance_to(&self, step: &str) {
        while self.advance() {
            if self.status().step().contains(step) {
                return;
            }
            self.work_all();
        }
        panic!("there is no step {step}");
    }

    pub fn work_all(&self) {
        for shard in self.status().missing() {
            self.work(shard);
        }
    }

    /// Does all that is left.
    pub fn finish(&self) {
        loop {
            if self.scratch.exists() && !self.status().can_advance() {
                self.work_all();
            }
            if !self.advance() {
                return self.check();
            }
        }
    }

    /// Checks that only the right mesh is left.
    pub fn check(&self) {
        assert!(util::hash(&self.mesh) == self.expected, "another mesh");
        let left = util::listing(self.bench.folder());
        assert_eq!(left, ["mesh.ply", "tiles"]);
        std::fs::remove_file(&self.mesh).unwrap();
    }
}

/// Waits until `there` is true.
pub fn wait_until(mut there: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !there() {
        assert!(begin.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(2));
    }
}
