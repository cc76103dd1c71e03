//! Windows 10 and later.

mod access;
mod process;
mod volume;

pub use access::{is_private, make_private_folder};
pub use process::{
    CAN_TRIM, cpu_seconds, freeze, kill, memory_allowed, on_stop, open_many_files, peak_resident,
    resident, resident_file, trim,
};
pub use volume::{device, disk_free, is_local, links, populate};

use std::ffi::OsString;
use std::fs::{File, Metadata, OpenOptions};
use std::io;
use std::os::windows::ffi::{OsStrExt, OsStringExt};
use std::os::windows::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::process::Command;
use windows_sys::Win32::Foundation::{ERROR_DISK_FULL, ERROR_IO_DEVICE};
use windows_sys::Win32::Storage::FileSystem::{
    FILE_ATTRIBUTE_REPARSE_POINT, FILE_FLAG_BACKUP_SEMANTICS, FILE_FLAG_OPEN_REPARSE_POINT,
};

/// Reads and writes at an offset. They move the position that the file itself has.
pub trait FileAt {
    /// Reads some bytes from `offset` on; 0 at the end of the file.
    ///
    /// # Errors
    /// Errors of the system.
    fn read_at(&self, bytes: &mut [u8], offset: u64) -> io::Result<usize>;

    /// Fills `bytes` from `offset` on.
    ///
    /// # Errors
    /// Errors of the system; one of kind `UnexpectedEof` if the file ends before.
    fn read_exact_at(&self, bytes: &mut [u8], offset: u64) -> io::Result<()>;

    /// Writes all of `bytes` from `offset` on.
    ///
    /// # Errors
    /// Errors of the system.
    fn write_all_at(&self, bytes: &[u8], offset: u64) -> io::Result<()>;
}

impl FileAt for File {
    fn read_at(&self, bytes: &mut [u8], offset: u64) -> io::Result<usize> {
        self.seek_read(bytes, offset)
    }

    fn read_exact_at(&self, mut bytes: &mut [u8], mut offset: u64) -> io::Result<()> {
        while !bytes.is_empty() {
            match self.seek_read(bytes, offset) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(n) => (bytes, offset) = (&mut bytes[n..], offset + n as u64),
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }

    fn write_all_at(&self, mut bytes: &[u8], mut offset: u64) -> io::Result<()> {
        while !bytes.is_empty() {
            match self.seek_write(bytes, offset) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(n) => (bytes, offset) = (&bytes[n..], offset + n as u64),
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }
}

/// Who may read a private file follows from its folder.
pub fn private_options() -> OpenOptions {
    let mut options = File::options();
    options.read(true).write(true);
    options.custom_flags(FILE_FLAG_OPEN_REPARSE_POINT);
    options
}

pub fn public_options() -> OpenOptions {
    private_options()
}

pub fn existing_options() -> OpenOptions {
    private_options()
}

pub fn is_regular(about: &Metadata) -> bool {
    about.is_file() && about.file_attributes() & FILE_ATTRIBUTE_REPARSE_POINT == 0
}

/// A folder opens with this flag only, and is synced only if it may be written.
pub fn open_folder(path: &Path) -> io::Result<File> {
    let mut options = File::options();
    options.read(true).write(true);
    options.custom_flags(FILE_FLAG_BACKUP_SEMANTICS).open(path)
}

/// File systems that keep a journal have the names in it, and some refuse to be asked.
pub fn sync_folder(path: &Path) -> io::Result<()> {
    match open_folder(path).and_then(|folder| folder.sync_all()) {
        Err(error) if error.kind() != io::ErrorKind::PermissionDenied => Err(error),
        _ => Ok(()),
    }
}

/// File by file: to sync the volume takes the rights of an administrator.
pub fn sync_below(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        match entry.file_type()?.is_dir() {
            true => sync_below(&entry.path())?,
            false => File::options().write(true).open(entry.path())?.sync_all()?,
        }
    }
    sync_folder(folder)
}

/// Ticks of a ten-millionth of a second between the beginnings of 1601, from which the system counts, and of 1970.
const TICKS_TO_1970: i64 = 116_444_736_000_000_000;

pub fn modified(about: &Metadata) -> (i64, i64) {
    let ticks = about.last_write_time().cast_signed() - TICKS_TO_1970;
    let second = 10_000_000;
    (ticks.div_euclid(second), ticks.rem_euclid(second) * 100)
}

/// The code units of UTF-16, two bytes each.
pub fn path_bytes(path: &Path) -> Vec<u8> {
    let units = path.as_os_str().encode_wide();
    units.flat_map(u16::to_le_bytes).collect()
}

pub fn path_of_bytes(bytes: Vec<u8>) -> PathBuf {
    let (units, _) = bytes.as_chunks();
    let units: Vec<u16> = units.iter().map(|unit| u16::from_le_bytes(*unit)).collect();
    OsString::from_wide(&units).into()
}

/// The path with a 0 at its end, absolute and in the form that is not limited to 260 characters.
fn wide(path: &Path) -> io::Result<Vec<u16>> {
    let path = std::path::absolute(path)?;
    let units: Vec<u16> = path.as_os_str().encode_wide().collect();
    let text = |text: &str| text.encode_utf16().collect::<Vec<u16>>();
    let mut whole = match () {
        () if units.starts_with(&text(r"\\?\")) || units.starts_with(&text(r"\\.\")) => units,
        () if units.starts_with(&text(r"\\")) => [text(r"\\?\UNC\"), units[2..].to_vec()].concat(),
        () => [text(r"\\?\"), units].concat(),
    };
    whole.push(0);
    Ok(whole)
}

/// What the system's functions return: 0 for an error.
fn check(answer: i32) -> io::Result<()> {
    match answer {
        0 => Err(io::Error::last_os_error()),
        _ => Ok(()),
    }
}

/// The file cannot be replaced while it runs.
pub fn program() -> io::Result<PathBuf> {
    std::env::current_exe()
}

/// For `cmd` and PowerShell; no name has quotes in it.
pub fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || r"\/._-+:".contains(c);
    match text.chars().all(plain) {
        true => text.to_owned(),
        false => format!("\"{text}\""),
    }
}

pub fn browser(url: &str) -> Option<Command> {
    let mut command = Command::new("cmd");
    command.args(["/C", "start", ""]).arg(url);
    Some(command)
}

pub const DISK_FULL: i32 = ERROR_DISK_FULL.cast_signed();
pub const DISK_FAILS: i32 = ERROR_IO_DEVICE.cast_signed();

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_any_length_are_given_to_the_system() {
        let text = |path: &str| {
            let units = wide(Path::new(path)).unwrap();
            String::from_utf16(&units).unwrap()
        };
        assert_eq!(text(r"C:\a/b"), "\\\\?\\C:\\a\\b\0");
        assert_eq!(text(r"\\server\share\a"), "\\\\?\\UNC\\server\\share\\a\0");
        assert_eq!(text(r"\\?\C:\a"), "\\\\?\\C:\\a\0");
    }

    #[test]
    fn quotes_are_for_a_shell() {
        assert_eq!(quoted(r"C:\a\b-c.ply"), r"C:\a\b-c.ply");
        assert_eq!(quoted(r"C:\a b"), "\"C:\\a b\"");
        assert_eq!(quoted("a&b"), "\"a&b\"");
    }
}
