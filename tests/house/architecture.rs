//! The map of ARCHITECTURE.md, checked by the paths in `src`: the permitted imports of each room inside a crate (the
//! manifests hold those between crates), no circle of imports, rows with named fields, and files of limited length.

mod imports;
mod scratch;
mod skips;

use crate::source::graph::Graph;
use crate::source::{modules, modules_of};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Each room, and the rooms of the same crate whose items it may use. A room is a folder or file of a crate with
/// several steps, or of the program.
const MAY_USE: &[(&str, &str)] = &[
    (
        "cli",
        "deliver faults features info page params pipeline report",
    ),
    ("convert", "write"),
    ("deliver", "features"),
    ("faults", ""),
    ("features", ""),
    ("info", "params pipeline"),
    ("page", "info report"),
    ("params", ""),
    ("pipeline", "deliver features params report write"),
    ("report", "deliver params"),
    ("write", ""),
    ("disk/error", ""),
    ("disk/spill", "disk/error disk/workspace"),
    ("disk/workspace", "disk/error"),
    ("draw/histogram", ""),
    ("draw/picture", ""),
    ("mesh/confidence", "mesh/repair mesh/surface mesh/triples"),
    ("mesh/repair", "mesh/stitch mesh/surface"),
    ("mesh/stitch", "mesh/surface mesh/triples"),
    ("mesh/surface", ""),
    ("mesh/triples", ""),
    ("mesh_files/cut", ""),
    ("mesh_files/export", "mesh_files/cut"),
    ("paper", "paper/kernels paper/method"),
    ("paper/kernels", ""),
    ("paper/method", ""),
    ("pictures/cloud", ""),
    ("pictures/mesh", ""),
    ("stages/attributes", "stages/blocks stages/ids stages/order"),
    ("stages/blocks", "stages/ids"),
    (
        "stages/cells",
        "stages/blocks stages/ids stages/levels stages/normals stages/order stages/spacing stages/tiles",
    ),
    ("stages/cloud", "stages/order"),
    ("stages/columns", "stages/blocks stages/ids stages/order"),
    ("stages/ids", ""),
    ("stages/levels", ""),
    (
        "stages/located",
        "stages/blocks stages/cells stages/ids stages/levels stages/order stages/outside stages/spacing",
    ),
    (
        "stages/normals",
        "stages/attributes stages/blocks stages/ids stages/order",
    ),
    ("stages/order", "stages/ids"),
    (
        "stages/outliers",
        "stages/blocks stages/cells stages/ids stages/order stages/tiles",
    ),
    (
        "stages/outside",
        "stages/blocks stages/columns stages/ids stages/normals stages/order stages/scanners",
    ),
    ("stages/scanners", "stages/attributes stages/ids"),
    (
        "stages/smooth",
        "stages/cells stages/ids stages/levels stages/order stages/spacing stages/tiles",
    ),
    ("stages/spacing", "stages/ids stages/levels"),
    ("stages/thin", ""),
    ("stages/tiles", "stages/ids stages/order"),
];

/// Largest number of lines of a file, without its tests.
const MOST_LINES: usize = 500;

/// The folder of the crate to which a module belongs; `None` for the program.
fn crate_of(module: &str) -> Option<&str> {
    let first = module.split('/').next()?;
    let manifest = format!("{}/src/{first}/Cargo.toml", env!("CARGO_MANIFEST_DIR"));
    Path::new(&manifest).exists().then_some(first)
}

/// The room of a module: the crate, or, in a crate with several rooms, its folder or file there.
fn room(module: &str) -> String {
    let inside = MAY_USE.iter().map(|(room, _)| *room);
    let holds = |room: &&str| module == *room || module.starts_with(&format!("{room}/"));
    let room = inside.filter(holds).max_by_key(|room| room.len());
    let first = module.split('/').next().unwrap_or_default();
    room.unwrap_or(first).to_owned()
}

fn graph() -> Graph {
    let mut texts = modules_of("src");
    texts.remove("main");
    let root = texts.remove("lib").expect("src/lib.rs");
    texts.insert(String::new(), root);
    let crates = texts.keys().filter_map(|module| crate_of(module));
    let crates = crates.map(str::to_owned).collect();
    Graph::new(&texts, crates)
}

#[test]
fn no_room_knows_more_than_the_map_says() {
    let rules: BTreeMap<&str, &str> = MAY_USE.iter().copied().collect();
    let mut wrong = Vec::new();
    for (module, targets) in graph().uses {
        if module.is_empty() {
            continue;
        }
        let from = room(&module);
        let Some(allowed) = rules.get(from.as_str()) else {
            let alone = crate_of(&module) == Some(from.as_str());
            assert!(alone, "{from} is not on the map");
            continue;
        };
        let allowed: BTreeSet<&str> = allowed.split(' ').collect();
        for target in targets {
            let to = room(&target);
            let same = crate_of(&target) == crate_of(&module) && !target.is_empty();
            if same && to != from && !allowed.contains(to.as_str()) {
                wrong.push(format!("{module} uses {target}"));
            }
        }
    }
    assert!(wrong.is_empty(), "not on the map:\n{}", wrong.join("\n"));
}

#[test]
fn no_circle_of_imports() {
    let circles = graph().circles();
    assert!(circles.is_empty(), "circles of imports: {circles:#?}");
}

#[test]
fn no_stage_reads_records_by_position() {
    for (module, text) in modules() {
        if module.starts_with("stages/") {
            let plain = ["Table<[u32", "Shuffle<[u32", "Sorter<[u32"];
            let found = plain.iter().find(|plain| text.contains(**plain));
            assert!(found.is_none(), "{module}: {found:?} has no named fields");
        }
    }
}

#[test]
fn no_state_is_hidden_in_threads() {
    let found = modules().into_iter().filter(|(module, text)| {
        // The hook of panics has no other way to know who asks.
        module != "formats/contain" && text.contains("thread_local!")
    });
    assert_eq!(found.map(|(module, _)| module).collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn only_kernels_are_tied_to_a_processor() {
    let tied = [
        "target_arch",
        "std::arch",
        "core::arch",
        "is_x86_feature_detected",
        "asm!",
    ];
    let found = modules().into_iter().filter(|(module, text)| {
        !module.starts_with("paper/kernels") && tied.iter().any(|word| text.contains(word))
    });
    assert_eq!(found.map(|(module, _)| module).collect::<Vec<_>>(), [""; 0]);
    // Of the kernels every use is for x86-64 only: what else there is, is for every processor.
    let kernels = modules()
        .into_iter()
        .filter(|(m, _)| m.starts_with("paper/kernels"));
    let mut uses = 0;
    for (module, text) in kernels {
        uses += text.matches("target_arch = \"x86_64\"").count();
        let others = text.matches("target_arch").count() - text.matches("x86_64\")").count();
        assert_eq!(others, 0, "{module}");
    }
    assert!(uses > 5, "{uses}");
}

#[test]
fn only_the_platform_knows_the_system() {
    let tied = [
        "cfg(unix",
        "cfg(windows",
        "cfg!(unix",
        "cfg!(windows",
        "target_os",
        "target_env",
        "target_family",
        "std::os::",
        "rustix::",
        "libc::",
        "signal_hook",
        "windows_sys",
        "/proc/",
        "/sys/",
    ];
    let found = modules().into_iter().chain(modules_of("tools/ply/src"));
    let found = found.filter(|(module, text)| {
        !module.starts_with("platform") && tied.iter().any(|word| text.contains(word))
    });
    assert_eq!(found.map(|(module, _)| module).collect::<Vec<_>>(), [""; 0]);
}

/// The compiler sees the files of one system only.
#[test]
fn every_system_has_every_item_of_the_platform() {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let all = modules_of("src/platform");
    let faces = ["files", "names", "process"].map(|face| &all[face]);
    let items = faces.into_iter().flat_map(|text| {
        let after = text
            .match_indices("system::")
            .map(|(at, _)| &text[at + 8..]);
        after.map(|rest| &rest[..rest.find(|c| !word(c)).unwrap_or(rest.len())])
    });
    let items: BTreeSet<&str> = items.collect();
    assert!(items.len() > 30, "{items:?}");
    for system in ["linux", "macos", "windows"] {
        let here = all.iter().filter(|(name, _)| name.starts_with(system));
        let words = here.flat_map(|(_, text)| text.split(|c| !word(c)));
        let words: BTreeSet<&str> = words.collect();
        let missing: Vec<_> = items.difference(&words).collect();
        assert!(missing.is_empty(), "{system} lacks {missing:?}");
    }
}

/// Functions of floats that a system has in its own library, with its own rounding. `sqrt`, `floor`, `ceil`, `round`,
/// `%` and whole powers are exact or the same everywhere.
const ROUNDED_BY_THE_SYSTEM: [&str; 27] = [
    "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "exp",
    "exp2", "exp_m1", "hypot", "ln", "ln_1p", "ln_gamma", "log", "log10", "log2", "mul_add",
    "powf", "sin", "sin_cos", "sinh", "tan", "tanh",
];

#[test]
fn no_result_depends_on_the_library_of_the_system() {
    let tools = ["cloudgen", "ply", "raster"];
    let tools = tools.map(|tool| (tool, modules_of(&format!("tools/{tool}/src"))));
    let tools = tools.into_iter().flat_map(|(tool, modules)| {
        let named = move |(module, text)| (format!("{tool}/{module}"), text);
        modules.into_iter().map(named)
    });
    let mut wrong = Vec::new();
    for (module, text) in modules().into_iter().chain(tools) {
        for name in ROUNDED_BY_THE_SYSTEM {
            let calls = [
                format!(".{name}("),
                format!("f64::{name}"),
                format!("f32::{name}"),
            ];
            let word = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
            let found = calls.iter().any(|call| {
                let mut after = text.match_indices(call.as_str());
                after.any(|(at, _)| call.ends_with('(') || word(&text[at + call.len()..]))
            });
            if found {
                wrong.push(format!("{module}: {name}"));
            }
        }
    }
    assert!(wrong.is_empty(), "use the crate libm: {wrong:?}");
}

/// The crates that the program is built of, each with its version and features, with these arguments of cargo.
fn built(arguments: &[&str]) -> BTreeSet<String> {
    let mut cargo = std::process::Command::new(env!("CARGO"));
    let what = ["tree", "--offline", "--locked", "--edges", "normal,build"];
    let how = ["--no-dedupe", "--prefix", "none", "--format", "{p} {f}"];
    let cargo = cargo.args(what).args(how).args(arguments);
    let output = cargo.current_dir(env!("CARGO_MANIFEST_DIR")).output();
    let output = output.expect("cargo runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().map(str::to_owned).collect()
}

/// Crates with other features are built again, with all on top of them.
#[test]
fn the_feature_cloud_builds_only_the_readers_and_the_program_again() {
    let (without, with) = (built(&[]), built(&["--features", "cloud"]));
    assert!(with.iter().any(|line| line.starts_with("outcrop-remote ")));
    let name = |line: &String| line.split(' ').next().unwrap_or_default().to_owned();
    let again: BTreeSet<String> = without.difference(&with).map(name).collect();
    let expected = ["outcrop", "outcrop-formats"].map(str::to_owned);
    assert_eq!(
        again,
        expected.into(),
        "the root manifest has their features"
    );
}

/// Stages, meshes and what is measured know neither formats nor servers.
#[test]
fn only_the_program_reads_clouds() {
    for package in ["draw", "inspect", "levels", "mesh-files", "survey"] {
        let name = format!("outcrop-{package}");
        let crates = built(&["--package", &name]);
        let readers = ["outcrop-formats ", "outcrop-remote "];
        let found = crates
            .iter()
            .find(|line| readers.iter().any(|reader| line.starts_with(reader)));
        assert_eq!(found, None, "{name}");
    }
}

#[test]
fn files_are_about_one_thing() {
    let long: Vec<_> = modules()
        .into_iter()
        .map(|(module, text)| (text.lines().count(), module))
        .filter(|(lines, _)| *lines > MOST_LINES)
        .collect();
    assert!(long.is_empty(), "more than {MOST_LINES} lines: {long:?}");
}
