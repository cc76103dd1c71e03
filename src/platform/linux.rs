//! Linux.

mod heap;
mod limits;

pub use super::unix::{
    DISK_FAILS, DISK_FULL, FileAt, arguments, canonical, cpu_seconds, device, disk_free,
    existing_options, freeze, is_broken_pipe, is_private, is_regular, kill, links,
    make_private_folder, modified, no_name, on_stop, open_folder, path_bytes, path_of_bytes,
    private_options, public_options, quoted, rename, sync_names,
};
pub use heap::{CAN_TRIM, trim};
pub use limits::{memory_allowed, peak_resident, resident, resident_file};

use memmap2::{Advice, Mmap};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Types of local file systems: ext2 to ext4, XFS, Btrfs, F2FS, ZFS, bcachefs, tmpfs and overlays (`f_type` of
/// statfs).
const LOCAL: [u32; 8] = [
    0xef53,
    0x5846_5342,
    0x9123_683e,
    0xf2f5_2010,
    0x2fc1_2fc1,
    0xca45_1a4e,
    0x0102_1994,
    0x794c_7630,
];

pub fn is_local(path: &Path) -> bool {
    rustix::fs::statfs(path).is_ok_and(|found| LOCAL.contains(&(found.f_type as u32)))
}

/// All of the file system: file by file would take long.
pub fn sync_below(folder: &Path) -> io::Result<()> {
    Ok(rustix::fs::syncfs(File::open(folder)?)?)
}

/// Older systems read at the first access.
pub fn populate(map: &Mmap) -> io::Result<()> {
    map.advise(Advice::PopulateRead)
}

pub fn open_many_files() {
    super::unix::open_files(u64::MAX);
}

/// The file that was started, also if another one has its name by now.
pub fn program() -> io::Result<PathBuf> {
    Ok("/proc/self/exe".into())
}

pub fn browser(url: &str) -> Option<Command> {
    let screen = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    if !["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(screen) {
        return None;
    }
    let mut command = Command::new("xdg-open");
    command.arg(url);
    Some(command)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_known_file_systems_are_local() {
        assert!(!is_local(Path::new("/proc")));
        assert!(!is_local(Path::new("/does/not/exist")));
    }
}
