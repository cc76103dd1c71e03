//! The places of scans and of units of lines in a PTX file. Only the number of lines tells where a scan ends.

use super::super::input::{Input, Range, STREAM_BUFFER};
use super::super::lines::{self, LONGEST_LINE};
use super::kinds::Value;
use super::scan::{HEADER, Scan};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_points::columns::Wanted;
use outcrop_points::spool::{Sink, SourceWriter};
use serde::{Deserialize, Serialize};
use std::io::{BufRead, BufReader};

/// Most bytes of lines in a unit; no line is longer.
pub(super) const UNIT: u64 = 2 << 20;

/// Most bytes of a line of a header.
const LONGEST_ROW: u64 = 4096;

/// Most scans in a file.
const MOST_SCANS: usize = 1 << 16;

/// Lines of one scan.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct UnitOfLines {
    start: u64,
    end: u64,
    /// Number of the scan.
    scan: u32,
}

/// The scans of a file and their lines.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Index {
    pub(super) scans: Vec<Scan>,
    pub(super) units: Vec<UnitOfLines>,
}

impl Index {
    /// Reads the file to its end, once in a run, and the memory for the index.
    ///
    /// # Errors
    /// [`Error::Input`] if there are other lines than the headers say; [`Error::Memory`], [`Error::Io`],
    /// [`Error::Cancelled`].
    pub(super) fn read(input: &Input, target: &SourceWriter<'_>) -> Result<(Self, Reservation)> {
        let workspace = target.workspace;
        let name = target.step("PTX scans");
        let index = workspace.once(&name, |_| {
            let mut reader = Reader::new(input, workspace)?;
            while reader.scan()? {}
            Ok(reader.index)
        })?;
        let held = workspace.reserve("PTX index", index.bytes())?;
        Ok((index, held))
    }

    fn bytes(&self) -> u64 {
        let scans = self.scans.capacity() * size_of::<Scan>();
        (scans + self.units.capacity() * size_of::<UnitOfLines>()) as u64
    }

    /// Passes the points of a unit on.
    pub(super) fn take(
        &self,
        input: &Input,
        unit: usize,
        wanted: &Wanted,
        sink: &mut Sink<'_, f64>,
    ) -> Result<()> {
        let UnitOfLines { start, end, scan } = self.units[unit];
        let scan = &self.scans[scan as usize];
        let bytes = input.window(start, (end - start) as usize, "lines")?;
        let mut at = start;
        let values = Value::all(wanted);
        let every = values.iter().any(|value| !value.is_scanner());
        // Without values to read, the first point of a unit tells what its lines have.
        let mut seen = false;
        for line in bytes.split(|b| lines::is_end(*b)) {
            let text = line.trim_ascii();
            if text.is_empty() {
                at += line.len() as u64 + 1;
                continue;
            }
            let before = sink.stats.invalid;
            let taken = scan.take(text, (&values, every || !seen), sink)?;
            seen |= sink.stats.invalid == before;
            if let Err(found) = taken {
                let place = format!("line {}", lines::number_of(input, at)?);
                let expected = "three coordinates, perhaps with an intensity and a colour";
                return Err(input.error(place, found, expected));
            }
            at += line.len() as u64 + 1;
        }
        Ok(())
    }
}

/// Reads a file line by line.
struct Reader<'a> {
    input: &'a Input,
    workspace: &'a Workspace,
    source: BufReader<Range<'a>>,
    /// Offset of the next byte.
    at: u64,
    /// Scans with points so far.
    filled: u16,
    index: Index,
    /// For the index, which grows.
    held: Reservation,
}

impl<'a> Reader<'a> {
    fn new(input: &'a Input, workspace: &'a Workspace) -> Result<Self> {
        let fixed = STREAM_BUFFER as u64 + LONGEST_LINE;
        Ok(Self {
            input,
            workspace,
            source: input.stream(0, input.bytes),
            at: 0,
            filled: 0,
            index: Index {
                scans: Vec::new(),
                units: Vec::new(),
            },
            held: workspace.reserve("PTX index", fixed)?,
        })
    }

    /// The place of the next line that is not blank, which is put into `keep`; none at the end of the file.
    fn line(&mut self, mut keep: Option<&mut Vec<u8>>) -> Result<Option<(u64, u64)>> {
        let mut start = None;
        loop {
            let buffer = self.source.fill_buf();
            let buffer = buffer.map_err(|e| Error::io(&self.input.path, "read", e))?;
            if buffer.is_empty() {
                return Ok(start.map(|start| (start, self.at)));
            }
            let mut from = 0;
            if start.is_none() {
                let text = buffer.iter().position(|b| !b.is_ascii_whitespace());
                from = text.unwrap_or(buffer.len());
                start = text.map(|text| self.at + text as u64);
            }
            let end = buffer[from..].iter().position(|b| lines::is_end(*b));
            let to = end.map_or(buffer.len(), |end| from + end);
            if let Some(line) = &mut keep {
                let most = to.min(from + LONGEST_ROW as usize);
                line.extend_from_slice(&buffer[from..most]);
            }
            self.source.consume(to);
            self.at += to as u64;
            let Some(start) = start else { continue };
            let most = if keep.is_some() {
                LONGEST_ROW
            } else {
                LONGEST_LINE
            };
            if self.at - start > most {
                return Err(lines::too_long(self.input, start, most));
            }
            if end.is_some() {
                return Ok(Some((start, self.at)));
            }
        }
    }

    /// Reads a scan; false at the end of the file.
    fn scan(&mut self) -> Result<bool> {
        let mut header = Vec::with_capacity(HEADER);
        let mut begin = 0;
        while header.len() < HEADER {
            let mut line = Vec::new();
            let Some((start, _)) = self.line(Some(&mut line))? else {
                break;
            };
            if header.is_empty() {
                begin = start;
            }
            line.truncate(line.trim_ascii_end().len());
            header.push(line);
        }
        if header.is_empty() {
            return Ok(false);
        }
        let header: Vec<&[u8]> = header.iter().map(Vec::as_slice).collect();
        let mut scan = Scan::of(self.input, begin, &header)?;
        // Beyond the largest number it is that of none.
        scan.number = self.filled;
        if scan.points > 0 {
            self.filled = self.filled.saturating_add(1);
        }
        let number = self.index.scans.len();
        if number == MOST_SCANS {
            let place = format!("scan {}", number + 1);
            let expected = format!("at most {MOST_SCANS} scans");
            return Err(self.input.error(place, "one more", expected));
        }
        let points = scan.points;
        self.index.scans.push(scan);
        self.lines(number, begin, points)?;
        Ok(true)
    }

    /// Passes over the lines of the points of a scan, in units.
    fn lines(&mut self, scan: usize, begin: u64, points: u64) -> Result<()> {
        let (mut first, mut last) = (None, 0);
        for done in 0..points {
            let Some((start, end)) = self.line(None)? else {
                let line = lines::number_of(self.input, begin)?;
                return Err(self.input.error(
                    format!("scan {}, whose header begins in line {line}", scan + 1),
                    format!("the end of the file after {done} points"),
                    format!("{points}, the product of its columns and rows"),
                ));
            };
            match first {
                Some(first) if end - first <= UNIT => {}
                Some(begun) => {
                    self.unit(scan, begun, last)?;
                    first = Some(start);
                }
                None => first = Some(start),
            }
            last = end;
        }
        first.map_or(Ok(()), |first| self.unit(scan, first, last))
    }

    fn unit(&mut self, scan: usize, start: u64, end: u64) -> Result<()> {
        self.workspace.check_cancel()?;
        let scan = scan as u32;
        self.index.units.push(UnitOfLines { start, end, scan });
        let bytes = STREAM_BUFFER as u64 + LONGEST_LINE + self.index.bytes();
        self.held.at_least(bytes)
    }
}
