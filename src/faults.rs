//! Fault injection for tests, by the environment variable `OUTCROP_FAULT`: see `CONTRIBUTING.md`.

use outcrop_disk::workspace::fault::{self, Event, Faults};
use outcrop_disk::workspace::limits;
use outcrop_platform::process::{DISK_FAILS, DISK_FULL, freeze, kill};
use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

const VARIABLE: &str = "OUTCROP_FAULT";

/// Time for which memory is held: long enough for a scheduler that polls to see it.
const HELD: Duration = Duration::from_secs(3);

const EVENTS: [(Event, &str); 11] = [
    (Event::Write, "write"),
    (Event::Record, "record"),
    (Event::Torn, "torn"),
    (Event::Recorded, "recorded"),
    (Event::Sync, "sync"),
    (Event::Synced, "synced"),
    (Event::Rename, "rename"),
    (Event::Renamed, "renamed"),
    (Event::Delete, "delete"),
    (Event::Publish, "publish"),
    (Event::Published, "published"),
];

#[derive(Debug, PartialEq, Eq)]
enum Plan {
    /// End the process at this event.
    Kill(Event, u64),
    /// Stop, as by SIGSTOP, before this event.
    Freeze(Event, u64),
    /// Have this number of MiB resident for some seconds before a finished journal is published.
    Hold(u64),
    /// From this event on, all of its kind fail with this number of an error, as on a disk that is full or removed.
    Fail(Event, i32, u64),
    /// A format of meshes with a limit holds this number of bytes.
    Most(u64),
    /// A process whose files are in a store gives a sign of life after each so many milliseconds.
    Beat(u64),
    /// Write the number of events of each kind to this file.
    Count(PathBuf),
}

impl Plan {
    fn read(text: &str) -> Option<Self> {
        let (kind, rest) = text.split_once(':')?;
        match kind {
            "freeze" if rest == "publish" => return Some(Self::Freeze(Event::Publish, 1)),
            "count" => return Some(Self::Count(rest.into())),
            _ => {}
        }
        let number = rest.parse().ok()?;
        Some(match kind {
            "full" => Self::Fail(Event::Write, DISK_FULL, number),
            "eio" => Self::Fail(Event::Write, DISK_FAILS, number),
            "sync" => Self::Fail(Event::Sync, DISK_FAILS, number),
            "freeze" => Self::Freeze(Event::Record, number),
            "hold" => Self::Hold(number),
            "most" => Self::Most(number),
            "beat" => Self::Beat(number),
            _ => {
                let (event, _) = EVENTS.iter().find(|(_, name)| *name == kind)?;
                Self::Kill(*event, number)
            }
        })
    }
}

/// A plan, and the number of events seen of each kind.
struct Planned {
    plan: Plan,
    seen: [AtomicU64; EVENTS.len()],
}

impl Planned {
    /// Counts an event: its number of its kind.
    fn count(&self, event: Event) -> u64 {
        let seen = EVENTS.iter().zip(&self.seen);
        let seen = seen.filter(|((kind, _), _)| *kind == event);
        seen.map(|(_, seen)| seen.fetch_add(1, Ordering::Relaxed) + 1)
            .sum()
    }
}

impl Faults for Planned {
    fn at(&self, event: Event) -> io::Result<()> {
        let number = self.count(event);
        match self.plan {
            Plan::Kill(kind, at) if kind == event && at == number => kill(),
            Plan::Fail(kind, error, at) if kind == event && at <= number => {
                return Err(io::Error::from_raw_os_error(error));
            }
            Plan::Freeze(kind, at) if kind == event && at == number => freeze(),
            Plan::Hold(mebibytes) if event == Event::Publish => hold(mebibytes << 20),
            _ => {}
        }
        Ok(())
    }

    fn tear(&self, part: &mut dyn FnMut()) {
        let number = self.count(Event::Torn);
        if self.plan == Plan::Kill(Event::Torn, number) {
            part();
            kill();
        }
    }

    fn most(&self, bytes: u64) -> u64 {
        match self.plan {
            Plan::Most(number) => number,
            _ => bytes,
        }
    }

    fn beat(&self, usual: Duration) -> Duration {
        match self.plan {
            Plan::Beat(number) => Duration::from_millis(number),
            _ => usual,
        }
    }

    fn finish(&self) {
        if let Plan::Count(path) = &self.plan {
            let lines = EVENTS.iter().zip(&self.seen);
            let lines: Vec<String> = lines
                .map(|((_, name), seen)| format!("{name} {}\n", seen.load(Ordering::Relaxed)))
                .collect();
            let _ = std::fs::write(path, lines.concat());
        }
    }
}

/// Has this number of bytes resident in all.
fn hold(bytes: u64) {
    let more = bytes.saturating_sub(limits::resident());
    let held = vec![1u8; more as usize];
    std::thread::sleep(HELD);
    std::hint::black_box(&held);
}

/// Installs the fault of the environment, if there is one.
///
/// # Errors
/// A message about a fault that does not exist.
pub fn install() -> Result<(), String> {
    let text = std::env::var_os(VARIABLE).filter(|text| !text.is_empty());
    let Some(text) = text else {
        return Ok(());
    };
    let plan = text.to_str().and_then(Plan::read).ok_or_else(|| {
        format!("{VARIABLE}: found {text:?}, expected a fault of CONTRIBUTING.md, such as write:3")
    })?;
    let seen = [const { AtomicU64::new(0) }; EVENTS.len()];
    fault::install(Box::new(Planned { plan, seen }));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planned(text: &str) -> Planned {
        let seen = [const { AtomicU64::new(0) }; EVENTS.len()];
        let plan = Plan::read(text).unwrap();
        Planned { plan, seen }
    }

    #[test]
    fn from_an_event_on_all_of_its_kind_fail() {
        for (text, event, kind) in [
            ("full:2", Event::Write, io::ErrorKind::StorageFull),
            (
                "sync:2",
                Event::Sync,
                io::Error::from_raw_os_error(DISK_FAILS).kind(),
            ),
        ] {
            let faults = planned(text);
            let others = EVENTS.iter().filter(|(other, _)| *other != event);
            for (other, _) in others.clone().chain(others) {
                faults.at(*other).unwrap();
            }
            faults.at(event).unwrap();
            for _ in 0..2 {
                assert_eq!(faults.at(event).unwrap_err().kind(), kind, "{text}");
            }
        }
    }

    #[test]
    fn signs_of_life_come_as_often_as_a_test_says() {
        let usual = Duration::from_secs(60);
        assert_eq!(planned("beat:200").beat(usual), Duration::from_millis(200));
        assert_eq!(planned("most:200").beat(usual), usual);
    }

    #[test]
    fn what_is_no_fault_is_refused() {
        for text in ["", "write", "write:", "write:x", "wrote:1", "freeze:record"] {
            assert_eq!(Plan::read(text), None, "{text}");
        }
        assert_eq!(Plan::read("torn:3"), Some(Plan::Kill(Event::Torn, 3)));
        for (text, event, number) in [
            ("freeze:publish", Event::Publish, 1),
            ("freeze:7", Event::Record, 7),
        ] {
            assert_eq!(
                Plan::read(text),
                Some(Plan::Freeze(event, number)),
                "{text}"
            );
        }
    }
}
