//! Reading a header.

use crate::error::{Error, Result};
use crate::header::{Element, Header};
use crate::place::Place;
use crate::system::System;
use crate::types::{Encoding, Property, Scalar};
use std::io::BufRead;

/// Longest header that is read, in bytes. It also bounds the size of one entry: a property takes at least 18
/// bytes in the header and at most 8 in an entry.
const LONGEST: usize = 1 << 20;

impl Header {
    /// Longest header that is read, in bytes.
    pub const LONGEST: usize = LONGEST;

    /// Reads a header from its first line on, and none of the data after it.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Input`] with the line.
    pub fn read(input: &mut impl BufRead) -> Result<Self> {
        let mut lines = Lines {
            input,
            line: Vec::new(),
            bytes: 0,
            number: 0,
            end: b'\n',
        };
        let mut header = Self {
            encoding: Encoding::Ascii,
            elements: Vec::new(),
            bytes: 0,
            place: Place::default(),
            system: System::default(),
        };
        let mut encoding = None;
        loop {
            lines.next()?;
            let text = String::from_utf8_lossy(lines.line.trim_ascii());
            if lines.number == 1 && text != "ply" {
                return Err(lines.wrong(&text, "\"ply\""));
            }
            if text == "end_header" {
                header.encoding =
                    encoding.ok_or_else(|| lines.wrong(&text, "a line \"format\" before it"))?;
                header.bytes = lines.bytes as u64;
                return Ok(header);
            }
            header
                .take(&text, &mut encoding)
                .map_err(|expected| lines.wrong(&text, expected))?;
        }
    }

    /// Processes a line; the error is the expected content.
    fn take(&mut self, text: &str, encoding: &mut Option<Encoding>) -> Result<(), &'static str> {
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words[..] {
            ["comment", ref words @ ..] => {
                self.place.take(words);
                self.system.take(words);
                Ok(())
            }
            [] | ["ply" | "obj_info", ..] => Ok(()),
            ["format", name, ..] => {
                let found = Encoding::parse(name).ok_or("ascii or binary_…_endian")?;
                *encoding = Some(found);
                Ok(())
            }
            ["element", name, count] => {
                let count = count.parse();
                self.elements.push(Element {
                    name: name.to_owned(),
                    count: count.map_err(|_| "a number of elements, 0 or more")?,
                    properties: Vec::new(),
                });
                Ok(())
            }
            ["property", "list", count, item, name] => {
                match (Scalar::parse(count), Scalar::parse(item)) {
                    (Some(count), Some(item)) if count.is_integer() => {
                        self.property(name, Property::List { count, item })
                    }
                    _ => Err("an integer type and a type"),
                }
            }
            ["property", kind, name] => match Scalar::parse(kind) {
                Some(scalar) => self.property(name, Property::One(scalar)),
                None => Err("a type such as float or uchar"),
            },
            _ => Err("format, element, property, comment or end_header"),
        }
    }

    fn property(&mut self, name: &str, property: Property) -> Result<(), &'static str> {
        let element = self.elements.last_mut();
        let element = element.ok_or("an element before its properties")?;
        element.properties.push((name.to_owned(), property));
        Ok(())
    }
}

/// The lines of a header.
struct Lines<'a, R> {
    input: &'a mut R,
    /// The last line, without its end.
    line: Vec<u8>,
    /// Bytes read so far.
    bytes: usize,
    /// Lines read so far.
    number: usize,
    /// The byte that ends lines; a carriage return alone only if it ends the first line.
    end: u8,
}

impl<R: BufRead> Lines<'_, R> {
    fn next(&mut self) -> Result<()> {
        self.line.clear();
        self.number += 1;
        while self.bytes < LONGEST
            && let Some(byte) = self.peek()?
        {
            self.input.consume(1);
            self.bytes += 1;
            if self.number == 1 && byte == b'\r' && self.peek()?.is_some_and(|b| b != b'\n') {
                self.end = byte;
            }
            if byte == self.end {
                return Ok(());
            }
            self.line.push(byte);
        }
        let found = match self.bytes == LONGEST {
            true => "no end in 1 MiB",
            false => "the end of the file",
        };
        Err(Error::input("PLY header", found, "a line \"end_header\""))
    }

    fn peek(&mut self) -> Result<Option<u8>> {
        loop {
            match self.input.fill_buf() {
                Ok(buffer) => return Ok(buffer.first().copied()),
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e.into()),
            }
        }
    }

    fn wrong(&self, text: &str, expected: &str) -> Error {
        let short: String = text.chars().take(60).collect();
        let found = format!("\"{}\"", short.escape_debug());
        Error::input(format!("PLY header, line {}", self.number), found, expected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Header> {
        Header::read(&mut text.as_bytes())
    }

    #[test]
    fn lines_end_in_three_ways() {
        let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n\
                    property list uchar int y\nend_header\n";
        for end in ["\n", "\r\n", "\r"] {
            let text = text.replace('\n', end);
            let header = read(&format!("{text}\n")).unwrap();
            assert_eq!(header.bytes, text.len() as u64);
            let (_, vertex) = header.element("vertex").unwrap().unwrap();
            assert_eq!((vertex.count, vertex.properties.len()), (2, 2));
            assert_eq!(
                (vertex.bytes_before(1), vertex.record_bytes()),
                (Some(4), None)
            );
        }
    }

    #[test]
    fn refusals_name_the_line() {
        for (text, place, found) in [
            ("", "PLY header", "the end of the file"),
            ("plywood\n", "PLY header, line 1", "\"plywood\""),
            ("ply\nend_header\n", "PLY header, line 2", "\"end_header\""),
            (
                "ply\nformat ascii 1.0\nproperty float x\n",
                "PLY header, line 3",
                "\"property float x\"",
            ),
            (
                "ply\nelement v 1\nproperty list float int x\n",
                "PLY header, line 3",
                "\"property list",
            ),
            (
                "ply\nhello \u{1b}[31m\n",
                "PLY header, line 2",
                "\"hello \\u{1b}[31m\"",
            ),
        ] {
            let error = read(text).unwrap_err().to_string();
            let start = format!("{place}: found {found}");
            assert!(error.starts_with(&start), "{error}");
        }
        let endless = format!("ply\ncomment {}", "a".repeat(3 << 20));
        let error = read(&endless).unwrap_err().to_string();
        assert!(error.contains("found no end in 1 MiB"), "{error}");
    }
}
