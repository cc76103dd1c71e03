//! Limits of the machine: memory and free disk.

pub use outcrop_platform::process::{
    cpu_seconds, memory_allowed, peak_resident, resident, resident_file,
};
use std::path::Path;

/// Bytes free for this user on the file system that holds `path` (or its nearest existing parent).
#[must_use]
pub fn disk_free(path: &Path) -> Option<u64> {
    let existing = path
        .ancestors()
        .find(|p| p.exists())
        .unwrap_or_else(|| Path::new("."));
    let existing = if existing.as_os_str().is_empty() {
        Path::new(".")
    } else {
        existing
    };
    outcrop_platform::disk_free(existing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_does_not_exist_has_the_room_of_its_parent() {
        assert!(disk_free(Path::new("does/not/exist")).is_some());
    }
}
