//! Numbers and texts of pages.

use maud::{Markup, html};
use std::path::Path;

/// A count with groups of three digits. The gaps are drawn, not written, so that a copied number has none.
pub fn count(number: u64) -> Markup {
    let digits = number.to_string();
    let first = (digits.len() - 1) % 3 + 1;
    let (head, rest) = digits.split_at(first);
    let groups = rest.as_bytes().chunks(3);
    html! {
        (head)
        @for group in groups { span.g { (String::from_utf8_lossy(group)) } }
    }
}

/// A length with four significant digits.
pub fn length(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return x.to_string();
    }
    let digits = 3 - libm::log10(x.abs()).floor() as i32;
    if !(-4..=9).contains(&digits) {
        return format!("{x:.3e}");
    }
    let text = format!("{x:.*}", digits.max(0) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// The middle of some lengths, and the range of most.
pub fn spread(p5: f64, p50: f64, p95: f64) -> String {
    let [p5, p50, p95] = [p5, p50, p95].map(length);
    format!("median {p50}, 5 to 95 %: {p5} to {p95}")
}

/// A position, to a tenth of a step of the lattice on which it lies.
pub fn position(p: [f64; 3], step: f64) -> String {
    let decimals = match step {
        step if step > 0.0 && step < 1.0 => (-libm::log10(step).floor()) as usize + 1,
        _ => 1,
    };
    let text = |x: f64| {
        let text = format!("{x:.*}", decimals.min(12));
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    p.map(text).join("  ")
}

/// Bytes with a binary unit.
pub fn bytes(count: u64) -> String {
    bytesize::ByteSize(count).display().iec().to_string()
}

/// A time.
pub fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 10.0 => format!("{s:.2} s"),
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// A share in per cent.
pub fn percent(part: f64, whole: f64) -> String {
    match whole > 0.0 {
        true => format!("{:.1} %", 100.0 * part / whole),
        false => "–".to_owned(),
    }
}

/// A text without control characters, which have no place in a page.
pub fn clean(text: &str) -> String {
    let shown = |c: char| {
        let odd = c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}' | '\u{202a}'..='\u{202e}');
        if odd { char::REPLACEMENT_CHARACTER } else { c }
    };
    text.chars().map(shown).collect()
}

/// A path as text.
pub fn path(path: &Path) -> String {
    clean(&path.to_string_lossy())
}

/// The name of a file as text.
pub fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    clean(&name.to_string_lossy())
}

/// A number with its noun.
pub fn counted(number: u64, noun: &str) -> Markup {
    let plural = if number == 1 { "" } else { "s" };
    html! { (count(number)) " " (noun) (plural) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_readable_and_copied_whole() {
        let shown = count(12_345_678).into_string();
        assert_eq!(
            shown,
            "12<span class=\"g\">345</span><span class=\"g\">678</span>"
        );
        assert_eq!(count(999).into_string(), "999");
        assert_eq!(count(0).into_string(), "0");
        assert_eq!(length(0.123_456), "0.1235");
        assert_eq!(length(1234.56), "1235");
        assert_eq!(length(-2.5), "-2.5");
        assert_eq!(length(0.0), "0");
        assert_eq!(length(1e-9), "1.000e-9");
        assert_eq!(length(123_456_789.0), "1.235e8");
        assert_eq!(percent(1.0, 0.0), "–");
        let p = [1.488_500_000_000_000_2, -2.0, 1e6];
        assert_eq!(position(p, 0.0001), "1.4885  -2  1000000");
        assert_eq!(position([0.5, 1.25, 3.0], 0.0), "0.5  1.2  3");
    }

    #[test]
    fn nothing_odd_is_left_in_a_text() {
        assert_eq!(
            clean("a\u{0}b\n\u{1b}[31m\u{202e}c"),
            "a\u{fffd}b\u{fffd}\u{fffd}[31m\u{fffd}c"
        );
    }
}
