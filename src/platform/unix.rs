//! What Linux and macOS have in common.

use rustix::fs::OFlags;
use rustix::process::{Signal, getpid, kill_process};
use std::ffi::OsString;
use std::fs::{DirBuilder, File, Metadata, OpenOptions};
use std::io;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
pub use std::os::unix::fs::FileExt as FileAt;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// Options for files of this mode, never through a symbolic link.
fn options(mode: u32, more: OFlags) -> OpenOptions {
    let flags = OFlags::NOFOLLOW | more;
    let mut options = File::options();
    options.read(true).write(true).mode(mode);
    options.custom_flags(flags.bits().cast_signed());
    options
}

pub fn private_options() -> OpenOptions {
    options(0o600, OFlags::empty())
}

pub fn public_options() -> OpenOptions {
    options(0o666, OFlags::empty())
}

/// Opening a pipe must not block.
pub fn existing_options() -> OpenOptions {
    options(0o600, OFlags::NONBLOCK)
}

pub fn is_regular(about: &Metadata) -> bool {
    about.is_file()
}

pub fn make_private_folder(path: &Path) -> io::Result<()> {
    DirBuilder::new().mode(0o700).create(path)
}

pub fn is_private(_: &Path, about: &Metadata) -> io::Result<bool> {
    let own = rustix::process::geteuid().as_raw();
    Ok(about.uid() == own && about.mode() & 0o077 == 0)
}

pub fn open_folder(path: &Path) -> io::Result<File> {
    File::open(path)
}

pub fn sync_names(folder: &File) -> io::Result<()> {
    folder.sync_all()
}

pub fn rename(from: &Path, to: &Path) -> io::Result<()> {
    std::fs::rename(from, to)
}

pub fn is_broken_pipe(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::BrokenPipe
}

pub fn device(path: &Path) -> Option<u64> {
    Some(path.metadata().ok()?.dev())
}

pub fn links(path: &Path) -> Option<u64> {
    Some(path.metadata().ok()?.nlink())
}

pub fn modified(about: &Metadata) -> (i64, i64) {
    (about.mtime(), about.mtime_nsec())
}

pub fn disk_free(path: &Path) -> Option<u64> {
    let stat = rustix::fs::statvfs(path).ok()?;
    Some(stat.f_bavail * stat.f_frsize)
}

pub fn path_bytes(path: &Path) -> Vec<u8> {
    path.as_os_str().as_bytes().to_vec()
}

pub fn path_of_bytes(bytes: Vec<u8>) -> PathBuf {
    OsString::from_vec(bytes).into()
}

pub fn canonical(path: &Path) -> io::Result<PathBuf> {
    path.canonicalize()
}

/// Any can.
pub fn no_name(_: &str) -> Option<&'static str> {
    None
}

/// The shell has replaced wildcards.
pub fn arguments() -> Vec<OsString> {
    std::env::args_os().collect()
}

pub fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+,@%".contains(c);
    if text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

pub fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Allows as many open files as the system does, but no more than `most`.
pub fn open_files(most: u64) {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
    let current = match maximum {
        None if most == u64::MAX => None,
        maximum => Some(maximum.unwrap_or(most).min(most)),
    };
    // With the old limit, only runs on very many threads fail, and they name the file.
    let _ = setrlimit(Resource::Nofile, Rlimit { current, maximum });
}

pub fn on_stop(mut tell: impl FnMut(i32) -> bool + Send + 'static) -> bool {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM, SIGHUP]) else {
        return false;
    };
    std::thread::spawn(move || signals.forever().all(&mut tell));
    true
}

pub fn kill() {
    let _ = kill_process(getpid(), Signal::KILL);
}

pub fn freeze() {
    let _ = kill_process(getpid(), Signal::STOP);
}

/// `ENOSPC` and `EIO`.
pub const DISK_FULL: i32 = 28;
pub const DISK_FAILS: i32 = 5;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_are_not_followed_and_pipes_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, pipe] = ["file", "link", "pipe"].map(|name| folder.path().join(name));
        std::fs::write(&file, "content").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        assert!(crate::open_regular(&file).is_ok());
        assert!(crate::open_regular(&link).is_err());
        assert!(private_options().create(true).open(&link).is_err());
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        if made.is_ok_and(|status| status.success()) {
            let found = crate::open_regular(&pipe).unwrap_err();
            assert_eq!(found.kind(), io::ErrorKind::InvalidInput);
        }
    }

    #[test]
    fn modes_are_those_of_private_and_public_files() {
        let folder = tempfile::tempdir().unwrap();
        let mode = |mut options: OpenOptions, name: &str| {
            let path = folder.path().join(name);
            let file = options.create_new(true).open(path).unwrap();
            file.metadata().unwrap().mode() & 0o777
        };
        assert_eq!(mode(private_options(), "private"), 0o600);
        // As the user's mask has it.
        assert_eq!(mode(public_options(), "public") & 0o600, 0o600);
        let path = folder.path().join("open");
        std::fs::create_dir(&path).unwrap();
        let open = std::os::unix::fs::PermissionsExt::from_mode(0o750);
        std::fs::set_permissions(&path, open).unwrap();
        let about = path.symlink_metadata().unwrap();
        assert!(!crate::is_private(&path, &about).unwrap());
    }

    #[test]
    fn quotes_are_for_a_shell() {
        assert_eq!(quoted("a/b-c_d.e+f"), "a/b-c_d.e+f");
        assert_eq!(quoted("a b"), "'a b'");
        assert_eq!(quoted("it's"), "'it'\\''s'");
    }
}
