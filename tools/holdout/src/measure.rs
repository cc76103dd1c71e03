//! Distances of the left-out points, in units of the local spacing.

use crate::error::{Error, Result};
use crate::{Limits, read};
use clap::Args;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use outcrop::inspect::compare;
use outcrop_disk::workspace::Workspace;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::num::NonZero;
use std::path::PathBuf;

/// Points around a left-out point from which its local spacing is computed.
const AROUND: usize = 8;

/// `holdout measure`; the program's help defines the local spacing.
#[derive(Debug, Args)]
pub(crate) struct Measure {
    /// The points from which the mesh was made
    #[arg(value_name = "TRAIN.ply")]
    train: PathBuf,
    /// The points left out
    #[arg(value_name = "HELD.ply")]
    held: PathBuf,
    /// The mesh
    #[arg(value_name = "MESH.ply")]
    mesh: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    limits: Limits,
}

/// Figures of one quantity over all left-out points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Figures {
    pub(crate) p50: f64,
    pub(crate) p90: f64,
    pub(crate) p99: f64,
    pub(crate) p99_9: f64,
    pub(crate) mean: f64,
    pub(crate) max: f64,
}

/// The result.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct HeldOut {
    /// Distinct points that remained.
    pub(crate) train: u64,
    /// Distinct points left out.
    pub(crate) held: u64,
    /// Distance to the mesh in units of the local spacing.
    pub(crate) error: Figures,
    /// Distance to the mesh in the unit of the files.
    pub(crate) distance: Figures,
    /// The local spacing itself.
    pub(crate) spacing: Figures,
}

/// Measures the distances.
pub(crate) fn run(args: &Measure) -> Result<String> {
    let workspace = args.limits.workspace()?;
    let found = measure(args, &workspace)?;
    if args.json {
        return serde_json::to_string_pretty(&found)
            .map_err(|e| Error::io("standard output", "write JSON", e.into()));
    }
    let mut text = format!(
        "{} points left out of {}",
        found.held,
        found.held + found.train
    );
    let rows = [
        ("in local spacings", found.error),
        ("distance", found.distance),
        ("local spacing", found.spacing),
    ];
    for (name, f) in rows {
        text += &format!(
            "\n{name:<18} 50 % {:.6}  90 % {:.6}  99 % {:.6}  99.9 % {:.6}  mean {:.6}  max {:.6}",
            f.p50, f.p90, f.p99, f.p99_9, f.mean, f.max
        );
    }
    Ok(text)
}

fn measure(args: &Measure, workspace: &Workspace) -> Result<HeldOut> {
    let train = read::points(&args.train, workspace)?;
    if train.len() < 2 {
        let what = format!("{} distinct points have no spacing", train.len());
        return Err(Error::input(&args.train, what));
    }
    let mut held = Vec::new();
    compare::distances(&args.held, &args.mesh, workspace, |found| {
        held.push((found.position, found.distance));
        Ok(())
    })?;
    let spacing = workspace.install(|| {
        let positions: Vec<_> = held.iter().map(|h| h.0).collect();
        spacings(&train, &positions)
    });
    let distance: Vec<f64> = held.iter().map(|h| h.1).collect();
    let error = distance.iter().zip(&spacing).map(|(d, s)| d / s).collect();
    Ok(HeldOut {
        train: train.len() as u64,
        held: held.len() as u64,
        error: figures(error),
        distance: figures(distance),
        spacing: figures(spacing),
    })
}

/// The local spacing of `train` at each of `places`: the mean distance from the nearest [`AROUND`] points to
/// their own nearest neighbours.
fn spacings(train: &[[f64; 3]], places: &[[f64; 3]]) -> Vec<f64> {
    let tree: ImmutableKdTree<f64, 3> = ImmutableKdTree::new_from_slice(train);
    let two = NonZero::<usize>::MIN.saturating_add(1);
    let around = NonZero::<usize>::MIN.saturating_add(AROUND - 1);
    let own = |p: &[f64; 3]| {
        let near = tree.nearest_n::<SquaredEuclidean>(p, two);
        near.last().map_or(0.0, |n| n.distance.sqrt())
    };
    let own: Vec<f64> = train.par_iter().map(own).collect();
    let local = |p: &[f64; 3]| {
        let near = tree.nearest_n::<SquaredEuclidean>(p, around);
        let sum: f64 = near.iter().map(|n| own[n.item as usize]).sum();
        sum / near.len().max(1) as f64
    };
    places.par_iter().map(local).collect()
}

fn figures(mut values: Vec<f64>) -> Figures {
    values.sort_unstable_by(f64::total_cmp);
    let count = values.len();
    let at = |thousandths: usize| {
        let rank = (count * thousandths).div_ceil(1000).max(1);
        values.get(rank - 1).copied().unwrap_or(0.0)
    };
    Figures {
        p50: at(500),
        p90: at(900),
        p99: at(990),
        p99_9: at(999),
        mean: values.iter().sum::<f64>() / count.max(1) as f64,
        max: at(1000),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spacing_of_a_grid() {
        let grid = |step: f64, at: f64| {
            let places = (0..400).map(move |i| [f64::from(i % 20), f64::from(i / 20)]);
            places.map(move |[x, y]| [at + step * x, step * y, 0.0])
        };
        // One grid with steps of 1, another with steps of 3.
        let train: Vec<_> = grid(1.0, 0.0).chain(grid(3.0, 1000.0)).collect();
        let found = spacings(
            &train,
            &[[5.5, 5.5, 0.0], [0.0, 0.0, 9.0], [1001.0, 2.0, 0.0]],
        );
        assert_eq!(found, [1.0, 1.0, 3.0]);
        // Fewer points than [`AROUND`].
        let found = spacings(&train[..2], &[[7.0, 0.0, 0.0]]);
        assert_eq!(found, [1.0]);
    }

    #[test]
    fn percentiles_are_ranks() {
        let found = figures((1..=1000).map(f64::from).collect());
        assert_eq!(
            [found.p50, found.p90, found.p99, found.p99_9],
            [500.0, 900.0, 990.0, 999.0]
        );
        assert_eq!([found.mean, found.max], [500.5, 1000.0]);
        let found = figures(vec![2.0, 1.0]);
        assert_eq!([found.p50, found.p90, found.max], [1.0, 2.0, 2.0]);
    }
}
