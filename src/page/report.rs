//! The page of a run.

use super::advice;
use super::charts::{Line, course, lengths, sizes};
use super::sheet::{advice as words_of, card, key, lattice, list, sheet, shown, table, view};
use super::words::{
    bytes, clean, count, counted, file_name, length, path, percent, position, seconds, spread,
};
use crate::report::{Details, IngestStats, Picture, Report, Sample};
use maud::{Markup, html};
use std::path::Path;

/// Most input files in the table; the JSON report has all.
const FILES: usize = 40;

/// The report of a run as a page; `mesh` is the path of its mesh. It has pictures and distributions if the run was
/// built with [`Builder::pictures`](crate::Builder::pictures).
#[must_use]
pub fn report(report: &Report, mesh: &Path) -> String {
    let title = file_name(mesh);
    let advice = advice::of_report(report);
    let body = html! {
        (cards(report))
        @if !advice.is_empty() { h2 { "In words" } (words_of(&advice)) }
        @if !report.pictures.is_empty() { h2 { "Pictures" } (pictures(&report.pictures)) }
        h2 { "What went in" }
        (input(report))
        h2 { "What came out" }
        (output(report, mesh))
        @if let Some(details) = &report.details { (distributions(details)) }
        h2 { "Time" }
        (stages(report))
        @if let Some(details) = &report.details { (over_time(report, details)) }
        h2 { "Memory" }
        (memory(report))
        h2 { "Settings" }
        (settings(report))
    };
    let line = html! {
        "Surface reconstruction of " (counted(report.input.files.len() as u64, "file"))
        " by outcrop " (report.version)
    };
    sheet("Reconstruction report", &title, &line, &body)
}

fn cards(report: &Report) -> Markup {
    let mesh = &report.mesh;
    let repair = &report.repair;
    let pieces = repair
        .components_found
        .saturating_sub(repair.components_removed);
    let loops = report.details.as_ref().and_then(|d| d.loops.as_ref());
    let memory = html! { "of " (bytes(report.memory_budget)) ", " (counted(report.threads as u64, "thread")) };
    html! {
        div.cards {
            (card("Points read", &count(report.input.read), &html! { (count(report.points)) " distinct used" }))
            (card("Triangles", &count(mesh.triangles), &html! { (count(mesh.vertices)) " vertices" }))
            (card("Boundary edges", &count(mesh.boundary_edges), &html! {
                @if let Some(loops) = loops { "in " (counted(loops.count, "loop")) }
            }))
            (card("Components", &count(pieces), &html! { (count(repair.components_removed)) " small ones removed" }))
            (card("Time", &html! { (seconds(report.seconds)) }, &html! {
                @if report.seconds > 0.0 { (count((report.points as f64 / report.seconds) as u64)) " points/s" }
            }))
            (card("Memory", &html! { (bytes(report.peak_resident_bytes)) }, &memory))
        }
    }
}

fn pictures(all: &[Picture]) -> Markup {
    let surface = html! {
        (key("#ece0ce", "front")) (key("#5c84e8", "back")) (key("#e11414", "boundary"))
    };
    let map = html! {
        "from above: " (key("#b0b2b6", "all points are vertices")) (key("#de5c00", "none is"))
        ". Small pieces that were removed are here."
    };
    let caption = |picture: &Picture| match picture.name.starts_with("Points") {
        true => map.clone(),
        false => surface.clone(),
    };
    html! {
        div.two {
            @for picture in all { (view(picture, &caption(picture))) }
        }
    }
}

/// The box around all files.
pub(super) fn bounds(input: &IngestStats) -> Option<[[f64; 3]; 2]> {
    let files = input.files.iter();
    let boxes = files.filter_map(|file| Some([file.min?, file.max?]));
    boxes.reduce(|[a, b], [c, d]| {
        let each = |k: usize| [a[k].min(c[k]), b[k].max(d[k])];
        [[0, 1, 2].map(|k| each(k)[0]), [0, 1, 2].map(|k| each(k)[1])]
    })
}

/// The table of the files.
pub(super) fn files(input: &IngestStats) -> Markup {
    let files = input.files.iter().take(FILES).map(|file| {
        vec![
            html! { (path(&file.path)) },
            html! { (file.format.to_string()) },
            html! { (bytes(file.bytes)) },
            count(file.points),
            count(file.kept),
        ]
    });
    let more = input.files.len().saturating_sub(FILES) as u64;
    html! {
        (table(&["file", "format", "size", "points", "kept"], files))
        @if more > 0 { p.note { "and " (counted(more, "more file")) ", in the JSON report" } }
    }
}

fn input(report: &Report) -> Markup {
    let input = &report.input;
    let some = |n: u64| (n > 0).then(|| count(n));
    let corner = |p| shown(position(p, report.lattice.step));
    let extent = bounds(&report.input);
    let size = extent.map(|[low, high]| [0, 1, 2].map(|k| length(high[k] - low[k])).join(" × "));
    let all: u64 = input.files.iter().map(|file| file.bytes).sum();
    let spacing = report.details.as_ref().and_then(|d| d.spacings.as_ref());
    let rows = [
        ("points read", Some(count(input.read))),
        ("points kept", Some(count(input.kept))),
        ("size of the files", shown(bytes(all))),
        ("no numbers", some(input.dropped_non_finite)),
        ("withheld", some(input.withheld)),
        ("no return", some(input.invalid)),
        ("of other classes", some(input.dropped_by_class)),
        (
            "outside the region",
            some(input.dropped_by_crop + input.skipped_by_crop),
        ),
        ("far from all others", some(input.dropped_far)),
        ("duplicates", Some(count(report.duplicates_folded))),
        ("left out by thinning", some(report.thin.dropped)),
        ("outliers dropped", some(report.outliers.dropped)),
        ("distinct points used", Some(count(report.points))),
        (
            "reference system",
            Some(html! {
                @match &input.crs { Some(crs) => (clean(&crs.line())), None => "not given" }
            }),
        ),
        (
            "lowest corner",
            extent.and_then(|[low, _]| corner(low)),
        ),
        (
            "highest corner",
            extent.and_then(|[_, high]| corner(high)),
        ),
        ("extent", size.and_then(shown)),
        (
            "local spacing",
            spacing.and_then(|s| shown(spread(s.p5, s.p50, s.p95))),
        ),
        ("lattice", lattice(report.lattice.step, report.lattice.exact)),
        ("scanners", some(report.scanners.len() as u64)),
        (
            "normals",
            report.normals.as_ref().map(|normals| {
                html! {
                    (clean(&normals.input.to_string())) "; used for " (count(normals.disks.used)) " disks, "
                    (count(normals.disks.disagreeing)) " disagree with the points"
                }
            }),
        ),
    ];
    html! {
        div.two {
            div.panel { (list(&rows)) }
            div.panel { (files(input)) }
        }
    }
}

fn output(report: &Report, mesh: &Path) -> Markup {
    let (stats, repair) = (&report.mesh, &report.repair);
    let (origin, step) = (report.origin, report.lattice.step);
    let some = |n: u64| (n > 0).then(|| count(n));
    let loops = report.details.as_ref().and_then(|d| d.loops.as_ref());
    let rows = [
        ("file", shown(path(mesh))),
        ("vertices", Some(count(stats.vertices))),
        ("triangles", Some(count(stats.triangles))),
        ("boundary edges", Some(count(stats.boundary_edges))),
        ("boundary loops", loops.map(|loops| count(loops.count))),
        (
            "points that are vertices",
            Some(html! {
                (count(stats.points_used)) " (" (percent(stats.points_used as f64, report.points as f64)) ")"
            }),
        ),
        (
            "copies of pinched vertices",
            Some(count(stats.pinched_copies)),
        ),
        ("meshes", some(report.cut.squares)),
        (
            "triangles outside the region",
            some(report.cut.triangles_outside),
        ),
        (
            "coordinates",
            shown(format!("{:?}", report.coordinates).to_lowercase()),
        ),
        (
            "origin",
            origin.map(|origin| position(origin, step)).and_then(shown),
        ),
    ];
    let steps = [
        ("components found", repair.components_found),
        ("small components removed", repair.components_removed),
        ("their triangles", repair.component_triangles_removed),
        ("bridges removed", repair.bridges_removed),
        ("gaps of one triangle closed", repair.gaps_closed),
        ("boundary loops found", repair.holes_found),
        ("holes filled", repair.holes_filled),
        ("triangles that fill holes", repair.hole_triangles),
        ("loops closed where torn", repair.holes_clipped),
        ("outlines left open", repair.holes_outline),
        ("too long, left open", repair.holes_too_long),
        ("not filled cleanly, left open", repair.holes_not_filled),
        ("points off the surface", report.cells.off_surface),
    ];
    let steps = steps.map(|(name, n)| vec![html! { (name) }, count(n)]);
    html! {
        div.two {
            div.panel { (list(&rows)) }
            div.panel { (table(&["repair", "count"], steps)) }
        }
    }
}

fn distributions(details: &Details) -> Markup {
    html! {
        h2 { "Distributions" }
        div.two {
            @if let Some(edges) = &details.edges {
                (lengths("Edge lengths", edges, "Each bar is a range of lengths, in the cloud's unit; ranges widen with the length."))
            }
            @if let Some(spacings) = &details.spacings {
                (lengths("Local spacing", spacings, "Of patches of 256 points that follow each other on the curve."))
            }
            @if let Some(loops) = &details.loops {
                (sizes("Boundary loops by number of edges", loops, "Holes and outlines of the finished mesh; loops that meet at a vertex count as one."))
            } @else if details.many_loops {
                div.panel { h3 { "Boundary loops" } p.note { "There are too many boundary edges to count their loops." } }
            }
            @if let Some(components) = &details.components {
                (sizes("Components by number of triangles", components, "Of the finished mesh, without triangles that fill holes."))
            }
        }
    }
}

fn stages(report: &Report) -> Markup {
    let longest = report.stages.iter().map(|s| s.seconds).fold(0.0, f64::max);
    let all: f64 = report.stages.iter().map(|s| s.seconds).sum();
    html! {
        div.panel {
            table {
                thead {
                    tr {
                        th scope="col" { "stage" }
                        th scope="col" { "" }
                        th.n scope="col" { "seconds" }
                        th.n scope="col" { "share" }
                        th.n scope="col" { "read" }
                        th.n scope="col" { "written" }
                        th.n scope="col" { "scratch" }
                        th.n scope="col" { "memory" }
                    }
                }
                tbody {
                    @for stage in &report.stages {
                        tr {
                            td { (stage.name) }
                            td.bar { span.fill style=(format!("width:{:.1}%", 100.0 * stage.seconds / longest.max(1e-9))) {} }
                            td.n { (format!("{:.2}", stage.seconds)) }
                            td.n { (percent(stage.seconds, all)) }
                            td.n { (bytes(stage.bytes_read)) }
                            td.n { (bytes(stage.bytes_written)) }
                            td.n { (bytes(stage.scratch_bytes)) }
                            td.n { (bytes(stage.held_bytes)) }
                        }
                    }
                }
            }
            p.note { "Scratch and memory are peaks during the stage. In all " (seconds(report.seconds)) "." }
        }
    }
}

fn over_time(report: &Report, details: &Details) -> Markup {
    if details.course.len() < 2 {
        return html! { p.note { "The course of memory and disk is not known: tasks shared the run." } };
    }
    let line = |name, class, of: fn(&Sample) -> u64| Line {
        name,
        class,
        at: details.course.iter().map(|s| (s.seconds, of(s))).collect(),
    };
    let stages: Vec<_> = details
        .begun
        .iter()
        .map(|s| (s.name.clone(), s.seconds))
        .collect();
    let memory = [
        line("resident memory", "l1", |s| s.resident),
        line("memory held by name", "l2", |s| s.held),
    ];
    let disk = [line("scratch files", "l3", |s| s.scratch)];
    html! {
        h2 { "Memory and disk over time" }
        (course("Memory", &memory, &stages, Some(report.memory_budget)))
        p {}
        (course("Scratch disk", &disk, &stages, None))
        p.note { "Of this attempt, if the run was resumed." }
    }
}

fn memory(report: &Report) -> Markup {
    let rows = [
        ("budget", report.memory_budget),
        ("peak resident", report.peak_resident_bytes),
        ("peak held", report.peak_held_bytes),
        ("peak reserved", report.peak_reserved_bytes),
        ("peak of scratch files", report.peak_scratch_bytes),
        ("estimated scratch", report.estimated_scratch_bytes),
    ];
    let rows = rows.map(|(name, size)| (name, shown(bytes(size))));
    let held = report.held_at_peak.iter();
    let held = held.map(|(name, size)| vec![html! { (name) }, html! { (bytes(*size)) }]);
    html! {
        div.two {
            div.panel { (list(&rows)) }
            div.panel { (table(&["held at the peak", "size"], held)) }
        }
    }
}

/// All parameters, as they are in the JSON report.
fn settings(report: &Report) -> Markup {
    let all = serde_json::to_value(&report.parameters).unwrap_or_default();
    let text = |value: &serde_json::Value| match value {
        serde_json::Value::String(text) => clean(text),
        serde_json::Value::Null => "not given".to_owned(),
        other => clean(&other.to_string()),
    };
    let short = |text: String| match text.char_indices().nth(300) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    };
    let rows = all.as_object().into_iter().flatten();
    let rows: Vec<_> = rows
        .map(|(name, value)| (name.replace('_', "-"), short(text(value))))
        .collect();
    html! {
        div.panel {
            table {
                tbody {
                    @for (name, value) in &rows { tr { th scope="row" { (name) } td { (value) } } }
                    tr { th scope="row" { "disk radius" } td {
                        @match report.radius { Some(radius) => (length(radius)), None => "follows the density" }
                    } }
                }
            }
        }
    }
}
