//! The test of imports sees what it should, in small examples.

use super::graph;
use crate::source::graph::Graph;
use crate::source::tokens::{paths, without_comments};
use std::collections::BTreeSet;

/// What the modules of a small program use, and its circles.
fn looked_at(texts: &[(&str, &str)]) -> (Vec<String>, Vec<Vec<String>>) {
    let texts = texts.iter();
    let texts = texts.map(|(module, text)| ((*module).to_owned(), without_comments(text)));
    let graph = Graph::new(&texts.collect(), BTreeSet::from(["d".to_owned()]));
    let uses = graph.uses.iter();
    let uses = uses.flat_map(|(a, all)| all.iter().map(move |b| format!("{a} {b}")));
    (uses.collect(), graph.circles())
}

#[test]
fn paths_lead_to_modules() {
    // With braces, with other names, and without a `use` line.
    let text = "use crate::a::{b, c::{D, self}, e::F as G};\nfn f() -> d::X { outcrop_d::x() }";
    let found = paths(text)
        .into_iter()
        .map(|path| (path.parts.join("::"), path.name));
    let named = |path: &str, name: &str| (path.to_owned(), Some(name.to_owned()));
    let expected = [
        named("crate::a::b", "b"),
        named("crate::a::c::D", "D"),
        named("crate::a::c", "c"),
        named("crate::a::e::F", "G"),
        ("d::X".to_owned(), None),
        ("outcrop_d::x".to_owned(), None),
    ];
    assert_eq!(found.collect::<Vec<_>>(), expected);
    let (uses, _) = looked_at(&[
        // What is inside a module is known there by its name alone.
        ("a", "mod b; use b::X; fn f() { b::y(); std::c::z() }"),
        // From inside `mod`, one level more leads out; names are passed on by others.
        (
            "a/b",
            "mod inside { use super::super::e::h; use super::Z; } use super::Y; use crate::R;",
        ),
        ("", "pub use c::R; pub use outcrop_d::other;"),
        // Neither comments nor texts count, nor what looks like the end of one.
        (
            "c",
            "// crate::a::b\nconst C: char = '\"'; const T: &str = \"crate::a // \\\"\"; fn f<'a>() {}",
        ),
        ("d", "pub use other::T;"),
        ("d/other", "impl crate::d::T { } use crate::T;"),
        ("g", "pub use c::R; fn c() -> crate::T {}"),
        (
            "a/e",
            "pub use super::b::{self, Y as Z}; fn f() -> r#type { super::super::c::x() }",
        ),
    ]);
    let expected = [
        " c",
        " d/other",
        "a a/b",
        "a/b a",
        "a/b a/e",
        "a/b c",
        "a/e a",
        "a/e a/b",
        "a/e c",
        "d d/other",
        "d/other d",
        "g ",
    ];
    assert_eq!(uses, expected);
    let real = graph();
    assert!(real.uses["pipeline/stages"].contains("mesh/repair"));
    assert!(real.uses["disk/spill/table"].contains("disk/workspace/place"));
    assert!(real.uses["codecs/foreign"].contains("codecs/foreign/ply"));
    assert!(real.uses["pipeline/made"].contains("pipeline/close"));
}

#[test]
fn circles_are_found() {
    let circles = |texts: &[(&str, &str)]| looked_at(texts).1;
    let two = |a: &str, b: &str| vec![vec![a.to_owned(), b.to_owned()]];
    // A module and those inside it are one.
    assert!(circles(&[("a", "mod b; use b::X;"), ("a/b", "use super::Y;")]).is_empty());
    // Through what is inside one, and through a name that another passes on.
    let inside = [
        ("a", "mod b; fn f() { b::x() }"),
        ("a/b", "use crate::c::X;"),
        ("c", "use crate::a::Y;"),
    ];
    assert_eq!(circles(&inside), two("a", "c"));
    let passed = [
        ("p", "mod a; mod b; use a::A;"),
        ("p/a", "use super::b::B;"),
        ("p/b", "use super::A;"),
    ];
    assert_eq!(circles(&passed), two("p/a", "p/b"));
    let three = [
        ("a", "use crate::b::X;"),
        ("b", "use crate::c::Y;"),
        ("c", "mod m { use super::super::a::Z; }"),
    ];
    assert_eq!(circles(&three), [["a", "b", "c"].map(str::to_owned)]);
}
