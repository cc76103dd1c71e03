//! Bodies of ascii files: numbers separated by white space; line ends have no meaning.

use super::source::Source;
use crate::error::FileError;
use std::str::FromStr;

/// Longer than any number that programs write.
const WORD: usize = 400;

impl Source {
    /// Parses the next number, of the property `name`.
    pub(super) fn parse<T: FromStr>(&mut self, name: &str, expected: &str) -> Result<T, FileError> {
        while self.peek(1)?.first().is_some_and(u8::is_ascii_whitespace) {
            self.consume(1);
        }
        let bytes = self.peek(WORD)?.iter().take(WORD);
        let length = bytes.take_while(|b| !b.is_ascii_whitespace()).count();
        match length {
            0 => return Err(self.truncated(0, expected)),
            WORD => {
                let found = format!("a word of {WORD} characters or more");
                return Err(self.refuse(0, found, expected));
            }
            _ => {}
        }
        let word = self.consume(length);
        if let Some(value) = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()) {
            return Ok(value);
        }
        let short: String = String::from_utf8_lossy(word).chars().take(40).collect();
        let found = format!("'{}' as property {name}", short.escape_debug());
        Err(self.refuse(length, found, expected))
    }
}
