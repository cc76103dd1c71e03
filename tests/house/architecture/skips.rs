//! Tests that are skipped say so where it is seen.

use crate::source::modules_of;
use crate::source::tokens::tokens;
use std::collections::BTreeMap;
use std::path::Path;

/// Where a text says something and then leaves: the other ways to skip a test, whose words are thrown away if it passes.
fn leaves_with_words(text: &str) -> usize {
    let tokens = tokens(text);
    let said = (0..tokens.len()).filter(|at| ["println", "eprintln"].contains(&tokens[*at]));
    let leaves = said.filter(|at| {
        let (mut depth, behind) = (0, tokens[at + 2..].iter());
        let mut behind = behind.skip_while(|token| {
            depth += i32::from(**token == "(") - i32::from(**token == ")");
            depth > 0
        });
        let next = [behind.nth(1), behind.next()].map(|token| token.copied().unwrap_or_default());
        let next = if next[0] == ";" { next[1] } else { next[0] };
        ["return", "continue", "None"].contains(&next)
    });
    leaves.count()
}

#[test]
fn tests_are_skipped_in_one_way() {
    for (text, count) in [
        ("println!(\"{} is absent\", f(x)); return;", 1),
        ("{ eprintln!(\"none\"); None }", 1),
        ("println!(\"skipped\");\ncontinue;", 1),
        ("println!(\"{x}\"); } } fn f() { return; }", 0),
        ("skip(\"x\"); return; println!(\"done\"); x()", 0),
    ] {
        assert_eq!(leaves_with_words(text), count, "{text}");
    }
    let tools = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("tools")).unwrap();
    let tools = tools.map(|tool| tool.unwrap().path().join("tests"));
    let tools = tools.filter(|tests| tests.is_dir());
    let folders = tools.map(|tests| tests.display().to_string());
    let texts = folders.chain(["tests".to_owned()]).flat_map(|folder| {
        let all = modules_of(&folder).into_iter();
        all.map(move |(module, text)| (format!("{folder}/{module}"), text))
    });
    let mut texts: BTreeMap<String, String> = texts.collect();
    texts
        .remove("tests/program/skip")
        .expect("tests/program/skip");
    // This file has them as words.
    texts.remove("tests/house/architecture/skips");
    assert!(texts.len() > 100, "{}", texts.len());
    let wrong = texts.iter().filter(|(_, text)| {
        let of_others = text.contains("shared/data") && !text.contains("if_present(");
        of_others || text.contains("skipped: ") || leaves_with_words(text) > 0
    });
    let wrong: Vec<&String> = wrong.map(|(module, _)| module).collect();
    assert!(wrong.is_empty(), "use tests/program/skip.rs: {wrong:?}");
}
