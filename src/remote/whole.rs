//! Whole files, from their start.

use super::answer::Answer;
use super::object::Object;
use bytes::Bytes;
use std::io::{self, ErrorKind, Read};

/// A reader of a whole remote file, from its start.
pub struct Whole<'a>(Source<'a>);

enum Source<'a> {
    Parts(&'a Object, u64),
    /// The answer, the bytes of it that are not read yet, and how many are to come.
    Stream(Answer, Bytes, u64),
}

impl<'a> Whole<'a> {
    /// A reader of `object`. If the server sends no parts, an answer that breaks off is an error.
    ///
    /// # Errors
    /// As [`Object::open`].
    pub fn of(object: &'a Object) -> io::Result<Self> {
        Ok(Self(match object.has_parts() {
            true => Source::Parts(object, 0),
            false => Source::Stream(object.file.stream()?, Bytes::new(), object.size()),
        }))
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
