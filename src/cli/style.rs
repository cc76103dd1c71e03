//! Formatting of numbers, and small helpers for messages.

use outcrop_disk::error::Error;

/// 12345678 as `12 345 678`.
pub fn grouped(number: u64) -> String {
    indicatif::HumanCount(number).to_string().replace(',', " ")
}

/// A number with its noun.
pub fn counted(number: u64, noun: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{} {noun}{plural}", grouped(number))
}

/// Bytes with a binary unit.
pub fn bytes(count: u64) -> String {
    bytesize::ByteSize(count).display().iec().to_string()
}

/// Seconds in a readable form.
pub fn seconds(seconds: f64) -> String {
    if seconds < 10.0 {
        format!("{seconds:.1} s")
    } else if seconds < 120.0 {
        format!("{seconds:.0} s")
    } else if seconds < 7200.0 {
        format!("{:.0} min", seconds / 60.0)
    } else {
        format!("{:.1} h", seconds / 3600.0)
    }
}

/// True for a write to a closed pipe.
pub fn is_broken_pipe(error: &Error) -> bool {
    matches!(error, Error::Io { source, .. } if outcrop_platform::files::is_broken_pipe(source))
}

#[cfg(test)]
mod tests {
    #[test]
    fn groups_of_three() {
        assert_eq!(super::grouped(7), "7");
        assert_eq!(super::grouped(1234), "1 234");
        assert_eq!(super::grouped(12_345_678), "12 345 678");
    }
}
