//! Measurements as text and as Markdown.

use crate::Result;
use crate::measure::Measurement;
use std::fmt::Write as _;
use std::path::PathBuf;

const MIB: f64 = (1u64 << 20) as f64;

/// One measurement, for a terminal.
pub fn text(m: &Measurement) -> String {
    let mut out = String::new();
    let mut line = |text: String| {
        out.push_str(&text);
        out.push('\n');
    };
    let millions = m.points as f64 / 1e6;
    line(format!(
        "{}: {millions:.3} M points, {} threads, budget {:.0} MiB, {} ({} cores)",
        m.cloud,
        m.threads,
        m.memory_budget as f64 / MIB,
        m.machine.model,
        m.machine.cores,
    ));
    let per_point = m.k_seconds / millions;
    line(format!(
        "K          {:9.3} s  ({per_point:.2} us a point)",
        m.k_seconds
    ));
    let per_point = m.pipeline_seconds / millions;
    line(format!(
        "outcrop    {:9.3} s  ({per_point:.2} us a point)",
        m.pipeline_seconds
    ));
    line(format!(
        "ratio      {:9.2} K  ({:.2} by processor time, {:.0} % of the threads used, {} pairs)",
        m.ratio,
        m.cpu_ratio,
        100.0 * m.utilisation,
        m.pairs.len(),
    ));
    line(format!(
        "neighbours {:9.2} K  (its own 30-NN search alone)",
        m.neighbors_ratio
    ));
    line(format!(
        "resident   {:9.0} MiB at peak",
        m.peak_resident_bytes as f64 / MIB
    ));
    let scratch = m.peak_scratch_bytes as f64 / m.points as f64;
    line(format!("scratch    {scratch:9.1} bytes a point at peak"));
    line(format!(
        "{:10} {:>9} {:>7} {:>9} {:>9}",
        "stage", "s", "K", "MiB read", "written"
    ));
    for s in &m.stages {
        let share = s.seconds / m.k_seconds;
        let (read, written) = (s.bytes_read as f64 / MIB, s.bytes_written as f64 / MIB);
        line(format!(
            "{:10} {:9.3} {share:7.3} {read:9.0} {written:9.0}",
            s.name, s.seconds
        ));
    }
    out
}

/// Prints several measurements as Markdown.
pub fn table(files: &[PathBuf]) -> Result<()> {
    let mut all = Vec::with_capacity(files.len());
    for path in files {
        let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let measured =
            serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
        all.push(measured);
    }
    print!("{}", markdown(&all)?);
    Ok(())
}

fn markdown(all: &[Measurement]) -> Result<String> {
    let mut out = String::new();
    writeln!(
        out,
        "| cloud | points | threads | budget | K | outcrop | ratio | 30-NN alone | by CPU | used | peak resident \
         | scratch |"
    )?;
    writeln!(out, "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|")?;
    for m in all {
        writeln!(
            out,
            "| {} | {:.2} M | {} | {:.0} MiB | {:.2} s | {:.2} s | **{:.2} K** | {:.2} K | {:.2} K | {:.0} % \
             | {:.0} MiB | {:.0} B/pt |",
            m.cloud,
            m.points as f64 / 1e6,
            m.threads,
            m.memory_budget as f64 / MIB,
            m.k_seconds,
            m.pipeline_seconds,
            m.ratio,
            m.neighbors_ratio,
            m.cpu_ratio,
            100.0 * m.utilisation,
            m.peak_resident_bytes as f64 / MIB,
            m.peak_scratch_bytes as f64 / m.points as f64,
        )?;
    }
    // Seconds of each stage; stages of one name, such as several rounds of smoothing, are added.
    let mut names: Vec<&str> = Vec::new();
    for stage in all.iter().flat_map(|m| &m.stages) {
        if !names.contains(&stage.name.as_str()) {
            names.push(&stage.name);
        }
    }
    writeln!(out, "\n| seconds in | threads | {} |", names.join(" | "))?;
    writeln!(out, "|---|--:|{}", "--:|".repeat(names.len()))?;
    for m in all {
        write!(
            out,
            "| {}, {:.2} M | {} |",
            m.cloud,
            m.points as f64 / 1e6,
            m.threads
        )?;
        for name in &names {
            let mine = m.stages.iter().filter(|s| s.name == *name);
            write!(out, " {:.2} |", mine.map(|s| s.seconds).sum::<f64>())?;
        }
        writeln!(out)?;
    }
    Ok(out)
}
