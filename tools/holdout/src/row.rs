//! A line of a Markdown table from the output files of one run.

use crate::error::{Error, Result};
use crate::measure::HeldOut;
use clap::Args;
use serde_json::Value;
use std::path::{Path, PathBuf};

const COLUMNS: [&str; 12] = [
    "scan",
    "options",
    "points",
    "points used",
    "holes before filling",
    "holes left",
    "boundary edges left",
    "components",
    "held-out 50 %",
    "90 %",
    "99 %",
    "seconds",
];

/// `holdout row`
#[derive(Debug, Args)]
pub(crate) struct Row {
    /// Print the head of the table instead
    #[arg(long, conflicts_with_all = ["scan", "report", "verdict", "held_out"])]
    head: bool,
    /// Name of the scan
    #[arg(long, value_name = "NAME", required_unless_present = "head")]
    scan: Option<String>,
    /// Options of the run, for the table
    #[arg(
        long,
        value_name = "TEXT",
        default_value = "",
        allow_hyphen_values = true
    )]
    options: String,
    /// Instead of all files: the reason why the run failed
    #[arg(long, value_name = "TEXT", conflicts_with_all = ["report", "verdict", "held_out"])]
    failed: Option<String>,
    /// The file of `outcrop reconstruct --report`
    #[arg(long, value_name = "FILE", required_unless_present_any = ["head", "failed"])]
    report: Option<PathBuf>,
    /// The output of `outcrop verify --json`
    #[arg(long, value_name = "FILE", required_unless_present_any = ["head", "failed"])]
    verdict: Option<PathBuf>,
    /// The output of `holdout measure --json`
    #[arg(long, value_name = "FILE", required_unless_present_any = ["head", "failed"])]
    held_out: Option<PathBuf>,
}

/// The row.
pub(crate) fn run(args: &Row) -> Result<String> {
    if args.head {
        let line = |cells: Vec<&str>| format!("| {} |", cells.join(" | "));
        let rule = COLUMNS.map(|_| "---").to_vec();
        return Ok(format!("{}\n{}", line(COLUMNS.to_vec()), line(rule)));
    }
    let scan = args.scan.as_deref().unwrap_or_default();
    let options = match args.options.trim() {
        "" => "default".to_owned(),
        some => format!("`{some}`"),
    };
    let mut cells = vec![clean(scan), clean(&options)];
    if let Some(why) = &args.failed {
        cells.push(clean(why));
        cells.resize(COLUMNS.len(), String::new());
    } else if let (Some(report), Some(verdict), Some(held)) =
        (&args.report, &args.verdict, &args.held_out)
    {
        cells.extend(numbers(report, verdict, held)?);
    }
    Ok(format!("| {} |", cells.join(" | ")))
}

/// Text without characters that end a cell or a row.
fn clean(text: &str) -> String {
    text.replace('|', "\\|").replace(['\n', '\r'], " ")
}

fn numbers(report: &Path, verdict: &Path, held: &Path) -> Result<Vec<String>> {
    let (report_path, report) = (report, json(report)?);
    let (verdict_path, verdict) = (verdict, json(verdict)?);
    let found: HeldOut = serde_json::from_value(json(held)?)
        .map_err(|e| Error::input(held, format!("not from `holdout measure`: {e}")))?;
    let count = |path: &Path, value: &Value, key: &str| {
        let place = format!("/{}", key.replace('.', "/"));
        let number = value.pointer(&place).and_then(Value::as_u64);
        number.ok_or_else(|| Error::input(path, format!("no number {key}")))
    };
    let of_report = |key| count(report_path, &report, key).map(grouped);
    let of_verdict = |key| count(verdict_path, &verdict, key).map(grouped);
    let seconds = report["seconds"].as_f64();
    let seconds = seconds.ok_or_else(|| Error::input(report_path, "no number seconds"))?;
    Ok(vec![
        of_report("points")?,
        of_report("mesh.points_used")?,
        of_report("repair.holes_found")?,
        of_report("holes_left")?,
        of_verdict("boundary_edges")?,
        of_verdict("components")?,
        format!("{:.3}", found.error.p50),
        format!("{:.3}", found.error.p90),
        format!("{:.3}", found.error.p99),
        format!("{seconds:.1}"),
    ])
}

fn json(path: &Path) -> Result<Value> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, "read", e))?;
    serde_json::from_str(&text).map_err(|e| Error::input(path, format!("not JSON: {e}")))
}

/// 12345678 as `12 345 678`.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}
