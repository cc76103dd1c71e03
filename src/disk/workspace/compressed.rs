//! Files compressed with gzip or Zstandard, and ZIP archives with one cloud or mesh: their content in a scratch file,
//! or its beginning in memory.

#[cfg(test)]
mod tests;

use super::file::ScratchFile;
pub use super::names::plain_name;
use super::zip::{Archive, Wanted, is_archive};
use super::{Files, Workspace};
use crate::error::{Error, Result};
use flate2::bufread::MultiGzDecoder;
use outcrop_platform::FileAt;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use zstd::stream::read::Decoder;
use zstd::zstd_safe::{DCtx, DParameter};

/// Names of the scratch files; there is one of each at a time.
const DECOMPRESSED: &str = "decompressed";
const SAVED: &str = "saved";

/// Bytes of content that are decoded at a time.
const CHUNK: usize = 1 << 20;

/// Bytes of the file that are read at a time.
const READ: usize = 128 << 10;

/// Bytes of memory for decoding, besides the window: the buffers here, and those of the decoders.
const BUFFERS: u64 = 2 << 20;

/// Largest window for the beginning of a file, whose memory is touched only as far as it is decoded: that of
/// the highest level of `zstd`.
const WINDOW: u64 = 1 << 27;

/// The base-two logarithm of the largest window that the decoder accepts: the budget decides.
const LARGEST_WINDOW: u32 = 31;

/// A compression that is recognised by the first bytes of a file.
#[derive(Debug, Clone, Copy)]
enum Compression {
    Gzip,
    Zstandard,
    Zip,
}

impl Compression {
    fn of(file: &File) -> std::io::Result<Option<Self>> {
        Ok(Self::told_by(&head_at(file, 0)?))
    }

    fn told_by(head: &[u8]) -> Option<Self> {
        match head {
            [0x1f, 0x8b, ..] => Some(Self::Gzip),
            _ if is_archive(head) => Some(Self::Zip),
            _ => window(head).map(|_| Self::Zstandard),
        }
    }
}

/// True if a file that begins with these bytes is compressed; eighteen suffice.
#[must_use]
pub fn is_compressed(head: &[u8]) -> bool {
    Compression::told_by(head).is_some()
}

/// The content of a compressed file or of a stream, in a scratch file that is deleted when this is dropped.
#[derive(Debug)]
pub struct Content {
    /// The scratch file.
    pub path: PathBuf,
    /// Its size in bytes.
    pub bytes: u64,
    /// The name under which the workspace has it.
    name: &'static str,
    files: Files,
}

impl Content {
    /// The content of the file `path`; none if it is not compressed. Of an archive it is the member that is wanted.
    ///
    /// # Errors
    /// [`Error::Input`] if it is damaged, or an archive in which not exactly one member is wanted;
    /// [`Error::Memory`] if it needs a window larger than the free part of the budget; [`Error::Io`], [`Error::Disk`], [`Error::Cancelled`].
    pub fn of(path: &Path, wanted: Wanted<'_>, workspace: &Workspace) -> Result<Option<Self>> {
        match opened(path)? {
            Some(file) => Self::decoded(path, &file, wanted, workspace).map(Some),
            None => Ok(None),
        }
    }

    /// The content of an open file, called `path` in errors; none if it is not compressed.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn within(
        path: &Path,
        file: File,
        wanted: Wanted<'_>,
        workspace: &Workspace,
    ) -> Result<Option<Self>> {
        let found = Compression::of(&file).map_err(|e| Error::io(path, "read", e))?;
        let Some(compression) = found else {
            return Ok(None);
        };
        Self::decoded(path, &(file, compression), wanted, workspace).map(Some)
    }

    /// All that `source`, called `path` in errors, gives.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Memory`], [`Error::Disk`], [`Error::Cancelled`].
    pub fn saved(path: &Path, mut source: impl Read, workspace: &Workspace) -> Result<Self> {
        let mut held = workspace.promise("save a stream", CHUNK as u64)?;
        held.set_held(CHUNK as u64);
        let mut content = Self::empty(SAVED, workspace);
        let scratch = workspace.files.open(SAVED, false)?;
        let mut take = |bytes: &[u8]| {
            workspace.check_cancel()?;
            content.append(&scratch, bytes)?;
            Ok(true)
        };
        let failed = |_: &_, e| Error::io(path, "read", e);
        pump(&mut source, &mut vec![0; CHUNK], &mut take, failed)?;
        Ok(content)
    }

    fn empty(name: &'static str, workspace: &Workspace) -> Self {
        Self {
            path: PathBuf::new(),
            bytes: 0,
            name,
            files: workspace.files.clone(),
        }
    }

    fn decoded(
        path: &Path,
        (file, compression): &(File, Compression),
        wanted: Wanted<'_>,
        workspace: &Workspace,
    ) -> Result<Self> {
        let mut held = workspace.promise("decompress", BUFFERS)?;
        held.set_held(BUFFERS);
        let scratch = workspace.files.open(DECOMPRESSED, false)?;
        let mut content = Self::empty(DECOMPRESSED, workspace);
        let window = |bytes: u64| {
            held.at_least(bytes.saturating_add(BUFFERS))?;
            held.set_held(held.bytes());
            Ok(())
        };
        let packed = (file, *compression, wanted);
        let read = decode(path, packed, window, |bytes| {
            workspace.check_cancel()?;
            content.append(&scratch, bytes)?;
            Ok(true)
        })?;
        workspace.io.add_read(read);
        if content.bytes == 0 {
            let expected = "compressed points or a compressed mesh";
            return Err(Error::input(path, "content", "nothing", expected));
        }
        Ok(content)
    }

    fn append(&mut self, scratch: &ScratchFile, bytes: &[u8]) -> Result<()> {
        let place = scratch.append(self.files.worker(), bytes, 0)?;
        self.path = scratch.path(place.segment);
        self.bytes += bytes.len() as u64;
        Ok(())
    }
}

impl Drop for Content {
    fn drop(&mut self) {
        // If it cannot be deleted, it is when the folder is removed.
        let _ = self.files.release(self.name);
    }
}

/// The beginning of the content of a compressed file.
#[derive(Debug)]
pub struct Beginning {
    /// The first bytes.
    pub bytes: Vec<u8>,
    /// An estimate of the size of the content; exact if `bytes` are all of it, larger than these if not.
    pub likely: u64,
}

impl Beginning {
    /// At least the first `least` bytes of the content of the file `path`, up to 1 MiB more, or all; none if
    /// it is not compressed.
    ///
    /// # Errors
    /// [`Error::Input`] if it is damaged there, or needs a window of more than 128 MiB; [`Error::Io`].
    pub fn of(path: &Path, wanted: Wanted<'_>, least: usize) -> Result<Option<Self>> {
        let Some((file, compression)) = opened(path)? else {
            return Ok(None);
        };
        let all = file.metadata();
        let all = all.map_err(|e| Error::io(path, "read the size of", e))?;
        Self::decoded(path, (&file, compression, wanted), all.len(), least).map(Some)
    }

    /// As [`Self::of`], of a file of `all` bytes that is called `path` and of which `file` has the first; what
    /// ends with those is no error. None for an archive: what is in it stands at its end.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn within(path: &Path, file: &File, all: u64, least: usize) -> Result<Option<Self>> {
        let found = Compression::of(file).map_err(|e| Error::io(path, "read", e))?;
        let Some(compression @ (Compression::Gzip | Compression::Zstandard)) = found else {
            return Ok(None);
        };
        let none: Wanted<'_> = &|_, _, _| false;
        Self::decoded(path, (file, compression, none), all, least).map(Some)
    }

    fn decoded(
        path: &Path,
        packed: (&File, Compression, Wanted<'_>),
        all: u64,
        least: usize,
    ) -> Result<Self> {
        let window = |bytes| match bytes > WINDOW {
            true => {
                let found = format!("a window of {bytes} bytes");
                let expected = format!("at most {WINDOW} to detect the format");
                Err(Error::input(path, "Zstandard frame", found, expected))
            }
            false => Ok(()),
        };
        let mut bytes = Vec::new();
        let here = packed.0.metadata().map_or(all, |about| about.len());
        let read = decode(path, packed, window, |chunk| {
            bytes.extend_from_slice(chunk);
            Ok(bytes.len() < least)
        });
        let read = match read {
            Err(Error::Input { .. }) if here < all && !bytes.is_empty() => here,
            read => read?,
        };
        let now = bytes.len() as u64;
        // If it is long enough there may be more, even where no byte of the file is left.
        let share = all.max(read) as f64 / read.max(1) as f64;
        let likely = match now < least as u64 {
            true => now,
            false => (now as f64 * share) as u64 + 1,
        };
        Ok(Self { bytes, likely })
    }
}

/// A file and its compression; none if it is not compressed, or no regular file.
fn opened(path: &Path) -> Result<Option<(File, Compression)>> {
    let io = |action: &'static str| move |e| Error::io(path, action, e);
    // Opening a pipe may block.
    if !path.metadata().map_err(io("open"))?.is_file() {
        return Ok(None);
    }
    let file = File::open(path).map_err(io("open"))?;
    let found = Compression::of(&file).map_err(io("read"))?;
    Ok(found.map(|compression| (file, compression)))
}

/// A file that is read from its start.
struct Forward<'a> {
    file: &'a File,
    at: u64,
}

impl Read for Forward<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let got = self.file.read_at(buffer, self.at)?;
        self.at += got as u64;
        Ok(got)
    }
}

/// Offset in the file of the next byte.
fn position(source: &BufReader<Forward<'_>>) -> u64 {
    source.get_ref().at - source.buffer().len() as u64
}

/// Passes the content to `take` until that returns false; `allow` is asked before memory for a window is
/// taken. Returns the bytes of the file that were read.
fn decode(
    path: &Path,
    (file, compression, wanted): (&File, Compression, Wanted<'_>),
    mut allow: impl FnMut(u64) -> Result<()>,
    mut take: impl FnMut(&[u8]) -> Result<bool>,
) -> Result<u64> {
    let mut buffer = vec![0; CHUNK];
    if let Compression::Zip = compression {
        let archive = Archive::open(path, file, wanted)?;
        let mut bytes = 0;
        let mut count = |chunk: &[u8]| {
            bytes += chunk.len() as u64;
            take(chunk)
        };
        let failed = |_: &&mut dyn Read, e| damaged(path, archive.place(), "a whole file", e);
        archive.read(|mut member| pump(&mut member, &mut buffer, &mut count, failed))?;
        return Ok(archive.share(bytes));
    }
    let mut source = BufReader::with_capacity(READ, Forward { file, at: 0 });
    if let Compression::Gzip = compression {
        let mut decoder = MultiGzDecoder::new(source);
        pump(&mut decoder, &mut buffer, &mut take, |decoder, e| {
            let place = format!("gzip data before byte {}", position(decoder.get_ref()));
            damaged(path, place, "gzip data", e)
        })?;
        return Ok(position(decoder.get_ref()));
    }
    let mut context = DCtx::create();
    // The parameter is in the range of all versions of the library.
    let _ = context.set_parameter(DParameter::WindowLogMax(LARGEST_WINDOW));
    loop {
        let at = position(&source);
        let head = head_at(file, at).map_err(|e| Error::io(path, "read", e))?;
        if head.is_empty() {
            return Ok(at);
        }
        let place = format!("Zstandard frame at byte {at}");
        let Some(window) = window(&head) else {
            let found = format!("\"{}\"", head[..head.len().min(4)].escape_ascii());
            return Err(Error::input(
                path,
                place,
                found,
                "a frame, or the end of the file",
            ));
        };
        allow(window)?;
        let mut frame = Decoder::with_context(source, &mut context).single_frame();
        let more = pump(&mut frame, &mut buffer, &mut take, |_, e| {
            damaged(path, place.clone(), "a whole frame", e)
        })?;
        source = frame.finish();
        if !more {
            return Ok(position(&source));
        }
    }
}

/// Passes all that `decoder` gives to `take`; false if that returns false.
fn pump<R: Read>(
    decoder: &mut R,
    buffer: &mut [u8],
    take: &mut impl FnMut(&[u8]) -> Result<bool>,
    failed: impl Fn(&R, std::io::Error) -> Error,
) -> Result<bool> {
    loop {
        let mut filled = 0;
        while filled < buffer.len() {
            match decoder.read(&mut buffer[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(failed(decoder, e)),
            }
        }
        if filled > 0 && !take(&buffer[..filled])? {
            return Ok(false);
        }
        if filled < buffer.len() {
            return Ok(true);
        }
    }
}

/// The error of a decoder.
fn damaged(path: &Path, place: String, expected: &str, error: std::io::Error) -> Error {
    if error.raw_os_error().is_some() {
        return Error::io(path, "read", error);
    }
    let found = match error.kind() {
        ErrorKind::UnexpectedEof => "the end of the file".to_owned(),
        _ => format!("damaged data ({})", error.to_string().escape_debug()),
    };
    Error::input(path, place, found, expected)
}

/// Bytes of the longest head of a Zstandard frame.
const HEAD: usize = 18;

/// The first bytes from `offset` on, at most those of a head of a frame.
fn head_at(file: &File, offset: u64) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::with_capacity(HEAD);
    let from = Forward { file, at: offset };
    from.take(HEAD as u64).read_to_end(&mut head)?;
    Ok(head)
}

/// Bytes of the window of the Zstandard frame that begins with `head`, 0 for one that is skipped; none if it
/// is no frame. (RFC 8878, section 3.1.1.1)
fn window(head: &[u8]) -> Option<u64> {
    let (magic, rest) = head.split_first_chunk()?;
    match u32::from_le_bytes(*magic) {
        0x184d_2a50..=0x184d_2a5f => return Some(0),
        0xfd2f_b528 => {}
        _ => return None,
    }
    // The decoder reports a head that ends early.
    let byte = |at: usize| u64::from(rest.get(at).copied().unwrap_or(0));
    let descriptor = byte(0) as usize;
    if descriptor & 0x20 == 0 {
        let base = 1u64 << (10 + (byte(1) >> 3));
        return Some(base + base / 8 * (byte(1) & 7));
    }
    // The window is the whole content.
    let start = 1 + [0, 1, 2, 4][descriptor & 3];
    let field = |bytes| (0..bytes).fold(0, |sum, at| sum | byte(start + at) << (8 * at));
    Some(match descriptor >> 6 {
        0 => field(1),
        1 => field(2) + 256,
        2 => field(4),
        _ => field(8),
    })
}
