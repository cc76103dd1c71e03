//! The description in an E57 file, which is XML: its scans and its reference system.

use super::super::contain::contain;
use super::super::input::Input;
use super::pages::{PAGE, Pages, Part};
use super::scan::{Field, Kind, Name, Scan};
use outcrop_disk::error::{Error, Result};
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};
use std::io::BufReader;
use std::str::FromStr;

/// Most bytes of a description. Two thousand scans take a third of it.
const LONGEST: u64 = 16 << 20;

/// Most bytes of a word or a text in it.
const LONGEST_TEXT: u64 = 1 << 20;

/// Most parts of a record: packets count them in two bytes.
const MOST_FIELDS: usize = u16::MAX as usize;

/// Deepest nesting of which the names are kept.
const DEEPEST: usize = 8;

/// The description of a file.
#[derive(Debug, Default)]
pub(super) struct Description {
    pub(super) scans: Vec<Scan>,
    /// The reference system, as well-known text.
    pub(super) system: String,
}

impl Description {
    /// Reads the description of this many bytes at `at`.
    ///
    /// # Errors
    /// [`Error::Input`] if it is damaged, too long, or says something else than points; [`Error::Io`].
    pub(super) fn read(input: &Input, at: u64, bytes: u64) -> Result<Self> {
        let most = LONGEST.min(input.bytes);
        if bytes > most {
            let expected = format!("at most {most}");
            return Err(input.error(
                "length of the description at byte 32",
                format!("{bytes} bytes"),
                expected,
            ));
        }
        if at >= input.bytes {
            let expected = format!("less than {}, the size of the file", input.bytes);
            return Err(input.error(
                "offset of the description at byte 24",
                at.to_string(),
                expected,
            ));
        }
        let part = Part::new(Pages::new(input, at), bytes);
        let source = BufReader::with_capacity(PAGE as usize, part);
        let mut parser = Parser {
            input,
            at,
            path: Vec::new(),
            depth: 0,
            text: String::new(),
            found: Self::default(),
        };
        let parsed = contain(|| parser.parse(Reader::from_reader(source)));
        parsed.unwrap_or_else(|found| {
            let place = format!("description at byte {at}");
            Err(input.error(place, found, "well-formed XML"))
        })?;
        Ok(parser.found)
    }
}

/// The number of a colour, and 0 for its lowest number or 1 for its highest, by the name of a limit.
fn limit_of(name: &str) -> Option<(usize, usize)> {
    let name = name.strip_prefix("color")?;
    let ends = ["Minimum", "Maximum"].iter().enumerate();
    let (end, color) = ends
        .into_iter()
        .find_map(|(n, end)| Some((n, name.strip_suffix(end)?)))?;
    let colors = ["Red", "Green", "Blue"];
    Some((colors.iter().position(|own| *own == color)?, end))
}

struct Parser<'a> {
    input: &'a Input,
    /// Offset of the description.
    at: u64,
    /// Local names of the open elements, down to [`DEEPEST`].
    path: Vec<Box<str>>,
    depth: usize,
    /// The text of the innermost element.
    text: String,
    found: Description,
}

impl Parser<'_> {
    fn parse(&mut self, mut reader: Reader<BufReader<Part<'_>>>) -> Result<()> {
        let mut buffer = Vec::new();
        loop {
            buffer.clear();
            reader.get_mut().get_mut().allow(LONGEST_TEXT);
            let event = match reader.read_event_into(&mut buffer) {
                Ok(event) => event,
                Err(error) => {
                    let place = format!("description at byte {}", self.at);
                    let found = error.to_string().escape_debug().to_string();
                    let failed = reader.into_inner().into_inner().failed;
                    return Err(
                        failed.unwrap_or_else(|| self.input.error(place, found, "well-formed XML"))
                    );
                }
            };
            match event {
                Event::Start(element) => self.begin(&element)?,
                Event::Empty(element) => {
                    self.begin(&element)?;
                    self.end()?;
                }
                Event::End(_) => self.end()?,
                Event::Text(text) => self.text += &text.xml_content(XmlVersion::Implicit1_0),
                Event::CData(text) => self.text += &text.xml_content(XmlVersion::Implicit1_0),
                Event::GeneralRef(name) => match name.resolve_char_ref() {
                    Ok(Some(c)) => self.text.push(c),
                    _ => {
                        self.text +=
                            quick_xml::escape::resolve_predefined_entity(&name).unwrap_or("")
                    }
                },
                Event::Eof => return Ok(()),
                _ => {}
            }
        }
    }

    /// The path of the innermost element below the root; empty if it is too deep.
    fn path(&self) -> Vec<&str> {
        match self.depth <= DEEPEST {
            true => self.path.iter().skip(1).map(AsRef::as_ref).collect(),
            false => Vec::new(),
        }
    }

    fn begin(&mut self, element: &BytesStart<'_>) -> Result<()> {
        self.text.clear();
        self.depth += 1;
        if self.depth <= DEEPEST {
            self.path.push(element.local_name().as_ref().into());
        }
        match self.path()[..] {
            ["data3D", "vectorChild"] => self.found.scans.push(Scan::default()),
            ["data3D", "vectorChild", "pose"] => {
                if let Some(scan) = self.found.scans.last_mut() {
                    scan.pose.get_or_insert_default();
                }
            }
            ["data3D", "vectorChild", "points"] => {
                let section = self.required(element, "fileOffset")?;
                let points = self.required(element, "recordCount")?;
                if let Some(scan) = self.found.scans.last_mut() {
                    (scan.section, scan.points) = (section, points);
                }
            }
            ["data3D", "vectorChild", "points", "prototype", _] => {
                let name = element.name();
                let kind = self.kind(element)?;
                let Some(scan) = self.found.scans.last_mut() else {
                    return Ok(());
                };
                scan.fields.push(Field {
                    name: Name::of(name.as_ref()),
                    kind,
                });
                if scan.fields.len() > MOST_FIELDS {
                    let expected = format!("at most {MOST_FIELDS} parts of a record");
                    return Err(self.wrong("one more", expected));
                }
            }
            ["data3D", "vectorChild", "points", "prototype", _, _, ..] => {
                let expected = "numbers that are not nested";
                return Err(self.wrong("a part of a record that has parts", expected));
            }
            _ => {}
        }
        Ok(())
    }

    fn end(&mut self) -> Result<()> {
        let text = std::mem::take(&mut self.text);
        match self.path()[..] {
            ["coordinateMetadata"] => self.found.system = text,
            ["data3D", "vectorChild", "colorLimits", limit] => {
                if let Some((color, end)) = limit_of(limit)
                    && let Some(scan) = self.found.scans.last_mut()
                {
                    let zero = text.trim().is_empty();
                    let value = if zero {
                        Some(0.0)
                    } else {
                        text.trim().parse().ok()
                    };
                    scan.color_limits[color][end] = value.filter(|v: &f64| v.is_finite());
                }
            }
            ["data3D", "vectorChild", "pose", part, axis] => {
                let (part, axis) = (part.to_owned(), axis.to_owned());
                self.pose(&part, &axis, text.trim())?;
            }
            _ => {}
        }
        self.depth = self.depth.saturating_sub(1);
        self.path.truncate(self.depth);
        Ok(())
    }

    /// Takes a number of a pose.
    fn pose(&mut self, part: &str, axis: &str, text: &str) -> Result<()> {
        let place = match (part, axis) {
            ("rotation", "w") => 0,
            ("rotation" | "translation", "x") => 1,
            ("rotation" | "translation", "y") => 2,
            ("rotation" | "translation", "z") => 3,
            _ => return Ok(()),
        };
        let value: Option<f64> = match text {
            "" => Some(0.0),
            text => text.parse().ok(),
        };
        let Some(value) = value else {
            let found = format!("{part} {axis} \"{}\"", text.escape_debug());
            return Err(self.wrong(found, "a number"));
        };
        let pose = self.found.scans.last_mut().and_then(|s| s.pose.as_mut());
        match pose {
            Some(pose) if part == "rotation" => pose.rotation[place] = value,
            Some(pose) => pose.translation[place - 1] = value,
            None => {}
        }
        Ok(())
    }

    /// The type of a part of a record.
    fn kind(&self, element: &BytesStart<'_>) -> Result<Kind> {
        let kind = self.attribute(element, "type")?.unwrap_or_default();
        let scaled = kind == "ScaledInteger";
        match &kind[..] {
            "Float" => match self.attribute(element, "precision")?.as_deref() {
                None | Some("double") => Ok(Kind::Double),
                Some("single") => Ok(Kind::Single),
                Some(other) => {
                    let found = format!("precision \"{}\"", other.escape_debug());
                    Err(self.wrong(found, "single or double"))
                }
            },
            "Integer" | "ScaledInteger" => {
                let lowest = self.optional(element, "minimum")?.unwrap_or(i64::MIN);
                let highest = self.optional(element, "maximum")?.unwrap_or(i64::MAX);
                if highest < lowest {
                    let found = format!("whole numbers from {lowest} to {highest}");
                    return Err(self.wrong(found, "a range that is not empty"));
                }
                let number = |name| match scaled {
                    true => self.optional(element, name),
                    false => Ok(None),
                };
                Ok(Kind::Integer {
                    lowest,
                    highest,
                    scale: number("scale")?.unwrap_or(1.0),
                    offset: number("offset")?.unwrap_or(0.0),
                })
            }
            other => {
                let name = element.name();
                let found = format!(
                    "{} of type \"{}\"",
                    name.as_ref().escape_debug(),
                    other.escape_debug()
                );
                Err(self.wrong(found, "Float, Integer or ScaledInteger"))
            }
        }
    }

    /// The text of an attribute.
    fn attribute(&self, element: &BytesStart<'_>, name: &str) -> Result<Option<String>> {
        let bad = |found: String| {
            let found = found.escape_debug().to_string();
            self.wrong(found, "attributes of XML")
        };
        let found = element.try_get_attribute(name);
        let Some(found) = found.map_err(|e| bad(e.to_string()))? else {
            return Ok(None);
        };
        let value = found.normalized_value(XmlVersion::Implicit1_0);
        Ok(Some(value.map_err(|e| bad(e.to_string()))?.into_owned()))
    }

    /// The number in an attribute.
    fn optional<T: FromStr>(&self, element: &BytesStart<'_>, name: &str) -> Result<Option<T>> {
        let Some(text) = self.attribute(element, name)? else {
            return Ok(None);
        };
        let value = text.trim().parse().map(Some);
        value.map_err(|_| {
            let shown: String = text.chars().take(40).collect();
            self.wrong(format!("{name} \"{}\"", shown.escape_debug()), "a number")
        })
    }

    fn required<T: FromStr>(&self, element: &BytesStart<'_>, name: &str) -> Result<T> {
        let value = self.optional(element, name)?;
        value.ok_or_else(|| self.wrong(format!("no {name}"), "one for the points"))
    }

    fn wrong(&self, found: impl Into<String>, expected: impl Into<String>) -> Error {
        let place = format!("description of scan {}", self.found.scans.len());
        self.input.error(place, found, expected)
    }
}
