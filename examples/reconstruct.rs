//! Reconstructs a surface from a program: progress, cancellation, and the report.
//!
//! ```text
//! cargo run --release --example reconstruct -- scan.laz mesh.ply
//! ```
//!
//! Without arguments it generates a small cloud in a temporary folder first.

use outcrop::{Cancel, Error, Observer, Params, Radius, Reconstruction};
use outcrop_cloudgen::{Cloud, Format, Kind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Points of the generated cloud.
const POINTS: u64 = 20_000;

/// Time after which the run is cancelled.
const PATIENCE: Duration = Duration::from_secs(3600);

/// Prints a line when a stage begins and ends, and cancels the run when its time is over.
struct Progress {
    begun: Instant,
    cancel: Cancel,
    stage: Mutex<&'static str>,
    done: AtomicU64,
}

impl Progress {
    fn stage(&self) -> std::sync::MutexGuard<'_, &'static str> {
        self.stage
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl Observer for Progress {
    fn begin(&self, name: &'static str, unit: &'static str, total: u64) {
        *self.stage() = name;
        self.done.store(0, Ordering::Relaxed);
        match total {
            0 => println!("{name}: counting {unit}"),
            _ => println!("{name}: {total} {unit}"),
        }
    }

    // Called from all worker threads.
    fn advance(&self, count: u64) {
        self.done.fetch_add(count, Ordering::Relaxed);
        if self.begun.elapsed() > PATIENCE {
            self.cancel.cancel();
        }
    }

    fn end(&self) {
        println!(
            "{}: {} done",
            self.stage(),
            self.done.load(Ordering::Relaxed)
        );
    }

    fn warn(&self, message: &str) {
        eprintln!("warning: {message}");
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The folder is deleted when this variable is dropped.
    let folder = tempfile::tempdir()?;
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let (input, output) = match arguments.as_slice() {
        [input, output] => (input.clone(), output.clone()),
        [] => {
            let cloud = folder.path().join("torus.laz");
            Cloud::new(Kind::Torus)
                .points(POINTS)
                .write(&cloud, Format::from_path(&cloud)?)?;
            (cloud, folder.path().join("torus.ply"))
        }
        _ => return Err("give a cloud and the mesh to write, or nothing".into()),
    };

    let cancel = Cancel::new();
    let observer = Arc::new(Progress {
        begun: Instant::now(),
        cancel: cancel.clone(),
        stage: Mutex::new(""),
        done: AtomicU64::new(0),
    });
    let outcome = Reconstruction::builder()
        .input(input)
        .output(output.clone())
        .params(Params {
            radius: Radius::Auto,
            smooth: outcrop::Smooth::Rounds(0),
            ..Params::default()
        })
        .memory(256 << 20)
        .threads(2)
        .observer(observer)
        .cancel(cancel)
        .build()?
        .run();
    match outcome {
        Ok(report) => {
            println!(
                "{}: {} triangles, {} vertices, {} boundary edges; at most {} MiB of memory",
                output.display(),
                report.mesh.triangles,
                report.mesh.vertices,
                report.mesh.boundary_edges,
                report.peak_resident_bytes >> 20,
            );
            Ok(())
        }
        // No mesh was written: it is renamed only when it is complete.
        Err(Error::Cancelled) => Err("stopped before the end".into()),
        Err(error) => Err(error.into()),
    }
}
