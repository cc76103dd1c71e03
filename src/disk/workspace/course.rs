//! The course of memory and disk over a run, for a report that shows it. A thread takes samples; their number is
//! bounded, since neighbours are joined when there are too many.

use super::memory::MemoryPool;
use super::{IoCounters, limits, lock};
use crossbeam_channel::{RecvTimeoutError, Sender, bounded};
use serde::Serialize;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Most samples.
const MOST: usize = 512;

/// Time between the first samples; it doubles whenever neighbours are joined.
const FIRST: Duration = Duration::from_millis(25);

/// Memory and disk at a time, in bytes; the largest values since the sample before.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Sample {
    /// Seconds since the attempt began.
    pub seconds: f64,
    /// Resident memory of the process.
    pub resident: u64,
    /// Memory held as the program counts it.
    pub held: u64,
    /// Scratch files.
    pub scratch: u64,
}

/// Takes samples until it is dropped.
#[derive(Debug)]
pub struct Course {
    samples: Arc<Mutex<Vec<Sample>>>,
    _running: Sender<()>,
}

impl Course {
    /// Starts to take samples. Without a thread for them there are none.
    #[must_use]
    pub fn start(memory: MemoryPool, io: Arc<IoCounters>) -> Self {
        let (running, over) = bounded::<()>(0);
        let samples: Arc<Mutex<Vec<Sample>>> = Arc::default();
        let taken = samples.clone();
        let begin = Instant::now();
        let take = move || {
            let mut pause = FIRST;
            loop {
                let mut samples = lock(&taken);
                samples.push(Sample {
                    seconds: begin.elapsed().as_secs_f64(),
                    resident: limits::resident(),
                    held: memory.held(),
                    scratch: io.scratch(),
                });
                if join(&mut samples) {
                    pause *= 2;
                }
                drop(samples);
                if over.recv_timeout(pause) != Err(RecvTimeoutError::Timeout) {
                    break;
                }
            }
        };
        let thread = std::thread::Builder::new().name("outcrop-course".into());
        let _ = thread.spawn(take);
        Self {
            samples,
            _running: running,
        }
    }

    /// The samples so far.
    #[must_use]
    pub fn samples(&self) -> Vec<Sample> {
        lock(&self.samples).clone()
    }
}

/// Joins neighbours if there are too many samples.
fn join(samples: &mut Vec<Sample>) -> bool {
    if samples.len() < MOST {
        return false;
    }
    let joined = samples.chunks(2).map(|two| {
        let most = |of: fn(&Sample) -> u64| two.iter().map(of).max().unwrap_or(0);
        Sample {
            seconds: two[two.len() - 1].seconds,
            resident: most(|s| s.resident),
            held: most(|s| s.held),
            scratch: most(|s| s.scratch),
        }
    });
    *samples = joined.collect();
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_samples_keep_peaks_and_times() {
        let sample = |n: u64| Sample {
            seconds: n as f64,
            resident: n,
            held: 1000 - n,
            scratch: n % 7,
        };
        let mut samples: Vec<Sample> = (0..MOST as u64 - 1).map(sample).collect();
        assert!(!join(&mut samples));
        samples.push(sample(MOST as u64 - 1));
        assert!(join(&mut samples));
        assert_eq!(samples.len(), MOST / 2);
        assert_eq!((samples[0].held, samples[0].resident), (1000, 1));
        assert_eq!(samples[MOST / 2 - 1].seconds, MOST as f64 - 1.0);
        assert!(
            samples
                .windows(2)
                .all(|two| two[0].seconds < two[1].seconds)
        );
    }

    #[test]
    fn samples_are_taken_until_the_end() {
        let workspace = super::super::Workspace::for_tests(1).expect("a scratch folder");
        let course = Course::start(workspace.memory.clone(), workspace.io.clone());
        let _held = workspace.reserve("much", 50 << 20).unwrap();
        let seen = || {
            course
                .samples()
                .iter()
                .any(|s| s.held >= 50 << 20 && s.resident > 0)
        };
        while !seen() {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}
