//! `outcrop view`: meshes in the browser, and points beside them.

mod opening;
mod scratch;
mod wanted;

use super::args::{Quiet, View};
use super::output::print;
use super::{jobs, stop, style};
use crate::pipeline::Tiles;
use opening::{Beginning, Opening};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_formats::ingest_selected;
use outcrop_levels::cloud;
use outcrop_view::{Part, Server, write_html};
use scratch::{Scratch, scratch};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use wanted::{Item, Source, items};

/// Time between two looks whether the program is to end.
const WAIT: Duration = Duration::from_millis(100);

/// Shows meshes until a signal comes, or writes the page.
pub fn run(args: &View) -> Result<bool> {
    let (observer, cancel) = stop::watched(args.limits.quiet);
    let items = items(args)?;
    let mut maker = Maker {
        args,
        cancel: &cancel,
        scratch: None,
    };
    if let (Some(page), [item, ..]) = (&args.html, &items[..]) {
        let folder = maker.folder(item, observer)?;
        return write(&folder, page, args.html_limit, args.limits.quiet);
    }
    let parts: Vec<(Part, String)> = items.iter().map(|i| (i.part, i.name.clone())).collect();
    let server = Server::open(&parts, args.port)?;
    let names: Vec<String> = parts.into_iter().map(|(_, name)| name).collect();
    let line = format!("{} is shown there; Ctrl-C ends it", names.join(", "));
    let opening = Opening::new(
        server.url(),
        !args.no_browser,
        args.limits.quiet.tells().then_some(line),
    );
    if let Err(error) = maker.show(&items, &server, &Arc::new(opening), &observer) {
        if !matches!(error, Error::Cancelled) {
            server.fail(&error.to_string());
        }
        return Err(error);
    }
    while !cancel.is_cancelled() {
        std::thread::sleep(WAIT);
    }
    server.stop();
    Ok(true)
}

/// Makes what is not there yet.
struct Maker<'a> {
    args: &'a View,
    cancel: &'a Cancel,
    /// Deleted at the end.
    scratch: Option<Scratch>,
}

impl Maker<'_> {
    /// Shows one item after the other, as soon as it is there.
    fn show(
        &mut self,
        items: &[Item<'_>],
        server: &Server,
        opening: &Arc<Opening>,
        observer: &Arc<dyn Observer>,
    ) -> Result<()> {
        for item in items {
            let begins = Beginning {
                opening: opening.clone(),
                other: observer.clone(),
            };
            let folder = self.folder(item, server.observer(item.part, Arc::new(begins)))?;
            server.show(item.part, &folder)?;
            opening.now()?;
        }
        Ok(())
    }

    /// The folder with the tileset of an item.
    fn folder(&mut self, item: &Item<'_>, observer: Arc<dyn Observer>) -> Result<PathBuf> {
        match &item.source {
            Source::Folder(folder) => Ok(folder.clone()),
            Source::Mesh(mesh) => self.tiles(mesh, item.part, observer),
            Source::Cloud(cloud) => self.points(cloud, &item.name, observer),
        }
    }

    /// Levels of detail of a mesh: those that were kept, if they are newer than it, or new ones.
    fn tiles(&mut self, mesh: &Path, part: Part, observer: Arc<dyn Observer>) -> Result<PathBuf> {
        let kept = self.args.keep.as_ref();
        let kept = kept.map(|folder| folder.clone().unwrap_or_else(|| tiles_of(mesh)));
        let limits = &self.args.limits;
        let (folder, place) = match kept {
            Some(folder) if is_newer(&folder.join(outcrop_levels::NAME), mesh) => {
                return Ok(folder);
            }
            Some(folder) => (folder, limits.scratch.clone()),
            None => {
                let place = self.place()?;
                let name = match part {
                    Part::Second => "second",
                    _ => "tiles",
                };
                (place.join(name), Some(place))
            }
        };
        let mut tiles = Tiles::new(mesh, &folder)
            .memory(jobs::memory(limits))
            .threads(jobs::threads(limits))
            .storage(limits.storing.storage())
            .start(self.args.again.start())
            .observer(observer)
            .cancel(self.cancel.clone());
        if let Some(place) = place {
            tiles = tiles.scratch(place);
        }
        tiles.run()?;
        Ok(folder)
    }

    /// A tileset with a part of the points of a cloud.
    fn points(&mut self, path: &Path, name: &str, observer: Arc<dyn Observer>) -> Result<PathBuf> {
        let (place, limits) = (self.place()?, &self.args.limits);
        let memory = MemoryPool::new(jobs::memory(limits))?;
        let cancel = self.cancel.clone();
        let workspace = Workspace::new(&place, memory, jobs::threads(limits), observer, cancel)?;
        workspace.set_storage(limits.storing.storage())?;
        let folder = place.join("points");
        let made = cloud::tileset(
            path,
            name,
            &folder,
            self.args.points_limit,
            ingest_selected,
            &workspace,
        )?;
        if limits.quiet.tells() && made.points < made.of_points {
            eprintln!(
                "outcrop: {name}: {} of {} points are shown, one in each box of at most {}",
                style::grouped(made.points),
                style::grouped(made.of_points),
                made.side as f32,
            );
        }
        Ok(folder)
    }

    /// The folder for what is deleted at the end: in that for scratch files, or beside the first mesh.
    fn place(&mut self) -> Result<PathBuf> {
        let beside = self.args.mesh.parent();
        let beside = beside.filter(|parent| !parent.as_os_str().is_empty());
        let place = self.args.limits.scratch.as_deref().or(beside);
        let made = match &mut self.scratch {
            Some(made) => made,
            none => none.insert(scratch(place.unwrap_or(Path::new(".")))?),
        };
        Ok(made.path().to_path_buf())
    }
}

/// The folder where the levels of detail of a mesh are kept.
fn tiles_of(mesh: &Path) -> PathBuf {
    let mut name = mesh.file_stem().unwrap_or_default().to_os_string();
    name.push("-tiles");
    mesh.with_file_name(name)
}

/// True if a file was made after another one.
fn is_newer(file: &Path, other: &Path) -> bool {
    let modified = |path: &Path| path.metadata().and_then(|about| about.modified()).ok();
    matches!((modified(file), modified(other)), (Some(file), Some(other)) if file > other)
}

fn write(folder: &Path, page: &Path, limit: u64, quiet: Quiet) -> Result<bool> {
    let embedded = write_html(folder, page, limit)?;
    if quiet.tells() {
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
