//! The documents: not too long, without dead links, and without options that the program does not have.

use crate::source::modules;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Documents with a limit of lines.
const SHORT: [(&str, usize); 2] = [("README.md", 200), ("ARCHITECTURE.md", 200)];

/// Largest number of characters of a line, except in tables.
const WIDTH: usize = 110;

/// Options that documents give to other programs: cargo, scripts and tools.
const OTHERS: [&str; 14] = [
    "--address",
    "--draft",
    "--features",
    "--format",
    "--fraction",
    "--kind",
    "--large",
    "--no-default-features",
    "--others",
    "--quick",
    "--seconds",
    "--short",
    "--strict",
    "--tried",
];

/// Hidden options of `outcrop reconstruct`, for tests.
const HIDDEN: [&str; 2] = ["--block-points", "--tile-points"];

struct Document {
    /// Path from the root of the repository.
    path: PathBuf,
    text: String,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All documents at the root and in `docs`.
fn documents() -> Vec<Document> {
    let mut all = Vec::new();
    for folder in ["", "docs"] {
        for entry in std::fs::read_dir(root().join(folder)).expect("a folder") {
            let path = Path::new(folder).join(entry.expect("an entry").file_name());
            if path.extension().is_some_and(|e| e == "md") {
                let text = std::fs::read_to_string(root().join(&path)).expect("text");
                all.push(Document { path, text });
            }
        }
    }
    assert!(all.len() > 10, "{} documents", all.len());
    all
}

impl Document {
    fn name(&self) -> std::path::Display<'_> {
        self.path.display()
    }

    /// True for the changelog: it has long entries, and options that may have been removed.
    fn is_history(&self) -> bool {
        self.path == Path::new("CHANGELOG.md")
    }

    /// Lines with their numbers; true for those in a block of code.
    fn lines(&self) -> impl Iterator<Item = (usize, &str, bool)> {
        let mut code = false;
        self.text.lines().zip(1..).map(move |(line, number)| {
            let fence = line.trim_start().starts_with("```");
            code ^= fence;
            (number, line, code || fence)
        })
    }

    /// The text without blocks of code.
    fn prose(&self) -> String {
        let lines = self.lines().filter(|(_, _, code)| !code);
        lines.map(|(_, line, _)| format!("{line}\n")).collect()
    }

    /// Targets of links and pictures, without those in the web.
    fn targets(&self) -> Vec<String> {
        let prose = self.prose();
        let after = prose.split("](").skip(1);
        let targets = after.filter_map(|rest| rest.split_once(')'));
        let own = targets.filter(|(target, _)| !target.starts_with("http"));
        own.map(|(target, _)| target.to_owned()).collect()
    }

    /// The anchors of its headings by GitHub's rules.
    fn anchors(&self) -> BTreeSet<String> {
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        let headings = self
            .lines()
            .filter(|(_, line, code)| !code && line.starts_with('#'));
        let mut anchors = BTreeSet::new();
        for (_, line, _) in headings {
            let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
            let title = line.trim_start_matches('#').trim().to_lowercase();
            let anchor: String = title.chars().filter(kept).collect();
            let anchor = anchor.replace(' ', "-");
            let before = seen.entry(anchor.clone()).or_default();
            let number = *before;
            *before += 1;
            anchors.insert(match number {
                0 => anchor,
                n => format!("{anchor}-{n}"),
            });
        }
        anchors
    }
}

/// The long options in a text.
fn options(text: &str) -> BTreeSet<String> {
    let word = |c: char| !(c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-');
    let words = text
        .split(word)
        .filter(|w| w.starts_with("--") && w.len() > 2);
    words
        .filter(|w| !w.starts_with("---"))
        .map(str::to_owned)
        .collect()
}

/// The options of each command, from its help.
fn of_commands() -> BTreeMap<&'static str, BTreeSet<String>> {
    let commands = [
        "reconstruct",
        "resume",
        "info",
        "verify",
        "compare",
        "change",
        "volume",
        "raster",
        "simplify",
        "close",
        "tiles",
        "view",
        "demo",
        "plan",
        "work",
        "advance",
        "status",
        "submit",
        "completions",
        "man",
    ];
    let help = |command: &'static str| {
        let mut outcrop = Command::new(env!("CARGO_BIN_EXE_outcrop"));
        let output = outcrop.args([command, "--help"]).output().expect("it runs");
        assert!(output.status.success(), "{command} --help");
        let mut all = options(&String::from_utf8_lossy(&output.stdout));
        if command == "reconstruct" {
            all.extend(HIDDEN.map(str::to_owned));
        }
        (command, all)
    };
    commands.into_iter().map(help).collect()
}

#[test]
fn short_ones_are_short() {
    for (path, most) in SHORT {
        let text = std::fs::read_to_string(root().join(path)).expect("text");
        let lines = text.lines().count();
        assert!(
            lines <= most,
            "{path} has {lines} lines, expected at most {most}"
        );
    }
}

#[test]
fn lines_are_not_too_wide() {
    let mut wide = Vec::new();
    for document in documents().iter().filter(|d| !d.is_history()) {
        for (number, line, code) in document.lines() {
            let table = !code && line.starts_with('|');
            if !table && line.chars().count() > WIDTH {
                wide.push(format!("{}:{number}", document.name()));
            }
        }
    }
    assert!(wide.is_empty(), "more than {WIDTH} characters: {wide:?}");
}

#[test]
fn links_lead_somewhere() {
    let documents = documents();
    let mut broken = Vec::new();
    for document in &documents {
        let folder = document.path.parent().expect("a folder");
        for target in document.targets() {
            let (path, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let path = match path {
                "" => document.path.clone(),
                path => folder.join(path),
            };
            let Ok(found) = root().join(&path).canonicalize() else {
                broken.push(format!("{}: {target}", document.name()));
                continue;
            };
            let same =
                |d: &&Document| root().join(&d.path).canonicalize().ok() == Some(found.clone());
            let there = documents.iter().find(same);
            if !anchor.is_empty() && !there.is_some_and(|d| d.anchors().contains(anchor)) {
                broken.push(format!("{}: {target}", document.name()));
            }
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn options_exist() {
    let commands = of_commands();
    let known = |option: &String| commands.values().any(|all| all.contains(option));
    let mut unknown = Vec::new();
    for document in documents().iter().filter(|d| !d.is_history()) {
        let prose = document.prose();
        let pieces: Vec<&str> = prose.split('`').collect();
        assert!(
            pieces.len() % 2 == 1,
            "{}: an open code span",
            document.name()
        );
        let spans = pieces.into_iter().skip(1).step_by(2);
        // Options of other programs may appear as a code span of their own.
        for span in spans.filter(|span| span.starts_with("--")) {
            let missing = options(span).into_iter().filter(|o| !known(o));
            let missing = missing.filter(|o| !OTHERS.contains(&o.as_str()));
            unknown.extend(missing.map(|o| format!("{}: {o}", document.name())));
        }
        let code = document.lines().filter(|(_, _, code)| *code);
        for (number, line, _) in code {
            let line = line.split('#').next().unwrap_or_default();
            // Options of another program follow.
            let line = line.split(" -- ").next().unwrap_or_default();
            let mut words = line.split_whitespace();
            if words.next() != Some("outcrop") {
                continue;
            }
            let Some(all) = words.next().and_then(|command| commands.get(command)) else {
                continue;
            };
            let missing = options(line).into_iter().filter(|o| !all.contains(o));
            unknown.extend(missing.map(|o| format!("{}:{number}: {o}", document.name())));
        }
    }
    assert!(unknown.is_empty(), "{unknown:#?}");
}

/// Rows that the library defines: the link to each, and its fields.
fn rows() -> BTreeMap<String, Vec<String>> {
    let mut all = BTreeMap::new();
    for (module, text) in modules() {
        for definition in text.split("\nrow! {\n").skip(1) {
            let (_, rest) = definition.split_once("struct ").expect("a struct");
            let (name, rest) = rest.split_once(" {").expect("its fields");
            let (body, _) = rest.split_once("\n    }").expect("its end");
            let fields = body.lines().map(str::trim);
            let fields = fields.filter_map(|line| line.split_once(": "));
            let fields = fields.map(|(field, _)| field.to_owned()).collect();
            let files = [".rs", "/mod.rs"].map(|end| format!("src/{module}{end}"));
            let file = files.iter().find(|file| root().join(file).exists());
            all.insert(format!("[`{name}`](../{})", file.expect("a file")), fields);
        }
    }
    assert!(all.len() > 30, "{} rows", all.len());
    all
}

/// A line of a table of rows with these fields, if it has this link.
fn with_fields(line: &str, link: &str, fields: &[String]) -> String {
    let Some((before, rest)) = line.split_once(link) else {
        return line.to_owned();
    };
    let (_, rest) = rest.split_once(" | ").expect("fields");
    let (listed, rest) = rest.split_once(" | ").expect("a meaning");
    // A type in brackets may follow.
    let same = |field: &str| {
        listed
            .split(", ")
            .find(|l| l.split(' ').next() == Some(field))
    };
    let fields: Vec<_> = fields.iter().map(|f| same(f).unwrap_or(f)).collect();
    format!("{before}{link} | {} | {rest}", fields.join(", "))
}

#[test]
fn records_are_the_rows_of_the_program() {
    let path = root().join("docs/records.md");
    let document = std::fs::read_to_string(&path).expect("the list of files");
    let mut written = document.clone();
    for (link, fields) in rows() {
        assert!(written.contains(&link), "docs/records.md has no row {link}");
        let lines = written
            .lines()
            .map(|line| with_fields(line, &link, &fields) + "\n");
        written = lines.collect();
    }
    if std::env::var_os("OUTCROP_WRITE").is_some() {
        std::fs::write(&path, &written).expect("the list of files, written");
    } else {
        let lines = document.lines().zip(written.lines());
        let other: Vec<_> = lines.filter(|(a, b)| a != b).collect();
        assert!(other.is_empty(), "OUTCROP_WRITE=1 writes them: {other:#?}");
    }
    // Files with a name of their own.
    for text in modules().into_values() {
        for creation in ["Table::new(\"", "Shuffle::new(\""] {
            for rest in text.split(creation).skip(1) {
                let name = rest.split('"').next().expect("a name");
                let listed = document.contains(&format!("`{name}`"));
                assert!(listed, "docs/records.md has no file {name}");
            }
        }
    }
}

#[test]
fn the_index_of_the_manual_has_all_documents() {
    let all = documents();
    let index = all.iter().find(|d| d.path == Path::new("docs/README.md"));
    let listed = index.expect("docs/README.md").targets();
    let inside = all.iter().filter_map(|d| d.path.strip_prefix("docs").ok());
    let missing: Vec<_> = inside
        .filter(|path| *path != Path::new("README.md"))
        .filter(|path| !listed.iter().any(|target| Path::new(target) == *path))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn packages_agree_with_the_program() {
    let read = |path: &str| std::fs::read_to_string(root().join(path)).expect(path);
    let version = env!("CARGO_PKG_VERSION");
    assert!(read("CITATION.cff").contains(&format!("\nversion: {version}\n")));
    let conda = read("packaging/conda/recipe.yaml");
    assert!(conda.contains(&format!("\n  version: \"{version}\"\n")));
    // The same licences for cargo-deny and for the script that needs nothing else.
    let script = read("scripts/check-licences");
    let (_, list) = script.split_once("\nallowed=\"").expect("a list");
    let (list, _) = list.split_once('"').expect("its end");
    let script: BTreeSet<&str> = list.split(' ').collect();
    let deny = read("deny.toml");
    let lines = deny.lines().map(str::trim);
    let lines = lines.filter_map(|line| line.strip_prefix('"')?.strip_suffix("\","));
    assert_eq!(lines.collect::<BTreeSet<&str>>(), script);
    // What the Debian package contains is what the script makes.
    let (cargo, package) = (read("Cargo.toml"), read("scripts/package"));
    for made in ["outcrop", "man", "complete", "licences"] {
        assert!(
            cargo.contains(&format!("\"target/package/{made}")),
            "{made}"
        );
        assert!(package.contains(&format!("$stage/{made}")), "{made}");
    }
}
