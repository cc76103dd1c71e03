//! Charts as inline SVG.

use super::words::{bytes, count, length, seconds, spread};
use maud::{Markup, html};
use outcrop_draw::histogram::{Bin, Histogram};

/// Width of charts in a column, in units of the drawing.
const WIDTH: f64 = 460.0;
const HEIGHT: f64 = 170.0;
const BOTTOM: f64 = 20.0;
const TOP: f64 = 14.0;

/// A distribution of lengths: bars of equal width, since bins widen with the length.
pub fn lengths(name: &str, histogram: &Histogram, note: &str) -> Markup {
    let label = |bin: &Bin| format!("{} to {}", length(bin.from), length(bin.to));
    let bins = histogram.bins.len();
    let ticks = (0..=4).map(|n| n * bins / 4);
    let edge = |n: usize| match histogram.bins.get(n) {
        Some(bin) => bin.from,
        None => histogram.bins.last().map_or(0.0, |bin| bin.to),
    };
    let ticks: Vec<_> = ticks
        .map(|n| (n as f64 / bins as f64, length(edge(n))))
        .collect();
    let line = html! {
        (spread(histogram.p5, histogram.p50, histogram.p95)) ", longest " (length(histogram.max))
    };
    chart(name, histogram, &label, (&ticks, &[]), &line, note)
}

/// A distribution of changes, growth to the right, with the limits of what is no more than noise.
pub fn changes(name: &str, histogram: &Histogram, limit: f64, note: &str) -> Markup {
    let label = |bin: &Bin| format!("{} to {}", length(bin.from), length(bin.to));
    let end = histogram.bins.last().map_or(1.0, |bin| bin.to);
    let place = |change: f64| (change / end + 1.0) / 2.0;
    let tick = |share: f64| (place(share * end), length(share * end));
    let ticks = [-1.0, -0.5, 0.0, 0.5, 1.0].map(tick);
    let limits = [-limit, limit].map(place);
    let line = html! {
        (spread(histogram.p5, histogram.p50, histogram.p95)) ", from " (length(histogram.min)) " to "
        (length(histogram.max))
    };
    chart(name, histogram, &label, (&ticks, &limits), &line, note)
}

/// A distribution of numbers by powers of two.
pub fn sizes(name: &str, histogram: &Histogram, note: &str) -> Markup {
    let label = |bin: &Bin| match (bin.from, bin.to - 1.0) {
        (from, to) if from >= to => format!("{from}"),
        (from, to) => format!("{from} to {to}"),
    };
    let bins = histogram.bins.len() as f64;
    let short = |bin: &Bin| match bin.from {
        from if from >= 1e6 => format!("{}M", (from / 1e6).round()),
        from if from >= 1e4 => format!("{}k", (from / 1e3).round()),
        from => from.to_string(),
    };
    let every = histogram.bins.len().div_ceil(12);
    let some = histogram.bins.iter().enumerate().step_by(every.max(1));
    let ticks: Vec<_> = some
        .map(|(n, bin)| ((n as f64 + 0.5) / bins, short(bin)))
        .collect();
    let line = html! { (count(histogram.count)) " in all, largest " (count(histogram.max as u64)) };
    chart(name, histogram, &label, (&ticks, &[]), &line, note)
}

/// A chart with texts of bars, and ticks and limits at shares of the width.
fn chart(
    name: &str,
    histogram: &Histogram,
    label: &dyn Fn(&Bin) -> String,
    (ticks, limits): (&[(f64, String)], &[f64]),
    line: &Markup,
    note: &str,
) -> Markup {
    let most = histogram
        .bins
        .iter()
        .map(|bin| bin.count)
        .max()
        .unwrap_or(0)
        .max(1);
    let wide = WIDTH / histogram.bins.len().max(1) as f64;
    let room = HEIGHT - BOTTOM - TOP;
    let floor = HEIGHT - BOTTOM;
    let tall = |bin: &Bin| {
        let tall = room * bin.count as f64 / most as f64;
        if bin.count > 0 { tall.max(0.8) } else { 0.0 }
    };
    html! {
        figure.panel {
            h3 { (name) }
            svg viewBox=(format!("0 0 {WIDTH} {HEIGHT}")) role="img" aria-label=(name) {
                @for (n, bin) in histogram.bins.iter().enumerate() {
                    rect.bar x=(num(n as f64 * wide + 0.5)) y=(num(floor - tall(bin)))
                        width=(num((wide - 1.0).max(0.5))) height=(num(tall(bin))) {
                        title { (label(bin)) ": " (bin.count) }
                    }
                }
                @for x in limits.iter().map(|share| num(share * WIDTH)) {
                    line.limit x1=(x) x2=(x) y1=(TOP) y2=(floor) {}
                }
                line.axis x1="0" x2=(WIDTH) y1=(floor) y2=(floor) {}
                text x="0" y="10" { "up to " (most) " in a bar" }
                @for (at, text) in ticks {
                    text x=(num(at * WIDTH)) y=(num(HEIGHT - 5.0)) text-anchor=(anchor(*at)) { (text) }
                }
            }
            p.note { (line) "." @if !note.is_empty() { " " (note) } }
            details {
                summary { "Numbers" }
                table {
                    tbody {
                        @for bin in histogram.bins.iter().filter(|bin| bin.count > 0) {
                            tr { td { (label(bin)) } td.n { (bin.count) } }
                        }
                    }
                }
            }
        }
    }
}

fn anchor(at: f64) -> &'static str {
    match at {
        x if x < 0.03 => "start",
        x if x > 0.97 => "end",
        _ => "middle",
    }
}

/// A coordinate of a drawing.
fn num(x: f64) -> String {
    format!("{x:.2}")
}

/// A line of a chart over time.
pub struct Line<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its class: `l1`, `l2` or `l3`.
    pub class: &'static str,
    /// Seconds and bytes.
    pub at: Vec<(f64, u64)>,
}

/// A chart of bytes over time, with the stages as bands, and a limit.
pub fn course(
    name: &str,
    lines: &[Line<'_>],
    stages: &[(String, f64)],
    limit: Option<u64>,
) -> Markup {
    const WIDE: f64 = 1040.0;
    const TALL: f64 = 210.0;
    let (floor, top) = (TALL - BOTTOM, 30.0);
    let last = |line: &Line<'_>| line.at.last().map_or(0.0, |at| at.0);
    let end = lines.iter().map(last).fold(0.001, f64::max);
    let values = lines.iter().flat_map(|line| &line.at).map(|at| at.1);
    let most = values.chain(limit).max().unwrap_or(0).max(1);
    let x = |seconds: f64| WIDE * (seconds / end).clamp(0.0, 1.0);
    let y = |bytes: u64| floor - (floor - top) * bytes as f64 / most as f64;
    let points = |line: &Line<'_>| {
        let points = line
            .at
            .iter()
            .map(|(s, b)| format!("{},{}", num(x(*s)), num(y(*b))));
        points.collect::<Vec<_>>().join(" ")
    };
    let ends = stages.iter().skip(1).map(|stage| stage.1).chain([end]);
    let bands: Vec<_> = stages.iter().zip(ends).collect();
    html! {
        figure.panel {
            h3 { (name) }
            svg viewBox=(format!("0 0 {WIDE} {TALL}")) role="img" aria-label=(name) {
                @for (n, ((stage, from), to)) in bands.iter().enumerate() {
                    @if n % 2 == 0 {
                        rect.band x=(num(x(*from))) width=(num(x(*to) - x(*from))) y=(top - 4.0) height=(floor - top + 4.0) {}
                    }
                    @if x(*to) - x(*from) > 6.2 * stage.len() as f64 {
                        text x=(num(x((from + to) / 2.0))) y=(top - 9.0) text-anchor="middle" { (stage) }
                    }
                }
                @if let Some(limit) = limit {
                    line.limit x1="0" x2=(WIDE) y1=(num(y(limit))) y2=(num(y(limit))) {}
                    text x=(WIDE - 2.0) y=(num(y(limit) + 12.0)) text-anchor="end" { "budget " (bytes(limit)) }
                }
                @for line in lines {
                    polyline class=(line.class) points=(points(line)) {}
                }
                line.axis x1="0" x2=(WIDE) y1=(floor) y2=(floor) {}
                text x="0" y=(TALL - 5.0) { "0" }
                text x=(WIDE / 2.0) y=(TALL - 5.0) text-anchor="middle" { (seconds(end / 2.0)) }
                text x=(WIDE) y=(TALL - 5.0) text-anchor="end" { (seconds(end)) }
                text x="0" y="10" { "top: " (bytes(most)) }
            }
            p.note {
                @for (n, line) in lines.iter().enumerate() {
                    @if n > 0 { " · " }
                    span style=(format!("color:var(--{})", ["accent", "second", "third"][usize::from(line.class.as_bytes()[1] - b'1') % 3])) { "▬ " }
                    (line.name) ", most " (bytes(line.at.iter().map(|at| at.1).max().unwrap_or(0)))
                }
            }
        }
    }
}
