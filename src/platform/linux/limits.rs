//! Memory: limits of the cgroup (v1 and v2), memory in use.

use std::fs;
use std::path::{Path, PathBuf};

pub fn memory_allowed() -> u64 {
    let physical = meminfo("MemTotal:").unwrap_or(4 << 30);
    let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let limits = cgroup_limits(&groups, Path::new("/sys/fs/cgroup"));
    limits.into_iter().fold(physical, u64::min)
}

pub fn peak_resident() -> u64 {
    status("VmHWM:").unwrap_or(0)
}

pub fn resident() -> u64 {
    status("VmRSS:").unwrap_or(0)
}

pub fn resident_file() -> u64 {
    status("RssFile:").unwrap_or(0)
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

/// All limits on the way from the groups in the text of `/proc/self/cgroup` to the root of their
/// hierarchies, which are mounted at or below `root`.
fn cgroup_limits(groups: &str, root: &Path) -> Vec<u64> {
    // In v2 "no limit" is a word and does not parse; in v1 it is a large number.
    limit_files(groups, root)
        .iter()
        .filter_map(|file| fs::read_to_string(file).ok()?.trim().parse().ok())
        .collect()
}

/// Paths of the files that may hold a limit.
fn limit_files(groups: &str, root: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else {
            continue;
        };
        // Above `memory.high` a process is slowed down so much that it must be treated as a limit.
        let (mounts, names): (&[&str], &[&str]) = if controllers.is_empty() {
            (&["", "unified"], &["memory.max", "memory.high"])
        } else if controllers.split(',').any(|c| c == "memory") {
            (&["memory"], &["memory.limit_in_bytes"])
        } else {
            continue;
        };
        for mount in mounts {
            for folder in Path::new(path).ancestors() {
                let relative = folder.strip_prefix("/").unwrap_or(folder);
                let folder = root.join(mount).join(relative);
                files.extend(names.iter().map(|name| folder.join(name)));
            }
        }
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files of a simulated hierarchy and their contents.
    fn tree(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        root
    }

    fn least(groups: &str, files: &[(&str, &str)]) -> Option<u64> {
        cgroup_limits(groups, tree(files).path()).into_iter().min()
    }

    #[test]
    fn the_first_version_counts_all_groups_above() {
        let files = [
            ("memory/memory.limit_in_bytes", "9223372036854771712\n"),
            ("memory/batch/memory.limit_in_bytes", "1073741824\n"),
            ("memory/batch/job7/memory.limit_in_bytes", "4294967296\n"),
            ("memory/other/memory.limit_in_bytes", "1\n"),
            ("cpu/memory.limit_in_bytes", "2\n"),
        ];
        let groups = "9:cpu:/\n4:name=systemd,memory:/batch/job7\n";
        assert_eq!(least(groups, &files), Some(1 << 30));
        assert_eq!(least("4:memory:/batch\n", &files), Some(1 << 30));
        assert_eq!(
            least("4:memory:/\n", &files),
            Some(9_223_372_036_854_771_712)
        );
        assert_eq!(least("9:cpu:/\n", &files), None);
    }

    #[test]
    fn the_second_version_counts_all_groups_above() {
        let files = [
            ("user.slice/memory.max", "max\n"),
            ("user.slice/memory.high", "max\n"),
            ("user.slice/shell/memory.max", "2147483648\n"),
            ("user.slice/shell/job/memory.max", "max\n"),
            ("user.slice/shell/job/memory.high", "max\n"),
        ];
        let groups = "0::/user.slice/shell/job\n";
        assert_eq!(least(groups, &files), Some(2 << 30));
        assert_eq!(least("0::/user.slice\n", &files), None);
        // Inside a container its own group appears as the root.
        assert_eq!(
            least("0::/\n", &[("memory.max", "536870912\n")]),
            Some(512 << 20)
        );
        // A group may be named that is not visible.
        assert_eq!(
            least("0::/../other/job\n", &[("memory.max", "536870912\n")]),
            Some(512 << 20)
        );
    }

    #[test]
    fn what_slows_down_is_a_limit_too() {
        let files = [
            ("job/memory.max", "2147483648\n"),
            ("job/memory.high", "1073741824\n"),
            ("job/step/memory.max", "1610612736\n"),
        ];
        assert_eq!(least("0::/job/step\n", &files), Some(1 << 30));
    }

    #[test]
    fn both_versions_side_by_side() {
        let files = [
            ("unified/job/memory.max", "3221225472\n"),
            ("memory/job/memory.limit_in_bytes", "1073741824\n"),
        ];
        assert_eq!(least("4:memory:/job\n0::/job\n", &files), Some(1 << 30));
        assert_eq!(least("0::/job\n", &files), Some(3 << 30));
        assert_eq!(least("", &files), None);
        assert_eq!(least("no lines\n:::\n", &files), None);
    }
}
