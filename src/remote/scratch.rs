//! The files of a run below a prefix of a store: read, put, put unless they are there, listed and deleted.

use super::agent::Counts;
use super::answer::Answer;
use super::errors::told;
use super::location::Location;
use super::object::{again, ask};
use super::stores::{Patience, Place, place};
use super::wait::wait;
use bytes::Bytes;
use futures_util::StreamExt;
use object_store::path::Path;
use object_store::{MultipartUpload, ObjectMeta, ObjectStore, ObjectStoreExt, PutMode, PutPayload};
use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of a part of a large file: a store takes 10 000 parts, so files have up to 80 GB.
const PART: u64 = 8 << 20;

/// A file below the prefix.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Its name, from the prefix on.
    pub name: String,
    /// Size in bytes.
    pub bytes: u64,
    /// Seconds since 1970 of its last change, and nanoseconds.
    pub modified: (i64, u32),
}

/// The files below a prefix.
#[derive(Debug)]
pub struct Scratch {
    place: Place,
    counts: Arc<Counts>,
    sent: AtomicU64,
}

impl Scratch {
    /// The files below `prefix`; nothing is asked yet.
    ///
    /// # Errors
    /// [`ErrorKind::InvalidInput`] for a web server, which takes no files; errors of the settings of the store.
    pub fn new(prefix: &Location) -> io::Result<Self> {
        if prefix.is_web() {
            let why = "a web server takes no files";
            return Err(io::Error::new(ErrorKind::InvalidInput, why));
        }
        let counts = Arc::default();
        Ok(Self {
            place: place(prefix, Patience::Long, &counts).map_err(told)?,
            counts,
            sent: AtomicU64::new(0),
        })
    }

    /// Most bytes of memory that one call of [`Self::put`] takes.
    #[must_use]
    pub fn part(&self) -> u64 {
        2 * PART
    }

    /// Requests, bytes of their answers, and bytes that were put.
    #[must_use]
    pub fn traffic(&self) -> (u64, u64, u64) {
        let sent = self.sent.load(Ordering::Relaxed);
        (self.counts.requests(), self.counts.bytes(), sent)
    }

    fn path(&self, name: &str) -> io::Result<Path> {
        let parts = self.place.1.parts().map(|part| part.as_ref().to_owned());
        let parts = parts.chain(
            name.split('/')
                .filter(|part| !part.is_empty())
                .map(str::to_owned),
        );
        Ok(Path::from_iter(parts))
    }

    fn found(&self, meta: &ObjectMeta) -> Option<Found> {
        let name: Vec<String> = meta
            .location
            .prefix_match(&self.place.1)?
            .map(|part| part.as_ref().to_owned())
            .collect();
        Some(Found {
            name: name.join("/"),
            bytes: meta.size,
            modified: (
                meta.last_modified.timestamp(),
                meta.last_modified.timestamp_subsec_nanos(),
            ),
        })
    }

    /// The files whose names begin with `under`, which is empty or ends with a slash.
    ///
    /// # Errors
    /// As [`super::Object::open`], after minutes of failed requests.
    pub fn list(&self, under: &str) -> io::Result<Vec<Found>> {
        let path = self.path(under)?;
        let mut all = Vec::new();
        let outcome: io::Result<()> = wait(async {
            let mut files = self.place.0.list(Some(&path));
            while let Some(file) = files.next().await {
                all.extend(self.found(&file.map_err(told)?));
            }
            Ok(())
        })?;
        outcome?;
        Ok(all)
    }

    /// The names that follow the prefix up to a slash.
    ///
    /// # Errors
    /// As [`Self::list`].
    pub fn folders(&self) -> io::Result<Vec<String>> {
        let listed = wait(self.place.0.list_with_delimiter(Some(&self.place.1)))?;
        let folders = listed.map_err(told)?.common_prefixes;
        Ok(folders
            .iter()
            .filter_map(|path| path.filename().map(str::to_owned))
            .collect())
    }

    /// A file; none if there is none.
    ///
    /// # Errors
    /// As [`Self::list`].
    pub fn look(&self, name: &str) -> io::Result<Option<Found>> {
        let path = self.path(name)?;
        match wait(self.place.0.head(&path))?.map_err(told) {
            Ok(meta) => Ok(self.found(&meta)),
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
            Err(e) => Err(e),
        }
    }

    /// The bytes of a range that is within the file.
    ///
    /// # Errors
    /// [`ErrorKind::NotFound`]; [`ErrorKind::UnexpectedEof`] if the file ends before; as [`Self::list`].
    pub fn read(&self, name: &str, range: Range<u64>) -> io::Result<Bytes> {
        let place = (self.place.0.clone(), self.path(name)?);
        let wanted = range.end - range.start;
        again(|| {
            let got = match ask(&place, Some(range.clone()), None) {
                // The file ends before the range begins.
                Err(e) if e.kind() == ErrorKind::Unsupported => Err(short()),
                got => got,
            }?;
            // An answer that is too short because the file is, is not asked for again.
            match got.range.end - got.range.start < wanted {
                true => Err(short()),
                false => Answer::of(got).take(wanted),
            }
        })
        .map_err(|e| match is_short(&e) {
            true => ErrorKind::UnexpectedEof.into(),
            false => e,
        })
    }

    /// Puts the first `bytes` bytes of a file, in the place of what has its name.
    ///
    /// # Errors
    /// Errors of the file; as [`Self::list`].
    pub fn put(&self, name: &str, file: &File, bytes: u64) -> io::Result<()> {
        let path = self.path(name)?;
        let mut file = file;
        file.seek(SeekFrom::Start(0))?;
        let mut left = bytes;
        let mut part = || {
            let mut part = vec![0; left.min(PART) as usize];
            file.read_exact(&mut part)?;
            left -= part.len() as u64;
            Ok::<_, io::Error>((PutPayload::from(part), left))
        };
        if bytes <= PART {
            let (all, _) = part()?;
            wait(self.place.0.put(&path, all))?.map_err(told)?;
        } else {
            let mut upload = wait(self.place.0.put_multipart(&path))?.map_err(told)?;
            let done = parts(&mut *upload, part);
            if done.is_err() {
                // The store deletes by its own rules what is not taken back here.
                let _ = wait(upload.abort());
            }
            done?;
        }
        self.sent.fetch_add(bytes, Ordering::Relaxed);
        Ok(())
    }

    /// Puts a file unless there is one; false if there is.
    ///
    /// # Errors
    /// As [`Self::list`]; [`ErrorKind::Unsupported`] if the store knows no conditions.
    pub fn put_new(&self, name: &str, bytes: Vec<u8>) -> io::Result<bool> {
        let (path, count) = (self.path(name)?, bytes.len() as u64);
        let put = self
            .place
            .0
            .put_opts(&path, bytes.into(), PutMode::Create.into());
        match wait(put)?.map_err(told) {
            Ok(_) => {
                self.sent.fetch_add(count, Ordering::Relaxed);
                Ok(true)
            }
            Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(false),
            Err(e) => Err(e),
        }
    }

    /// Deletes a file, if it is there.
    ///
    /// # Errors
    /// As [`Self::list`].
    pub fn delete(&self, name: &str) -> io::Result<()> {
        let path = self.path(name)?;
        match wait(self.place.0.delete(&path))?.map_err(told) {
            Err(e) if e.kind() != ErrorKind::NotFound => Err(e),
            _ => Ok(()),
        }
    }
}

/// Puts the parts of a file, one after the other.
fn parts(
    upload: &mut dyn MultipartUpload,
    mut part: impl FnMut() -> io::Result<(PutPayload, u64)>,
) -> io::Result<()> {
    loop {
        let (payload, left) = part()?;
        wait(upload.put_part(payload))?.map_err(told)?;
        if left == 0 {
            return wait(upload.complete())?.map(drop).map_err(told);
        }
    }
}

/// The error of a file that is too short: not that of an answer that breaks off, which is asked for again.
fn short() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "the file ends before")
}

fn is_short(error: &io::Error) -> bool {
    error.kind() == ErrorKind::InvalidInput
}
