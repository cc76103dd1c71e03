//! The files below a folder, and no others.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// A folder with a tileset. Only what lies below it can be opened, symbolic links resolved.
#[derive(Debug)]
pub struct Folder {
    /// Its path without symbolic links.
    root: PathBuf,
}

/// An open file.
#[derive(Debug)]
pub struct Opened {
    /// The file, at its start.
    pub file: File,
    /// Its length in bytes when it was opened.
    pub length: u64,
    /// Value of `Content-Type`.
    pub kind: &'static str,
}

impl Folder {
    /// The folder at a path.
    pub fn new(path: &Path) -> io::Result<Self> {
        let root = outcrop_platform::canonical(path)?;
        if !root.is_dir() {
            return Err(io::ErrorKind::NotADirectory.into());
        }
        Ok(Self { root })
    }

    /// The folder's path, without symbolic links.
    pub fn path(&self) -> &Path {
        &self.root
    }

    /// The file at a path of plain names below the folder; `None` if there is none, if it is of another kind
    /// than a tileset has, or if it lies elsewhere.
    pub fn open<'a>(&self, names: impl IntoIterator<Item = &'a str>) -> Option<Opened> {
        let mut path = self.root.clone();
        for name in names {
            if !is_plain(name) {
                return None;
            }
            path.push(name);
        }
        let kind = match path.extension()?.to_str()? {
            "json" => "application/json",
            "glb" => "model/gltf-binary",
            _ => return None,
        };
        let path = outcrop_platform::canonical(&path).ok()?;
        if !path.starts_with(&self.root) || !path.is_file() {
            return None;
        }
        let file = File::open(path).ok()?;
        let length = file.metadata().ok().filter(|data| data.is_file())?.len();
        Some(Opened { file, length, kind })
    }
}

/// True for the name of one file or folder that is neither `.` nor `..`, on every system.
fn is_plain(name: &str) -> bool {
    let odd = |c: char| matches!(c, '/' | '\\' | ':') || c.is_control();
    !name.is_empty() && name != "." && name != ".." && !name.contains(odd)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made() -> (tempfile::TempDir, Folder) {
        let place = tempfile::tempdir().unwrap();
        let root = place.path().join("mesh");
        std::fs::create_dir_all(root.join("tiles")).unwrap();
        for name in ["tileset.json", "tiles/0.glb", "secret.txt", "../out.glb"] {
            std::fs::write(root.join(name), name).unwrap();
        }
        let folder = Folder::new(&root).unwrap();
        (place, folder)
    }

    #[test]
    fn files_of_a_tileset_are_opened() {
        let (_place, folder) = made();
        let tile = folder.open(["tiles", "0.glb"]).unwrap();
        assert_eq!((tile.length, tile.kind), (11, "model/gltf-binary"));
        let tileset = folder.open(["tileset.json"]).unwrap();
        assert_eq!(tileset.kind, "application/json");
    }

    #[test]
    fn nothing_else_is_opened() {
        let (_place, folder) = made();
        let refused: [&[&str]; 10] = [
            &[],
            &["secret.txt"],
            &["tiles"],
            &["tiles", "1.glb"],
            &["..", "out.glb"],
            &["../out.glb"],
            &["tiles/0.glb"],
            &["tiles", "", "0.glb"],
            &[".", "tileset.json"],
            &["tiles\\0.glb"],
        ];
        for names in refused {
            assert!(folder.open(names.iter().copied()).is_none(), "{names:?}");
        }
        let absolute = folder.path().join("tileset.json");
        assert!(folder.open([absolute.to_str().unwrap()]).is_none());
    }

    #[cfg(unix)]
    #[test]
    fn links_out_of_the_folder_are_refused_and_those_inside_followed() {
        use std::os::unix::fs::symlink;
        let (_place, folder) = made();
        let root = folder.path();
        symlink("../../out.glb", root.join("tiles/out.glb")).unwrap();
        symlink("../..", root.join("tiles/up")).unwrap();
        symlink("secret.txt", root.join("secret.glb")).unwrap();
        symlink("0.glb", root.join("tiles/same.glb")).unwrap();
        assert!(folder.open(["tiles", "out.glb"]).is_none());
        assert!(folder.open(["tiles", "up", "out.glb"]).is_none());
        assert!(folder.open(["tiles", "same.glb"]).is_some());
        assert!(folder.open(["secret.glb"]).is_some());
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_regular_file_is_not_waited_for() {
        let (_place, folder) = made();
        let pipe = folder.path().join("tiles/pipe.glb");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        if made.is_ok_and(|status| status.success()) {
            assert!(folder.open(["tiles", "pipe.glb"]).is_none());
        }
    }
}
