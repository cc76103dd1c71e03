//! The page of a check.

use super::sheet::{Advice, advice, card, key, list, sheet, shown, table, view};
use super::words::{clean, count, file_name, path, position};
use maud::{Markup, html};
use outcrop_inspect::verify::{Illustration, Place, Verdict};
use std::path::Path;

/// Most places in the table.
const PLACES: usize = 100;

/// The verdict on a mesh as a page.
#[must_use]
pub fn verdict(mesh: &Path, verdict: &Verdict, illustration: &Illustration) -> String {
    let title = file_name(mesh);
    let words = words(verdict);
    let defects = verdict.defects().map(|(name, number)| {
        let class = if number > 0 { "bad" } else { "good" };
        vec![
            html! { (name) },
            html! { span class=(class) { (count(number)) } },
        ]
    });
    let body = html! {
        (cards(verdict))
        @if !words.is_empty() { h2 { "In words" } (advice(&words)) }
        h2 { "Findings" }
        div.two {
            div.panel { (table(&["defect", "count"], defects)) }
            div.panel { (counts(mesh, verdict)) }
        }
        h2 { "Pictures" }
        @if let Some(reason) = &illustration.reason {
            p { "The mesh cannot be drawn: " (clean(reason)) "." }
        }
        div.two {
            @for picture in &illustration.pictures {
                (view(picture, &html! {
                    (key("#ece0ce", "front")) (key("#5c84e8", "back"))
                    @if !illustration.places.is_empty() { (key("#e100e1", "defects, also hidden ones")) }
                }))
            }
        }
        @if !illustration.places.is_empty() { (places(&illustration.places)) }
    };
    let line = html! { "Is it a manifold? " @if verdict.manifold { "Yes." } @else { "No." } };
    sheet("Check of a mesh", &title, &line, &body)
}

fn cards(verdict: &Verdict) -> Markup {
    let defects: u64 = verdict.defects().iter().map(|defect| defect.1).sum();
    let answer = match verdict.manifold {
        true => html! { span.good { "manifold" } },
        false => html! { span.bad { "no manifold" } },
    };
    let nothing = html! {};
    html! {
        div.cards {
            (card("Verdict", &answer, &html! { (count(defects)) " defects" }))
            (card("Triangles", &count(verdict.triangles), &html! { (count(verdict.vertices)) " vertices" }))
            (card("Boundary edges", &count(verdict.boundary_edges), &html! { "in " (count(verdict.boundary_loops)) " loops" }))
            (card("Components", &count(verdict.components), &nothing))
            (card("Genus", &html! { @match verdict.genus { Some(genus) => (genus), None => "–" } }, &nothing))
        }
    }
}

fn words(verdict: &Verdict) -> Vec<Advice> {
    let all = [
        (
            verdict.index_out_of_range,
            "triangles name a vertex that does not exist.",
            "The file is damaged, or was cut off.",
        ),
        (
            verdict.degenerate_triangles,
            "triangles have the same vertex twice.",
            "Remove them: they have no area.",
        ),
        (
            verdict.repeated_triangles,
            "triangles are there twice.",
            "Remove the copies.",
        ),
        (
            verdict.non_manifold_edges,
            "edges have more than two triangles.",
            "Such edges have no inside and outside; split or remove triangles there.",
        ),
        (
            verdict.inconsistent_edges,
            "edges have triangles that run in the same direction.",
            "Turn triangles so that neighbours face the same side.",
        ),
        (
            verdict.pinched_vertices,
            "vertices have several fans of triangles.",
            "Copy such a vertex for each fan.",
        ),
        (
            verdict.non_finite_vertices,
            "vertices have a coordinate that is no number.",
            "The file is damaged.",
        ),
    ];
    let rest = [
        (
            !verdict.unreferenced_allowed,
            verdict.unreferenced_vertices,
            "vertices have no triangle.",
            "--allow-unreferenced accepts them.",
        ),
        (
            false,
            verdict.zero_area_triangles,
            "triangles have no area. It is not a defect.",
            "",
        ),
    ];
    let all = all.map(|(count, what, remedy)| (true, count, what, remedy));
    let found = all.into_iter().chain(rest).filter(|one| one.1 > 0);
    found
        .map(|(warning, count, what, remedy)| {
            Advice::new(warning, format!("{count} {what}"), remedy)
        })
        .collect()
}

fn counts(mesh: &Path, verdict: &Verdict) -> Markup {
    let corner = |p: [f64; 3]| html! { (position(p, 1e-6)) };
    list(&[
        ("file", shown(path(mesh))),
        ("vertices", Some(count(verdict.vertices))),
        ("triangles", Some(count(verdict.triangles))),
        ("edges", Some(count(verdict.edges))),
        ("boundary edges", Some(count(verdict.boundary_edges))),
        ("boundary loops", Some(count(verdict.boundary_loops))),
        ("components", Some(count(verdict.components))),
        ("Euler characteristic", shown(verdict.euler_characteristic)),
        ("genus", verdict.genus.and_then(shown)),
        (
            "triangles without area",
            Some(count(verdict.zero_area_triangles)),
        ),
        ("lowest corner", verdict.bounds.map(|b| corner(b.min))),
        ("highest corner", verdict.bounds.map(|b| corner(b.max))),
        ("origin", verdict.origin.map(corner)),
    ])
}

fn places(all: &[Place]) -> Markup {
    let rows = all.iter().take(PLACES).map(|place| {
        vec![
            html! { (place.kind.name()) },
            html! { (place.vertex) },
            html! { (position(place.position, 1e-6)) },
        ]
    });
    html! {
        h2 { "Places of defects" }
        div.panel {
            (table(&["defect", "vertex", "position"], rows))
            p.note {
                "Of each kind at most 256 places are marked"
                @if all.len() > PLACES { ", and the first " (PLACES) " are in this table" }
                ": those with the lowest vertices."
            }
        }
    }
}
