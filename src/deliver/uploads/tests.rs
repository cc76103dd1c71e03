//! Notes that cannot be read, and stores that do not tell their uploads.

use super::super::Kind;
use super::*;
use std::path::Path;
use std::sync::Mutex;

/// Keeps the warnings.
#[derive(Default)]
struct Warnings(Mutex<Vec<String>>);

impl Observer for Warnings {
    fn warn(&self, message: &str) {
        self.0.lock().unwrap().push(message.to_owned());
    }
}

/// A delivery to a store that nobody asks, with its files in `folder`.
fn delivery(folder: &Path) -> Delivery {
    let output = Path::new("s3://nobody/mesh.ply");
    let delivery = Delivery::of(output, Kind::Mesh, Some(folder), None).unwrap();
    let delivery = delivery.unwrap();
    delivery.prepare().unwrap();
    delivery
}

#[test]
fn notes_that_cannot_be_read_are_kept_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let delivery = delivery(folder.path());
    let notes = delivery.files_folder().with_file_name("uploads");
    // No text.
    std::fs::write(&notes, b"\xff\xfe").unwrap();
    let warnings = Warnings::default();
    let error = delivery.begin(&warnings).unwrap_err().to_string();
    assert!(
        error.contains("cannot read the notes about uploads"),
        "{error}"
    );
    assert!(notes.is_file());
    delivery.end(&warnings);
    let warnings = warnings.0.into_inner().unwrap();
    assert!(warnings[0].contains("uploads: cannot read"), "{warnings:?}");
    assert!(warnings[0].ends_with("so they are kept"), "{warnings:?}");
    assert!(notes.is_file() && !delivery.files_folder().exists());
}

#[test]
fn an_upload_whose_name_nobody_knows_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let delivery = delivery(folder.path());
    let file = || "mesh.ply".to_owned();
    let begin = Note::Begin {
        file: file(),
        others: None,
        before: None,
    };
    delivery.notes().add(&begin).unwrap();
    let warnings = Warnings::default();
    assert!(delivery.give_up(&warnings).unwrap().is_empty());
    let said = warnings.0.into_inner().unwrap();
    assert!(
        said[0].contains("attempt ended while an upload began"),
        "{said:?}"
    );
    assert!(delivery.notes().open().unwrap().is_empty());
}

#[test]
fn only_a_store_that_does_not_tell_is_taken_for_one() {
    let failed = |kind: ErrorKind| if_told::<()>(Err(kind.into()));
    assert!(failed(ErrorKind::Unsupported).unwrap().is_none());
    assert!(failed(ErrorKind::PermissionDenied).unwrap().is_none());
    assert_eq!(
        failed(ErrorKind::Other).unwrap_err().kind(),
        ErrorKind::Other
    );
    assert_eq!(if_told(Ok(3)).unwrap(), Some(3));
}
