//! What the journals of a folder say.

use super::super::history::History;
use super::super::journal::{self, Record};
use super::super::listing::listing;
use crate::error::Result;
use std::path::Path;

/// The ends of the journals, and the numbers of records before them.
pub(super) struct Ends {
    pub(super) program: (u64, u64),
    /// By worker; none if the file is no journal.
    pub(super) workers: Vec<(u32, Option<(u64, u64)>)>,
}

/// The history in the journals of a folder before time `until`.
pub(super) fn read_history(path: &Path, until: u64) -> Result<(History, Ends)> {
    let mut history = History::default();
    let mut add = |entry: &journal::Entry<'_>, until: u64| {
        let valid = entry.at < until;
        if valid {
            history.add(entry);
        }
        valid
    };
    let program = journal::read(&path.join(journal::NAME), None, |entry| add(entry, until))?
        .unwrap_or_default();
    // A worker cannot have seen more records than there are.
    let until = until.min(2 * program.1 + 1);
    let mut ends = Vec::new();
    for worker in workers(path)? {
        let unit = |entry: &journal::Entry<'_>| matches!(entry.record, Record::Unit { .. });
        let each = |entry: &journal::Entry<'_>| unit(entry) && add(entry, until);
        let journal = journal::path_of(path, Some(worker));
        ends.push((worker, journal::read(&journal, Some(worker), each)?));
    }
    let workers = ends;
    Ok((history, Ends { program, workers }))
}

/// The numbers of the workers that have journals in a folder, ascending.
pub(super) fn workers(path: &Path) -> Result<Vec<u32>> {
    let mut all: Vec<u32> = listing(path)?
        .iter()
        .filter_map(|n| journal::worker(n))
        .collect();
    all.sort_unstable();
    Ok(all)
}
