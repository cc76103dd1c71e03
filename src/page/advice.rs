//! Warnings of a report in words, each with its remedy.

use super::sheet::Advice;
use super::words::percent;
use crate::report::Report;

/// Share of the points above which it is worth a word that they are not in the mesh.
const MANY_LEFT: f64 = 0.05;

/// Share of duplicates that is worth a word.
const MANY_DUPLICATES: f64 = 0.05;

pub const GIVEN_TWICE: &str = "Were files, or overlapping flight lines, given twice?";

/// That points have the position of another one.
pub fn duplicates(number: u64, kept: u64) -> String {
    let share = percent(number as f64, kept as f64);
    format!("{number} points ({share}) have the position of another one.")
}

/// Warnings of the run, and what follows from its counts.
pub fn of_report(report: &Report) -> Vec<Advice> {
    let warning = |words: &String| Advice::new(true, words.clone(), "");
    let mut all: Vec<Advice> = report.warnings.iter().map(warning).collect();
    let mut note = |warning, words, remedy: &str| all.push(Advice::new(warning, words, remedy));
    let share = |part: u64, whole: u64| part as f64 / whole.max(1) as f64;
    let (points, mesh, repair) = (report.points, &report.mesh, &report.repair);
    let unused = points.saturating_sub(mesh.points_used);
    if report.cut.squares == 0 && share(unused, points) > MANY_LEFT {
        let words = format!(
            "{unused} points ({}) are not in the mesh: they are in small pieces that were removed, off the surface, \
             or where cells did not agree.",
            percent(unused as f64, points as f64)
        );
        note(
            share(unused, points) > 4.0 * MANY_LEFT,
            words,
            "Noisy scans: try --smooth 1. Thin parts, such as wires and twigs: --keep-all and a smaller \
             --min-component.",
        );
    }
    if repair.components_removed > 0 {
        let words = format!(
            "{} small pieces with {} triangles in all were removed.",
            repair.components_removed, repair.component_triangles_removed
        );
        note(false, words, "A smaller --min-component keeps them.");
    }
    if repair.holes_not_filled > 0 {
        let words = format!(
            "{} holes were left open because they could not be filled cleanly.",
            repair.holes_not_filled
        );
        note(false, words, "--max-hole-edges 0 leaves all holes open.");
    }
    if repair.holes_too_long > 0 {
        let words = format!("{} holes are too long to be filled.", repair.holes_too_long);
        note(false, words, "A larger --max-hole-edges fills longer ones.");
    }
    if share(report.duplicates_folded, report.input.kept) > MANY_DUPLICATES {
        let words = duplicates(report.duplicates_folded, report.input.kept);
        note(false, words, GIVEN_TWICE);
    }
    if report.input.crs.is_none() {
        let mixed = report.input.files.iter().any(|file| file.crs.is_some());
        let words = match mixed {
            true => "The files do not all have one reference system, so the mesh names none.",
            false => "No file names a reference system, so the mesh names none.",
        };
        note(mixed, words.to_owned(), "");
    }
    if report.peak_resident_bytes > report.memory_budget {
        let words = format!(
            "The process took more memory than its budget: {} of {}.",
            super::words::bytes(report.peak_resident_bytes),
            super::words::bytes(report.memory_budget)
        );
        note(
            true,
            words,
            "Please report this with the JSON report of the run.",
        );
    }
    all
}
