//! Tells the program from which commit it is built: `OUTCROP_COMMIT`, at most 12 digits, or `unknown`. On Windows it
//! also sets the size of the stack.
//!
//! The first of these counts: the variable `OUTCROP_COMMIT`, for packagers; the file that cargo puts into a
//! published crate; the files of git, which are read without git. The script runs again only if one of them
//! changes.

use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// Digits of a commit that are told.
const DIGITS: usize = 12;

fn main() {
    println!("cargo::rerun-if-env-changed=OUTCROP_COMMIT");
    // Without another line of this kind cargo would watch all files of the package.
    println!("cargo::rerun-if-changed=build.rs");
    let given = std::env::var("OUTCROP_COMMIT").ok();
    let commit = given
        .as_deref()
        .and_then(digits)
        .or_else(|| published(Path::new(".cargo_vcs_info.json")))
        .or_else(|| of_git(Path::new(".git")));
    let commit = commit.unwrap_or_else(|| "unknown".to_owned());
    println!("cargo::rustc-env=OUTCROP_COMMIT={commit}");
    // The main thread has 1 MiB on Windows, and 8 MiB elsewhere.
    let is = |name: &str, value: &str| std::env::var(name).is_ok_and(|found| found == value);
    if is("CARGO_CFG_TARGET_OS", "windows") {
        let stack = match is("CARGO_CFG_TARGET_ENV", "msvc") {
            true => "/STACK:8388608",
            false => "-Wl,--stack,8388608",
        };
        println!("cargo::rustc-link-arg-bins={stack}");
    }
}

/// The first digits, if a text begins with a commit.
fn digits(text: &str) -> Option<String> {
    let text = text.trim_start();
    let length = text.bytes().take_while(u8::is_ascii_hexdigit).count();
    (length >= 7).then(|| text[..length.min(DIGITS)].to_ascii_lowercase())
}

/// The commit from which a crate was published.
fn published(file: &Path) -> Option<String> {
    let text = watched(file)?;
    let (_, after) = text.split_once("\"sha1\"")?;
    digits(after.trim_start_matches([' ', ':', '"']))
}

/// The commit that is checked out.
fn of_git(place: &Path) -> Option<String> {
    let folder = match place.is_dir() {
        true => place.to_path_buf(),
        // A file that names the folder of a work tree.
        false => PathBuf::from(read_to_string(place).ok()?.strip_prefix("gitdir:")?.trim()),
    };
    let head = watched(&folder.join("HEAD"))?;
    let Some(name) = head.strip_prefix("ref:") else {
        return digits(&head);
    };
    // Work trees share the branches, and their own HEAD has a log that grows with each commit.
    watch(&folder.join("logs/HEAD"));
    let shared = read_to_string(folder.join("commondir"));
    let shared = shared.map_or_else(|_| folder.clone(), |path| folder.join(path.trim()));
    let name = name.trim();
    watched(&shared.join(name))
        .or_else(|| packed(&watched(&shared.join("packed-refs"))?, name))
        .and_then(|commit| digits(&commit))
}

/// The line of a branch in the list of all.
fn packed(list: &str, name: &str) -> Option<String> {
    let line = list
        .lines()
        .find(|line| line.split(' ').nth(1) == Some(name));
    line.map(str::to_owned)
}

/// The content of a file that is watched.
fn watched(file: &Path) -> Option<String> {
    watch(file);
    read_to_string(file).ok()
}

/// Has the script run again when a file changes, if it is there: one that is not would have it run every time.
fn watch(file: &Path) {
    if file.exists() {
        println!("cargo::rerun-if-changed={}", file.display());
    }
}
