//! The page of a change.

use super::charts::changes;
use super::comparison::side;
use super::sheet::{card, key, list, sheet, shown, table, view};
use super::words::{count, file_name, length, percent};
use maud::{Markup, html};
use outcrop_inspect::change::{Area, Change, Illustration};

/// Areas of the table; the others are summed up.
const MOST: usize = 20;

/// The page of a comparison of two epochs, as HTML.
#[must_use]
pub fn change(change: &Change, illustration: &Illustration) -> String {
    let (old, new) = (file_name(&change.old.path), file_name(&change.new.path));
    let title = format!("From {old} to {new}");
    let body = html! {
        (cards(change))
        h2 { "Map" }
        div.two {
            @for picture in &illustration.pictures { (view(picture, &scale(illustration.top))) }
        }
        p.note {
            "Only significant changes have a colour; red is growth, blue is loss. The scale ends at the 95th percentile "
            "of the significant changes."
            (key("#9c54c4", "only new")) (key("#349454", "only old"))
        }
        h2 { "Distribution" }
        div.two {
            @if let Some(histogram) = &illustration.changes {
                (changes("Change", histogram, illustration.uncertainty, NOTE))
            }
            div.panel { h3 { "Measurement" } (measurement(change, illustration)) }
        }
        h2 { "Connected areas" }
        div.panel { (areas(change)) }
        h2 { "The two surfaces" }
        div.two {
            div.panel { h3 { "Old" } (side(&change.old)) }
            div.panel { h3 { "New" } (side(&change.new)) }
        }
    };
    let line = html! { "The old surface is " (old) ", the new one is " (new) };
    sheet("Change", &title, &line, &body)
}

const NOTE: &str = "Of the vertices of the new surface. The dashed lines are the median of the uncertainty at 95 %: \
                    what is between them is no more than noise at most places. The first and the last bar have what is beyond.";

fn scale(top: f64) -> Markup {
    let top = length(top);
    html! { "\u{2212}" (top) " " span.ramp.change {} (top) }
}

fn cards(change: &Change) -> Markup {
    let one = |name: &str, value: f64, more: &Markup| card(name, &html! { (length(value)) }, more);
    let share = percent(change.significant_area, change.compared_area);
    html! {
        div.cards {
            (one("Volume gained", change.gained, &html! { "where the change is significant" }))
            (one("Volume lost", change.lost, &html! { "likewise" }))
            (one("Changed area", change.significant_area, &html! { (share) " of what was compared" }))
            (card("Connected areas", &count(change.areas.len() as u64), &html! {
                "and " (count(change.small_vertices)) " vertices in smaller ones"
            }))
            (one("Only new", change.only_new_area, &html! { "area" }))
            @if let Some(area) = change.only_old_area { (one("Only old", area, &html! { "area" })) }
        }
    }
}

fn measurement(change: &Change, illustration: &Illustration) -> Markup {
    list(&[
        ("radius of the cylinder", shown(length(change.radius))),
        ("largest change looked for", shown(length(change.farthest))),
        (
            "error of the registration",
            shown(length(change.registration)),
        ),
        (
            "median uncertainty at 95 %",
            shown(length(illustration.uncertainty)),
        ),
        ("vertices compared", Some(count(change.compared))),
        ("of them significant", Some(count(change.significant))),
        ("area compared", shown(length(change.compared_area))),
    ])
}

fn areas(change: &Change) -> Markup {
    let all = &change.areas;
    let row = |area: &Area| {
        let largest = area.largest.map_or("only new".to_owned(), length);
        let place = area.largest_at.map(|x| format!("{x:.2}")).join("  ");
        let numbers = [area.area, area.gained, area.lost].map(length);
        let mut row = vec![html! { (place) }];
        row.extend(numbers.map(|number| html! { (number) }));
        row.push(html! { (largest) });
        row.push(count(area.vertices));
        row
    };
    let head = [
        "where",
        "area",
        "gained",
        "lost",
        "largest change",
        "vertices",
    ];
    html! {
        (table(&head, all.iter().take(MOST).map(row)))
        p.note {
            "Vertices that changed in the same direction and are joined by edges, the largest volume first; the place is "
            "that of the largest change. "
            @if all.len() > MOST { (count((all.len() - MOST) as u64)) " more are not listed. " }
            "Areas of fewer than 30 vertices have together an area of " (length(change.small_area))
            ", gained " (length(change.small_gained)) " and lost " (length(change.small_lost))
            ". Lengths in the files' unit, areas and volumes in its square and cube."
        }
    }
}
