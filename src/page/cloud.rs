//! The page of a cloud.

use super::advice::{GIVEN_TWICE, duplicates};
use super::charts::lengths;
use super::report::{bounds, files};
use super::sheet::{Advice, advice, card, lattice, list, sheet, shown, table, view};
use super::words::{
    bytes, clean, count, counted, file_name, length, percent, position, seconds, spread,
};
use crate::info::{Illustration, Info, Percentiles};
use maud::{Markup, html};
use std::path::PathBuf;

/// Names of the classes of LAS 1.4 that are used in practice.
const CLASSES: [&str; 19] = [
    "never classified",
    "unclassified",
    "ground",
    "low vegetation",
    "medium vegetation",
    "high vegetation",
    "building",
    "low point, noise",
    "model key point",
    "water",
    "rail",
    "road",
    "overlap",
    "wire, guard",
    "wire, conductor",
    "transmission tower",
    "wire connector",
    "bridge deck",
    "high noise",
];

/// The description of a cloud as a page; `inputs` are the files or folders as they were given.
#[must_use]
pub fn cloud(inputs: &[PathBuf], info: &Info, illustration: &Illustration) -> String {
    let title = match inputs {
        [one] => file_name(one),
        many => format!("{} files or folders", many.len()),
    };
    let advice_ = words(info);
    let body = html! {
        (cards(info))
        @if !advice_.is_empty() { h2 { "In words" } (advice(&advice_)) }
        (pictures(illustration))
        h2 { "Points" }
        (points(info))
        h2 { "Distributions" }
        div.two {
            @if let Some(spacings) = &illustration.spacings {
                (lengths("Distance to the nearest point", spacings, "Of a sample of the points, in the cloud's unit."))
            }
            @if !illustration.classes.is_empty() { (classes(&illustration.classes)) }
        }
        h2 { "A reconstruction would need" }
        div.panel { (needs(info)) }
    };
    let line = html! { (counted(info.input.files.len() as u64, "file")) ", " (count(info.points)) " distinct points" };
    sheet("Point cloud", &title, &line, &body)
}

fn cards(info: &Info) -> Markup {
    let [low, high] = [info.min, info.max];
    let extent = [0, 1, 2].map(|k| length(high[k] - low[k]));
    let area = (high[0] - low[0]) * (high[1] - low[1]);
    let system = info.input.crs.as_ref();
    html! {
        div.cards {
            (card("Points", &count(info.points), &html! { (count(info.input.read)) " read" }))
            (card("Extent", &html! { (extent[0]) " × " (extent[1]) }, &html! { "height " (extent[2]) }))
            (card("Spacing", &html! { (length(info.spacing.p50)) }, &html! { "median distance to the nearest point" }))
            (card("Noise", &html! { (percent(info.noisy, 1.0)) }, &html! { "of the points are noisy" }))
            (card("Density", &html! { (length(info.points as f64 / area)) }, &html! { "points for a square unit of the box" }))
            (card("Reference system", &html! {
                @match system { Some(crs) => (clean(&crs.label())), None => "none" }
            }, &html! { @if let Some(crs) = system { (clean(&crs.name)) } }))
        }
    }
}

fn words(info: &Info) -> Vec<Advice> {
    let mut all: Vec<Advice> = Vec::new();
    let mut say = |warning, words, remedy: &str| all.push(Advice::new(warning, words, remedy));
    let input = &info.input;
    for warning in &input.warnings {
        say(true, warning.clone(), "");
    }
    if input.dropped_far > 0 {
        let words = format!(
            "{} points are far from all others and were left out.",
            input.dropped_far
        );
        say(
            true,
            words,
            "reconstruct does the same; --keep-far keeps them.",
        );
    }
    if input.dropped_non_finite > 0 {
        let words = format!(
            "{} points have a coordinate that is no number.",
            input.dropped_non_finite
        );
        say(true, words, "");
    }
    if info.duplicates > info.input.kept / 20 {
        let words = duplicates(info.duplicates, info.input.kept);
        say(false, words, GIVEN_TWICE);
    }
    if !info.lattice_exact {
        let words = format!(
            "Positions are rounded to steps of {}: the cloud is wide for its precision.",
            length(info.lattice_step)
        );
        say(false, words, "");
    }
    if input.crs.is_none() {
        let mixed = input.files.iter().any(|file| file.crs.is_some());
        let words = match mixed {
            true => "The files do not all have one reference system.",
            false => "No file names a reference system.",
        };
        let remedy = match mixed {
            true => "reconstruct refuses them, unless --ignore-crs is given.",
            false => "",
        };
        say(mixed, words.to_owned(), remedy);
    }
    all
}

fn pictures(illustration: &Illustration) -> Markup {
    let [low, high] = illustration.heights;
    html! {
        @if !illustration.pictures.is_empty() { h2 { "Pictures" } }
        div.two {
            @for (n, picture) in illustration.pictures.iter().enumerate() {
                (view(picture, &match n {
                    0 => html! { "few" span.ramp {} "up to " (length(illustration.densest)) " points for a square unit" },
                    _ => html! { (length(low)) span.ramp {} (length(high)) },
                }))
            }
        }
    }
}

fn points(info: &Info) -> Markup {
    let input = &info.input;
    let some = |n: u64| (n > 0).then(|| count(n));
    let step = info.lattice_step;
    let rows = [
        ("points read", Some(count(input.read))),
        ("distinct points", Some(count(info.points))),
        ("duplicates", Some(count(info.duplicates))),
        ("no numbers", some(input.dropped_non_finite)),
        ("withheld", some(input.withheld)),
        ("no return", some(input.invalid)),
        ("of other classes", some(input.dropped_by_class)),
        ("far from all others", some(input.dropped_far)),
        (
            "outside the region",
            some(input.dropped_by_crop + input.skipped_by_crop),
        ),
        ("columns", shown(clean(&info.columns()))),
        (
            "reference system",
            Some(html! {
                @match &input.crs { Some(crs) => (clean(&crs.described(|option| format!("--{option}")))), None => "not given" }
            }),
        ),
        ("lowest corner", shown(position(info.min, step))),
        ("highest corner", shown(position(info.max, step))),
        (
            "box of the files",
            bounds(input).and_then(|b| shown(b.map(|p| position(p, step)).join(" to "))),
        ),
        ("lattice", lattice(step, info.lattice_exact)),
    ];
    html! {
        div.two {
            div.panel { (list(&rows)) }
            div.panel { (files(input)) }
        }
    }
}

fn classes(classes: &[(u8, u64)]) -> Markup {
    let all: u64 = classes.iter().map(|class| class.1).sum();
    let name = |class: u8| CLASSES.get(usize::from(class)).copied().unwrap_or("");
    let rows = classes.iter().map(|&(class, points)| {
        vec![
            html! { (class) " " (name(class)) },
            count(points),
            html! { (percent(points as f64, all as f64)) },
        ]
    });
    html! {
        div.panel {
            h3 { "Classes" }
            (table(&["class", "points", "share"], rows))
        }
    }
}

fn needs(info: &Info) -> Markup {
    let about = |size: u64| shown(format!("about {}", bytes(size)));
    let Percentiles { p5, p50, p95 } = info.auto_radius;
    let least = format!("any budget from {}", bytes(info.memory_minimum));
    let time = format!("about {} on this machine", seconds(info.seconds));
    list(&[
        ("memory", shown(least)),
        ("scratch", about(info.scratch_bytes)),
        ("mesh", about(info.output_bytes)),
        ("time", shown(time)),
        ("automatic radius", shown(spread(p5, p50, p95))),
    ])
}
