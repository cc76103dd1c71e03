//! The page of a comparison.

use super::charts::lengths;
use super::sheet::{card, list, sheet, shown, table, view};
use super::words::{count, file_name, length, path};
use maud::{Markup, html};
use outcrop_inspect::compare::{Comparison, Distances, Illustration, Kind, Side};

/// Distances between two shapes as a page.
#[must_use]
pub fn comparison(comparison: &Comparison, illustration: &Illustration) -> String {
    let (a, b) = (&comparison.a, &comparison.b);
    let title = format!("{} and {}", file_name(&a.path), file_name(&b.path));
    let names = ["Distances from A to B", "Distances from B to A"];
    let body = html! {
        (cards(comparison))
        h2 { "Distances" }
        div.panel { (distances(comparison)) }
        h2 { "Pictures" }
        div.two {
            @for picture in &illustration.pictures {
                (view(picture, &html! { "0" span.ramp {} (length(illustration.top)) " and more" }))
            }
        }
        p.note {
            "Each sample has the colour of its distance from the other side. The scale ends at the 99th percentile of "
            "both directions."
        }
        h2 { "Distributions" }
        div.two {
            @for (name, histogram) in names.iter().zip(&illustration.distances) {
                @if let Some(histogram) = histogram {
                    (lengths(name, histogram, "Of all samples, those at vertices included."))
                }
            }
        }
        h2 { "The two sides" }
        div.two {
            div.panel { h3 { "A" } (side(a)) }
            div.panel { h3 { "B" } (side(b)) }
        }
    };
    let line = html! { "A is " (file_name(&a.path)) ", B is " (file_name(&b.path)) };
    sheet("Comparison", &title, &line, &body)
}

fn cards(comparison: &Comparison) -> Markup {
    let both = &comparison.symmetric;
    let one = |name: &str, value: f64, percent: Option<f64>| {
        card(
            name,
            &html! { (length(value)) },
            &html! {
                @if let Some(percent) = percent { (length(percent)) " % of the diagonal" }
            },
        )
    };
    let (f, p) = (&both.figures, both.percent);
    html! {
        div.cards {
            (one("Median", f.p50, p.map(|p| p.p50)))
            (one("Mean", f.mean, p.map(|p| p.mean)))
            (one("RMS", f.rms, p.map(|p| p.rms)))
            (one("99 %", f.p99, p.map(|p| p.p99)))
            (one("Largest", f.max, p.map(|p| p.max)))
        }
    }
}

fn distances(comparison: &Comparison) -> Markup {
    let ways = [
        &comparison.a_to_b,
        &comparison.b_to_a,
        &comparison.symmetric,
    ];
    let named = ways.map(|way| way.figures.named());
    let percent = ways.map(|way| way.percent.map(|percent| percent.named()));
    let cells = |of: &dyn Fn(&Distances) -> Markup| ways.map(of);
    let mut rows = Vec::new();
    for (n, (name, _)) in named[0].iter().enumerate() {
        let mut row = vec![html! { (name) }];
        row.extend((0..3).map(|way| {
            html! {
                (length(named[way][n].1))
                @if let Some(percent) = &percent[way] { "  (" (length(percent[n].1)) " %)" }
            }
        }));
        rows.push(row);
    }
    let mut add = |name: &str, cells: [Markup; 3]| {
        let mut row = vec![html! { (name) }];
        row.extend(cells);
        rows.push(row);
    };
    add("samples", cells(&|way| count(way.samples)));
    add("of them vertices", cells(&|way| count(way.vertex_samples)));
    add(
        "largest at",
        cells(&|way| html! { (way.max_at.map(length).join("  ")) }),
    );
    html! {
        (table(&["", "A to B", "B to A", "both"], rows))
        p.note {
            "Lengths in the files' unit; in brackets in per cent of the diagonal of A's box, " (length(comparison.diagonal))
            ". Vertices of a mesh count in the largest distance alone. Seed " (comparison.seed)
            ", at most " (count(comparison.most_samples)) " samples of a side."
        }
    }
}

/// A table about one side.
pub(super) fn side(side: &Side) -> Markup {
    let mesh = side.kind == Kind::Mesh;
    list(&[
        ("file", shown(path(&side.path))),
        ("kind", shown(if mesh { "mesh" } else { "cloud" })),
        (
            if mesh { "vertices" } else { "distinct points" },
            Some(count(side.points)),
        ),
        ("triangles", mesh.then(|| count(side.triangles))),
        ("area", mesh.then(|| html! { (length(side.area)) })),
        ("lowest corner", shown(side.min.map(length).join("  "))),
        ("highest corner", shown(side.max.map(length).join("  "))),
    ])
}
