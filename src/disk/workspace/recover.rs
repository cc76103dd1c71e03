//! Recovery: all parts of files that are still needed are read and checked, and damaged ones are made again,
//! with as little work as possible.

use super::away::Away;
use super::history::{History, Needed, Remedy};
use super::names::{OUTPUT, square_path, temporary};
use super::open::open_existing;
use super::progress::{Cancel, Observer};
use crate::error::{Error, Result};
use outcrop_platform::FileAt;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Bytes checked at a time.
const CHUNK: usize = 1 << 20;

/// True for the name of a mesh in the journal.
fn is_output(file: &str) -> bool {
    let rest = file.strip_prefix(OUTPUT);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(':'))
}

/// An empty part of the output which records that the mesh is complete and may be renamed.
pub const RENAMED: u32 = u32::MAX - 1;

/// Paths of the files; of the output its temporary name and its final one.
#[derive(Debug)]
pub struct Whereabouts<'a> {
    pub folder: &'a Path,
    pub output: &'a [PathBuf; 2],
    /// The store that has the other files, if no folder is shared.
    pub away: Option<&'a Away>,
}

/// True if the part matches the journal.
fn is_whole(file: &File, part: &Needed) -> bool {
    let mut crc = crc32fast::Hasher::new();
    let mut buffer = vec![0; part.place.bytes.min(CHUNK)];
    let mut at = part.place.offset;
    let mut left = part.place.bytes;
    if part.place.end().is_none() {
        return false;
    }
    while left > 0 {
        let now = &mut buffer[..left.min(CHUNK)];
        if file.read_exact_at(now, at).is_err() {
            return false;
        }
        crc.update(now);
        at += now.len() as u64;
        left -= now.len();
    }
    crc.finalize() == part.place.crc
}

/// True if a file is not there, or ends too early.
fn is_lost(error: &std::io::Error) -> bool {
    use std::io::ErrorKind::{NotFound, UnexpectedEof};
    matches!(error.kind(), NotFound | UnexpectedEof)
}

/// The name of the file on disk that has the part.
fn segment(part: &Needed) -> String {
    match part.file.as_str() {
        file if is_output(file) => file.to_owned(),
        file => format!("{file}.{}", part.place.segment),
    }
}

/// The parts that do not match the journals.
fn damaged(
    parts: Vec<Needed>,
    places: &Whereabouts<'_>,
    observer: &dyn Observer,
    cancel: &Cancel,
) -> Result<Vec<Needed>> {
    let mut by_file: BTreeMap<String, Vec<Needed>> = BTreeMap::new();
    for part in parts {
        // A name with a path in it was not written by this program. An empty part has no bytes to check.
        if !part.file.contains('/') && (part.place.bytes > 0 || is_output(&part.file)) {
            by_file.entry(segment(&part)).or_default().push(part);
        }
    }
    let sizes = by_file.values().flatten().map(|p| p.place.bytes as u64);
    observer.begin("check", "bytes", sizes.fold(0, u64::saturating_add));
    let mut all = Vec::new();
    for (name, parts) in by_file {
        let paths = if name == OUTPUT {
            places.output.to_vec()
        } else if let Some(square) = name.strip_prefix(OUTPUT).filter(|_| is_output(&name)) {
            let path = square_path(&places.output[1], square.trim_start_matches(':'));
            vec![temporary(&path), path]
        } else {
            vec![places.folder.join(&name)]
        };
        let check = |path: &PathBuf| -> Result<Vec<Needed>> {
            if let Some(away) = places.away.filter(|_| !is_output(&name)) {
                let ends = parts.iter().map(|part| part.place.end().unwrap_or(0));
                match away.bring(path, ends.max().unwrap_or(0)) {
                    Err(e) if !is_lost(&e) => return Err(Error::io(path, "fetch", e)),
                    // What is not there is found to be missing.
                    _ => {}
                }
            }
            let Ok(file) = open_existing(path) else {
                return Ok(parts.clone());
            };
            let bad = parts.par_iter().map(|part| {
                cancel.check()?;
                let whole = is_whole(&file, part);
                observer.advance(part.place.bytes as u64);
                Ok((!whole).then(|| part.clone()))
            });
            let bad = bad.collect::<Result<Vec<_>>>()?;
            if let Some(away) = places.away {
                away.forget(path);
            }
            Ok(bad.into_iter().flatten().collect())
        };
        let renamed = is_output(&name) && parts.iter().any(|part| part.section == RENAMED);
        let mut bad = check(&paths[0])?;
        // A file with the final name may be the output of another run.
        if !bad.is_empty() && renamed && check(&paths[1])?.is_empty() {
            bad.clear();
        }
        all.extend(bad);
    }
    observer.end();
    Ok(all)
}

/// Checks the surviving files. Units that are to be done again are forgotten; returns the time from which on
/// all records are to be dropped, if this does not suffice.
pub fn recover(
    history: &mut History,
    places: &Whereabouts<'_>,
    observer: &dyn Observer,
    cancel: &Cancel,
) -> Result<Option<u64>> {
    let bad = damaged(history.needed(), places, observer, cancel)?;
    let names: BTreeSet<String> = bad.iter().map(segment).collect();
    let names = match names.len() {
        0 => super::journal::NAME.to_owned(),
        _ => names.into_iter().collect::<Vec<_>>().join(", "),
    };
    // Journals with parts before any stage were not written by this program: all but the manifest is dropped.
    let first = || Remedy::Rewind {
        end: 2,
        stage: None,
    };
    let remedy = history
        .remedy(&bad)
        .or_else(|| (!bad.is_empty()).then(first));
    let folder = places.folder.display();
    match remedy {
        None => Ok(None),
        Some(Remedy::Redo(units)) => {
            observer.warn(&format!(
                "{folder}: damaged: {names}; {} unit(s) of work, or more, are done again",
                units.len()
            ));
            history.forget(&units);
            Ok(None)
        }
        Some(Remedy::Rewind { end, stage }) => {
            let stage = stage
                .as_deref()
                .unwrap_or("the run")
                .trim_start_matches('/');
            observer.warn(&format!(
                "{folder}: damaged: {names}; what it was made from is gone, so the run goes back to the \
                 beginning of {stage}",
            ));
            Ok(Some(end))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::journal::{Entry, Record};
    use super::super::place::{Place, Put};
    use super::super::progress::Silent;
    use super::*;

    /// Found by fuzzing: parts before any stage were accepted, and memory was allocated by their sizes.
    #[test]
    fn damage_before_any_stage_leaves_nothing_that_counts() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.0"), "0123").unwrap();
        let put = Put {
            file: "a".into(),
            section: 0,
            place: Place {
                segment: 0,
                offset: 0,
                bytes: 1 << 40,
                records: 1 << 38,
                crc: 0,
            },
        };
        let unit = Record::Unit {
            step: "/step".into(),
            unit: 0,
            after: 1,
            puts: vec![put],
            payload: Vec::new(),
        };
        let gone = Record::Deleted("b".into());
        let records = [Record::Manifest(Vec::new()), unit, gone];
        let mut history = History::default();
        for (record, offset) in records.iter().zip(0..) {
            history.add(&Entry {
                at: 2 * offset + 1,
                offset,
                payload: (None, offset, 0),
                record,
            });
        }
        let places = Whereabouts {
            folder: folder.path(),
            output: &Default::default(),
            away: None,
        };
        let end = recover(&mut history, &places, &Silent, &Cancel::new()).unwrap();
        assert_eq!(end, Some(2));
    }

    #[test]
    fn a_part_beyond_the_end_of_all_files_is_damaged() {
        let file = tempfile::tempfile().unwrap();
        file.write_all_at(b"0123456789", 0).unwrap();
        let part = |offset, bytes| Needed {
            file: "a".into(),
            section: 0,
            place: Place {
                segment: 0,
                offset,
                bytes,
                records: 0,
                crc: crc32fast::hash(b"234"),
            },
        };
        assert!(is_whole(&file, &part(2, 3)));
        for (offset, bytes) in [
            (2, 4),
            (9, 3),
            (u64::MAX, 3),
            (2, usize::MAX),
            (u64::MAX, usize::MAX),
        ] {
            assert!(!is_whole(&file, &part(offset, bytes)), "{offset} {bytes}");
        }
    }
}
