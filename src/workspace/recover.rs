//! Recovery: all parts of files that are still needed are read and checked, and damaged ones are made again,
//! with as little work as possible.

use super::history::{History, Needed, Remedy};
use super::journal::Entry;
use super::open::open_existing;
use super::progress::{Cancel, Observer};
use crate::error::Result;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Bytes checked at a time.
const CHUNK: usize = 1 << 20;

/// The name of the mesh file in the journal; it is not in the scratch folder.
pub const OUTPUT: &str = "output";

/// An empty part of the output which records that the mesh is complete and may be renamed.
pub const RENAMED: u32 = u32::MAX - 1;

/// Paths of the files; of the output its temporary name and its final one.
#[derive(Debug)]
pub struct Whereabouts<'a> {
    pub folder: &'a Path,
    pub output: &'a [PathBuf; 2],
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

/// The parts that do not match the journal.
fn damaged(
    parts: Vec<Needed>,
    places: &Whereabouts<'_>,
    observer: &dyn Observer,
    cancel: &Cancel,
) -> Result<Vec<Needed>> {
    let mut by_file: BTreeMap<String, Vec<Needed>> = BTreeMap::new();
    for part in parts {
        // A name with a path in it was not written by this program.
        if !part.file.contains('/') {
            by_file.entry(part.file.clone()).or_default().push(part);
        }
    }
    let sizes = by_file.values().flatten().map(|p| p.place.bytes as u64);
    observer.begin("check", "bytes", sizes.fold(0, u64::saturating_add));
    let mut all = Vec::new();
    for (name, parts) in by_file {
        let paths = if name == OUTPUT {
            places.output.to_vec()
        } else {
            vec![places.folder.join(&name)]
        };
        let check = |path: &PathBuf| -> Result<Vec<Needed>> {
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
            Ok(bad.into_iter().flatten().collect())
        };
        let renamed = name == OUTPUT && parts.iter().any(|part| part.section == RENAMED);
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

/// The entries of a journal that stay valid, and their end, given the surviving files.
pub fn recover(
    entries: &[Entry],
    end: u64,
    places: &Whereabouts<'_>,
    observer: &dyn Observer,
    cancel: &Cancel,
) -> Result<(History, u64)> {
    let mut history = History::of(entries);
    let bad = damaged(history.needed(), places, observer, cancel)?;
    let names: BTreeSet<&str> = bad.iter().map(|part| part.file.as_str()).collect();
    let names = names.into_iter().collect::<Vec<_>>().join(", ");
    // A journal with parts before any stage was not written by this program and is ignored.
    let first = || Remedy::Rewind {
        end: entries.get(1).map_or(end, |entry| entry.offset),
        stage: None,
    };
    let remedy = history
        .remedy(&bad)
        .or_else(|| (!bad.is_empty()).then(first));
    match remedy {
        None => Ok((history, end)),
        Some(Remedy::Redo(units)) => {
            observer.warn(&format!(
                "{}: damaged: {names}; {} unit(s) of work are done again",
                places.folder.display(),
                units.len()
            ));
            history.forget(&units);
            Ok((history, end))
        }
        Some(Remedy::Rewind { end, stage }) => {
            let stage = stage
                .as_deref()
                .unwrap_or("the run")
                .trim_start_matches('/');
            observer.warn(&format!(
                "{}: damaged: {names}; what it was made from is gone, so the run goes back to the \
                 beginning of {stage}",
                places.folder.display(),
            ));
            let kept: Vec<Entry> = entries
                .iter()
                .filter(|entry| entry.offset < end)
                .cloned()
                .collect();
            Ok((History::of(&kept), end))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::journal::Record;
    use super::super::place::{Place, Put};
    use super::super::progress::Silent;
    use super::*;

    /// Found by fuzzing: parts before any stage were accepted, and memory was allocated by their sizes.
    #[test]
    fn damage_before_any_stage_leaves_nothing_that_counts() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a"), "0123").unwrap();
        let put = Put {
            file: "a".into(),
            section: 0,
            place: Place {
                offset: 0,
                bytes: 1 << 40,
                records: 1 << 38,
                crc: 0,
            },
        };
        let unit = Record::Unit {
            step: "/step".into(),
            unit: 0,
            puts: vec![put],
            payload: Vec::new(),
        };
        let gone = Record::Deleted("b".into());
        let records = [Record::Manifest(Vec::new()), unit, gone];
        let entries = records.into_iter().zip(0..);
        let entries: Vec<Entry> = entries
            .map(|(record, offset)| Entry {
                offset,
                payload: (offset, 0),
                record,
            })
            .collect();
        let places = Whereabouts {
            folder: folder.path(),
            output: &Default::default(),
        };
        let (history, end) = recover(&entries, 3, &places, &Silent, &Cancel::new()).unwrap();
        assert!(history.places("a").is_empty() && history.units("/step").is_empty());
        assert_eq!(end, 1);
    }

    #[test]
    fn a_part_beyond_the_end_of_all_files_is_damaged() {
        let file = tempfile::tempfile().unwrap();
        file.write_all_at(b"0123456789", 0).unwrap();
        let part = |offset, bytes| Needed {
            file: "a".into(),
            section: 0,
            place: Place {
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
