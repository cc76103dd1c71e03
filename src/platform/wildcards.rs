//! Names with `*` and `?` in arguments, where the shell leaves them to the program.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The arguments, each with wildcards in its last name replaced by the files and folders that it matches, in the order
/// of their names. One that matches nothing stays, so that a message can name it; so does an option.
pub(crate) fn expanded(arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut all = Vec::new();
    for argument in arguments {
        let found = matching(Path::new(&argument));
        match found.is_empty() {
            true => all.push(argument),
            false => all.extend(found.into_iter().map(OsString::from)),
        }
    }
    all
}

/// The paths that match one, if it has wildcards in its last name.
fn matching(path: &Path) -> Vec<PathBuf> {
    let Some(pattern) = path.file_name().and_then(|name| name.to_str()) else {
        return Vec::new();
    };
    if !pattern.contains(['*', '?']) || pattern.starts_with('-') {
        return Vec::new();
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let listed = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let entries = std::fs::read_dir(listed).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name());
    let hidden = pattern.starts_with('.');
    let mut names: Vec<OsString> = names
        .filter(|name| {
            let name = name.to_string_lossy();
            (hidden || !name.starts_with('.')) && matches(pattern, &name)
        })
        .collect();
    names.sort();
    names.into_iter().map(|name| folder.join(name)).collect()
}

/// True if a name matches a pattern, whatever the case of its letters: `*` stands for any characters, `?` for one.
fn matches(pattern: &str, name: &str) -> bool {
    let lower = |text: &str| {
        text.chars()
            .flat_map(char::to_lowercase)
            .collect::<Vec<_>>()
    };
    let (pattern, name) = (lower(pattern), lower(name));
    // Where the pattern goes on if what follows the last `*` does not match: the `*` takes one character more.
    let (mut p, mut n, mut star) = (0, 0, None);
    while n < name.len() {
        match pattern.get(p) {
            Some('*') => {
                star = Some((p, n));
                p += 1;
            }
            Some(c) if *c == '?' || *c == name[n] => (p, n) = (p + 1, n + 1),
            _ => match star {
                Some((at, taken)) => {
                    star = Some((at, taken + 1));
                    (p, n) = (at + 1, taken + 1);
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns() {
        for (pattern, yes, no) in [
            (
                "*.laz",
                &["a.laz", ".laz", "A.LAZ"][..],
                &["a.las", "laz"][..],
            ),
            (
                "tile-??.las",
                &["tile-01.las"],
                &["tile-1.las", "tile-001.las"],
            ),
            ("*", &["", "a", "a.b"], &[]),
            ("*a*b", &["ab", "xaxb", "aab", "abab"], &["ba", "abx"]),
            ("ä?.*", &["Äb.x"], &["a.x"]),
        ] {
            yes.iter()
                .for_each(|name| assert!(matches(pattern, name), "{pattern} {name}"));
            no.iter()
                .for_each(|name| assert!(!matches(pattern, name), "{pattern} {name}"));
        }
    }

    #[test]
    fn arguments_are_replaced_by_the_files_they_match() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["b.laz", "a.laz", ".hidden.laz", "c.las"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let path = |name: &str| folder.path().join(name).into_os_string();
        let given = [path("*.laz"), "-o".into(), path("?.ply"), "--x=*".into()];
        let found = expanded(given.into_iter());
        let wanted = [
            path("a.laz"),
            path("b.laz"),
            "-o".into(),
            path("?.ply"),
            "--x=*".into(),
        ];
        assert_eq!(found, wanted);
    }
}
