//! Files mapped into memory.

use memmap2::{Mmap, MmapOptions};
use outcrop_platform::{is_local, populate};
use std::fs::File;
use std::ops::Deref;
use std::path::Path;
use std::str::FromStr;

/// The way in which points are read, from scratch files and inputs. It changes no result.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Io {
    /// Mapped on local disks where the budget has ample room, else read; inputs are read.
    #[default]
    Auto,
    /// Mapped wherever the system allows it and the budget has room; inputs, too. Whoever cuts an input
    /// meanwhile ends the run by SIGBUS.
    Map,
    /// Read into buffers.
    Read,
}

impl FromStr for Io {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "map" => Ok(Self::Map),
            "read" => Ok(Self::Read),
            _ => Err(format!("{text:?} is not auto, map or read")),
        }
    }
}

/// With [`Io::Auto`], the part of the free budget that one file may take: a quarter.
const SHARE: u64 = 4;

impl Io {
    /// True if the file at `path`, of this size, is to be mapped when this much of the budget is free.
    #[must_use]
    pub fn maps(self, path: &Path, bytes: u64, free: u64) -> bool {
        match self {
            Self::Auto => bytes <= free / SHARE && is_local(path),
            Self::Map => bytes <= free,
            Self::Read => false,
        }
    }
}

/// A mapped file, all of it in memory.
#[derive(Debug)]
pub struct Mapping(Mmap);

impl Mapping {
    /// Maps the file as long as it is now, and brings it into memory; `None` if that cannot be done.
    #[must_use]
    pub fn of(file: &File) -> Option<Self> {
        #[expect(
            unsafe_code,
            reason = "no mapping of a file can be proved to be constant"
        )]
        // SAFETY: the bytes are only read, and decoded with bounds after a CRC matched. A scratch file is
        // private and is not written any more when it is mapped. Whoever cuts it meanwhile ends the run by
        // SIGBUS.
        let map = unsafe { Mmap::map(file) }.ok()?;
        // Fails where a later access would raise SIGBUS. Older systems read at the first access.
        match populate(&map) {
            Err(e) if e.kind() != std::io::ErrorKind::InvalidInput => None,
            _ => Some(Self(map)),
        }
    }

    /// A part of the file; `None` if it is not within it.
    #[must_use]
    pub fn get(&self, offset: u64, bytes: usize) -> Option<&[u8]> {
        let offset = usize::try_from(offset).ok()?;
        self.0.get(offset..offset.checked_add(bytes)?)
    }
}

/// A part of an input file: mapped, or a copy.
#[derive(Debug)]
pub enum Window {
    /// Mapped, all of it in memory.
    Mapped(Mmap),
    /// A copy.
    Copied(Vec<u8>),
}

impl Window {
    /// Maps a part of the file, and brings it into memory; `None` if that cannot be done, or if the file ends
    /// before it.
    #[must_use]
    pub fn of(file: &File, offset: u64, bytes: usize) -> Option<Self> {
        let end = offset.checked_add(bytes as u64)?;
        if bytes == 0 || file.metadata().ok()?.len() < end {
            return None;
        }
        #[expect(
            unsafe_code,
            reason = "no mapping of a file can be proved to be constant"
        )]
        // SAFETY: the bytes are only read, and decoded with bounds. A program that writes to an input at the
        // same time changes what is read, as it does without a mapping. Whoever cuts it between the next line
        // and the end of its use ends the run by SIGBUS.
        let map = unsafe { MmapOptions::new().offset(offset).len(bytes).map(file) }.ok()?;
        populate(&map).ok()?;
        Some(Self::Mapped(map))
    }
}

impl Deref for Window {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Copied(bytes) => bytes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_mapping_has_the_bytes_of_the_file_and_nothing_beyond() {
        let mut file = tempfile::tempfile().unwrap();
        let bytes: Vec<u8> = (0..70_001u32).map(|n| (n % 251) as u8).collect();
        file.write_all(&bytes).unwrap();
        let map = Mapping::of(&file).unwrap();
        assert_eq!(map.get(0, bytes.len()), Some(&bytes[..]));
        assert_eq!(map.get(69_999, 2), Some(&bytes[69_999..]));
        assert_eq!(map.get(69_999, 3), None);
        assert_eq!(map.get(u64::MAX, 1), None);
        assert_eq!(map.get(5, usize::MAX), None);
    }

    #[test]
    fn a_window_has_the_bytes_of_its_part_and_none_if_the_file_ends_before() {
        let mut file = tempfile::tempfile().unwrap();
        let bytes: Vec<u8> = (0..70_001u32).map(|n| (n % 251) as u8).collect();
        file.write_all(&bytes).unwrap();
        for (offset, count) in [(0, 70_001), (4095, 2), (4096, 4096), (69_990, 11)] {
            let window = Window::of(&file, offset as u64, count).unwrap();
            assert_eq!(window[..], bytes[offset..offset + count]);
        }
        assert!(Window::of(&file, 69_990, 12).is_none());
        assert!(Window::of(&file, u64::MAX, 2).is_none());
        assert!(Window::of(&file, 0, 0).is_none());
        file.set_len(69_999).unwrap();
        assert!(Window::of(&file, 69_990, 11).is_none());
    }

    #[test]
    fn files_are_mapped_where_the_budget_has_room() {
        let here = std::env::temp_dir();
        assert!(Io::Map.maps(&here, 10, 10) && !Io::Map.maps(&here, 11, 10));
        assert!(!Io::Read.maps(&here, 1, 1 << 30));
        assert!(!Io::Auto.maps(&here, 3, 8));
        assert_eq!(Io::Auto.maps(&here, 2, 8), is_local(&here));
    }
}
