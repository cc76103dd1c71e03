//! `outcrop view`: a mesh in the browser.

use super::args::{Limits, size};
use super::output::print;
use super::{stop, style};
use crate::error::{Error, Result};
use crate::view::{Server, write_html};
use clap::Args as ClapArgs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// `outcrop view`
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "The page is served to browsers on this machine only, until Ctrl-C. Nothing is fetched from elsewhere."
)]
pub struct View {
    /// A folder that `outcrop tiles` made, or a mesh (PLY), of which levels of detail are made first
    #[arg(value_name = "DIR|MESH.ply")]
    pub mesh: PathBuf,
    /// Port of the server [default: a free one]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub port: Option<u16>,
    /// Only print the address, open no browser
    #[arg(long)]
    pub no_browser: bool,
    /// Write one page that shows the coarser levels without a server, for sending, instead of serving
    #[arg(long, value_name = "FILE", conflicts_with_all = ["port", "no_browser"])]
    pub html: Option<PathBuf>,
    /// Largest size of that page
    #[arg(long, value_name = "SIZE", default_value = "20MB", requires = "html", value_parser = size)]
    pub html_limit: u64,
    #[command(flatten)]
    pub limits: Limits,
}

/// Shows a mesh until a signal comes, or writes the page.
pub fn run(args: &View) -> Result<bool> {
    let folder = folder(&args.mesh)?;
    if let Some(page) = &args.html {
        return write(folder, page, args.html_limit, args.limits.quiet);
    }
    let cancel = stop::watch(None);
    let server = Server::start(folder, args.port)?;
    let url = server.url();
    print(&url)?;
    if !args.limits.quiet {
        eprintln!(
            "outcrop: {} is shown there; Ctrl-C ends it",
            folder.display()
        );
    }
    if !args.no_browser {
        open(&url);
    }
    // A channel without senders tells the same.
    let _ = cancel.raised().recv();
    server.stop();
    Ok(true)
}

/// The folder with the tileset.
fn folder(mesh: &Path) -> Result<&Path> {
    if mesh.is_dir() {
        return Ok(mesh);
    }
    let tileset = mesh.file_name().is_some_and(|name| name == "tileset.json");
    match mesh.parent().filter(|_| tileset) {
        Some(parent) if parent.as_os_str().is_empty() => Ok(Path::new(".")),
        Some(parent) => Ok(parent),
        None if mesh.exists() => Err(Error::input(
            mesh,
            "path",
            "a file",
            "a folder that `outcrop tiles` made",
        )),
        None => Err(Error::io(mesh, "open", std::io::ErrorKind::NotFound.into())),
    }
}

fn write(folder: &Path, page: &Path, limit: u64, quiet: bool) -> Result<bool> {
    let embedded = write_html(folder, page, limit)?;
    if !quiet {
        print(&format!(
            "{}: {}, {} of {} tiles, {} of {} triangles",
            page.display(),
            style::bytes(embedded.bytes),
            style::grouped(embedded.tiles),
            style::grouped(embedded.of_tiles),
            style::grouped(embedded.triangles),
            style::grouped(embedded.of_triangles),
        ))?;
    }
    Ok(true)
}

/// Opens a browser, if there is one.
fn open(url: &str) {
    let (program, before): (&str, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(windows) {
        ("cmd", &["/C", "start", ""])
    } else {
        let screen = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        if !["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(screen) {
            return;
        }
        ("xdg-open", &[])
    };
    let mut command = Command::new(program);
    command.args(before).arg(url);
    let silent = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    if let Ok(mut child) = silent.spawn() {
        // It may stay for as long as the browser does.
        std::thread::spawn(move || child.wait());
    }
}
