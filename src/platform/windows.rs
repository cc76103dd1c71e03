//! Windows 10 and later.

mod access;
mod names;
mod process;
mod volume;

pub use access::{is_private, make_private_folder};
pub use names::{arguments, canonical, no_name, path_bytes, path_of_bytes, quoted};
pub use process::{
    CAN_TRIM, cpu_seconds, freeze, kill, memory_allowed, on_stop, open_many_files, peak_resident,
    resident, resident_file, trim,
};
pub use volume::{device, disk_free, is_local, links, populate};

use std::fs::{File, Metadata, OpenOptions};
use std::io;
use std::os::windows::ffi::OsStrExt;
use std::os::windows::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use windows_sys::Win32::Foundation::{
    ERROR_ACCESS_DENIED, ERROR_DISK_FULL, ERROR_INVALID_FUNCTION, ERROR_IO_DEVICE, ERROR_NO_DATA,
    ERROR_PIPE_NOT_CONNECTED, ERROR_SHARING_VIOLATION,
};
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

/// File systems that keep a journal have the names in it, and others refuse to be asked.
pub fn sync_names(folder: &File) -> io::Result<()> {
    let refused = [ERROR_ACCESS_DENIED, ERROR_INVALID_FUNCTION].map(u32::cast_signed);
    match folder.sync_all() {
        Err(e) if e.raw_os_error().is_some_and(|code| refused.contains(&code)) => Ok(()),
        done => done,
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
    sync_names(&open_folder(folder)?)
}

/// Ticks of a ten-millionth of a second between the beginnings of 1601, from which the system counts, and of 1970.
const TICKS_TO_1970: i64 = 116_444_736_000_000_000;

pub fn modified(about: &Metadata) -> (i64, i64) {
    let ticks = about.last_write_time().cast_signed() - TICKS_TO_1970;
    let second = 10_000_000;
    (ticks.div_euclid(second), ticks.rem_euclid(second) * 100)
}

/// Looks at a file that is in the way of a program that scans new files, and the time between them: half a second in
/// all.
const LOOKS: u32 = 25;
const PAUSE: Duration = Duration::from_millis(20);

/// Others that hold one of the files may let it go soon.
pub fn rename(from: &Path, to: &Path) -> io::Result<()> {
    let held = [ERROR_ACCESS_DENIED, ERROR_SHARING_VIOLATION].map(u32::cast_signed);
    let is_held = |e: &io::Error| e.raw_os_error().is_some_and(|code| held.contains(&code));
    for _ in 1..LOOKS {
        match std::fs::rename(from, to) {
            Err(error) if is_held(&error) => std::thread::sleep(PAUSE),
            done => return done,
        }
    }
    std::fs::rename(from, to)
}

pub fn is_broken_pipe(error: &io::Error) -> bool {
    let codes = [ERROR_NO_DATA, ERROR_PIPE_NOT_CONNECTED].map(u32::cast_signed);
    error.kind() == io::ErrorKind::BrokenPipe
        || error
            .raw_os_error()
            .is_some_and(|code| codes.contains(&code))
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
    fn a_rename_waits_for_whoever_holds_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let [new, old] = ["new", "old"].map(|name| folder.path().join(name));
        std::fs::write(&new, "new").unwrap();
        std::fs::write(&old, "old").unwrap();
        let held = File::open(&old).unwrap();
        let holder = std::thread::spawn(move || {
            std::thread::sleep(5 * PAUSE);
            drop(held);
        });
        rename(&new, &old).unwrap();
        holder.join().unwrap();
        assert_eq!(std::fs::read(&old).unwrap(), b"new");
    }

    /// Disks that have the semantics of POSIX replace it, and others refuse.
    #[test]
    fn a_file_that_is_held_longer_stays_whole() {
        let folder = tempfile::tempdir().unwrap();
        let [new, old] = ["new", "old"].map(|name| folder.path().join(name));
        std::fs::write(&new, "new").unwrap();
        std::fs::write(&old, "old").unwrap();
        let held = File::open(&old).unwrap();
        let renamed = rename(&new, &old);
        drop(held);
        let (there, content) = (new.exists(), std::fs::read(&old).unwrap());
        match renamed {
            Ok(()) => assert!(!there && content == b"new"),
            Err(_) => assert!(there && content == b"old"),
        }
    }

    #[test]
    fn paths_longer_than_260_characters() {
        let folder = tempfile::tempdir().unwrap();
        let deep = folder.path().join("x".repeat(100)).join("y".repeat(200));
        std::fs::create_dir_all(&deep).unwrap();
        let [one, two] = ["one", "two"].map(|name| deep.join(name));
        std::fs::write(&one, "content").unwrap();
        rename(&one, &two).unwrap();
        assert!(device(&two).is_some() && disk_free(&deep).is_some() && is_local(&two));
        assert_eq!(links(&two), Some(1));
        let private = deep.join("private");
        make_private_folder(&private).unwrap();
        assert!(is_private(&private, &private.symlink_metadata().unwrap()).unwrap());
    }
}
