//! The map of ARCHITECTURE.md, checked by the `use` lines of `src`: the permitted imports of each folder, no
//! circle of imports, rows with named fields, and files of limited length.

mod source;

use source::modules;
use std::collections::{BTreeMap, BTreeSet};

/// Each part of the program, and the parts whose items it may use, besides `error`. A part is a folder of
/// `src`, a folder or file of `src/stages`, or a file of `src`.
const MAY_USE: &[(&str, &str)] = &[
    (
        "cli",
        "inspect levels method page params pipeline report stages/ingest view workspace",
    ),
    ("convert", "inspect stages/export workspace"),
    ("error", ""),
    ("geom", "kernels method"),
    ("histogram", ""),
    (
        "inspect",
        "geom histogram method params picture pipeline spill stages/attributes stages/blocks stages/cells stages/ingest \
         stages/normals stages/order stages/smooth stages/tiles \
         workspace",
    ),
    ("kernels", ""),
    (
        "levels",
        "inspect light meshopt spill stages/ingest workspace",
    ),
    ("light", ""),
    ("meshopt", ""),
    ("method", ""),
    (
        "params",
        "geom method stages/ingest stages/normals stages/smooth stages/spacing stages/surface",
    ),
    ("page", "histogram inspect picture report"),
    ("picture", ""),
    (
        "pipeline",
        "geom levels method params report stages/* workspace",
    ),
    (
        "report",
        "histogram levels params picture stages/* workspace",
    ),
    ("spill", "workspace"),
    (
        "stages/attributes",
        "stages/blocks stages/ingest stages/order",
    ),
    ("stages/blocks", ""),
    ("stages/columns", "stages/blocks stages/order"),
    (
        "stages/cells",
        "kernels stages/blocks stages/levels stages/normals stages/order stages/spacing stages/tiles",
    ),
    (
        "stages/cut",
        "stages/blocks stages/located stages/order stages/repair stages/surface",
    ),
    (
        "stages/draw",
        "histogram picture stages/blocks stages/cut stages/located stages/order stages/repair stages/spacing",
    ),
    (
        "stages/export",
        "light meshopt stages/attributes stages/blocks stages/cut stages/ingest stages/order stages/repair stages/surface",
    ),
    ("stages/ingest", ""),
    ("stages/levels", ""),
    (
        "stages/located",
        "stages/blocks stages/cells stages/levels stages/order stages/outside stages/spacing",
    ),
    (
        "stages/normals",
        "stages/attributes stages/blocks stages/ingest stages/order",
    ),
    ("stages/order", "stages/ingest"),
    (
        "stages/outliers",
        "stages/blocks stages/cells stages/order stages/tiles",
    ),
    (
        "stages/outside",
        "stages/blocks stages/columns stages/normals stages/order stages/scanners",
    ),
    (
        "stages/repair",
        "stages/blocks stages/located stages/order stages/outside stages/spacing stages/stitch stages/surface",
    ),
    (
        "stages/smooth",
        "kernels stages/cells stages/levels stages/order stages/spacing stages/tiles",
    ),
    ("stages/scanners", "stages/attributes"),
    ("stages/spacing", "stages/levels"),
    (
        "stages/stitch",
        "kernels stages/blocks stages/cells stages/columns stages/located stages/surface stages/triples",
    ),
    ("stages/surface", "stages/blocks stages/located"),
    ("stages/thin", "stages/ingest"),
    ("stages/tiles", "kernels stages/order"),
    ("stages/triples", "stages/blocks stages/cells"),
    ("view", ""),
    ("workspace", ""),
];

/// Every stage may use these.
const COMMON: &str = "error geom method spill workspace";

/// Largest number of lines of a file, without its tests.
const MOST_LINES: usize = 500;

/// `a::{b, c::{d, e}}` as `a::b`, `a::c::d`, `a::c::e`.
fn expand(path: &str) -> Vec<String> {
    let Some((before, inside)) = path.split_once('{') else {
        return vec![path.split(" as ").next().unwrap().trim().to_owned()];
    };
    let inside = inside.trim_end().strip_suffix('}').unwrap();
    let (mut parts, mut depth) = (vec![String::new()], 0);
    for c in inside.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        if c == ',' && depth == 0 {
            parts.push(String::new());
        } else {
            parts.last_mut().unwrap().push(c);
        }
    }
    let parts = parts.iter().map(|part| part.trim());
    let parts = parts.filter(|part| !part.is_empty());
    parts
        .flat_map(|part| expand(&format!("{}{part}", before.trim_start())))
        .collect()
}

/// The modules that a module imports from, by its `use` lines.
fn imports(module: &str, text: &str, all: &BTreeMap<String, String>) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for line in text.split("use ").skip(1) {
        let Some((path, _)) = line.split_once(';') else {
            continue;
        };
        if !["crate::", "super::", "self::"]
            .iter()
            .any(|start| path.starts_with(start))
        {
            continue;
        }
        let path = path.split_whitespace().collect::<Vec<_>>().join(" ");
        for path in expand(&path) {
            let mut at: Vec<&str> = module.split('/').collect();
            for (number, part) in path.split("::").enumerate() {
                match part.trim() {
                    "crate" if number == 0 => at.clear(),
                    "self" => {}
                    "super" => drop(at.pop()),
                    part => {
                        at.push(part);
                        if !all.contains_key(&at.join("/")) {
                            at.pop();
                            break;
                        }
                    }
                }
            }
            let target = at.join("/");
            if target != module && all.contains_key(&target) {
                found.insert(target);
            }
        }
    }
    found
}

fn room(module: &str) -> String {
    let depth = 1 + usize::from(module.starts_with("stages/"));
    module.split('/').take(depth).collect::<Vec<_>>().join("/")
}

fn graph() -> BTreeMap<String, BTreeSet<String>> {
    let all = modules();
    let edges = all
        .iter()
        .map(|(module, text)| (module.clone(), imports(module, text, &all)));
    edges.collect()
}

#[test]
fn use_lines_are_read() {
    let paths = expand("crate::a::{b, c::{D, self}, e::F as G}");
    assert_eq!(
        paths,
        [
            "crate::a::b",
            "crate::a::c::D",
            "crate::a::c::self",
            "crate::a::e::F"
        ]
    );
    let graph = graph();
    assert!(graph["pipeline/stages"].contains("stages/repair"));
    assert!(graph["spill/table"].contains("workspace/place"));
}

#[test]
fn no_room_knows_more_than_the_map_says() {
    let rules: BTreeMap<&str, &str> = MAY_USE.iter().copied().collect();
    let mut wrong = Vec::new();
    for (module, targets) in graph() {
        let from = room(&module);
        if from == "stages" {
            continue;
        }
        let allowed = rules.get(from.as_str());
        let allowed = allowed.unwrap_or_else(|| panic!("{from} is not on the map"));
        let stage = from.starts_with("stages/");
        let common = COMMON.split(' ').filter(|_| stage);
        let allowed: BTreeSet<&str> = allowed.split(' ').chain(common).collect();
        for target in targets {
            let to = room(&target);
            let any = to.starts_with("stages/") && allowed.contains("stages/*");
            if to != from && to != "error" && !any && !allowed.contains(to.as_str()) {
                wrong.push(format!("{module} uses {target}"));
            }
        }
    }
    assert!(wrong.is_empty(), "not on the map:\n{}", wrong.join("\n"));
}

#[test]
fn no_circle_of_imports() {
    let mut graph = graph();
    // Modules whose imports are all removed already are in no circle.
    loop {
        let free: Vec<String> = graph
            .iter()
            .filter(|(_, targets)| targets.iter().all(|t| !graph.contains_key(t)))
            .map(|(module, _)| module.clone())
            .collect();
        if free.is_empty() {
            break;
        }
        free.iter().for_each(|module| drop(graph.remove(module)));
    }
    // A folder's first file and its other files count as one module.
    let mut circles = BTreeMap::new();
    for (module, targets) in &graph {
        let inside = |t: &&String| graph.contains_key(*t) && !module.starts_with(&format!("{t}/"));
        let inside: Vec<&String> = targets.iter().filter(inside).collect();
        if !inside.is_empty() {
            circles.insert(module, inside);
        }
    }
    let reaches = |from: &String, to: &String| {
        let (mut seen, mut stack) = (BTreeSet::new(), vec![from]);
        while let Some(at) = stack.pop() {
            for &next in circles.get(at).into_iter().flatten() {
                if next == to {
                    return true;
                }
                if seen.insert(next) {
                    stack.push(next);
                }
            }
        }
        false
    };
    let wrong: Vec<_> = circles
        .keys()
        .filter(|module| reaches(module, module))
        .collect();
    assert!(wrong.is_empty(), "in circles of imports: {wrong:?}");
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
        module != "stages/ingest/contain" && text.contains("thread_local!")
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
        !module.starts_with("kernels") && tied.iter().any(|word| text.contains(word))
    });
    assert_eq!(found.map(|(module, _)| module).collect::<Vec<_>>(), [""; 0]);
    // Of the kernels every use is for x86-64 only: what else there is, is for every processor.
    let kernels = modules()
        .into_iter()
        .filter(|(m, _)| m.starts_with("kernels"));
    let mut uses = 0;
    for (module, text) in kernels {
        uses += text.matches("target_arch = \"x86_64\"").count();
        let others = text.matches("target_arch").count() - text.matches("x86_64\")").count();
        assert_eq!(others, 0, "{module}");
    }
    assert!(uses > 5, "{uses}");
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
