//! ZIP archives: the one member that is read.
//!
//! The list of members is read piece by piece, so archives of any size take the same little memory.

use crate::error::{Error, Result};
use flate2::bufread::DeflateDecoder;
use rawzip::{
    CompressionMethod, ErrorKind, FileReader, MAX_CENTRAL_DIRECTORY_RECORD_SIZE, ZipArchive,
    ZipArchiveEntryWayfinder, ZipLocator,
};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// Tells by the name and the first bytes of a member if it is what is looked for; the last is true if these are all
/// of its bytes.
pub type Wanted<'a> = &'a dyn Fn(&Path, &[u8], bool) -> bool;

/// First bytes of a member by which it is known.
const HEAD: u64 = 64 << 10;

/// Most members that are looked at.
const MOST_MEMBERS: usize = 1000;

/// Most names in a message, and most characters of a name.
const MOST_NAMES: usize = 8;
const LONGEST_NAME: usize = 80;

/// Bytes at the end of a file in which the list of members is searched for.
const END: u64 = 1 << 20;

/// Bytes of the archive that are read at a time.
const READ: usize = 128 << 10;

/// True for the first bytes of an archive.
pub fn is_archive(head: &[u8]) -> bool {
    head.starts_with(b"PK\x03\x04") || head.starts_with(b"PK\x05\x06")
}

/// A member of an archive.
#[derive(Debug, Clone)]
struct Member {
    name: String,
    method: CompressionMethod,
    encrypted: bool,
    place: ZipArchiveEntryWayfinder,
}

impl Member {
    /// The reason why it cannot be read, if there is one.
    fn unreadable(&self) -> Option<String> {
        let known = [CompressionMethod::STORE, CompressionMethod::DEFLATE];
        let method = match self.method.name() {
            _ if self.encrypted => return Some("encrypted".into()),
            _ if known.contains(&self.method) => return None,
            Some(name) => name.to_owned(),
            None => format!("method {}", self.method.as_u16()),
        };
        Some(format!("compressed by {method}"))
    }
}

/// An archive, and the member of it that is read.
#[derive(Debug)]
pub struct Archive<'a> {
    path: &'a Path,
    archive: ZipArchive<FileReader>,
    member: Member,
}

impl<'a> Archive<'a> {
    /// The only member of an archive that is wanted.
    ///
    /// # Errors
    /// [`Error::Input`] if there is none or several, or if the archive is damaged; [`Error::Io`].
    pub fn open(path: &'a Path, file: &File, wanted: Wanted<'_>) -> Result<Self> {
        let file = file.try_clone().map_err(|e| Error::io(path, "open", e))?;
        let mut buffer = vec![0; MAX_CENTRAL_DIRECTORY_RECORD_SIZE];
        let locator = ZipLocator::new().max_search_space(END);
        let archive = locator.locate_in_file(file, &mut buffer);
        let archive = archive.map_err(|(_, e)| damaged(path, &e))?;
        let members = members(path, &archive, &mut buffer)?;
        let mut found = Vec::new();
        for member in &members {
            if member.unreadable().is_none() && is_wanted(path, &archive, member, wanted)? {
                found.push(member.clone());
            }
        }
        match &found[..] {
            [member] => Ok(Self {
                path,
                archive,
                member: member.clone(),
            }),
            [] => Err(none(path, &members)),
            all => Err(several(path, all)),
        }
    }

    /// The place of damage of the member.
    pub fn place(&self) -> String {
        format!("ZIP member {}", shown(&self.member.name))
    }

    /// Its content, whose checksum is compared at the end.
    ///
    /// # Errors
    /// [`Error::Input`] if its place is damaged; [`Error::Io`].
    pub fn read<T>(&self, take: impl FnOnce(&mut dyn Read) -> Result<T>) -> Result<T> {
        let entry = self.archive.get_entry(self.member.place);
        let entry = entry.map_err(|e| damaged(self.path, &e))?;
        let source = BufReader::with_capacity(READ, entry.reader());
        match self.member.method {
            CompressionMethod::STORE => take(&mut entry.verifying_reader(source)),
            _ => take(&mut entry.verifying_reader(DeflateDecoder::new(source))),
        }
    }

    /// About the bytes of the archive that the first `bytes` of the content come from.
    pub fn share(&self, bytes: u64) -> u64 {
        let place = &self.member.place;
        let (packed, all) = (place.compressed_size_hint(), place.uncompressed_size_hint());
        let share = bytes as f64 / all.max(bytes).max(1) as f64;
        (packed as f64 * share) as u64
    }
}

/// The members of an archive but folders, hidden files, and what macOS adds.
fn members(
    path: &Path,
    archive: &ZipArchive<FileReader>,
    buffer: &mut [u8],
) -> Result<Vec<Member>> {
    let mut all = Vec::new();
    let mut entries = archive.entries(buffer);
    while let Some(entry) = entries.next_entry().map_err(|e| damaged(path, &e))? {
        let name = String::from_utf8_lossy(entry.file_path().as_bytes()).into_owned();
        let name = name.replace('\\', "/");
        let hidden = |part: &str| part.starts_with('.') || part == "__MACOSX";
        if entry.is_dir() || name.split('/').any(hidden) {
            continue;
        }
        if all.len() == MOST_MEMBERS {
            let found = format!("more than {MOST_MEMBERS} files");
            return Err(Error::input(path, "ZIP archive", found, unpack("fewer")));
        }
        all.push(Member {
            name,
            method: entry.compression_method(),
            encrypted: entry.flags().is_encrypted(),
            place: entry.wayfinder(),
        });
    }
    Ok(all)
}

/// True if a member is what is looked for. What is damaged is not.
fn is_wanted(
    path: &Path,
    archive: &ZipArchive<FileReader>,
    member: &Member,
    wanted: Wanted<'_>,
) -> Result<bool> {
    let Ok(entry) = archive.get_entry(member.place) else {
        return Ok(false);
    };
    let source = BufReader::new(entry.reader());
    let mut head = Vec::new();
    let read = match member.method {
        CompressionMethod::STORE => source.take(HEAD).read_to_end(&mut head),
        _ => DeflateDecoder::new(source)
            .take(HEAD)
            .read_to_end(&mut head),
    };
    match read {
        Err(e) if e.raw_os_error().is_some() => return Err(Error::io(path, "read", e)),
        // Its beginning tells what it is, and its damage is told when it is read.
        _ => {}
    }
    let whole = (head.len() as u64) < HEAD;
    Ok(wanted(Path::new(&member.name), &head, whole))
}

/// A name for a message.
fn shown(name: &str) -> String {
    let short: String = name.chars().take(LONGEST_NAME).collect();
    format!("\"{}\"", short.escape_debug())
}

/// The first names, for a message.
fn list(members: &[Member]) -> String {
    let names = members.iter().take(MOST_NAMES).map(|m| shown(&m.name));
    let more = match members.len().saturating_sub(MOST_NAMES) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    names.collect::<Vec<_>>().join(", ") + &more
}

/// What is expected, and how to get there.
fn unpack(what: &str) -> String {
    format!("{what}: unpack it, and give its files or their folder")
}

fn several(path: &Path, members: &[Member]) -> Error {
    let found = format!(
        "{} files that could be read: {}",
        members.len(),
        list(members)
    );
    Error::input(path, "ZIP archive", found, unpack("one"))
}

fn none(path: &Path, members: &[Member]) -> Error {
    let unreadable = members.iter().find_map(|m| Some((m, m.unreadable()?)));
    if let Some((member, why)) = unreadable {
        let place = format!("ZIP member {}", shown(&member.name));
        let expected = unpack("a file that is stored or deflated");
        return Error::input(path, place, format!("one that is {why}"), expected);
    }
    let found = match members {
        [] => "no file".to_owned(),
        some => format!("none that can be read among {}", list(some)),
    };
    Error::input(path, "ZIP archive", found, "one file with points or a mesh")
}

/// The error of an archive that cannot be read.
fn damaged(path: &Path, error: &rawzip::Error) -> Error {
    let found = match error.kind() {
        ErrorKind::IO(e) => {
            if let Some(code) = e.raw_os_error() {
                return Error::io(path, "read", std::io::Error::from_raw_os_error(code));
            }
            e.to_string()
        }
        other => other.to_string(),
    };
    let found = format!("damaged data ({})", found.escape_debug());
    Error::input(path, "ZIP archive", found, "a whole archive")
}
