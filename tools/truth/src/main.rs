//! Measures a mesh against the surface of which its points are measurements.

use clap::Parser;
use outcrop_truth::{Error, Options, Result, Truth, head, read_mesh, read_seen, row};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Measures meshes against the surface of which their points are measurements: rows of a Markdown table.
///
/// Distances (acc: mesh to truth, com: truth that was seen to mesh; 50, 90, 99 and 99.9 per cent) are in
/// spacings: the median root of the area for each place that was seen. F: at one spacing. Spurious: mesh
/// farther than 3 spacings. Complete: seen truth with mesh within 1.5; sided: and facing the right way. Angle:
/// mean to the true normal, without sign; bent: more than 30 degrees; wrong: facing the wrong way. b: boundary
/// edges, c: components, χ: Euler characteristic.
#[derive(Debug, Parser)]
#[command(name = "truth", version, max_term_width = 100)]
struct Arguments {
    /// Print the head of the table instead
    #[arg(long, conflicts_with = "json")]
    head: bool,
    /// Meshes, PLY
    #[arg(required_unless_present = "head", value_name = "MESH.ply")]
    meshes: Vec<PathBuf>,
    /// The true surface, as cloudgen --reference writes it
    #[arg(long, value_name = "FILE.ply", required_unless_present = "head")]
    truth: Option<PathBuf>,
    /// The places of it that were measured, as cloudgen --seen writes them
    #[arg(long, value_name = "FILE.ply", required_unless_present = "head")]
    seen: Option<PathBuf>,
    /// Name of the row, for one mesh [default: the file's]
    #[arg(long)]
    name: Option<String>,
    /// Compare distances with the spacing at the place where it is more than the median: for uneven density
    #[arg(long)]
    local: bool,
    /// Neighbours by which spacings are taken; 40 where points are on lines
    #[arg(long, value_name = "K", default_value_t = Options::default().neighbors)]
    neighbors: usize,
    /// Samples of the truth, and of each mesh
    #[arg(long, value_name = "N", default_value_t = Options::default().samples)]
    samples: usize,
    /// Seed of the samples
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Print a line of JSON for each mesh instead
    #[arg(long)]
    json: bool,
}

fn run(args: &Arguments) -> Result<()> {
    let mut out = std::io::stdout().lock();
    let (Some(truth), Some(seen)) = (&args.truth, &args.seen) else {
        return Ok(writeln!(out, "{}", head())?);
    };
    let limits = [
        ("samples", args.samples, 100_000_000),
        ("neighbors", args.neighbors, 10_000),
    ];
    for (name, found, most) in limits {
        if !(1..=most).contains(&found) {
            return Err(Error::Parameter {
                name,
                found: found.to_string(),
                expected: "a number from 1 to 10000 (neighbors) or to 100000000 (samples)",
            });
        }
    }
    let options = Options {
        samples: args.samples,
        seed: args.seed,
        neighbors: args.neighbors,
        local: args.local,
    };
    let truth = Truth::new(&read_mesh(truth)?, &read_seen(seen)?, options);
    for path in &args.meshes {
        let measures = truth.measure(&read_mesh(path)?);
        let file = path.file_stem().unwrap_or_default().to_string_lossy();
        let name = args.name.as_deref().unwrap_or(&file);
        let line = if args.json {
            serde_json::to_string(&measures).map_err(std::io::Error::from)?
        } else {
            row(name, &measures)
        };
        writeln!(out, "{line}")?;
    }
    Ok(())
}

fn main() -> ExitCode {
    outcrop_command::main(run)
}
