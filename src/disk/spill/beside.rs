//! Work beside the calling thread, one job at a time.

use crossbeam_channel::{Receiver, Sender, bounded};
use std::thread::JoinHandle;

/// A thread that does one job `J` at a time, with the result `D`.
#[derive(Debug)]
pub(super) struct Beside<J, D> {
    jobs: Option<Sender<J>>,
    done: Receiver<D>,
    thread: Option<JoinHandle<()>>,
    busy: bool,
}

impl<J: Send + 'static, D: Send + 'static> Beside<J, D> {
    /// Starts the thread.
    pub(super) fn start(work: impl Fn(J) -> D + Send + 'static) -> Self {
        let (jobs, queue) = bounded::<J>(1);
        let (results, done) = bounded(1);
        // There is room for the job and for its result, so neither side waits with what the other needs.
        let each = move || queue.iter().try_for_each(|job| results.send(work(job)));
        Self {
            jobs: Some(jobs),
            done,
            thread: Some(std::thread::spawn(move || drop(each()))),
            busy: false,
        }
    }

    /// Waits for the job at work, if there is one; returns its result.
    pub(super) fn end(&mut self) -> Option<D> {
        if !std::mem::take(&mut self.busy) {
            return None;
        }
        let done = self.done.recv().ok();
        if done.is_none()
            && let Some(Err(panic)) = self.thread.take().map(JoinHandle::join)
        {
            std::panic::resume_unwind(panic);
        }
        done
    }

    /// Begins a job, after the one before has ended; returns the result of that one.
    pub(super) fn begin(&mut self, job: J) -> Option<D> {
        let before = self.end();
        self.busy = self
            .jobs
            .as_ref()
            .is_some_and(|jobs| jobs.send(job).is_ok());
        before
    }
}

impl<J, D> Drop for Beside<J, D> {
    fn drop(&mut self) {
        // The job at work may write to the scratch folder, which is removed later.
        self.jobs = None;
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    #[test]
    fn a_slow_job_holds_the_next_one_back() {
        let begun = Arc::new(AtomicUsize::new(0));
        let (open, gate) = bounded::<()>(0);
        let mut beside = Beside::start(move |job: usize| {
            gate.recv().unwrap();
            job
        });
        let count = begun.clone();
        let caller = std::thread::spawn(move || {
            let mut results = Vec::new();
            for job in 0..5 {
                results.extend(beside.begin(job));
                count.fetch_add(1, Ordering::SeqCst);
            }
            results.extend(beside.end());
            assert_eq!(beside.end(), None);
            results
        });
        for done in 0..5 {
            std::thread::sleep(Duration::from_millis(5));
            assert!(begun.load(Ordering::SeqCst) <= done + 1);
            open.send(()).unwrap();
        }
        assert_eq!(caller.join().unwrap(), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn a_panic_reaches_the_caller() {
        let mut beside = Beside::start(|job: u32| assert!(job < 1));
        assert_eq!(beside.begin(0), None);
        assert_eq!(beside.begin(1), Some(()));
        let end = std::panic::AssertUnwindSafe(|| beside.end());
        assert!(std::panic::catch_unwind(end).is_err());
    }
}
