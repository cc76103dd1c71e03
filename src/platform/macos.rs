//! macOS. Nobody has run it yet.
#![allow(
    unsafe_code,
    reason = "the memory of the machine and of the process cannot be asked for otherwise"
)]

pub use super::unix::{
    DISK_FAILS, DISK_FULL, FileAt, arguments, canonical, cpu_seconds, device, disk_free,
    existing_options, freeze, is_broken_pipe, is_private, is_regular, kill, links,
    make_private_folder, modified, no_name, on_stop, open_folder, path_bytes, path_of_bytes,
    private_options, public_options, quoted, rename, sync_names,
};
use memmap2::{Advice, Mmap};
use std::ffi::{c_int, c_void};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

pub fn is_local(path: &Path) -> bool {
    let local = libc::MNT_LOCAL.cast_unsigned();
    rustix::fs::statfs(path).is_ok_and(|found| found.f_flags & local != 0)
}

/// File by file: there is no `syncfs`.
pub fn sync_below(folder: &Path) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        match entry.file_type()?.is_dir() {
            true => sync_below(&entry.path())?,
            false => File::open(entry.path())?.sync_all()?,
        }
    }
    crate::sync_folder(folder)
}

/// Bytes of a page, on either processor or smaller.
const PAGE: usize = 4096;

/// Reads a byte of each page. What cannot be read raises SIGBUS here.
pub fn populate(map: &Mmap) -> io::Result<()> {
    map.advise(Advice::WillNeed)?;
    let pages = map.iter().step_by(PAGE);
    std::hint::black_box(pages.fold(0, |all, byte| all | byte));
    Ok(())
}

/// More open files than these are refused (`OPEN_MAX`).
const OPEN_FILES: u64 = 10_240;

pub fn open_many_files() {
    super::unix::open_files(OPEN_FILES);
}

pub fn program() -> io::Result<PathBuf> {
    std::env::current_exe()
}

pub fn browser(url: &str) -> Option<Command> {
    let mut command = Command::new("open");
    command.arg(url);
    Some(command)
}

pub fn memory_allowed() -> u64 {
    let (mut memory, mut bytes) = (0u64, size_of::<u64>());
    let none = std::ptr::null_mut();
    // SAFETY: the name ends in 0, and the answer has the room of one number, as its size says.
    let failed = unsafe {
        let to = (&raw mut memory).cast::<c_void>();
        libc::sysctlbyname(c"hw.memsize".as_ptr(), to, &raw mut bytes, none, 0)
    };
    if failed == 0 { memory } else { 4 << 30 }
}

pub fn resident() -> u64 {
    let process = std::process::id().cast_signed();
    let bytes = size_of::<libc::proc_taskinfo>() as c_int;
    // SAFETY: the structure has plain numbers only, for which 0 is a value, and its size is given.
    unsafe {
        let mut about: libc::proc_taskinfo = std::mem::zeroed();
        let to = (&raw mut about).cast::<c_void>();
        let got = libc::proc_pidinfo(process, libc::PROC_PIDTASKINFO, 0, to, bytes);
        if got == bytes {
            about.pti_resident_size
        } else {
            0
        }
    }
}

pub fn peak_resident() -> u64 {
    // SAFETY: the structure has plain numbers only, for which 0 is a value.
    unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        match libc::getrusage(libc::RUSAGE_SELF, &raw mut usage) {
            0 => u64::try_from(usage.ru_maxrss).unwrap_or(0),
            _ => 0,
        }
    }
}

/// Not known.
pub fn resident_file() -> u64 {
    0
}

pub const CAN_TRIM: bool = false;

pub fn trim(_: impl FnOnce(&(dyn Fn() + Sync))) {}
