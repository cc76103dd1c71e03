//! The outcomes in `docs/formats.md`, checked for each kind of file.

mod archives;
mod compressed;
pub mod e57;
mod kinds;
mod las;
mod off;
pub mod pcd;
mod ply;
pub mod ptx;
mod text;
mod zoo;

use crate::ingest::bench::Bench;
use crate::skip::if_present;
use kinds::{KINDS, Kind};
use std::collections::BTreeSet;
use std::path::Path;
use zoo::ZOO;

const PAGE: &str = include_str!("../../../../docs/formats.md");

/// A row of a table: kind of file, outcome, message.
struct Row {
    kind: &'static str,
    outcome: &'static str,
    said: &'static str,
}

/// The rows of the tables of kinds of files; the page has other tables too.
fn rows() -> Vec<Row> {
    let cells = |line: &'static str| -> Vec<&'static str> {
        line.trim_matches('|').split(" |").map(str::trim).collect()
    };
    let tables = PAGE.split("| kind of file |").skip(1);
    let rows = tables.flat_map(|table| {
        table
            .lines()
            .skip(2)
            .take_while(|line| line.starts_with('|'))
    });
    rows.map(cells)
        .map(|cells| {
            assert_eq!(cells.len(), 3, "{cells:?}");
            Row {
                kind: cells[0],
                outcome: cells[1],
                said: cells[2].trim_matches('`'),
            }
        })
        .collect()
}

/// True if `text` contains the parts of `pattern` between `…` in this order.
fn has(text: &str, pattern: &str) -> bool {
    let mut rest = text;
    pattern.split('…').all(|part| match rest.find(part) {
        Some(at) => {
            rest = &rest[at + part.len()..];
            true
        }
        None => false,
    })
}

/// The difference between the outcome of a file and its row; none if they agree.
fn check(bench: &Bench, row: &Row, path: &Path) -> Option<String> {
    let outcome = bench.read(&[path.to_path_buf()]);
    let (outcome, said) = match outcome {
        Ok(spool) if spool.stats().warnings.is_empty() => ("read", String::new()),
        Ok(spool) => ("warning", spool.stats().warnings.join("\n")),
        Err(error) => ("refused", outcrop::cli::told(&error)),
    };
    let right = outcome == row.outcome && said.lines().count() <= 1 && has(&said, row.said);
    (!right).then(|| format!("{} ({}): {outcome} {said}", path.display(), row.kind))
}

#[test]
fn the_page_says_what_becomes_of_every_kind_of_file() {
    let rows = rows();
    let named: BTreeSet<&str> = rows.iter().map(|row| row.kind).collect();
    let made: BTreeSet<&str> = KINDS.iter().map(|(kind, _)| *kind).collect();
    assert_eq!(named.len(), rows.len(), "a kind is there twice");
    assert_eq!(named, made, "the page, and the kinds that are made here");
    let mut wrong = Vec::new();
    for row in &rows {
        let kind = KINDS.iter().find(|(kind, _)| *kind == row.kind);
        let make: &Kind = &kind.unwrap().1;
        let bench = Bench::new();
        let files = make(&bench);
        assert!(!files.is_empty());
        wrong.extend(files.iter().filter_map(|path| check(&bench, row, path)));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Files of other programs, if their folder exists, have the outcomes of their rows.
#[test]
fn files_of_other_programs_are_as_the_page_says() {
    let Some(zoo) = if_present("../shared/data/zoo") else {
        return;
    };
    let rows = rows();
    let bench = Bench::new();
    let mut wrong = Vec::new();
    for (kind, files) in ZOO {
        let row = rows.iter().find(|row| row.kind == *kind);
        let row = row.unwrap_or_else(|| panic!("no row {kind}"));
        for file in *files {
            wrong.extend(check(&bench, row, &zoo.join(file)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
