//! Processor time, which is less affected by other programs than wall-clock time.

use crate::Result;

/// Clock ticks per second in `/proc`: fixed by Linux for all programs.
const TICKS: f64 = 100.0;

/// User and system seconds of this process so far.
pub fn own() -> Result<f64> {
    ticks(&std::fs::read_to_string("/proc/self/stat")?, 13)
}

/// User and system seconds of all child processes that have ended.
pub fn children() -> Result<f64> {
    ticks(&std::fs::read_to_string("/proc/self/stat")?, 15)
}

/// Seconds in the field `first`, counted from 0, and the one after it.
fn ticks(stat: &str, first: usize) -> Result<f64> {
    // The name, field 1, is in brackets and may have any characters.
    let (_, rest) = stat
        .rsplit_once(')')
        .ok_or("no process name in /proc/self/stat")?;
    let mut ticks = 0u64;
    for field in rest.split_whitespace().skip(first - 2).take(2) {
        ticks += field.parse::<u64>()?;
    }
    Ok(ticks as f64 / TICKS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_fields_behind_an_odd_name() {
        let stat = "7 (a ) b) R 1 7 7 0 -1 0 0 0 0 0 120 30 500 25 20 0 3 0";
        assert_eq!(ticks(stat, 13).unwrap(), 1.5);
        assert_eq!(ticks(stat, 15).unwrap(), 5.25);
        assert!(own().is_ok() && children().is_ok());
    }
}
