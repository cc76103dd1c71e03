//! What `--version` says of the build.

use crate::end_to_end::util;
use std::path::Path;
use std::process::Command;

/// The commit of the sources, by git; none, with a message, if there is no repository, or no git.
fn commit() -> Option<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let git = Command::new("git")
        .args(["rev-parse", "--short=12", "HEAD"])
        .current_dir(root)
        .output();
    let said = git.ok().filter(|said| said.status.success());
    // cargo itself sets OUTCROP_COMMIT for tests, so that it says nothing of who built the program.
    let is_here = root.join(".git").exists();
    let Some(said) = said.filter(|_| is_here) else {
        util::skip("the sources are in no repository of their own, or there is no git");
        return None;
    };
    Some(String::from_utf8(said.stdout).unwrap().trim().to_owned())
}

#[test]
fn the_version_is_that_of_program_method_commit_and_features() {
    let said = util::run(["--version"]);
    let start = format!("outcrop {} (method 3, commit ", env!("CARGO_PKG_VERSION"));
    let rest = said.out.strip_prefix(&start).expect(&said.out);
    let (found, rest) = rest.split_once(", ").expect(&said.out);
    assert_eq!(
        rest,
        "features demo, e57, levels, pages, view, cloud, faults)\n"
    );
    if let Some(commit) = commit() {
        assert!(found == commit, "{found} is not {commit}");
    }
    assert_eq!(
        util::run(["-V"]).out.trim(),
        start.split(" (").next().unwrap()
    );
}
