//! Lines of a table in Markdown.

use crate::measures::Measures;

/// The head of a table of meshes.
#[must_use]
pub fn head() -> String {
    let columns = [
        "program",
        "F",
        "acc",
        "com",
        "spurious %",
        "complete %",
        "sided %",
        "angle",
        "bent %",
        "wrong %",
        "b",
        "c",
        "χ",
        "triangles",
    ];
    let rule = columns.iter().skip(1).map(|_| "--:|");
    format!(
        "| {} |\n|---|{}",
        columns.join(" | "),
        rule.collect::<String>()
    )
}

/// The row of a mesh: percentiles as 50 / 90 / 99 / 99.9.
#[must_use]
pub fn row(name: &str, m: &Measures) -> String {
    let four = |p: &[f64; 4]| p.map(|x| format!("{x:.2}")).join(" / ");
    let percent = |share: f64| format!("{:.2}", 100.0 * share);
    let cells = [
        name.to_owned(),
        format!("{:.4}", m.f),
        four(&m.accuracy),
        four(&m.completeness),
        format!("{:.3}", 100.0 * m.spurious),
        percent(m.complete),
        percent(m.sided),
        format!("{:.1}", m.angle),
        format!("{:.1}", 100.0 * m.bent),
        percent(m.wrong),
        m.boundary.to_string(),
        m.components.to_string(),
        m.euler.to_string(),
        m.triangles.to_string(),
    ];
    format!("| {} |", cells.join(" | "))
}
