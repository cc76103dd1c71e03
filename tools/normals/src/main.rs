//! Angle errors of normals: for clouds with known surfaces, the angles between the true normals and those of
//! the program and of other methods, without regard to orientation.
//!
//! The cloud is held in memory.

mod candidates;
mod error;
mod smoothing;
mod table;
mod world;

use clap::Parser;
use error::Result;
use outcrop_cloudgen::Kind;
use outcrop_stages::cells::Widen;
use std::io::Write;
use std::process::ExitCode;

/// Prints rows of a Markdown table: angle errors of normals at the points of a generated cloud.
#[derive(Debug, Parser)]
#[command(name = "normals", version, max_term_width = 100)]
struct Arguments {
    /// Print the head of the table instead
    #[arg(long)]
    head: bool,
    /// Surface, by its name in cloudgen
    #[arg(required_unless_present = "head")]
    kind: Option<Kind>,
    /// Number of points
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    points: u64,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Put the points on lines, RATIO times closer along than across
    #[arg(long, value_name = "RATIO")]
    scanlines: Option<f64>,
    /// Standard deviation of noise along the normal, in mean spacings (root of area per point)
    #[arg(long, value_name = "SPACINGS", default_value_t = 0.0)]
    noise: f64,
    /// Move this fraction of the points three mean spacings along the normal, to either side
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    strays: f64,
    /// Distribute the points among two layers this many mean spacings apart
    #[arg(long, value_name = "SPACINGS")]
    layers: Option<f64>,
    /// Neighbours for a plane
    #[arg(long, value_name = "N", default_value_t = 30)]
    neighbors: usize,
    /// Also measure other methods
    #[arg(long)]
    tried: bool,
    /// Measure instead the distances of points from the surface before and after smoothing, in mean spacings
    #[arg(long)]
    smoothing: bool,
}

fn run(args: &Arguments) -> Result<()> {
    let mut out = std::io::stdout().lock();
    let Some(kind) = args.kind else {
        let head = if args.smoothing {
            smoothing::head()
        } else {
            table::head()
        };
        return Ok(writeln!(out, "{head}")?);
    };
    let world = world::World::new(kind, args)?;
    let name = world::name(kind, args);
    if args.smoothing {
        for row in smoothing::rows(kind, &world, &name, args)? {
            writeln!(out, "{row}")?;
        }
        return Ok(());
    }
    let mut row = |method: &str, shape: &str, normals: &[Option<[f64; 3]>]| -> Result<()> {
        let errors = world.errors(normals);
        writeln!(out, "{}", table::row(&name, method, shape, errors))?;
        Ok(())
    };
    let shapes = [("measured", &world.store), ("relaxed", world.shape())];
    for (shape, store) in shapes {
        row("exactly k", shape, &world.planes(store, Widen::Never)?)?;
        row("paper", shape, &world.planes(store, Widen::OnLines)?)?;
        row("robust", shape, &world.planes(store, Widen::OnBands)?)?;
        if args.tried {
            for candidate in candidates::ALL {
                row(candidate.name, shape, &world.tried(store, candidate)?)?;
            }
        }
    }
    Ok(())
}

fn main() -> ExitCode {
    outcrop_command::main(run)
}
