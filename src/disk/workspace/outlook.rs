//! The outlook of a run: how much of it is done, and how long the rest takes.
//!
//! The time of each stage on a usual machine is known beforehand. Stages that are finished, and the one that is
//! under way, tell how much slower or faster this run is; the rest is expected to be so, too. Times are passed in,
//! so that nothing here looks at a clock.

use std::time::Duration;

/// A stage that is to come, and the seconds that it takes on a usual machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planned {
    /// Name of the stage.
    pub name: &'static str,
    /// Expected seconds.
    pub seconds: f64,
}

/// Share of the whole run that the expectation counts for, against what was measured.
const TRUST: f64 = 0.1;

/// The stage that is under way.
#[derive(Debug, Clone, Copy)]
struct Current {
    /// Expected seconds.
    expected: f64,
    /// Items in all; 0 if that is unknown.
    total: u64,
    began: Duration,
}

/// The outlook of a run; without a plan nothing is known.
#[derive(Debug, Clone, Default)]
pub struct Outlook {
    /// Stages that did not begin, in their order.
    coming: Vec<Planned>,
    current: Option<Current>,
    /// Expected seconds of the stages that are finished here.
    done: f64,
    /// Seconds that they took.
    took: f64,
    /// Expected seconds of stages that an earlier attempt finished.
    earlier: f64,
    /// Largest share that was told.
    told: f64,
}

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Share of the whole run that is done, from 0 to 1; it never falls.
    pub share: f64,
    /// Expected time until the end.
    pub left: Duration,
}

impl Outlook {
    /// Sets the stages that are to come, in their order. Those of the plan before that come before them were
    /// finished by an earlier attempt.
    pub fn plan(&mut self, stages: &[Planned]) {
        let first = stages.first().map(|stage| stage.name);
        let skipped = self.coming.iter();
        let skipped = skipped.take_while(|stage| Some(stage.name) != first);
        let skipped: f64 = skipped.map(|stage| stage.seconds).sum();
        if self.coming.iter().any(|stage| Some(stage.name) == first) {
            self.earlier += skipped;
        }
        self.coming = stages.to_vec();
    }

    /// Stage `name` begins, at time `now` since any fixed moment; it has `total` items (0: unknown). Stages before
    /// it in the plan were finished by an earlier attempt.
    pub fn begin(&mut self, name: &str, total: u64, now: Duration) {
        let Some(at) = self.coming.iter().position(|stage| stage.name == name) else {
            return;
        };
        let skipped = self.coming[..at].iter().map(|stage| stage.seconds);
        self.earlier += skipped.sum::<f64>();
        self.current = Some(Current {
            expected: self.coming[at].seconds,
            total,
            began: now,
        });
        self.coming.drain(..=at);
    }

    /// The stage that is under way is finished.
    pub fn end(&mut self, now: Duration) {
        if let Some(stage) = self.current.take() {
            self.done += stage.expected;
            self.took += now.saturating_sub(stage.began).as_secs_f64();
        }
    }

    /// True if no stage is under way and none is to come.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.current.is_none() && self.coming.is_empty()
    }

    /// Where the run is when `items` items of the current stage are done; none without a plan.
    pub fn position(&mut self, items: u64, now: Duration) -> Option<Position> {
        let coming: f64 = self.coming.iter().map(|stage| stage.seconds).sum();
        let own = self.current.map_or(0.0, |stage| stage.expected);
        let all = self.earlier + self.done + own + coming;
        if all <= 0.0 || self.is_over() {
            return None;
        }
        let took = self
            .current
            .map_or(0.0, |stage| now.saturating_sub(stage.began).as_secs_f64());
        let share = self.current.map_or(0.0, |stage| match stage.total {
            // It comes near the end, and never gets there.
            0 => took / (took + stage.expected * self.pace(0.0, 0.0, all)).max(f64::MIN_POSITIVE),
            total => (items as f64 / total as f64).min(1.0),
        });
        let pace = self.pace(own * share, took, all);
        // Of the current stage its own speed counts, the more of it is done.
        let by_plan = own * (1.0 - share) * pace;
        let by_itself = if share > 0.0 {
            took / share * (1.0 - share)
        } else {
            by_plan
        };
        let rest = share * by_itself + (1.0 - share) * by_plan;
        let reached = (self.earlier + self.done + own * share) / all;
        self.told = self.told.max(reached.min(1.0));
        Some(Position {
            share: self.told,
            left: Duration::try_from_secs_f64(rest + coming * pace).unwrap_or(Duration::MAX),
        })
    }

    /// Seconds that a second of the plan takes, with so many expected and measured seconds of the current stage.
    fn pace(&self, expected: f64, measured: f64, all: f64) -> f64 {
        let trust = TRUST * all;
        (self.took + measured + trust) / (self.done + expected + trust)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    fn planned(stages: &[(&'static str, f64)]) -> Vec<Planned> {
        let stages = stages.iter();
        stages
            .map(|(name, seconds)| Planned {
                name,
                seconds: *seconds,
            })
            .collect()
    }

    const STAGES: [(&str, f64); 4] = [
        ("ingest", 10.0),
        ("order", 10.0),
        ("cells", 60.0),
        ("export", 20.0),
    ];

    /// A run on a machine that takes `slower` times as long; each stage is seen at ten moments. Checks the time
    /// left at the end of each stage, and that shares rise.
    fn run(slower: f64, total: u64, close: f64) {
        let mut outlook = Outlook::default();
        assert_eq!(outlook.position(0, seconds(5.0)), None);
        outlook.plan(&planned(&STAGES));
        let (mut now, mut share) = (3.0, 0.0);
        for (n, (name, expected)) in STAGES.into_iter().enumerate() {
            outlook.begin(name, total, seconds(now));
            for part in 0..10 {
                let at = now + expected * slower * f64::from(part) / 10.0;
                let seen = outlook
                    .position(total * part as u64 / 10, seconds(at))
                    .unwrap();
                assert!(
                    seen.share >= share && seen.share <= 1.0,
                    "{seen:?} after {share}"
                );
                share = seen.share;
            }
            now += expected * slower;
            outlook.end(seconds(now));
            let rest: f64 = STAGES[n + 1..].iter().map(|stage| stage.1).sum();
            let seen = outlook.position(0, seconds(now));
            assert_eq!(seen.is_none(), rest == 0.0);
            if let Some(seen) = seen {
                share = seen.share;
                assert!((seen.share - (1.0 - rest / 100.0)).abs() < 1e-9, "{seen:?}");
                // What is measured counts more and more against the plan.
                let measured = 100.0 - rest;
                let pace = (measured * slower + 10.0) / (measured + 10.0);
                assert!((seen.left.as_secs_f64() - rest * pace).abs() < 1e-6);
                if n == 2 {
                    let off = seen.left.as_secs_f64() / (rest * slower);
                    assert!((off - 1.0).abs() < close, "{off}");
                }
            }
        }
        assert!(outlook.is_over());
    }

    #[test]
    fn the_time_left_follows_the_machine() {
        run(1.0, 1000, 1e-9);
        run(3.0, 1000, 0.08);
        run(0.2, 1000, 0.5);
        // Stages of unknown length.
        run(1.0, 0, 1e-9);
        run(7.0, 0, 0.1);
    }

    #[test]
    fn within_a_stage_its_own_speed_counts() {
        let mut outlook = Outlook::default();
        outlook.plan(&planned(&[("cells", 100.0)]));
        outlook.begin("cells", 200, seconds(0.0));
        let left = |outlook: &mut Outlook, items, at| {
            outlook
                .position(items, seconds(at))
                .unwrap()
                .left
                .as_secs_f64()
        };
        assert!((left(&mut outlook, 0, 0.0) - 100.0).abs() < 1e-9);
        // Twice as slow as planned.
        let early = left(&mut outlook, 2, 2.0);
        let late = left(&mut outlook, 180, 180.0);
        assert!((100.0..150.0).contains(&early), "{early}");
        assert!((late - 20.0).abs() < 1.0, "{late}");
    }

    #[test]
    fn stages_that_an_earlier_attempt_finished_are_done_and_tell_nothing() {
        let mut outlook = Outlook::default();
        outlook.plan(&planned(&STAGES));
        outlook.begin("cells", 10, seconds(1.0));
        let seen = outlook.position(0, seconds(1.0)).unwrap();
        assert!((seen.share - 0.2).abs() < 1e-9);
        assert!((seen.left.as_secs_f64() - 80.0).abs() < 1e-9);
        // One that is not in the plan.
        outlook.end(seconds(61.0));
        outlook.begin("other", 5, seconds(61.0));
        assert!((outlook.position(3, seconds(70.0)).unwrap().share - 0.8).abs() < 1e-9);
        // A new plan, once more is known: the share does not fall.
        outlook.plan(&planned(&[("cells", 500.0), ("export", 20.0)]));
        assert!((outlook.position(0, seconds(70.0)).unwrap().share - 0.8).abs() < 1e-9);
    }
}
