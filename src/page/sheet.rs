//! The kit of all pages: the sheet, tables, cards and pictures.

use super::words::{clean, length};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, Render, html};
use outcrop_draw::picture::Picture;

const STYLE: &str = include_str!("style.css");

/// A whole page as HTML, which needs nothing from anywhere else, and has no script: its kind, such as
/// "Reconstruction", its title, a line below the title, and the content.
pub fn sheet(kind: &str, title: &str, line: &Markup, content: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta name="generator" content=(concat!("outcrop ", env!("CARGO_PKG_VERSION")));
                title { (title) " · " (kind) }
                link rel="icon" href="data:,";
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    header {
                        div.kind { (kind) }
                        h1 { (title) }
                        p { (line) }
                    }
                    (content)
                    footer { "Made by outcrop " (env!("CARGO_PKG_VERSION")) ". This page needs no network and has no script." }
                }
            }
        }
    };
    page.into_string()
}

/// A figure at the top of a page.
pub fn card(what: &str, much: &Markup, more: &Markup) -> Markup {
    html! {
        div.card {
            div.what { (what) }
            div.much { (much) }
            div.more { (more) }
        }
    }
}

/// A table of names and values; rows without a value are left out.
pub fn list(rows: &[(&str, Option<Markup>)]) -> Markup {
    html! {
        table {
            tbody {
                @for (name, value) in rows {
                    @if let Some(value) = value {
                        tr { th scope="row" { (name) } td { (value) } }
                    }
                }
            }
        }
    }
}

/// The value of a row.
pub fn shown(value: impl Render) -> Option<Markup> {
    Some(value.render())
}

/// The value of the row of the lattice.
pub fn lattice(step: f64, exact: bool) -> Option<Markup> {
    let exact = if exact { "exact" } else { "rounded" };
    shown(format!("steps of {}, {exact}", length(step)))
}

/// A table whose first column is text and whose other columns are numbers.
pub fn table(head: &[&str], rows: impl IntoIterator<Item = Vec<Markup>>) -> Markup {
    let class = |column: usize| (column > 0).then_some("n");
    html! {
        table {
            thead {
                tr {
                    @for (column, name) in head.iter().enumerate() {
                        th scope="col" class=[class(column)] { (name) }
                    }
                }
            }
            tbody {
                @for row in rows {
                    tr {
                        @for (column, cell) in row.iter().enumerate() {
                            td class=[class(column)] { (cell) }
                        }
                    }
                }
            }
        }
    }
}

/// A sentence about the result, and what to do about it.
pub struct Advice {
    /// The sentence.
    pub words: String,
    /// The remedy; empty if there is none.
    pub remedy: String,
    /// False for a note, which is no warning.
    pub warning: bool,
}

impl Advice {
    pub fn new(warning: bool, words: String, remedy: &str) -> Self {
        Self {
            words,
            remedy: remedy.to_owned(),
            warning,
        }
    }
}

/// Warnings and notes.
pub fn advice(all: &[Advice]) -> Markup {
    html! {
        ul.words {
            @for one in all {
                li class=[(!one.warning).then_some("note")] {
                    (clean(&one.words))
                    @if !one.remedy.is_empty() { span.do { (clean(&one.remedy)) } }
                }
            }
        }
    }
}

/// A picture with a scale bar, if its scale is known, and a caption.
pub fn view(picture: &Picture, caption: &Markup) -> Markup {
    let source = format!("data:image/png;base64,{}", STANDARD.encode(&picture.png));
    let bar = scale_bar(picture);
    html! {
        figure.view {
            div.frame {
                img src=(source) width=(picture.width) height=(picture.height) alt=(picture.name);
                @if let Some((units, share)) = bar {
                    div.scale style=(format!("width:{:.2}%", 100.0 * share)) { (length(units)) }
                }
            }
            figcaption { b { (picture.name) } " " (caption) }
        }
    }
}

/// A round length of about a sixth of the picture's width, and its share of the width.
fn scale_bar(picture: &Picture) -> Option<(f64, f64)> {
    let units = f64::from(picture.width) / picture.scale;
    let about = units / 6.0;
    if !about.is_finite() || about <= 0.0 {
        return None;
    }
    let power = libm::exp10(libm::log10(about).floor());
    let step = [5.0, 2.0, 1.0]
        .into_iter()
        .find(|step| step * power <= about);
    let round = step.unwrap_or(1.0) * power;
    Some((round, round / units))
}

/// A key of colours.
pub fn key(colour: &str, name: &str) -> Markup {
    html! { span.key style=(format!("background:{colour}")) {} (name) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_are_round() {
        let picture = |scale: f64| Picture {
            name: String::new(),
            width: 880,
            height: 560,
            scale,
            png: Vec::new(),
        };
        let (units, share) = scale_bar(&picture(1.0)).unwrap();
        assert_eq!(units, 100.0);
        assert!((share - 100.0 / 880.0).abs() < 1e-12);
        assert_eq!(scale_bar(&picture(0.0)), None);
        assert_eq!(scale_bar(&picture(f64::NAN)), None);
    }
}
