//! `outcrop view`: a mesh in the browser.

use super::args::{Quiet, View};
use super::output::print;
use super::{stop, style};
use crate::pipeline::Tiles;
use crate::pipeline::{default_memory, default_threads};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_view::{Server, write_html};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

/// Time between two looks whether the program is to end.
const WAIT: Duration = Duration::from_millis(100);

/// Shows a mesh until a signal comes, or writes the page.
pub fn run(args: &View) -> Result<bool> {
    let (observer, cancel) = stop::watched(args.limits.quiet);
    let shown = Shown::of(args, observer, &cancel)?;
    if let Some(page) = &args.html {
        return write(&shown.folder, page, args.html_limit, args.limits.quiet);
    }
    let server = Server::start(&shown.folder, args.port)?;
    let url = server.url();
    print(&url)?;
    if args.limits.quiet.tells() {
        eprintln!(
            "outcrop: {} is shown there; Ctrl-C ends it",
            args.mesh.display()
        );
    }
    if !args.no_browser {
        open(&url);
    }
    while !cancel.is_cancelled() {
        std::thread::sleep(WAIT);
    }
    server.stop();
    Ok(true)
}

/// The folder that is shown.
struct Shown {
    folder: PathBuf,
    /// Deleted at the end, if the levels of detail are not to be kept.
    _scratch: Option<Scratch>,
}

impl Shown {
    /// The folder of the arguments, or one with levels of detail that are made.
    fn of(args: &View, observer: Arc<dyn Observer>, cancel: &Cancel) -> Result<Self> {
        let mesh = &args.mesh;
        let tileset = mesh.file_name().is_some_and(|name| name == "tileset.json");
        if mesh.is_dir() || tileset {
            let folder = match mesh.parent().filter(|_| !mesh.is_dir()) {
                Some(parent) if parent.as_os_str().is_empty() => PathBuf::from("."),
                Some(parent) => parent.to_path_buf(),
                None => mesh.clone(),
            };
            return Ok(Self {
                folder,
                _scratch: None,
            });
        }
        let beside = mesh
            .parent()
            .filter(|parent| !parent.as_os_str().is_empty());
        let beside = beside.unwrap_or(Path::new("."));
        // A mesh that is not there is an error of the tiles, and not of the folder beside it.
        let (folder, scratch) = match &args.keep {
            Some(kept) => (kept.clone().unwrap_or_else(|| tiles_of(mesh)), None),
            None => {
                let place = args.limits.scratch.as_deref().unwrap_or(beside);
                let made = scratch(place)?;
                (made.folder.path().join("tiles"), Some(made))
            }
        };
        if scratch.is_some() || !is_newer(&folder.join("tileset.json"), mesh) {
            let limits = &args.limits;
            let place = scratch.as_ref().map(|made| made.folder.path());
            let mut tiles = Tiles::new(mesh, &folder)
                .memory(limits.memory.unwrap_or_else(default_memory))
                .threads(limits.threads.map_or_else(default_threads, usize::from))
                .storage(limits.storing.storage())
                .start(args.again.start())
                .observer(observer)
                .cancel(cancel.clone());
            if let Some(place) = place.or(limits.scratch.as_deref()) {
                tiles = tiles.scratch(place);
            }
            tiles.run()?;
        }
        Ok(Self {
            folder,
            _scratch: scratch,
        })
    }
}

/// A folder for what is deleted at the end.
struct Scratch {
    folder: tempfile::TempDir,
    /// Locked as long as the program runs, even if it is killed.
    _lock: File,
}

/// How folders for what is deleted at the end are called.
const PREFIX: &str = "outcrop-view-";

/// The file in such a folder that is locked.
const LOCK: &str = "lock";

/// A folder for what is deleted at the end: here, or where temporary files go if nothing can be written here. Those
/// that programs left there which were killed are deleted.
fn scratch(place: &Path) -> Result<Scratch> {
    let make = |place: &Path| {
        remove_stale(place);
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(place)?;
        let lock = File::create_new(folder.path().join(LOCK))?;
        lock.lock()?;
        Ok(Scratch {
            folder,
            _lock: lock,
        })
    };
    make(place)
        .or_else(|_| make(&std::env::temp_dir()))
        .map_err(|e| Error::io(place, "make a folder", e))
}

/// Deletes the folders of programs that do not run any more. One without a lock file may just have been made.
fn remove_stale(place: &Path) {
    let entries = std::fs::read_dir(place).into_iter().flatten().flatten();
    for entry in entries.filter(|e| e.file_name().to_string_lossy().starts_with(PREFIX)) {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let lock = File::open(entry.path().join(LOCK));
        if is_folder && lock.is_ok_and(|lock| lock.try_lock().is_ok()) {
            // It does no harm if it cannot be deleted.
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

/// The folder where the levels of detail of a mesh are kept.
fn tiles_of(mesh: &Path) -> PathBuf {
    let mut name = mesh.file_stem().unwrap_or_default().to_os_string();
    name.push("-tiles");
    mesh.with_file_name(name)
}

/// True if a file was made after another one.
fn is_newer(file: &Path, other: &Path) -> bool {
    let modified = |path: &Path| path.metadata().and_then(|about| about.modified()).ok();
    matches!((modified(file), modified(other)), (Some(file), Some(other)) if file > other)
}

fn write(folder: &Path, page: &Path, limit: u64, quiet: Quiet) -> Result<bool> {
    let embedded = write_html(folder, page, limit)?;
    if quiet.tells() {
        print(&format!(
            "{}: {}, {} of {} tiles, {} of {} triangles",
            page.display(),
            style::bytes(embedded.bytes),
            style::grouped(embedded.tiles),
            style::grouped(embedded.of_tiles),
            style::grouped(embedded.triangles),
            style::grouped(embedded.of_triangles),
        ))?;
    }
    Ok(true)
}

/// Opens a browser, if there is one.
fn open(url: &str) {
    let (program, before): (&str, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(windows) {
        ("cmd", &["/C", "start", ""])
    } else {
        let screen = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        if !["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(screen) {
            return;
        }
        ("xdg-open", &[])
    };
    let mut command = Command::new(program);
    command.args(before).arg(url);
    let silent = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    if let Ok(mut child) = silent.spawn() {
        // It may stay for as long as the browser does.
        std::thread::spawn(move || child.wait());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_programs_that_were_killed_are_deleted() {
        let place = tempfile::tempdir().unwrap();
        let folder = |name: &str| {
            let folder = place.path().join(name);
            std::fs::create_dir_all(folder.join("tiles")).unwrap();
            folder
        };
        let (stale, young, other) = (
            folder("outcrop-view-stale"),
            folder("outcrop-view-young"),
            folder("other"),
        );
        for folder in [&stale, &other] {
            std::fs::write(folder.join(LOCK), "").unwrap();
        }
        let first = scratch(place.path()).unwrap();
        assert!(!stale.exists() && young.exists() && other.exists());
        let second = scratch(place.path()).unwrap();
        assert!(first.folder.path().exists() && second.folder.path().exists());
        // As after a kill: the folder stays, its lock does not.
        let left = first.folder.keep();
        drop(first._lock);
        let third = scratch(place.path()).unwrap();
        assert!(!left.exists() && second.folder.path().exists());
        drop((second, third));
        let mut names: Vec<_> = std::fs::read_dir(place.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, ["other", "outcrop-view-young"]);
    }
}
