//! What the machine allows: memory limits of the cgroup (v1 and v2), memory in use, free disk.

use std::fs;
use std::path::{Path, PathBuf};

/// Bytes of memory this process may use: the smallest of physical memory and the limits of its
/// memory cgroup and all its ancestors.
#[must_use]
pub fn memory_allowed() -> u64 {
    let physical = meminfo("MemTotal:").unwrap_or(4 << 30);
    cgroup_limits().into_iter().fold(physical, u64::min)
}

/// Peak resident memory of this process so far, in bytes (`VmHWM`).
#[must_use]
pub fn peak_resident() -> u64 {
    status("VmHWM:").unwrap_or(0)
}

/// Resident memory of this process now, in bytes (`VmRSS`).
#[must_use]
pub fn resident() -> u64 {
    status("VmRSS:").unwrap_or(0)
}

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
    let stat = rustix::fs::statvfs(existing).ok()?;
    Some(stat.f_bavail * stat.f_frsize)
}

fn kib_field(text: &str, key: &str) -> Option<u64> {
    let rest = text.lines().find_map(|l| l.strip_prefix(key))?;
    rest.split_whitespace()
        .next()?
        .parse::<u64>()
        .ok()
        .map(|kib| kib * 1024)
}

fn meminfo(key: &str) -> Option<u64> {
    kib_field(&fs::read_to_string("/proc/meminfo").ok()?, key)
}

fn status(key: &str) -> Option<u64> {
    kib_field(&fs::read_to_string("/proc/self/status").ok()?, key)
}

fn cgroup_limits() -> Vec<u64> {
    let membership = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    limit_files(&membership)
        .iter()
        .filter_map(|file| fs::read_to_string(file).ok()?.trim().parse().ok())
        .collect()
}

/// The files that may hold a limit, from the text of `/proc/self/cgroup`.
fn limit_files(membership: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for line in membership.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else {
            continue;
        };
        let (roots, file): (&[&str], &str) = if controllers.is_empty() {
            (&["/sys/fs/cgroup", "/sys/fs/cgroup/unified"], "memory.max")
        } else if controllers.split(',').any(|c| c == "memory") {
            (&["/sys/fs/cgroup/memory"], "memory.limit_in_bytes")
        } else {
            continue;
        };
        for root in roots {
            for folder in Path::new(path).ancestors() {
                let relative = folder.strip_prefix("/").unwrap_or(folder);
                files.push(Path::new(root).join(relative).join(file));
            }
        }
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_limit_files_of_both_versions() {
        let v1 = limit_files("9:cpu:/\n4:memory:/batch/job7\n");
        assert_eq!(
            v1,
            [
                "/sys/fs/cgroup/memory/batch/job7/memory.limit_in_bytes",
                "/sys/fs/cgroup/memory/batch/memory.limit_in_bytes",
                "/sys/fs/cgroup/memory/memory.limit_in_bytes",
            ]
            .map(PathBuf::from)
        );
        let v2 = limit_files("0::/user.slice\n");
        assert!(v2.contains(&PathBuf::from("/sys/fs/cgroup/user.slice/memory.max")));
        assert!(v2.contains(&PathBuf::from("/sys/fs/cgroup/memory.max")));
    }

    #[test]
    fn reads_this_process() {
        assert!(memory_allowed() > 1 << 20);
        assert!(peak_resident() >= resident() / 2);
        assert!(disk_free(Path::new("does/not/exist")).is_some());
    }
}
