//! The work of these commands: from arguments to results, without a word on the screen.

use super::super::jobs::Watch;
use super::super::new_file::is_page;
use super::super::output::write_report;
use super::{Advance, After, Plan, Process, Work, shard};
use crate::pipeline::{self, Advanced, Copies, Reconstruction, Status, Worked};
use crate::report::Report;
use outcrop_disk::error::{Error, Result};
use std::path::{Path, PathBuf};

/// How the work between two generations ended.
pub enum Step {
    /// The next step is open, or the mesh is finished.
    Done(Box<Done>),
    /// Shards are missing, as this text tells.
    Missing(String),
    /// The work of tasks is damaged, as this error tells.
    Damaged(Error),
}

/// The state after the work between two generations.
pub struct Done {
    /// The open step, or the end.
    pub after: After,
    /// The mesh.
    pub output: PathBuf,
    /// The report of a mesh that this process finished.
    pub report: Option<Box<Report>>,
}

/// Plans a run; returns its folder.
pub fn plan(args: &Plan) -> Result<PathBuf> {
    let mut builder = args
        .job
        .builder()
        .threads(args.task_threads.into())
        .memory(args.task_memory)
        .start(args.again.start());
    if let Some(scratch) = &args.scratch {
        builder = builder.scratch(scratch);
    }
    let run = builder.build()?;
    let unused = [
        ("--workers", args.how.workers.is_some()),
        ("--foreground", args.how.foreground),
        ("--within-allocation", args.how.within_allocation),
        ("--report", args.how.report.is_some()),
        ("SITE FLAGS", !args.how.site.is_empty()),
    ];
    if let (None, Some((name, _))) = (args.submit, unused.iter().find(|(_, given)| *given)) {
        return Err(Error::Parameter {
            name,
            found: "a plan that is not submitted".into(),
            expected: "--submit with it".into(),
        });
    }
    Ok(run.plan(args.shards)?.to_path_buf())
}

fn copies(process: &Process) -> Copies {
    Copies::new(process.copies.clone(), process.copies_limit)
}

fn opened(
    folder: &Path,
    process: &Process,
    pictures: bool,
    (observer, cancel): Watch,
    begins: impl FnOnce(&Reconstruction),
) -> Result<Reconstruction> {
    let mut builder = Reconstruction::shared_with(folder, copies(process))?
        .observer(observer)
        .cancel(cancel)
        .pictures(pictures)
        .storage(process.storing.storage());
    if let Some(memory) = process.memory {
        builder = builder.memory(memory);
    }
    if let Some(threads) = process.threads {
        builder = builder.threads(threads.into());
    }
    let run = builder.build()?;
    begins(&run);
    Ok(run)
}

/// Does the units of a shard.
pub fn work(args: &Work, watch: Watch, begins: impl FnOnce(&Reconstruction)) -> Result<Worked> {
    let shard = shard::chosen(args)?;
    let folder = pipeline::shared_folder(&args.folder)?;
    if let Some(count) = shard.count {
        let planned = pipeline::planned_shards(&folder, &copies(&args.process))?;
        if planned != count {
            return Err(Error::Parameter {
                name: "shard",
                found: format!("a shard of {count}"),
                expected: format!("one of the {planned} that were planned"),
            });
        }
    }
    let run = opened(&folder, &args.process, false, watch, begins)?;
    run.work(args.generation, shard.number)
}

/// The state of a run.
pub fn status(folder: &Path) -> Result<Status> {
    pipeline::status(&pipeline::shared_folder(folder)?)
}

/// Does the work between two generations.
pub fn advance(args: &Advance, watch: Watch, begins: impl FnOnce(&Reconstruction)) -> Result<Step> {
    let page = args.report.as_deref().is_some_and(is_page);
    let folder = pipeline::shared_folder(&args.folder)?;
    let run = opened(&folder, &args.process, page, watch, begins)?;
    let mut done = Done {
        after: After {
            finished: true,
            generation: None,
            missing: Vec::new(),
            totals: None,
            warnings: Vec::new(),
        },
        output: run.output().to_path_buf(),
        report: None,
    };
    match run.advance()? {
        Advanced::Finished(Some(finished)) => {
            let (report, totals) = *finished;
            done.after.totals = Some(totals);
            if let Some(path) = &args.report {
                write_report(path, &report, run.output())?;
            }
            done.report = Some(Box::new(report));
        }
        Advanced::Finished(None) => {}
        Advanced::Open(_) | Advanced::Superseded => {
            // Another process may have finished it meanwhile.
            if let Ok(status) = pipeline::status(&folder) {
                done.after = After {
                    finished: false,
                    generation: Some(status.generation),
                    missing: status.missing(),
                    totals: Some(status.totals),
                    warnings: Vec::new(),
                };
            }
        }
        Advanced::Missing(generation, shards) => {
            return Ok(Step::Missing(format!(
                "{}: of generation {generation} {} missing",
                folder.display(),
                list(&shards)
            )));
        }
        Advanced::Damaged(error) => return Ok(Step::Damaged(error)),
    }
    Ok(Step::Done(Box::new(done)))
}

/// Shards as text.
fn list(shards: &[u32]) -> String {
    match shards {
        [one] => format!("shard {one} is"),
        shards if shards.len() <= 8 => format!(
            "shards {} are",
            shards
                .iter()
                .map(u32::to_string)
                .collect::<Vec<_>>()
                .join(", ")
        ),
        shards => format!("{} shards are", shards.len()),
    }
}
