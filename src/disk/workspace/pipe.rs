//! A pipeline of two steps: all threads make parts, and the calling thread takes them in their order.

use super::Workspace;
use crate::error::Result;
use crossbeam_channel::bounded;

impl Workspace {
    /// Makes the parts `0..count` on `threads` threads of the pool, at most all; `take` gets them on the
    /// calling thread, in their order. A thread goes on when its part is taken, so there are never more than
    /// `threads + 1` parts at a time: one of each thread, and the one that `take` has. The first error ends
    /// all, that of the lowest part if making it failed.
    ///
    /// # Errors
    /// Errors of `make` and `take`.
    pub fn pipe<T: Send>(
        &self,
        threads: usize,
        count: usize,
        make: impl Fn(usize) -> Result<T> + Sync,
        mut take: impl FnMut(T) -> Result<()>,
    ) -> Result<()> {
        // A thread of the pool must not wait for another one, which may have no thread to run on.
        if self.pool.current_thread_index().is_some() {
            return (0..count).try_for_each(|part| take(make(part)?));
        }
        // Each maker has a thread of its own, and waits for nothing but the calling thread. That one waits for
        // the maker of the next part, which has taken all its parts before: so one of them can always go on.
        let threads = threads.clamp(1, self.threads);
        let (senders, receivers): (Vec<_>, Vec<_>) = (0..threads).map(|_| bounded(0)).unzip();
        let make = &make;
        self.pool.in_place_scope(move |scope| {
            for (first, sender) in senders.into_iter().enumerate() {
                scope.spawn(move |_| {
                    let mut parts = (first..count).step_by(threads).map(make);
                    // Nobody receives any more after an error.
                    while let Some(part) = parts.next()
                        && sender.send(part).is_ok()
                    {}
                });
            }
            (0..count).try_for_each(|part| match receivers[part % threads].recv() {
                Ok(made) => take(made?),
                // It panicked, which the scope hands on.
                Err(_) => Ok(()),
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    #[test]
    fn parts_are_taken_in_their_order_with_any_number_of_threads() {
        for (threads, of, count) in [(1, 1, 9), (2, 3, 40), (9, 2, 1), (4, 4, 0), (3, 3, 200)] {
            let workspace = Workspace::for_tests(of).expect("a scratch folder");
            let mut all = Vec::new();
            let take = |part| {
                all.push(part);
                Ok(())
            };
            workspace.pipe(threads, count, Ok, take).unwrap();
            assert_eq!(all, (0..count).collect::<Vec<_>>());
            // On a thread of the pool, too.
            let sum = AtomicUsize::new(0);
            let take = |part| {
                sum.fetch_add(part, Ordering::Relaxed);
                Ok(())
            };
            workspace
                .install(|| workspace.pipe(threads, count, Ok, take))
                .unwrap();
            assert_eq!(sum.into_inner(), all.iter().sum::<usize>());
        }
    }

    #[test]
    fn a_slow_taker_holds_the_makers_back() {
        let (workspace, made) = (
            Workspace::for_tests(3).expect("a scratch folder"),
            AtomicUsize::new(0),
        );
        let make = |part| {
            made.fetch_add(1, Ordering::SeqCst);
            Ok(part)
        };
        let take = |part| {
            std::thread::sleep(Duration::from_millis(2));
            // Those taken, this one, and one of each thread.
            assert!(made.load(Ordering::SeqCst) <= part + 1 + 3);
            Ok(())
        };
        workspace.pipe(3, 50, make, take).unwrap();
        assert_eq!(made.into_inner(), 50);
    }

    #[test]
    fn errors_end_both_sides() {
        for threads in [1, 2, 4] {
            let workspace = Workspace::for_tests(threads).expect("a scratch folder");
            let make = |part| {
                if part < 7 {
                    Ok(part)
                } else {
                    Err(Error::Cancelled)
                }
            };
            let mut taken = 0;
            let take = |_| {
                taken += 1;
                Ok(())
            };
            let outcome = workspace.pipe(threads, 1000, make, take);
            assert!(matches!(outcome, Err(Error::Cancelled)) && taken == 7);
            let fail = |part| {
                if part < 5 {
                    Ok(())
                } else {
                    Err(Error::TimeLimit)
                }
            };
            let outcome = workspace.pipe(threads, 1000, Ok, fail);
            assert!(matches!(outcome, Err(Error::TimeLimit)));
        }
    }

    #[test]
    fn a_panic_reaches_the_caller() {
        let workspace = Workspace::for_tests(2).expect("a scratch folder");
        let pipe = |maker: usize, taker: usize| {
            let make = |part| {
                assert!(part != maker, "made");
                Ok(part)
            };
            let take = |part: usize| {
                assert!(part != taker, "taken");
                Ok(())
            };
            let run = std::panic::AssertUnwindSafe(|| workspace.pipe(2, 100, make, take));
            std::panic::catch_unwind(run).is_err()
        };
        assert!(pipe(50, 1000) && pipe(1000, 50) && !pipe(1000, 1000));
    }
}
