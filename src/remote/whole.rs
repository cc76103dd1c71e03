//! Answers as they arrive, and whole files.

use super::object::{Object, changed, told};
use super::wait::wait;
use bytes::Bytes;
use futures_util::StreamExt;
use futures_util::stream::BoxStream;
use object_store::{Error, GetResult, Result};
use std::io::{self, ErrorKind, Read};

/// The bytes of an answer, as they arrive.
pub(crate) struct Answer(BoxStream<'static, Result<Bytes>>);

impl Answer {
    pub(crate) fn of(got: GetResult) -> Self {
        Self(got.into_stream())
    }

    /// The next bytes; none at the end. [`ErrorKind::UnexpectedEof`] if the answer breaks off.
    fn next(&mut self) -> io::Result<Option<Bytes>> {
        wait(self.0.next())?.transpose().map_err(broken)
    }

    /// The first `wanted` bytes, of which there must be as many.
    pub(crate) fn take(mut self, wanted: u64) -> io::Result<Bytes> {
        let wanted = usize::try_from(wanted).map_err(io::Error::other)?;
        let mut all = Vec::new();
        while all.len() < wanted {
            let part = self.next()?.ok_or_else(|| {
                let why = format!("the answer ended after {} of {wanted} bytes", all.len());
                io::Error::new(ErrorKind::UnexpectedEof, why)
            })?;
            let part = &part[..part.len().min(wanted - all.len())];
            // It grows with what has arrived, not with what a server promises.
            all.extend_from_slice(part);
        }
        Ok(all.into())
    }
}

impl Answer {
    /// All bytes, which may be at most `most`.
    pub(crate) fn all(mut self, most: u64) -> io::Result<Bytes> {
        let mut all = Vec::new();
        while let Some(part) = self.next()? {
            if part.len() as u64 > most - all.len() as u64 {
                let why = format!("it is larger than {most} bytes");
                return Err(io::Error::new(ErrorKind::InvalidData, why));
            }
            all.extend_from_slice(&part);
        }
        Ok(all.into())
    }
}

/// An error in the middle of an answer.
fn broken(error: Error) -> io::Error {
    match error {
        Error::Precondition { .. } => changed(),
        e => io::Error::new(ErrorKind::UnexpectedEof, told(e).to_string()),
    }
}

/// A reader of a whole remote file, from its start.
pub struct Whole<'a>(Source<'a>);

enum Source<'a> {
    Parts(&'a Object, u64),
    /// The answer, the bytes of it that are not read yet, and how many are to come.
    Stream(Answer, Bytes, u64),
}

impl<'a> Whole<'a> {
    pub(crate) fn of_parts(object: &'a Object) -> Self {
        Self(Source::Parts(object, 0))
    }

    pub(crate) fn of_stream(answer: Answer, bytes: u64) -> Self {
        Self(Source::Stream(answer, Bytes::new(), bytes))
    }
}

impl std::fmt::Debug for Whole<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Whole").finish_non_exhaustive()
    }
}

impl Read for Whole<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match &mut self.0 {
            Source::Parts(object, at) => {
                let done = object.read_at(buffer, *at)?;
                *at += done as u64;
                Ok(done)
            }
            Source::Stream(answer, here, left) => {
                while here.is_empty() {
                    match answer.next()? {
                        Some(bytes) => *here = bytes,
                        None if *left == 0 => return Ok(0),
                        None => {
                            let why = format!("the answer ended {left} bytes too early");
                            return Err(io::Error::new(ErrorKind::UnexpectedEof, why));
                        }
                    }
                }
                let done = buffer.len().min(here.len());
                buffer[..done].copy_from_slice(&here.split_to(done));
                *left = left.saturating_sub(done as u64);
                Ok(done)
            }
        }
    }
}
