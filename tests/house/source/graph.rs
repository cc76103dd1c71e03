//! Which module uses which, by the paths in their texts.

use super::tokens::{Path, paths};
use std::collections::{BTreeMap, BTreeSet};

/// The modules of a program with several crates. The first part of a name may be a crate; the module `""` is the root of
/// the program.
pub struct Graph {
    crates: BTreeSet<String>,
    modules: BTreeSet<String>,
    /// Modules without files, `mod a { … }`.
    inline: BTreeSet<String>,
    /// What `use` gives names, in each module.
    names: BTreeMap<String, BTreeMap<String, Vec<String>>>,
    /// For each module, those that it uses.
    pub uses: Targets,
}

fn joined(module: &str, part: &str) -> String {
    match module {
        "" => part.to_owned(),
        _ => format!("{module}/{part}"),
    }
}

fn parent(module: &str) -> &str {
    module.rsplit_once('/').map_or("", |(parent, _)| parent)
}

/// True for a module and those inside it.
fn is_around(module: &str, inside: &str) -> bool {
    let rest = inside.strip_prefix(module);
    module.is_empty() || rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

impl Graph {
    /// Of texts without comments.
    pub fn new(texts: &BTreeMap<String, String>, crates: BTreeSet<String>) -> Self {
        let written = texts.iter().map(|(module, text)| (module, paths(text)));
        let written: Vec<(&String, Vec<Path>)> = written.collect();
        let mut graph = Self {
            crates,
            modules: texts.keys().cloned().collect(),
            inline: BTreeSet::new(),
            names: BTreeMap::new(),
            uses: BTreeMap::new(),
        };
        for (module, paths) in &written {
            for path in paths {
                let mut place = (*module).clone();
                for part in &path.around {
                    place = joined(&place, part);
                    graph.inline.insert(place.clone());
                }
                if let Some(name) = &path.name {
                    let names = graph.names.entry(place).or_default();
                    names.insert(name.clone(), path.parts.clone());
                }
            }
        }
        for (module, paths) in &written {
            let targets = paths.iter().flat_map(|path| {
                let around = path.around.iter();
                let place = around.fold((*module).clone(), |place, part| joined(&place, part));
                graph.targets(&place, &path.parts, 0)
            });
            let targets = targets.filter(|target| target != *module).collect();
            graph.uses.insert((*module).clone(), targets);
        }
        graph
    }

    fn is_module(&self, name: &str) -> bool {
        self.modules.contains(name) || self.inline.contains(name)
    }

    /// The root of the crate of a module.
    fn root(&self, module: &str) -> String {
        let first = module.split('/').next().unwrap_or_default();
        self.crates.get(first).cloned().unwrap_or_default()
    }

    /// The modules to which a path in `place` leads: the one that has what is named, and those that pass it on. A module
    /// around `place` that only passes it on does not count.
    fn targets(&self, place: &str, path: &[String], passed: u32) -> Vec<String> {
        let Some((mut at, mut rest)) = self.start(place, path) else {
            return Vec::new();
        };
        while let Some((part, behind)) = rest.split_first() {
            let inside = joined(&at, part);
            match part.as_str() {
                "self" => {}
                "super" => at = parent(&at).to_owned(),
                _ if self.is_module(&inside) => at = inside,
                _ => {
                    let named = self.names.get(&at).and_then(|names| names.get(part));
                    // Names are passed on in circles only in a text that does not compile.
                    let Some(named) = named.filter(|_| passed < 8) else {
                        break;
                    };
                    let whole: Vec<String> = named.iter().chain(behind).cloned().collect();
                    let mut all = self.targets(&at, &whole, passed + 1);
                    if all.is_empty() || !is_around(&at, place) {
                        all.extend(self.file(&at));
                    }
                    return all;
                }
            }
            rest = behind;
        }
        self.file(&at).into_iter().collect()
    }

    /// Where a path in `place` begins, if that is in the program, and its further parts.
    fn start<'p>(&self, place: &str, path: &'p [String]) -> Option<(String, &'p [String])> {
        let (first, rest) = path.split_first()?;
        let at = match first.as_str() {
            "crate" => self.root(place),
            "self" => place.to_owned(),
            "super" => parent(place).to_owned(),
            first => match first.strip_prefix("outcrop_") {
                Some(name) if self.crates.contains(name) => name.to_owned(),
                _ => Some(joined(place, first)).filter(|inside| self.is_module(inside))?,
            },
        };
        Some((at, rest))
    }

    /// The module with the file of a module.
    fn file(&self, module: &str) -> Option<String> {
        let mut at = module;
        while !self.modules.contains(at) {
            if at.is_empty() {
                return None;
            }
            at = parent(at);
        }
        Some(at.to_owned())
    }

    /// Circles of modules beside each other, each with all that is inside it. What a module and those inside it take
    /// from each other is their own affair.
    pub fn circles(&self) -> Vec<Vec<String>> {
        let mut levels: BTreeMap<String, Targets> = BTreeMap::new();
        for (from, targets) in &self.uses {
            for to in targets {
                let (a, b): (Vec<_>, Vec<_>) = (from.split('/').collect(), to.split('/').collect());
                let same = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
                if same < a.len() && same < b.len() && !from.is_empty() && !to.is_empty() {
                    let level = levels.entry(a[..same].join("/")).or_default();
                    let targets = level.entry(a[..=same].join("/")).or_default();
                    targets.insert(b[..=same].join("/"));
                }
            }
        }
        levels.values().flat_map(circles_of).collect()
    }
}

type Targets = BTreeMap<String, BTreeSet<String>>;

fn reached<'a>(graph: &'a Targets, from: &'a String) -> BTreeSet<&'a String> {
    let (mut seen, mut stack) = (BTreeSet::new(), vec![from]);
    while let Some(at) = stack.pop() {
        let next = graph.get(at).into_iter().flatten();
        stack.extend(next.filter(|next| seen.insert(*next)));
    }
    seen
}

/// The groups in which each reaches each other.
fn circles_of(graph: &Targets) -> Vec<Vec<String>> {
    let all = graph.keys().map(|at| (at, reached(graph, at)));
    let reach: BTreeMap<&String, BTreeSet<&String>> = all.collect();
    let groups = reach.iter().filter_map(|(at, seen)| {
        let back = |other: &&&String| reach.get(**other).is_some_and(|all| all.contains(at));
        let group: Vec<String> = seen.iter().filter(back).map(|at| (*at).clone()).collect();
        (group.first() == Some(*at)).then_some(group)
    });
    groups.collect()
}
