//! The journal: the finished work of a run as checksummed records, append-only.
//!
//! A record is `length, CRC-32` (two `u32`) and its body. Bytes after the last whole record are ignored: an
//! attempt ended while it wrote them.

use super::fault;
use super::open::failed_write;
use super::place::{Place, Put};
use crate::error::{Error, Result};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Name of the file in the scratch folder.
pub const NAME: &str = "journal";

/// The first bytes of the file; the digit is the version of the journal's format.
const MAGIC: &[u8; 8] = b"OUTCROP1";

/// Bytes before the body of a record.
const HEAD: u64 = 8;

/// A record of finished work.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// The manifest of the run; the first record.
    Manifest(Vec<u8>),
    /// A stage began.
    Begin(String),
    /// A unit of a step is finished.
    Unit {
        /// Name of the step.
        step: String,
        /// Its number within the step.
        unit: u64,
        /// Parts of files that the unit wrote.
        puts: Vec<Put>,
        /// The saved result of the unit.
        payload: Vec<u8>,
    },
    /// A file is not needed any more.
    Deleted(String),
}

/// A record and its offset.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Offset of the record.
    pub offset: u64,
    /// Offset and length of its payload.
    pub payload: (u64, usize),
    /// The record itself.
    pub record: Record,
}

/// Appends records.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: Arc<File>,
    end: Mutex<u64>,
}

fn text(out: &mut Vec<u8>, text: &str) {
    out.extend_from_slice(&(text.len() as u32).to_le_bytes());
    out.extend_from_slice(text.as_bytes());
}

fn encode(record: &Record) -> Vec<u8> {
    let mut out = vec![0; HEAD as usize];
    match record {
        Record::Manifest(bytes) => {
            out.push(0);
            out.extend_from_slice(bytes);
        }
        Record::Begin(stage) => {
            out.push(1);
            text(&mut out, stage);
        }
        Record::Deleted(file) => {
            out.push(2);
            text(&mut out, file);
        }
        Record::Unit {
            step,
            unit,
            puts,
            payload,
        } => {
            out.push(3);
            text(&mut out, step);
            out.extend_from_slice(&unit.to_le_bytes());
            out.extend_from_slice(&(puts.len() as u32).to_le_bytes());
            for put in puts {
                text(&mut out, &put.file);
                out.extend_from_slice(&put.section.to_le_bytes());
                out.extend_from_slice(&put.place.offset.to_le_bytes());
                out.extend_from_slice(&(put.place.bytes as u64).to_le_bytes());
                out.extend_from_slice(&(put.place.records as u64).to_le_bytes());
                out.extend_from_slice(&put.place.crc.to_le_bytes());
            }
            out.extend_from_slice(payload);
        }
    }
    let length = (out.len() as u64 - HEAD) as u32;
    let crc = crc32fast::hash(&out[HEAD as usize..]);
    out[..4].copy_from_slice(&length.to_le_bytes());
    out[4..8].copy_from_slice(&crc.to_le_bytes());
    out
}

/// Reads the fields of a body.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*head)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Option<String> {
        let length = self.u32()? as usize;
        let (head, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        String::from_utf8(head.to_vec()).ok()
    }

    fn put(&mut self) -> Option<Put> {
        Some(Put {
            file: self.text()?.into(),
            section: self.u32()?,
            place: Place {
                offset: self.u64()?,
                bytes: self.u64()? as usize,
                records: self.u64()? as usize,
                crc: self.u32()?,
            },
        })
    }
}

/// A record and the offset of its payload in `body`.
fn decode(body: &[u8]) -> Option<(Record, usize)> {
    let (kind, rest) = body.split_first()?;
    let mut fields = Fields(rest);
    let record = match kind {
        0 => return Some((Record::Manifest(rest.to_vec()), 1)),
        1 => Record::Begin(fields.text()?),
        2 => Record::Deleted(fields.text()?),
        3 => {
            let (step, unit, count) = (fields.text()?, fields.u64()?, fields.u32()?);
            let puts = (0..count).map(|_| fields.put()).collect::<Option<_>>()?;
            // Payloads are read from disk when they are needed.
            let at = body.len() - fields.0.len();
            let payload = Vec::new();
            let record = Record::Unit {
                step,
                unit,
                puts,
                payload,
            };
            return Some((record, at));
        }
        _ => return None,
    };
    Some((record, body.len()))
}

impl Journal {
    /// Begins a journal in the new file at `path`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(path: &Path, file: File) -> Result<Self> {
        file.write_all_at(MAGIC, 0)
            .map_err(|e| failed_write(path, MAGIC.len(), 0, e))?;
        Ok(Self::at(path, file, MAGIC.len() as u64))
    }

    /// Continues a journal at `end`; the bytes after it are cut off.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn go_on(path: &Path, file: File, end: u64) -> Result<Self> {
        file.set_len(end)
            .map_err(|e| Error::io(path, "cut its torn end off", e))?;
        Ok(Self::at(path, file, end))
    }

    fn at(path: &Path, file: File, end: u64) -> Self {
        Self {
            path: path.to_path_buf(),
            file: Arc::new(file),
            end: Mutex::new(end),
        }
    }

    /// The file, for syncing.
    pub fn file(&self) -> Arc<File> {
        self.file.clone()
    }

    /// Appends a record.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn append(&self, record: &Record) -> Result<()> {
        let bytes = encode(record);
        let mut end = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        // An incomplete record is overwritten by the next one.
        fault::record(&bytes, |bytes| self.file.write_all_at(bytes, *end))
            .map_err(|e| failed_write(&self.path, bytes.len(), 0, e))?;
        *end += bytes.len() as u64;
        Ok(())
    }

    /// Reads a payload.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn payload(&self, offset: u64, bytes: usize) -> Result<Vec<u8>> {
        let mut payload = vec![0; bytes];
        self.file
            .read_exact_at(&mut payload, offset)
            .map_err(|e| Error::io(&self.path, format!("read {bytes} bytes"), e))?;
        Ok(payload)
    }
}

/// All whole records of a journal and the end of the last; `None` if the file is no journal.
///
/// # Errors
/// [`Error::Io`].
pub fn read(path: &Path, file: &File) -> Result<Option<(Vec<Entry>, u64)>> {
    let io = |e| Error::io(path, "read", e);
    let length = file.metadata().map_err(io)?.len();
    let mut magic = [0; MAGIC.len()];
    if length < magic.len() as u64 {
        return Ok(None);
    }
    file.read_exact_at(&mut magic, 0).map_err(io)?;
    if magic != *MAGIC {
        return Ok(None);
    }
    let mut entries = Vec::new();
    let mut at = MAGIC.len() as u64;
    let mut body = Vec::new();
    while at + HEAD <= length {
        let mut head = [0u32; 2];
        file.read_exact_at(bytemuck::cast_slice_mut(&mut head), at)
            .map_err(io)?;
        let [bytes, crc] = head.map(u32::from_le);
        if u64::from(bytes) > length - at - HEAD {
            break;
        }
        body.resize(bytes as usize, 0);
        file.read_exact_at(&mut body, at + HEAD).map_err(io)?;
        if crc32fast::hash(&body) != crc {
            break;
        }
        let Some((record, payload)) = decode(&body) else {
            break;
        };
        entries.push(Entry {
            offset: at,
            payload: (at + HEAD + payload as u64, body.len() - payload),
            record,
        });
        at += HEAD + u64::from(bytes);
    }
    Ok(Some((entries, at)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn records() -> Vec<Record> {
        let put = |section| Put {
            file: "cells.own".into(),
            section,
            place: Place {
                offset: 1 << 40,
                bytes: 77,
                records: 3,
                crc: 0xdead_beef,
            },
        };
        vec![
            Record::Manifest(b"{}".to_vec()),
            Record::Begin("cells#0".into()),
            Record::Unit {
                step: "cells#0/tile#0".into(),
                unit: 9,
                puts: vec![put(1), put(2)],
                payload: Vec::new(),
            },
            Record::Deleted("points".into()),
        ]
    }

    #[test]
    fn a_torn_or_damaged_end_is_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        let open = || {
            let mut options = File::options();
            options.read(true).write(true).create(true).truncate(false);
            options.open(&path).unwrap()
        };
        let journal = Journal::create(&path, open()).unwrap();
        let mut ends = vec![MAGIC.len() as u64];
        for record in records() {
            journal.append(&record).unwrap();
            ends.push(*journal.end.lock().unwrap());
        }
        let whole = std::fs::read(&path).unwrap();
        let read_back = || {
            let (entries, end) = read(&path, &open()).unwrap().unwrap();
            let records: Vec<_> = entries.into_iter().map(|e| e.record).collect();
            (records, end)
        };
        assert_eq!(read_back(), (records(), whole.len() as u64));
        for cut in MAGIC.len()..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let count = ends.partition_point(|end| *end <= cut as u64) - 1;
            assert_eq!(read_back(), (records()[..count].to_vec(), ends[count]));
        }
        for at in MAGIC.len()..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 4;
            std::fs::write(&path, &damaged).unwrap();
            let count = ends.partition_point(|end| *end <= at as u64) - 1;
            assert_eq!(read_back().1, ends[count], "a flip at {at}");
        }
    }
}
