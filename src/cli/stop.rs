//! Stopping: signals, time limits, and the messages about them.

use crate::pipeline::Reconstruction;
use crate::workspace::progress::Cancel;
use crate::workspace::{Folder, fault, lock};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::sync::Mutex;
use std::sync::atomic::{AtomicI32, Ordering};
use std::time::Duration;

/// Exit code of a run that reached its time limit.
pub const TIME_IS_UP: u8 = 75;

/// Time that a run has to stop by itself. Its finished work is on disk, so the program can be ended at any
/// time after that.
const PATIENCE: Duration = Duration::from_millis(1500);

/// Interval at which the flag is checked.
const LOOK: Duration = Duration::from_millis(50);

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

/// A flag that signals raise; a second signal ends the program at once.
pub fn on_signal() -> Cancel {
    let cancel = Cancel::new();
    let raised = cancel.clone();
    // Without a handler a signal ends the program; the run can be resumed in this case too.
    if let Ok(mut signals) = Signals::new([SIGINT, SIGTERM, SIGHUP]) {
        std::thread::spawn(move || {
            for signal in signals.forever() {
                if raised.is_cancelled() {
                    std::process::exit(128 + signal);
                }
                SIGNAL.store(signal, Ordering::Relaxed);
                raised.cancel();
            }
        });
    }
    cancel
}

/// Ends the program if the run does not stop soon after its flag is raised.
pub fn watch(run: &Reconstruction, cancel: &Cancel) {
    *lock(&FOLDER) = Some(run.scratch_folder().to_path_buf());
    let cancel = cancel.clone();
    std::thread::spawn(move || {
        while !cancel.is_cancelled() {
            std::thread::sleep(LOOK);
        }
        std::thread::sleep(PATIENCE);
        if let Err(error) = cancel.check() {
            eprintln!("outcrop: {error}{}", hint());
        }
        fault::finish();
        std::process::exit(code(cancel.is_expired()).into());
    });
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

/// A path quoted for a shell.
fn quoted(path: &std::path::Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/._-+,@%".contains(c);
    if text.chars().all(plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}
