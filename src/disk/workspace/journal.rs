//! Journals: the finished work of a run as checksummed records, append-only.
//!
//! The thread that runs the program writes `journal`; the workers of every attempt write `journal.0`,
//! `journal.1` …, each its own. A record of a worker tells how many records were in `journal` when its step
//! was at work, which puts all records in order.
//!
//! A record is `length, CRC-32` (two `u32`) and its body. Bytes after the last whole record are ignored: an
//! attempt ended while it wrote them.

use super::fault;
use super::lock;
use super::open::{failed_write, open_existing, options};
use super::place::Put;
use crate::error::{Error, Result};
use outcrop_platform::FileAt;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Name of the program's journal in the scratch folder.
pub const NAME: &str = "journal";

/// The first bytes of the file; the digit is the version of the journal's format.
pub(super) const MAGIC: &[u8; 8] = b"OUTCROP2";

/// Bytes before the body of a record.
const HEAD: u64 = 8;

/// Name of the journal of a worker.
pub fn of_worker(number: u32) -> String {
    format!("{NAME}.{number}")
}

/// The number of the worker to which a file of this name belongs, if it is the journal of a worker.
pub fn worker(name: &str) -> Option<u32> {
    let number = name.strip_prefix(NAME)?.strip_prefix('.')?;
    let number = number.parse().ok()?;
    (name == of_worker(number)).then_some(number)
}

/// A record of finished work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Record {
    /// The manifest of the run; the first record.
    Manifest(Vec<u8>),
    /// An attempt began; this number is larger than those of its workers.
    Attempt(u32),
    /// A stage began.
    Begin(String),
    /// A unit of a step is finished.
    Unit {
        /// Name of the step.
        step: String,
        /// Its number within the step.
        unit: u64,
        /// Number of records in the program's journal when it was finished.
        after: u64,
        /// Parts of files that the unit wrote.
        puts: Vec<Put>,
        /// The saved result of the unit.
        payload: Vec<u8>,
    },
    /// All units of a step are finished.
    End {
        /// Name of the step.
        step: String,
        /// Number of its units.
        units: u64,
        /// Files that they wrote.
        files: Vec<String>,
    },
    /// A file is not needed any more.
    Deleted(String),
    /// Tasks share the run.
    Shared(Sharing),
    /// The units of these steps that are not finished are for tasks; the last record of a generation.
    Open(Vec<OpenStep>),
    /// The journal is that of a task.
    Task(Task),
    /// A task, or the program between two generations, is finished.
    Took(Took),
    /// The run is finished.
    Finished,
    /// A process that shares the run failed; the last record of its journal.
    Failed(Failure),
}

/// The reason why a process failed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Its message.
    pub why: String,
    /// True if the work of others is damaged.
    pub damage: bool,
}

/// How tasks share a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sharing {
    /// A number that tells the run from others.
    pub run: u64,
    /// Number of shards of the units of a generation.
    pub shards: u32,
    /// Most threads of a process.
    pub threads: u32,
    /// Bytes of memory of a process, unless it is told otherwise.
    pub memory: u64,
    /// Checksum of the program; all processes must run the same one.
    pub program: u32,
}

/// A step with units that are not finished.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct OpenStep {
    /// Name of the step.
    pub step: String,
    /// Number of its units, all of which are open.
    pub units: u64,
}

/// The work of a task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Task {
    /// Number of the run.
    pub run: u64,
    /// Number of the generation whose units it does.
    pub generation: u64,
    /// Number of its shard.
    pub shard: u32,
}

/// Requests to a store, and their bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Traffic {
    /// Number of requests.
    pub requests: u64,
    /// Bytes of the answers.
    pub fetched: u64,
    /// Bytes of what was put.
    pub sent: u64,
}

/// The resources that a process took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Took {
    /// The shard; none for the program between two generations.
    pub shard: Option<u32>,
    /// Seconds.
    pub seconds: f64,
    /// Seconds of processor time.
    pub cpu_seconds: f64,
    /// Peak of the resident memory in bytes.
    pub resident: u64,
    /// Bytes read.
    pub read: u64,
    /// Bytes written.
    pub written: u64,
    /// Requests to the store of the run, if it is in one.
    pub traffic: Traffic,
    /// Points of the cloud, as far as they are known; of the program between two generations.
    pub points: u64,
    /// Seconds since the beginning of 1970 at its end.
    pub ended: u64,
}

/// The place of a payload: the worker whose journal has it (`None`: the program's), offset and length.
pub type PayloadPlace = (Option<u32>, u64, usize);

/// A record and its places.
#[derive(Debug)]
pub struct Entry<'a> {
    /// The time of the record: the odd number `2 n + 1` for record `n` of the program's journal; for one of a
    /// worker twice the number of records before it.
    pub at: u64,
    /// Offset of the record in its journal.
    pub offset: u64,
    /// Place of its payload.
    pub payload: PayloadPlace,
    /// The record itself, without its payload.
    pub record: &'a Record,
}

#[derive(Debug, Clone, Copy)]
struct End {
    bytes: u64,
    records: u64,
}

/// Appends records.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: Arc<File>,
    end: Mutex<End>,
}

fn encode(record: &Record) -> postcard::Result<Vec<u8>> {
    let mut out = postcard::to_extend(record, vec![0; HEAD as usize])?;
    let length = (out.len() as u64 - HEAD) as u32;
    let crc = crc32fast::hash(&out[HEAD as usize..]);
    out[..4].copy_from_slice(&length.to_le_bytes());
    out[4..8].copy_from_slice(&crc.to_le_bytes());
    Ok(out)
}

impl Journal {
    /// Begins the journal `path`, a new file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(path: &Path) -> Result<Self> {
        let file = options().create_new(true).open(path);
        let file = file.map_err(|e| Error::io(path, "create", e))?;
        file.write_all_at(MAGIC, 0)
            .map_err(|e| failed_write(path, MAGIC.len(), 0, e))?;
        let bytes = MAGIC.len() as u64;
        Ok(Self::at(path, file, End { bytes, records: 0 }))
    }

    /// Continues a journal of `records` records with `bytes` bytes; what comes after them is cut off.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn go_on(path: &Path, bytes: u64, records: u64) -> Result<Self> {
        let file = open_existing(path).map_err(|e| Error::io(path, "open", e))?;
        file.set_len(bytes)
            .map_err(|e| Error::io(path, "cut its torn end off", e))?;
        Ok(Self::at(path, file, End { bytes, records }))
    }

    fn at(path: &Path, file: File, end: End) -> Self {
        Self {
            path: path.to_path_buf(),
            file: Arc::new(file),
            end: Mutex::new(end),
        }
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file, for syncing.
    pub fn file(&self) -> Arc<File> {
        self.file.clone()
    }

    /// Number of records.
    pub fn records(&self) -> u64 {
        lock(&self.end).records
    }

    /// Appends a record.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn append(&self, record: Record) -> Result<()> {
        let bytes = encode(&record)
            .map_err(|e| Error::io(&self.path, "encode a record for", std::io::Error::other(e)))?;
        let mut end = lock(&self.end);
        // An incomplete record is overwritten by the next one.
        fault::record(&bytes, |bytes| self.file.write_all_at(bytes, end.bytes))
            .map_err(|e| failed_write(&self.path, bytes.len(), 0, e))?;
        end.bytes += bytes.len() as u64;
        end.records += 1;
        Ok(())
    }
}

/// Path of the journal of a worker in `folder` (`None`: the program's).
pub fn path_of(folder: &Path, worker: Option<u32>) -> PathBuf {
    folder.join(worker.map_or(NAME.to_owned(), of_worker))
}

/// Opens a journal to read payloads.
///
/// # Errors
/// [`Error::Io`].
pub fn open(path: &Path) -> Result<File> {
    open_existing(path).map_err(|e| Error::io(path, "open", e))
}

/// Reads a payload of the journal `path`, which is open as `file`.
///
/// # Errors
/// [`Error::Io`].
pub fn payload(path: &Path, file: &File, offset: u64, bytes: usize) -> Result<Vec<u8>> {
    let mut payload = vec![0; bytes];
    file.read_exact_at(&mut payload, offset)
        .map_err(|e| Error::io(path, format!("read {bytes} bytes"), e))?;
    Ok(payload)
}

/// Calls `each` with the whole records of the journal `path` of `worker` (`None`: the program's), until it
/// returns false. Returns the end of the last record for which it returned true, and their number; `None` if
/// the file is no journal.
///
/// # Errors
/// [`Error::Io`].
pub fn read(
    path: &Path,
    worker: Option<u32>,
    mut each: impl FnMut(&Entry<'_>) -> bool,
) -> Result<Option<(u64, u64)>> {
    let io = |e| Error::io(path, "read", e);
    let Ok(file) = open_existing(path) else {
        return Ok(None);
    };
    let length = file.metadata().map_err(io)?.len();
    let mut magic = [0; MAGIC.len()];
    if length < magic.len() as u64 {
        return Ok(None);
    }
    file.read_exact_at(&mut magic, 0).map_err(io)?;
    if magic != *MAGIC {
        return Ok(None);
    }
    let (mut at, mut records) = (MAGIC.len() as u64, 0);
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
        let Ok(mut record) = postcard::from_bytes::<Record>(&body) else {
            break;
        };
        // Payloads are read again when they are needed; they come last in a record.
        let (mut length, mut time) = (0, 2 * records + 1);
        if let Record::Unit { payload, after, .. } = &mut record {
            length = std::mem::take(payload).len();
            if worker.is_some() {
                time = after.saturating_mul(2);
            }
        }
        let next = at + HEAD + u64::from(bytes);
        let entry = Entry {
            at: time,
            offset: at,
            payload: (worker, next - length as u64, length),
            record: &record,
        };
        if !each(&entry) {
            break;
        }
        at = next;
        records += 1;
    }
    Ok(Some((at, records)))
}

#[cfg(test)]
mod tests;
