//! Volumes, links and mappings.
#![allow(unsafe_code, reason = "the standard library has no functions for them")]

use super::{check, wide};
use memmap2::Mmap;
use std::fs::File;
use std::io;
use std::os::windows::fs::OpenOptionsExt;
use std::os::windows::io::AsRawHandle;
use std::path::Path;
use std::ptr::null_mut;
use windows_sys::Win32::Storage::FileSystem::{
    BY_HANDLE_FILE_INFORMATION, FILE_FLAG_BACKUP_SEMANTICS, GetDiskFreeSpaceExW, GetDriveTypeW,
    GetFileInformationByHandle, GetVolumeInformationByHandleW, GetVolumePathNameW,
};
use windows_sys::Win32::System::Memory::{PrefetchVirtualMemory, WIN32_MEMORY_RANGE_ENTRY};
use windows_sys::Win32::System::SystemServices::FILE_PERSISTENT_ACLS;
use windows_sys::Win32::System::Threading::GetCurrentProcess;
use windows_sys::Win32::System::WindowsProgramming::{DRIVE_FIXED, DRIVE_RAMDISK, DRIVE_REMOVABLE};

/// Code units of the path of a volume, more than the system allows.
const LONGEST: usize = 1 << 15;

/// What the system knows of a file or folder.
fn about(path: &Path) -> io::Result<BY_HANDLE_FILE_INFORMATION> {
    // Nothing is read from it, so nobody is in the way.
    let mut options = File::options();
    options
        .access_mode(0)
        .custom_flags(FILE_FLAG_BACKUP_SEMANTICS);
    let file = options.open(path)?;
    let mut about = BY_HANDLE_FILE_INFORMATION::default();
    // SAFETY: the handle is open, and the answer has the room of the structure.
    check(unsafe { GetFileInformationByHandle(file.as_raw_handle(), &raw mut about) })?;
    Ok(about)
}

pub fn device(path: &Path) -> Option<u64> {
    Some(about(path).ok()?.dwVolumeSerialNumber.into())
}

pub fn links(path: &Path) -> Option<u64> {
    Some(about(path).ok()?.nNumberOfLinks.into())
}

pub fn disk_free(path: &Path) -> Option<u64> {
    let (mut free, none) = (0, null_mut());
    let path = wide(path).ok()?;
    // SAFETY: the path ends in 0, and the answer has the room of a number.
    check(unsafe { GetDiskFreeSpaceExW(path.as_ptr(), &raw mut free, none, none) }).ok()?;
    Some(free)
}

/// The root of the volume on which a path is.
fn root(path: &Path) -> io::Result<Vec<u16>> {
    let (path, mut root) = (wide(path)?, vec![0; LONGEST]);
    // SAFETY: the path ends in 0, and the answer has the room that is told.
    check(unsafe { GetVolumePathNameW(path.as_ptr(), root.as_mut_ptr(), LONGEST as u32) })?;
    Ok(root)
}

pub fn is_local(path: &Path) -> bool {
    let Ok(root) = root(path) else {
        return false;
    };
    // SAFETY: the path ends in 0.
    let kind = unsafe { GetDriveTypeW(root.as_ptr()) };
    path.exists() && [DRIVE_FIXED, DRIVE_REMOVABLE, DRIVE_RAMDISK].contains(&kind)
}

/// True if the volume of a folder keeps who may open its files, also if that cannot be had: the lists then tell.
pub(super) fn has_access_lists(folder: &Path) -> bool {
    let mut options = File::options();
    options
        .access_mode(0)
        .custom_flags(FILE_FLAG_BACKUP_SEMANTICS);
    let Ok(folder) = options.open(folder) else {
        return true;
    };
    let (mut flags, name, number) = (0, null_mut(), null_mut());
    let handle = folder.as_raw_handle();
    // SAFETY: the handle is open, the answer has the room of a number, and no other answer is wanted.
    let told = unsafe {
        GetVolumeInformationByHandleW(handle, name, 0, number, number, &raw mut flags, name, 0)
    };
    told == 0 || flags & FILE_PERSISTENT_ACLS != 0
}

/// What cannot be read is noticed later, and then ends the process.
pub fn populate(map: &Mmap) -> io::Result<()> {
    let range = WIN32_MEMORY_RANGE_ENTRY {
        VirtualAddress: map.as_ptr().cast_mut().cast(),
        NumberOfBytes: map.len(),
    };
    // SAFETY: the range is that of the mapping, which lives as long as the call.
    check(unsafe { PrefetchVirtualMemory(GetCurrentProcess(), 1, &raw const range, 0) })
}
