//! Manual pages and completions that packages install.

use crate::end_to_end::util::{self, Bench};
use std::path::Path;
use std::process::Command;

/// Commands that `outcrop --help` lists.
fn commands() -> Vec<String> {
    let help = util::run(["--help"]).out;
    let list = help
        .split("Commands:\n")
        .nth(1)
        .expect("a list of commands");
    let lines = list.lines().take_while(|line| !line.is_empty());
    let names = lines.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = names.filter_map(|line| line.split_whitespace().next());
    names.map(str::to_owned).collect()
}

#[test]
fn every_command_has_a_manual_page() {
    let bench = Bench::new();
    let folder = bench.path("man");
    let said = util::run(["man".as_ref(), folder.as_os_str()]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
    let commands = commands();
    assert!(commands.len() > 14, "{commands:?}");
    for command in commands.iter().filter(|name| *name != "help") {
        let page = std::fs::read_to_string(folder.join(format!("outcrop-{command}.1")));
        let page = page.unwrap_or_else(|e| panic!("{command}: {e}"));
        assert!(page.contains(".SH SYNOPSIS"), "{page}");
    }
    let program = std::fs::read_to_string(folder.join("outcrop.1")).expect("the first page");
    assert!(program.contains(".SH EXAMPLES") && program.contains(".SH \"EXIT STATUS\""));
    assert_eq!(util::listing(&folder).len(), commands.len());

    let file = bench.write("file", "");
    let said = util::run(["man".as_ref(), file.as_os_str()]);
    assert_eq!((said.code, said.out.as_str()), (Some(2), ""), "{said:?}");
    assert_eq!(said.err.lines().count(), 1, "{said:?}");
}

/// True if the shell takes the script; none if there is no such shell.
fn takes(shell: &str, script: &Path) -> Option<bool> {
    let mut checked = Command::new(shell);
    match checked.arg("-n").arg(script).output() {
        Ok(output) => Some(output.status.success() && output.stderr.is_empty()),
        Err(_) => {
            util::skip(format_args!("there is no {shell}"));
            None
        }
    }
}

#[test]
fn shells_take_the_completions() {
    let bench = Bench::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let said = util::run(["completions", shell]);
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{said:?}");
        for word in commands() {
            assert!(said.out.contains(&word), "{shell}: no {word}");
        }
        assert!(said.out.contains("max-hole-edges"), "{shell}");
        // Options for tests.
        assert!(!said.out.contains("block-points"), "{shell}");
        let script = bench.write(&format!("script.{shell}"), &said.out);
        if ["bash", "zsh", "fish"].contains(&shell) {
            assert_ne!(takes(shell, &script), Some(false), "{shell}");
        }
    }
    let broken = bench.write("broken", "if [ ; then");
    assert_ne!(takes("bash", &broken), Some(true));
    assert_eq!(util::run(["completions", "cmd"]).code, Some(2));
}
