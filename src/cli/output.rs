//! Output of the commands: text, JSON, reports.

use super::new_file::is_page;
use super::{pages, style};
use crate::deliver::put_text;
use crate::params::Smooth;
use crate::report::Report;
use outcrop_disk::error::{Error, Result, Setting};
use outcrop_points::is_remote;
use serde::Serialize;
use std::fmt::Display;
use std::io::Write;
use std::path::Path;

/// An error with what helps, options as on the command line.
pub fn told(error: &Error) -> String {
    error.told(spelled)
}

/// An option as on the command line.
pub fn spelled(setting: &Setting) -> String {
    match setting {
        Setting::Option(name) | Setting::Flag(name) => dashed(name),
        Setting::Value(name, value) => format!("{} {value}", dashed(name)),
    }
}

/// The option of this name; a name of something else as it is.
fn dashed(name: &str) -> String {
    let is_option = name.bytes().all(|c| c.is_ascii_lowercase() || c == b'_');
    match is_option {
        true => format!("--{}", name.replace('_', "-")),
        false => name.to_owned(),
    }
}

pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{text}").map_err(|e| Error::io("standard output", "write", e))
}

pub fn json<T: Serialize>(value: &T) -> Result<String> {
    serde_json::to_string_pretty(value)
        .map_err(|e| Error::io("standard output", "write JSON", e.into()))
}

/// Prints a value as JSON or as text.
pub fn show<T: Serialize + Display>(value: &T, as_json: bool) -> Result<()> {
    show_told(value, as_json, T::to_string)
}

/// Prints a value as JSON or as this text.
pub fn show_told<T: Serialize>(
    value: &T,
    as_json: bool,
    text: impl Fn(&T) -> String,
) -> Result<()> {
    print(&if as_json { json(value)? } else { text(value) })
}

/// The report of a run, whose mesh is `mesh`, in the format that its name says.
pub fn report_text(path: &Path, report: &Report, mesh: &Path) -> Result<String> {
    match is_page(path) {
        true => pages::report(report, mesh),
        false => Ok(json(report)? + "\n"),
    }
}

/// Writes the report of a run.
pub fn write_report(path: &Path, report: &Report, mesh: &Path) -> Result<()> {
    let text = report_text(path, report, mesh)?;
    if is_remote(path) {
        return put_text(path, &text);
    }
    std::fs::write(path, text).map_err(|e| Error::io(path, "write the report", e))
}

pub fn summary(report: &Report, output: &Path) -> String {
    let mesh = &report.mesh;
    format!(
        "{}: {} triangles, {} vertices from {} points; {}, {} boundary edges\n\
         {} in all, at most {} of memory and {} of scratch",
        output.display(),
        style::grouped(mesh.triangles),
        style::grouped(mesh.vertices),
        style::grouped(report.points),
        style::counted(
            report.repair.components_found - report.repair.components_removed,
            "component"
        ),
        style::grouped(mesh.boundary_edges),
        style::seconds(report.seconds),
        style::bytes(report.peak_resident_bytes),
        style::bytes(report.peak_scratch_bytes),
    ) + &simplified(report)
        + &closed(report)
        + &smoothed(report)
        + &left_out(report)
}

/// Lines about the mesh with fewer triangles, if it was asked for.
fn simplified(report: &Report) -> String {
    let made = report.simplified.as_ref();
    made.map_or_else(String::new, |made| format!("\nsimplified: {made}"))
}

/// Lines about the closing of the mesh, if it was closed.
fn closed(report: &Report) -> String {
    let closed = report.closed.as_ref();
    closed.map_or_else(String::new, |closed| format!("\n{closed}"))
}

/// A line about the points that were smoothed because they are noisy, if there are any.
fn smoothed(report: &Report) -> String {
    let Some(relax) = report.relax.filter(|relax| relax.moved > 0) else {
        return String::new();
    };
    let lengths = [relax.median, relax.most, relax.largest].map(|length| format!("{length:.2e}"));
    let [median, most, largest] = lengths.map(|length| length.parse().unwrap_or(0.0f64));
    let what = match report.parameters.smooth {
        Smooth::Auto => "smoothed",
        Smooth::Rounds(_) => "smoothed to connect them, and kept where they were",
    };
    format!(
        "\n{} noisy points {what}: moved by {median} (median), {most} (99 %), at most {largest}; {} are clean",
        style::grouped(relax.moved),
        style::grouped(report.points.saturating_sub(relax.moved)),
    )
}

/// A line about the points left out by options, if there are any.
fn left_out(report: &Report) -> String {
    let reasons: Vec<String> = [
        (report.input.dropped_by_class, "of other classes"),
        (report.input.dropped_far, "far from all others"),
        (report.thin.dropped, "by thinning"),
        (report.outliers.dropped, "outliers"),
    ]
    .iter()
    .filter(|(count, _)| *count > 0)
    .map(|(count, why)| format!("{} {why}", style::grouped(*count)))
    .collect();
    if reasons.is_empty() {
        return String::new();
    }
    format!("\npoints left out: {}", reasons.join(", "))
}
