//! Notes about uploads, in a file of their own: an upload that nobody completes costs money until it is given up, so
//! that its name must outlive the journal of a run that is begun anew.
//!
//! A note stands before the request that begins an upload, one after it. If the process ends between them, the uploads
//! of this file that the store has, without those that it had before, are the ones to give up.

use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::open::options;
use serde::{Deserialize, Serialize};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// A note; `file` is the name of the file below the place of the output.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Note {
    /// An upload is about to begin.
    Begin {
        file: String,
        /// The uploads of the file that others have begun; none if the store does not tell.
        others: Option<Vec<String>>,
        /// The tag of the file of this name that was there before.
        before: Option<String>,
    },
    /// It has begun.
    Begun { file: String, upload: String },
    /// The file is whole.
    Whole { file: String },
    /// The upload is given up, or the store has forgotten it.
    Gone { file: String },
}

/// The state of the upload of one file, from its notes.
#[derive(Debug, Clone, Default)]
pub(super) struct State {
    /// An upload has begun perhaps: those that others had begun before, if the store told them.
    pub begin: Option<Option<Vec<String>>>,
    /// An upload that is open.
    pub upload: Option<String>,
    /// How many uploads have begun.
    pub count: usize,
    pub before: Option<String>,
    pub whole: bool,
}

impl State {
    fn after(mut self, note: Note) -> Self {
        match note {
            Note::Begin { others, before, .. } => {
                self.begin = Some(others);
                self.before = before;
            }
            Note::Begun { upload, .. } => {
                self.begin = None;
                self.upload = Some(upload);
                self.count += 1;
            }
            Note::Whole { .. } => {
                self.upload = None;
                self.whole = true;
            }
            Note::Gone { .. } => {
                self.begin = None;
                self.upload = None;
            }
        }
        self
    }

    /// True if there is something to give up.
    pub fn is_open(&self) -> bool {
        self.begin.is_some() || self.upload.is_some()
    }
}

/// The file with the notes.
#[derive(Debug)]
pub(super) struct Notes(PathBuf);

impl Notes {
    pub fn of(folder: &Path) -> Self {
        Self(folder.join("uploads"))
    }

    /// Adds a note; it is on the disk when this returns.
    pub fn add(&self, note: &Note) -> Result<()> {
        let write = || {
            let text = serde_json::to_string(note)?;
            let mut file = options().create(true).append(true).open(&self.0)?;
            // A line that was broken off ends before this one.
            file.write_all(format!("\n{text}").as_bytes())?;
            file.sync_data()
        };
        write().map_err(|e| Error::io(&self.0, "write", e))
    }

    fn all(&self) -> Result<Vec<Note>> {
        match std::fs::read_to_string(&self.0) {
            Ok(text) => Ok(text
                .lines()
                .filter_map(|line| serde_json::from_str(line).ok())
                .collect()),
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(Vec::new()),
            Err(e) => Err(Error::io(&self.0, "read the notes about uploads", e)),
        }
    }

    /// The state of a file, from the notes about it.
    pub fn state(&self, file: &str) -> Result<State> {
        let notes = self.all()?.into_iter().filter(|note| note.file() == file);
        Ok(notes.fold(State::default(), State::after))
    }

    /// The files of which an upload may be open.
    pub fn open(&self) -> Result<Vec<(String, State)>> {
        let mut files: Vec<String> = self.all()?.iter().map(|n| n.file().to_owned()).collect();
        files.sort();
        files.dedup();
        let mut open = Vec::new();
        for file in files {
            let state = self.state(&file)?;
            if state.is_open() {
                open.push((file, state));
            }
        }
        Ok(open)
    }
}

impl Note {
    fn file(&self) -> &str {
        match self {
            Self::Begin { file, .. }
            | Self::Begun { file, .. }
            | Self::Whole { file }
            | Self::Gone { file } => file,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_tell_what_is_open_and_a_broken_line_is_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let notes = Notes::of(folder.path());
        let file = || "a.ply".to_owned();
        let begin = Note::Begin {
            file: file(),
            others: Some(vec!["theirs".into()]),
            before: None,
        };
        assert!(!notes.state("a.ply").unwrap().is_open());
        notes.add(&begin).unwrap();
        let state = notes.state("a.ply").unwrap();
        assert_eq!(state.begin.unwrap().unwrap(), ["theirs"]);
        let mut file_of = options().append(true).open(&notes.0).unwrap();
        file_of.write_all(b"\n{\"begun\":{\"fi").unwrap();
        let upload = "ours".to_owned();
        notes
            .add(&Note::Begun {
                file: file(),
                upload,
            })
            .unwrap();
        let open = notes.open().unwrap();
        assert_eq!(open[0].1.upload.as_deref(), Some("ours"));
        notes.add(&Note::Gone { file: file() }).unwrap();
        assert!(notes.open().unwrap().is_empty());
        assert_eq!(notes.state("a.ply").unwrap().count, 1);
        notes.add(&Note::Whole { file: file() }).unwrap();
        assert!(notes.state("a.ply").unwrap().whole);
    }
}
