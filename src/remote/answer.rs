//! Answers as they arrive.

use super::errors::{changed, told};
use super::pieces::PIECE;
use super::wait::wait;
use bytes::Bytes;
use futures_util::StreamExt;
use futures_util::stream::BoxStream;
use http_body_util::BodyStream;
use object_store::client::HttpResponseBody;
use object_store::{Error, GetResult, Result};
use std::io::{self, ErrorKind};

/// The bytes of an answer, as they arrive.
pub(crate) struct Answer(BoxStream<'static, Result<Bytes>>);

impl Answer {
    pub(crate) fn of(got: GetResult) -> Self {
        Self(got.into_stream())
    }

    /// The answer to a request of our own.
    pub(crate) fn of_body(body: HttpResponseBody) -> Self {
        let frames = BodyStream::new(body).filter_map(async |frame| {
            let data = frame.map(|frame| frame.into_data().ok());
            let failed = |source| Error::Generic {
                store: "server",
                source: Box::new(source),
            };
            data.map_err(failed).transpose()
        });
        Self(frames.boxed())
    }

    /// The next bytes; none at the end. [`ErrorKind::UnexpectedEof`] if the answer breaks off.
    pub(crate) fn next(&mut self) -> io::Result<Option<Bytes>> {
        wait(self.0.next())?.transpose().map_err(broken)
    }

    /// The first `wanted` bytes, of which there must be as many.
    pub(crate) fn take(mut self, wanted: u64) -> io::Result<Bytes> {
        let wanted = usize::try_from(wanted).map_err(io::Error::other)?;
        // Large enough for a piece, so that it need not be copied while it grows.
        let mut all = Vec::with_capacity(wanted.min(PIECE as usize));
        while all.len() < wanted {
            let part = self.next()?.ok_or_else(|| short(all.len(), wanted))?;
            let part = &part[..part.len().min(wanted - all.len())];
            // It grows with what has arrived, not with what a server promises.
            all.extend_from_slice(part);
        }
        Ok(all.into())
    }
}

impl Answer {
    /// Fills `buffer` with the first bytes, of which there must be as many.
    pub(crate) fn fill(mut self, buffer: &mut [u8]) -> io::Result<()> {
        let mut done = 0;
        while done < buffer.len() {
            let part = self.next()?.ok_or_else(|| short(done, buffer.len()))?;
            let wanted = part.len().min(buffer.len() - done);
            buffer[done..done + wanted].copy_from_slice(&part[..wanted]);
            done += wanted;
        }
        Ok(())
    }

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

/// The error of an answer with fewer bytes than were asked for.
fn short(got: usize, wanted: usize) -> io::Error {
    let why = format!("the answer ended after {got} of {wanted} bytes");
    io::Error::new(ErrorKind::UnexpectedEof, why)
}

/// An error in the middle of an answer.
fn broken(error: Error) -> io::Error {
    match error {
        Error::Precondition { .. } => changed(),
        e => io::Error::new(ErrorKind::UnexpectedEof, told(e).to_string()),
    }
}
