//! The format of scratch files is the checksum of all that decides it: a run that a program with another format left is
//! refused.

use crate::source::modules;
use crate::source::tokens::tokens;
use std::collections::BTreeSet;
use std::path::Path;

/// The file with the checksum, and the text around it.
const FILE: &str = "src/pipeline/format.rs";
const BEFORE: &str = "pub(super) const FORMAT: &str = \"";

/// Functions whose first argument names a step of a run.
const STEPS: [&str; 6] = ["once", "once_opened", "round", "stage", "step", "units"];

/// Number of tokens up to the one that closes the first bracket.
fn closed(tokens: &[&str]) -> usize {
    let mut depth = 0;
    let end = tokens.iter().position(|token| {
        depth += i32::from(["(", "[", "{"].contains(token));
        depth -= i32::from([")", "]", "}"].contains(token));
        depth == 0 && [")", "]", "}"].contains(token)
    });
    end.expect("a closing bracket") + 1
}

/// Number of tokens of the `struct`, `enum` or `impl` that begins here.
fn item(tokens: &[&str]) -> usize {
    let body = tokens.iter().position(|token| ["{", ";"].contains(token));
    let body = body.expect("a body");
    match tokens[body] {
        ";" => body + 1,
        _ => body + closed(&tokens[body..]),
    }
}

/// The definitions in a text without comments that decide what scratch files hold: rows; what is saved and restored; the
/// names of steps.
fn definitions(text: &str) -> BTreeSet<String> {
    let tokens = tokens(text);
    let mut found = BTreeSet::new();
    for at in 0..tokens.len() {
        let rest = &tokens[at..];
        let length = match rest {
            ["row", "!", "{", ..] => closed(rest),
            ["#", "[", "derive", ..] => {
                let traits = closed(&rest[1..]) + 1;
                let has = |name| rest[..traits].contains(&name);
                match (has("Serialize") && has("Deserialize")) || has("Pod") {
                    // Further attributes are part of it.
                    true => traits + item(&rest[traits..]),
                    false => continue,
                }
            }
            ["impl", ..] => {
                let head = rest.iter().take_while(|token| **token != "{");
                let head: Vec<&str> = head.copied().collect();
                let by_hand = ["Serialize", "Deserialize", "Row", "Pod"];
                let of = head.iter().position(|token| *token == "for");
                match of.is_some_and(|of| head[..of].iter().any(|name| by_hand.contains(name))) {
                    true => item(rest),
                    false => continue,
                }
            }
            [".", name, "(", ..] if STEPS.contains(name) => {
                let call = &rest[2..2 + closed(&rest[2..])];
                let mut depth = 0;
                let first = call.iter().position(|token| {
                    depth += i32::from(["(", "[", "{"].contains(token));
                    depth -= i32::from([")", "]", "}"].contains(token));
                    depth == 1 && *token == ","
                });
                2 + first.unwrap_or(call.len())
            }
            // The order of the stages.
            ["fn", "reconstruct", "(", "&", "self", ",", "workspace", ..] => item(rest),
            _ => continue,
        };
        found.insert(rest[..length].join(" "));
    }
    found
}

/// The checksum, 8 digits.
fn checksum<'a>(texts: impl IntoIterator<Item = &'a str>) -> String {
    let all: BTreeSet<String> = texts.into_iter().flat_map(definitions).collect();
    let all: Vec<String> = all.into_iter().collect();
    format!("{:08x}", crc32fast::hash(all.join("\n").as_bytes()))
}

#[test]
fn the_format_is_that_of_the_definitions() {
    let modules = modules();
    let texts = || modules.values().map(String::as_str);
    let all: Vec<String> = texts().flat_map(definitions).collect();
    let begins = |with: &str| all.iter().filter(|text| text.starts_with(with)).count();
    let counts = ["row !", "# [ derive", ".", "fn"].map(begins);
    assert!(
        counts[0] > 70 && counts[1] > 150 && counts[2] > 100,
        "{counts:?}"
    );
    assert_eq!(counts[3], 1);
    let expected = checksum(texts());
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(FILE);
    let text = std::fs::read_to_string(&file).unwrap();
    let (before, behind) = text.split_once(BEFORE).expect(BEFORE);
    let (found, behind) = behind.split_once('"').expect("an end");
    if std::env::var_os("OUTCROP_WRITE").is_some() {
        std::fs::write(&file, format!("{before}{BEFORE}{expected}\"{behind}")).unwrap();
        return;
    }
    assert_eq!(
        found, expected,
        "rows, results or steps have changed: OUTCROP_WRITE=1 writes the format to {FILE}"
    );
}

const EXAMPLE: &str = "
    row! { struct Edge { from: Id, to: [u32; 2], } packed Above Left Left }
    #[derive(Debug, Serialize, Deserialize)]
    #[serde(untagged)]
    pub enum Found { One(u32), Many { all: Vec<u32> } }
    #[derive(Clone, serde::Serialize, serde::Deserialize)] struct Count(pub u64);
    #[derive(Debug, Serialize)] struct Shown { a: u32 }
    impl Serialize for Format { fn serialize() { self.name } }
    impl Found { fn new() { work.once(\"read\", |_| x(1)); work.units((step, \"m\"), 3) } }
    fn reconstruct(&self, workspace: W) { stages.ingest(); stages.order() }
";

#[test]
fn the_format_changes_with_all_that_decides_it() {
    let format = checksum([EXAMPLE]);
    for (was, now) in [
        ("from: Id", "of: Id"),
        ("from: Id, to: [u32; 2],", "to: [u32; 2], from: Id,"),
        ("[u32; 2]", "[i32; 2]"),
        ("Above Left", "Left Above"),
        ("packed Above Left Left", "unpacked"),
        ("untagged", "transparent"),
        ("One(u32)", "One(u64)"),
        ("all: Vec<u32>", "all: Vec<u32>, more: u8"),
        ("Count(pub u64)", "Count(pub u32)"),
        ("self.name", "self.number"),
        ("\"read\"", "\"read twice\""),
        ("(step, \"m\")", "(step, \"n\")"),
        (
            "stages.ingest(); stages.order()",
            "stages.order(); stages.ingest()",
        ),
    ] {
        assert!(EXAMPLE.contains(was), "{was}");
        assert_ne!(
            checksum([EXAMPLE.replacen(was, now, 1).as_str()]),
            format,
            "{now}"
        );
    }
    // Not with anything else: spaces, what is only shown, work, arguments, places.
    for (was, now) in [
        ("\n", "\n\n"),
        ("struct Shown { a: u32 }", "struct Shown { b: u64 }"),
        ("x(1)", "x(2)"),
        (", 3)", ", 4)"),
    ] {
        assert!(EXAMPLE.contains(was), "{was}");
        assert_eq!(
            checksum([EXAMPLE.replacen(was, now, 1).as_str()]),
            format,
            "{now}"
        );
    }
    let (a, b) = EXAMPLE.split_at(EXAMPLE.find("impl Serialize").unwrap());
    assert_eq!(checksum([b, a]), format);
}
