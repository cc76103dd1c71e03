//! Leaves out random points of a scan.

use crate::error::{Error, Result};
use crate::{Limits, ply, read};
use clap::Args;
use oorandom::Rand64;
use std::path::PathBuf;

/// `holdout split`
#[derive(Debug, Args)]
pub(crate) struct Split {
    /// The scan: what outcrop reads, a file or a folder
    #[arg(value_name = "SCAN")]
    scan: PathBuf,
    /// Seed of the choice of points
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    seed: u64,
    /// Share of the points that is left out
    #[arg(long, value_name = "SHARE", default_value_t = 0.2)]
    fraction: f64,
    /// Output for the points that remain, binary PLY in double precision
    #[arg(long, value_name = "FILE.ply")]
    train: PathBuf,
    /// Output for the points left out, likewise
    #[arg(long, value_name = "FILE.ply")]
    held: PathBuf,
    #[command(flatten)]
    limits: Limits,
}

/// Splits the scan; returns a message with the numbers of points.
pub(crate) fn run(args: &Split) -> Result<String> {
    if !(args.fraction > 0.0 && args.fraction < 1.0) {
        return Err(Error::Parameter {
            name: "--fraction",
            found: args.fraction.to_string(),
            expected: "more than 0 and less than 1",
        });
    }
    if args.train == args.held {
        return Err(Error::Parameter {
            name: "--held",
            found: args.held.display().to_string(),
            expected: "another file than --train",
        });
    }
    let points = read::points(&args.scan, &args.limits.workspace()?)?;
    let (train, held) = divide(points, args.fraction, args.seed);
    if train.is_empty() || held.is_empty() {
        let what = format!(
            "{} distinct points cannot be divided",
            train.len() + held.len()
        );
        return Err(Error::input(&args.scan, what));
    }
    ply::write(&args.train, &train)?;
    ply::write(&args.held, &held)?;
    Ok(format!(
        "{} distinct points: {} stay, {} are left out",
        train.len() + held.len(),
        train.len(),
        held.len()
    ))
}

/// The remaining and the left-out points; all choices of the same number are equally likely.
fn divide(points: Vec<[f64; 3]>, fraction: f64, seed: u64) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let mut rng = Rand64::new(u128::from(seed));
    let mut left = points.len() as u64;
    let mut wanted = (left as f64 * fraction).round() as u64;
    let (mut train, mut held) = (Vec::new(), Vec::new());
    held.reserve_exact(wanted as usize);
    train.reserve_exact((left - wanted) as usize);
    for point in points {
        if rng.rand_range(0..left) < wanted {
            wanted -= 1;
            held.push(point);
        } else {
            train.push(point);
        }
        left -= 1;
    }
    (train, held)
}

#[cfg(test)]
mod tests {
    use super::divide;

    #[test]
    fn every_point_goes_to_one_side() {
        let points: Vec<_> = (0..1000).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let (train, held) = divide(points.clone(), 0.2, 1);
        assert_eq!((train.len(), held.len()), (800, 200));
        let mut all = [train, held.clone()].concat();
        all.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert_eq!(all, points);
        assert_eq!(divide(points.clone(), 0.2, 1).1, held);
        assert_ne!(divide(points, 0.2, 2).1, held);
        // Points are left out everywhere, not at one end.
        let early = held.iter().filter(|p| p[0] < 500.0).count();
        assert!((70..130).contains(&early), "{early}");
    }
}
