//! The thread that waits for signals, the end of a run and the next drawing of the progress; messages about
//! stopping.

use super::args::Quiet;
use super::progress::{Bars, Nothing, Warnings};
use crate::pipeline::Reconstruction;
use crossbeam_channel::{Receiver, after, never, select, tick, unbounded};
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_disk::workspace::{Folder, away, fault, lock};
use outcrop_platform::process::on_stop;
pub use outcrop_platform::quoted;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Exit code of a run that reached its time limit, and of a command that is to be tried again later.
pub const TIME_IS_UP: u8 = 75;

/// Time that a run has to stop by itself. Its finished work is on disk, so the program can be ended at any
/// time after that.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Time between two drawings of the progress.
const DRAW: Duration = Duration::from_millis(200);

/// The signal that stops the program; 0 if none.
static SIGNAL: AtomicI32 = AtomicI32::new(0);

/// The scratch folder of the run, for the message about resuming.
static FOLDER: Mutex<Option<std::path::PathBuf>> = Mutex::new(None);

/// Exit code of a run that was stopped.
pub fn code(expired: bool) -> u8 {
    match SIGNAL.load(Ordering::Relaxed) {
        0 if expired => TIME_IS_UP,
        0 => 130,
        signal => 128 + signal as u8,
    }
}

/// The receiver of the progress, and the flag that signals raise.
pub fn watched(quiet: Quiet) -> (Arc<dyn Observer>, Cancel) {
    if !quiet.warns() {
        (Arc::new(Nothing), watch(None))
    } else if quiet.tells() && std::io::stderr().is_terminal() {
        let bars = Arc::new(Bars::default());
        (bars.clone(), watch(Some(bars)))
    } else {
        (Arc::new(Warnings), watch(None))
    }
}

/// Starts the thread, which draws the progress; returns a flag that signals raise. A second signal ends the
/// program at once. If a run does not stop soon after its flag is raised, the program ends as well.
pub fn watch(bars: Option<Arc<Bars>>) -> Cancel {
    let cancel = Cancel::new();
    let (signals, flag) = (signals(), cancel.clone());
    std::thread::spawn(move || {
        let (raised, mut late) = (flag.raised(), never());
        let draw = bars.as_ref().map_or_else(never, |_| tick(DRAW));
        loop {
            select! {
                recv(signals) -> signal => match signal {
                    Ok(signal) if flag.is_cancelled() => std::process::exit(128 + signal),
                    Ok(signal) => {
                        SIGNAL.store(signal, Ordering::Relaxed);
                        flag.cancel();
                    }
                    Err(_) => return,
                },
                recv(raised) -> _ => late = after(PATIENCE),
                recv(late) -> _ => end(&flag),
                recv(draw) -> _ => bars.iter().for_each(|bars| bars.draw()),
            }
        }
    });
    cancel
}

/// Receives the signals that stop a run.
fn signals() -> Receiver<i32> {
    // Without a handler a signal ends the program; the run can be resumed in this case too.
    let (sender, receiver) = unbounded();
    match on_stop(move |signal| sender.send(signal).is_ok()) {
        true => receiver,
        false => never(),
    }
}

/// Notes that a run begins which the program may end at any time.
pub fn can_end(run: &Reconstruction) {
    *lock(&FOLDER) = Some(run.scratch_folder().to_path_buf());
}

/// Ends the program if its work can be resumed.
fn end(cancel: &Cancel) {
    if lock(&FOLDER).is_none() {
        return;
    }
    if let Err(error) = cancel.check() {
        eprintln!("outcrop: {error}{}", hint());
    }
    fault::finish();
    away::remove_all();
    std::process::exit(code(cancel.is_expired()).into());
}

/// A line about resuming the run, if that is possible.
pub fn hint() -> String {
    let folder = lock(&FOLDER)
        .clone()
        .filter(|folder| Folder::has_progress(folder));
    folder.map_or(String::new(), |folder| {
        format!("; go on with: outcrop resume {}", quoted(&folder))
    })
}
