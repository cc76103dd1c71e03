//! The source text of the library, for tests of the code itself.

pub mod graph;
pub mod tokens;

use std::collections::BTreeMap;
use std::path::Path;

/// Every module of the library that is not a test; its text without comments and tests.
pub fn modules() -> BTreeMap<String, String> {
    let mut all = modules_of("src");
    all.retain(|module, _| !["main", "lib"].contains(&module.as_str()));
    assert!(all.len() > 100, "only {} modules found", all.len());
    all
}

/// Every module of a folder that is not a test; its text without comments and tests.
pub fn modules_of(source: &str) -> BTreeMap<String, String> {
    fn walk(source: &Path, folder: &Path, all: &mut BTreeMap<String, String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap();
            if path.is_dir() {
                walk(source, &path, all);
            } else if path.extension().is_some_and(|e| e == "rs") && !name.contains("tests") {
                let relative = path.strip_prefix(source).unwrap().with_extension("");
                let relative = relative.to_str().unwrap().replace('\\', "/");
                let module = relative.strip_suffix("/mod").unwrap_or(&relative);
                let module = module.strip_suffix("/lib").unwrap_or(module);
                let text = std::fs::read_to_string(&path).unwrap();
                let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
                all.insert(module.to_owned(), tokens::without_comments(text));
            }
        }
    }
    let mut all = BTreeMap::new();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(source);
    walk(&source, &source, &mut all);
    all
}
