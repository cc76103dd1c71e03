//! The course of memory and disk over a run, for a report that shows it. A thread takes samples; their number is
//! bounded, since neighbours are joined when there are too many.

use super::memory::MemoryPool;
use super::{IoCounters, limits, lock};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
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
        let sampler = Sampler {
            begin: Instant::now(),
            pause: FIRST,
            samples: samples.clone(),
            memory,
            io,
        };
        let thread = std::thread::Builder::new().name("outcrop-course".into());
        let _ = thread.spawn(move || sampler.run(&over));
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

/// Takes the samples.
struct Sampler {
    begin: Instant,
    /// Time to the next sample.
    pause: Duration,
    samples: Arc<Mutex<Vec<Sample>>>,
    memory: MemoryPool,
    io: Arc<IoCounters>,
}

impl Sampler {
    /// Takes samples until it is over.
    fn run(mut self, over: &Receiver<()>) {
        loop {
            self.take();
            if over.recv_timeout(self.pause) != Err(RecvTimeoutError::Timeout) {
                break;
            }
        }
    }

    fn take(&mut self) {
        let mut samples = lock(&self.samples);
        samples.push(Sample {
            seconds: self.begin.elapsed().as_secs_f64(),
            resident: limits::resident(),
            held: self.memory.held(),
            scratch: self.io.scratch(),
        });
        if join(&mut samples) {
            self.pause *= 2;
        }
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
    fn a_sample_has_what_is_held_when_it_is_taken() {
        let workspace = super::super::Workspace::for_tests(1).expect("a scratch folder");
        let samples: Arc<Mutex<Vec<Sample>>> = Arc::default();
        let mut sampler = Sampler {
            begin: Instant::now(),
            pause: FIRST,
            samples: samples.clone(),
            memory: workspace.memory.clone(),
            io: workspace.io.clone(),
        };
        sampler.take();
        let much = workspace.reserve("much", 50 << 20).unwrap();
        sampler.take();
        drop(much);
        // When the run is over, no more are taken than the one at work.
        let (running, over) = bounded::<()>(0);
        drop(running);
        sampler.run(&over);
        let samples = lock(&samples).clone();
        let held = [0, 1, 2].map(|n| samples[n].held >= 50 << 20);
        assert_eq!((samples.len(), held), (3, [false, true, false]));
        assert!(samples.iter().all(|sample| sample.resident > 0));
        assert!(samples.is_sorted_by_key(|sample| sample.seconds));
    }
}
