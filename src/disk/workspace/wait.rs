//! Waiting for a run that still ends: a process that was killed has the lock until the system has cleaned up.

use super::folder::{Folder, Found};
use super::progress::{Cancel, Observer};
use crate::error::{Error, Result};
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest time that a run waits for another to end.
const PATIENCE: Duration = Duration::from_secs(10);

/// Time between two looks.
const LOOK: Duration = Duration::from_millis(50);

impl Folder {
    /// As [`Folder::find`]; waits some seconds while another process has the folder, and says so.
    ///
    /// # Errors
    /// See [`Folder::find`]; [`Error::Cancelled`].
    pub fn find_when_free(path: &Path, observer: &dyn Observer, cancel: &Cancel) -> Result<Found> {
        let begin = Instant::now();
        let mut said = false;
        loop {
            match Self::find(path) {
                Err(Error::Locked { .. }) if begin.elapsed() < PATIENCE => {}
                found => return found,
            }
            if !std::mem::replace(&mut said, true) {
                observer.warn(&format!(
                    "{}: another run is at work here; waiting up to {} s for it to end",
                    path.display(),
                    PATIENCE.as_secs()
                ));
            }
            cancel.check()?;
            std::thread::sleep(LOOK);
        }
    }
}
