//! How far each pass goes.
//!
//! In a pass the borders of cells stay, so a pass that goes too far leaves them as seams of small triangles. To meet a
//! number of triangles, a pass therefore removes at most all but a [`FALL`]th, and the last two passes are small. The
//! cost at which a pass ends is chosen from what each cost removes: in some of the cells while there is much to remove,
//! and in all of them when it is the number that counts. To meet an error, every pass goes up to its cost.

use super::collapse::{Curve, End, Price, cost_of};
use super::kept::Kept;
use super::pass::Pass;
use super::{Columns, Goal, Intake, Options, Simplified};
use crate::intake::{self, About, Reader};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use std::path::Path;

/// A pass leaves at least the triangles of its mesh through this.
const FALL: u64 = 16;

/// How many times the wanted number of triangles the passes before the last two leave, and the one before the last.
const ROUGH: f64 = 1.5;
const NEAR: f64 = 1.12;

/// Most passes.
const PASSES: u32 = 12;

/// Most passes that go up to an error: after the third, every place was inside of a cell.
const PASSES_TO_ERROR: u32 = 4;

/// A pass that leaves more than this part of its triangles was of no use.
const USEFUL: f64 = 0.98;

/// Cells of which the costs are looked at while there is much to remove, at least.
const LOOKED_AT: usize = 24;

/// Where topology allows no fewer triangles than this share more, what else there is would be ruined to save the
/// last ones: a town with 113 components and 227 handles, of 2.0 M triangles, takes 5 100 at least, without any ground
/// that is recognised.
const SPARE: f64 = 0.3;

/// What a pass is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Step {
    /// To this number of triangles, more or less.
    Towards(u64),
    /// To this number of triangles.
    To(u64),
    /// Up to this cost.
    UpTo(f32),
}

/// The cost at which about this many triangles are removed.
fn cost(curve: &Curve, removed: u64) -> f32 {
    let (mut sum, mut best) = (0u64, (removed, -1.0));
    for same in curve.chunk_by(|a, b| a.0 == b.0) {
        sum += same.iter().map(|one| u64::from(one.1)).sum::<u64>();
        let apart = sum.abs_diff(removed);
        if apart < best.0 {
            best = (apart, cost_of(same[0].0));
        }
    }
    best.1
}

/// The step of a pass over so many triangles.
fn step(goal: Goal, triangles: u64) -> Step {
    let wanted = match goal {
        Goal::Triangles(wanted) => wanted,
        // `run` has made a number of it.
        Goal::Ratio(_) => 0,
        Goal::Error(length) => return Step::UpTo((length * length) as f32),
    };
    let times = |factor: f64| (factor * wanted as f64) as u64;
    if triangles > times(ROUGH * 1.1) {
        Step::Towards(times(ROUGH).max(triangles / FALL))
    } else if triangles > times(NEAR * 1.05) {
        Step::To(times(NEAR))
    } else {
        Step::To(wanted)
    }
}

/// The end of the contractions of each cell in a pass.
fn end(
    pass: &Pass<'_>,
    (step, is_last): (Step, bool),
    triangles: u64,
    workspace: &Workspace,
) -> Result<End> {
    let all = |cost| End {
        price: match step {
            Step::UpTo(_) => Price::Distance,
            _ => Price::DistanceAndArea,
        },
        cost,
        triangles: 0,
    };
    let every = match step {
        Step::UpTo(cost) => return Ok(all(cost)),
        Step::To(_) => 1,
        Step::Towards(_) => (pass.cells.cells.len() / LOOKED_AT).max(1),
    };
    let (Step::To(number) | Step::Towards(number)) = step else {
        return Ok(all(-1.0));
    };
    if number >= triangles {
        return Ok(all(-1.0));
    }
    let (curve, held) = pass.curve(every, all(f32::MAX), workspace)?;
    let looked = pass.cells.cells.iter().step_by(every);
    let looked: u64 = looked.map(|cell| u64::from(cell.triangles)).sum();
    // Triangles at the borders of cells wait for the next pass, unless this is the last.
    let free = if is_last { looked } else { looked - held };
    let part = 1.0 - number as f64 / triangles as f64;
    let most: u64 = curve.iter().map(|one| u64::from(one.1)).sum();
    let least = looked.saturating_sub(most + held);
    let allowed = most as f64 - SPARE * least as f64;
    let removed = (part * free as f64).min(allowed).max(0.0) as u64;
    if pass.cells.cells.len() == 1 {
        // The only cell can count.
        return Ok(End {
            triangles: (triangles - removed) as usize,
            ..all(f32::MAX)
        });
    }
    Ok(all(cost(&curve, removed)))
}

/// The mesh that a pass left, read for the next one.
fn next(
    path: &Path,
    number: u32,
    kept: &Kept,
    columns: &Columns,
    workspace: &Workspace,
) -> Result<Intake> {
    let intake = workspace.once(&format!("read again {number}"), |unit| {
        let columns = Columns {
            with_quadrics: true,
            ..columns.clone()
        };
        let bytes = intake::bytes(&columns, kept.vertices);
        let _held = workspace.reserve("simplify: reading", bytes)?;
        let names = ["vertices", "triangles"].map(|name| format!("single.{name} {number}"));
        let about = About {
            path,
            vertices: kept.vertices,
            floats: false,
            columns,
            names: [&names[0], &names[1]],
        };
        let observer = &workspace.observer;
        let total = kept.vertices + kept.triangles;
        observer.begin("read again", "vertices and faces", total);
        let mut reader = Reader::new(about, unit);
        kept.read(&mut reader, true, unit)?;
        observer.end();
        reader.finish()
    })?;
    kept.release(workspace)?;
    workspace.trim();
    Ok(intake)
}

/// Runs all passes.
pub(super) fn run(
    path: &Path,
    mut intake: Intake,
    degenerate: u64,
    options: &Options,
    workspace: &Workspace,
) -> Result<Simplified> {
    let before = [intake.vertices, intake.triangles + degenerate];
    let goal = match options.goal {
        Goal::Ratio(ratio) => Goal::Triangles((ratio * before[1] as f64) as u64),
        goal => goal,
    };
    let mut farthest = 0f64;
    let mut number = 0;
    loop {
        let triangles = intake.triangles;
        let columns = intake.columns.clone();
        let pass = Pass::new(number, &intake, options, workspace)?;
        let single = pass.cells.cells.len() == 1;
        let ends = single || number + 1 == PASSES;
        let step = match goal {
            Goal::Triangles(wanted) if ends => Step::To(wanted),
            goal => step(goal, triangles),
        };
        let is_last = ends || matches!((goal, step), (Goal::Triangles(a), Step::To(b)) if a == b);
        let end = end(&pass, (step, is_last), triangles, workspace)?;
        let (kept, distance2) = pass.simplify(end, workspace)?;
        farthest = farthest.max(distance2);
        let useless = kept.triangles as f64 > USEFUL * triangles as f64;
        let is_over = matches!(goal, Goal::Error(_)) && (useless || number + 1 == PASSES_TO_ERROR);
        if is_last || is_over {
            return Ok(Simplified {
                kept,
                before,
                degenerate,
                error: farthest.sqrt(),
                passes: number + 1,
            });
        }
        number += 1;
        intake = next(path, number, &kept, &columns, workspace)?;
    }
}
