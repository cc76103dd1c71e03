//! Files, folders and disks.

use crate::system;
use memmap2::Mmap;
use std::fs::{File, Metadata, OpenOptions};
use std::io;
use std::path::Path;

/// Reads and writes at an offset, by several threads at the same time: `read_at`, `read_exact_at`,
/// `write_all_at`. Whoever uses them does not use the position that the file itself has.
pub use system::FileAt;

/// Options to read and write files that nobody else may read; never through a symbolic link.
#[must_use]
pub fn private_options() -> OpenOptions {
    system::private_options()
}

/// As [`private_options`], for files that others may read as the user wants it.
#[must_use]
pub fn public_options() -> OpenOptions {
    system::public_options()
}

/// Opens a file that exists to read and write it. It must be a regular file; others are not waited for.
///
/// # Errors
/// Errors of the system; an error of kind `InvalidInput` for a file that is not regular.
pub fn open_regular(path: &Path) -> io::Result<File> {
    let file = system::existing_options().open(path)?;
    if system::is_regular(&file.metadata()?) {
        return Ok(file);
    }
    let kind = io::ErrorKind::InvalidInput;
    Err(io::Error::new(kind, "not a regular file"))
}

/// Makes a folder that only this user may open, in one that exists.
///
/// # Errors
/// Errors of the system.
pub fn make_private_folder(path: &Path) -> io::Result<()> {
    system::make_private_folder(path)
}

/// True if a folder belongs to this user and nobody else may open it; `about` is what its link says.
///
/// # Errors
/// Errors of the system.
pub fn is_private(path: &Path, about: &Metadata) -> io::Result<bool> {
    system::is_private(path, about)
}

/// Opens a folder to sync the names in it.
///
/// # Errors
/// Errors of the system.
pub fn open_folder(path: &Path) -> io::Result<File> {
    system::open_folder(path)
}

/// Syncs the names in a folder that [`open_folder`] opened.
///
/// # Errors
/// Errors of the system.
pub fn sync_names(folder: &File) -> io::Result<()> {
    system::sync_names(folder)
}

/// Syncs the names in a folder.
///
/// # Errors
/// Errors of the system.
pub fn sync_folder(path: &Path) -> io::Result<()> {
    sync_names(&open_folder(path)?)
}

/// Syncs all that is below a folder, files and names.
///
/// # Errors
/// Errors of the system.
pub fn sync_below(folder: &Path) -> io::Result<()> {
    system::sync_below(folder)
}

/// Gives a file or folder another name. A file that has the name is replaced. Another program that looks at one of
/// them for a moment is waited for, where that is in the way.
///
/// # Errors
/// Errors of the system.
pub fn rename(from: &Path, to: &Path) -> io::Result<()> {
    system::rename(from, to)
}

/// A number that two paths have in common if they are on the same disk.
#[must_use]
pub fn device(path: &Path) -> Option<u64> {
    system::device(path)
}

/// Number of names of a file.
#[must_use]
pub fn links(path: &Path) -> Option<u64> {
    system::links(path)
}

/// Seconds and nanoseconds of the last change of a file, since the beginning of 1970.
#[must_use]
pub fn modified(about: &Metadata) -> (i64, i64) {
    system::modified(about)
}

/// Bytes free for this user on the disk that holds `path`, which exists.
#[must_use]
pub fn disk_free(path: &Path) -> Option<u64> {
    system::disk_free(path)
}

/// True if `path` is on a disk that is known to be local: a page of a mapped file cannot be lost with a
/// connection, or with another process.
#[must_use]
pub fn is_local(path: &Path) -> bool {
    system::is_local(path)
}

/// Brings all of a mapping into memory, so that what cannot be read fails here and not at its use.
///
/// # Errors
/// Errors of the system; one of kind `InvalidInput` if it cannot do that, as Linux before 5.14.
pub fn populate(map: &Mmap) -> io::Result<()> {
    system::populate(map)
}

/// True for the error of a write to a pipe that nobody reads any more.
#[must_use]
pub fn is_broken_pipe(error: &io::Error) -> bool {
    system::is_broken_pipe(error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_takes_the_name_of_another() {
        let folder = tempfile::tempdir().unwrap();
        let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
        std::fs::write(&one, "new").unwrap();
        std::fs::write(&two, "old").unwrap();
        rename(&one, &two).unwrap();
        assert_eq!(std::fs::read(&two).unwrap(), b"new");
        assert_eq!(
            rename(&one, &two).unwrap_err().kind(),
            io::ErrorKind::NotFound
        );
    }

    #[test]
    fn parts_are_read_and_written_at_their_offsets() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let file = private_options().create_new(true).open(&path).unwrap();
        file.write_all_at(b"56789", 5).unwrap();
        file.write_all_at(b"01234", 0).unwrap();
        let mut part = [0; 4];
        open_regular(&path)
            .unwrap()
            .read_exact_at(&mut part, 3)
            .unwrap();
        assert_eq!(&part, b"3456");
        let mut more = [0; 4];
        assert_eq!(file.read_at(&mut more, 8).unwrap(), 2);
        assert_eq!(file.read_at(&mut more, 10).unwrap(), 0);
        let short = file.read_exact_at(&mut more, 8).unwrap_err();
        assert_eq!(short.kind(), io::ErrorKind::UnexpectedEof);
    }

    #[test]
    fn only_regular_files_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let none = open_regular(&folder.path().join("none")).unwrap_err();
        assert_eq!(none.kind(), io::ErrorKind::NotFound);
        assert!(open_regular(folder.path()).is_err());
    }

    #[test]
    fn a_private_folder_is_private() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("private");
        make_private_folder(&path).unwrap();
        let about = path.symlink_metadata().unwrap();
        assert!(is_private(&path, &about).unwrap());
        let again = make_private_folder(&path).unwrap_err();
        assert_eq!(again.kind(), io::ErrorKind::AlreadyExists);
        private_options()
            .create_new(true)
            .open(path.join("file"))
            .unwrap();
    }

    #[test]
    fn folders_are_synced() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("inside");
        std::fs::create_dir(&inside).unwrap();
        std::fs::write(inside.join("file"), "content").unwrap();
        open_folder(folder.path()).unwrap().sync_all().unwrap();
        sync_folder(&inside).unwrap();
        sync_below(folder.path()).unwrap();
        assert!(sync_below(&folder.path().join("none")).is_err());
    }

    #[test]
    fn facts_of_files() {
        let folder = tempfile::tempdir().unwrap();
        let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
        std::fs::write(&one, "content").unwrap();
        assert_eq!((links(&one), links(&two)), (Some(1), None));
        std::fs::hard_link(&one, &two).unwrap();
        assert_eq!((links(&one), links(&two)), (Some(2), Some(2)));
        assert!(device(&one).is_some() && device(&one) == device(folder.path()));
        assert!(disk_free(folder.path()).is_some());
        let about = one.metadata().unwrap();
        let since = about.modified().unwrap();
        let since = since.duration_since(std::time::UNIX_EPOCH).unwrap();
        let (seconds, nanoseconds) = modified(&about);
        assert_eq!(seconds, since.as_secs() as i64);
        assert_eq!(nanoseconds, i64::from(since.subsec_nanos()));
    }
}
