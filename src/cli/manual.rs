//! Manual pages and completions for shells, made from the arguments themselves.

use super::command::{Args, EXAMPLES, EXIT_CODES};
use super::output::print;
use clap::{Command, CommandFactory};
use clap_complete::Shell;
use clap_mangen::roff::{Roff, bold, roman};
use outcrop_disk::error::{Error, Result};
use std::io;
use std::path::Path;

/// Prints a script that completes commands and options.
pub fn completions(shell: Shell) -> Result<bool> {
    let mut script = Vec::new();
    let mut command = shown(&Args::command());
    clap_complete::generate(shell, &mut command, "outcrop", &mut script);
    print(String::from_utf8_lossy(&script).trim_end())?;
    Ok(true)
}

/// A command without hidden options, which completions would show.
fn shown(command: &Command) -> Command {
    let arguments = command.get_arguments().filter(|a| !a.is_hide_set());
    Command::new(command.get_name().to_owned())
        .about(command.get_about().cloned().unwrap_or_default())
        .version(env!("CARGO_PKG_VERSION"))
        .disable_version_flag(command.get_version().is_none())
        .args(arguments.cloned())
        .subcommands(command.get_subcommands().map(shown))
}

/// Writes all manual pages.
pub fn man(folder: &Path) -> Result<bool> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "make the folder", e))?;
    let pages = pages().map_err(|e| Error::io(folder, "make the pages", e))?;
    for (name, page) in pages {
        let path = folder.join(name);
        std::fs::write(&path, page).map_err(|e| Error::io(&path, "write", e))?;
    }
    Ok(true)
}

/// The manual pages with their file names: that of the program, and one for each command.
fn pages() -> io::Result<Vec<(String, Vec<u8>)>> {
    let mut program = Args::command().disable_help_subcommand(true);
    program.build();
    let commands = || program.get_subcommands();
    let names: Vec<&str> = commands().filter_map(Command::get_display_name).collect();
    let mut pages = vec![page(&program, &names)?];
    for command in commands() {
        pages.push(page(command, &["outcrop"])?);
    }
    Ok(pages)
}

/// The page of a command, which names related pages.
fn page(command: &Command, related: &[&str]) -> io::Result<(String, Vec<u8>)> {
    // One line instead of a list of all options.
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ").to_owned();
    let page = clap_mangen::Man::new(command.clone().override_usage(usage))
        .source(concat!("outcrop ", env!("CARGO_PKG_VERSION")))
        // Pages of one version are equal whenever they are made; without a date the version would take its place.
        .date(" ")
        .manual("outcrop");
    let mut text = Vec::new();
    page.render_title(&mut text)?;
    page.render_name_section(&mut text)?;
    page.render_synopsis_section(&mut text)?;
    page.render_description_section(&mut text)?;
    page.render_options_section(&mut text)?;
    let mut roff = Roff::new();
    if command.has_subcommands() {
        page.render_subcommands_section(&mut text)?;
        roff.control("SH", ["EXAMPLES"]);
        roff.control("nf", []);
        for line in EXAMPLES.lines() {
            roff.text([roman(line.trim_start())]);
        }
        roff.control("fi", []);
        roff.control("SH", ["EXIT STATUS"]);
        roff.text([roman(EXIT_CODES)]);
    }
    roff.control("SH", ["SEE ALSO"]);
    for (place, name) in (1..).zip(related) {
        let end = if place < related.len() { "(1)," } else { "(1)" };
        roff.text([bold(*name), roman(end)]);
    }
    roff.to_writer(&mut text)?;
    Ok((page.get_filename(), text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_a_page_with_all_of_its_options() {
        let pages = pages().expect("memory can be written to");
        let mut program = Args::command().disable_help_subcommand(true);
        program.build();
        let all = std::iter::once(&program).chain(program.get_subcommands());
        let all: Vec<&Command> = all.collect();
        assert_eq!(pages.len(), all.len());
        assert!(all.len() > 10);
        for command in all {
            let name = command.get_display_name().unwrap_or("outcrop");
            let found = pages.iter().find(|(file, _)| *file == format!("{name}.1"));
            let (_, text) = found.unwrap_or_else(|| panic!("no page of {name}"));
            let text = String::from_utf8_lossy(text).replace("\\-", "-");
            for argument in command.get_arguments() {
                let Some(long) = argument.get_long() else {
                    continue;
                };
                let listed = text.contains(&format!("--{long}\\fR"));
                assert_eq!(listed, !argument.is_hide_set(), "{name}: --{long}\n{text}");
            }
        }
    }
}
