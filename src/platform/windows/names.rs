//! Paths and names.

use std::ffi::OsString;
use std::io;
use std::os::windows::ffi::{OsStrExt, OsStringExt};
use std::path::{Component, Path, PathBuf, Prefix};

/// The code units of UTF-16, two bytes each.
pub fn path_bytes(path: &Path) -> Vec<u8> {
    let units = path.as_os_str().encode_wide();
    units.flat_map(u16::to_le_bytes).collect()
}

pub fn path_of_bytes(bytes: Vec<u8>) -> PathBuf {
    let (units, _) = bytes.as_chunks();
    let units: Vec<u16> = units.iter().map(|unit| u16::from_le_bytes(*unit)).collect();
    OsString::from_wide(&units).into()
}

pub fn canonical(path: &Path) -> io::Result<PathBuf> {
    Ok(plain(path.canonicalize()?))
}

/// A path without the `\\?\` that the system puts before it, if it is one of a disk or of a server.
fn plain(path: PathBuf) -> PathBuf {
    let mut parts = path.components();
    let Some(Component::Prefix(prefix)) = parts.next() else {
        return path;
    };
    let mut begin = OsString::new();
    match prefix.kind() {
        Prefix::VerbatimDisk(letter) => begin.push(format!("{}:", char::from(letter))),
        Prefix::VerbatimUNC(server, share) => {
            begin.push(r"\\");
            begin.push(server);
            begin.push(r"\");
            begin.push(share);
        }
        _ => return path,
    }
    let mut whole = PathBuf::from(begin);
    parts.for_each(|part| whole.push(part));
    whole
}

/// Names of devices, also with any extension.
const DEVICES: [&str; 4] = ["CON", "PRN", "AUX", "NUL"];

/// The same with a number behind them.
const PORTS: [&str; 2] = ["COM", "LPT"];

pub fn no_name(name: &str) -> Option<&'static str> {
    let stem = name.split('.').next().unwrap_or(name).trim_end();
    let stem = stem.to_ascii_uppercase();
    let port = |port: &&str| {
        let number = stem.strip_prefix(*port).map(str::as_bytes);
        matches!(number, Some([b'1'..=b'9']))
    };
    if DEVICES.contains(&&*stem) || PORTS.iter().any(|name| port(&name)) {
        return Some("it is the name of a device");
    }
    if name.contains(['<', '>', ':', '"', '|', '?', '*']) || name.contains(char::is_control) {
        return Some("no name has such characters here");
    }
    if name.ends_with(['.', ' ']) {
        return Some("the system leaves out its end");
    }
    None
}

/// No shell replaces wildcards.
pub fn arguments() -> Vec<OsString> {
    let mut arguments = std::env::args_os();
    let program = arguments.next();
    program
        .into_iter()
        .chain(crate::wildcards::expanded(arguments))
        .collect()
}

/// For `cmd` and PowerShell; no name has quotes in it.
pub fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || r"\/._-+:".contains(c);
    match text.chars().all(plain) {
        true => text.to_owned(),
        false => format!("\"{text}\""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_shown_without_what_the_system_puts_before_them() {
        for (path, shown) in [
            (r"\\?\C:\a\b", r"C:\a\b"),
            (r"\\?\UNC\server\share\a", r"\\server\share\a"),
            (r"C:\a", r"C:\a"),
            (r"\\?\Volume{0}\a", r"\\?\Volume{0}\a"),
        ] {
            assert_eq!(plain(path.into()), Path::new(shown));
        }
        let here = canonical(Path::new(".")).unwrap();
        assert!(!here.display().to_string().contains('?'), "{here:?}");
    }

    #[test]
    fn what_no_file_can_be_called() {
        for name in [
            "con", "NUL.ply", "com1.laz", "a:b", "a?", "a.", "a ", "lpt9", "aux .x",
        ] {
            assert!(no_name(name).is_some(), "{name}");
        }
        for name in ["console.ply", "com.ply", "com10.ply", "a.b", "ä"] {
            assert!(no_name(name).is_none(), "{name}");
        }
    }

    #[test]
    fn quotes_are_for_a_shell() {
        assert_eq!(quoted(r"C:\a\b-c.ply"), r"C:\a\b-c.ply");
        assert_eq!(quoted(r"C:\a b"), "\"C:\\a b\"");
        assert_eq!(quoted("a&b"), "\"a&b\"");
    }
}
