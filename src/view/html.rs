//! A page in one file: the viewer with as many levels of detail as fit.

use super::assets::{LICENCES, PAGE, SCRIPT, STYLE};
use super::folder::{Folder, Opened};
use super::tileset::{Tile, Tileset};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use outcrop_disk::error::{Error, Result};
use serde::Serialize;
use std::cmp::Ordering;
use std::collections::{BTreeSet, BinaryHeap};
use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// Places of the page where the contents go, as `tools/viewer/build` leaves them.
const STYLE_PLACE: &str = "<link rel=\"stylesheet\" href=\"viewer.css\">";
const SCRIPT_PLACE: &str = "<script type=\"module\" src=\"viewer.js\"></script>";

/// Contents that the page may load: nothing but what is in it.
const POLICY: &str = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src \
    'unsafe-inline' 'wasm-unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; \
    form-action 'none'\">\n";

/// Counts of the tiles in a page, and its size.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Embedded {
    /// Tiles in the page.
    pub tiles: u64,
    /// Tiles of the tileset.
    pub of_tiles: u64,
    /// Triangles of the finest tiles in the page.
    pub triangles: u64,
    /// Triangles of the mesh.
    pub of_triangles: u64,
    /// Length of the page in bytes.
    pub bytes: u64,
}

/// Writes one self-contained page of at most `limit` bytes that shows the tileset of a folder: levels of
/// detail where the mesh needs them most, as many as fit.
///
/// # Errors
/// If the tileset is not valid, the limit too small for its coarsest tile, or the page cannot be written.
pub fn write_html(folder: &Path, page: &Path, limit: u64) -> Result<Embedded> {
    let mut tileset = Tileset::open(folder)?;
    let files = Folder::new(folder).map_err(|e| Error::io(folder, "open the folder", e))?;
    let triangles = tileset.property("triangles").and_then(|n| n.as_u64());
    let mut choice = Choice::new(&files, &tileset)?;
    let chosen = choice.choose(&tileset.root, limit)?;
    let of_tiles = count(&tileset.root);
    prune(&mut tileset.root, &chosen);
    let mut shown = 0;
    let mut uris = Vec::new();
    walk(&tileset.root, &mut |tile| {
        if tile.children.is_empty() {
            shown += tile.triangles();
        }
        uris.extend(tile.content.as_ref().map(|content| content.uri.clone()));
    });
    let unfinished = unfinished(page);
    let written = write(&tileset, &files, &uris, &unfinished);
    let finished = written.and_then(|bytes| {
        let renamed = outcrop_platform::rename(&unfinished, page);
        renamed.map_err(|e| Error::io(page, "write the page", e))?;
        Ok(bytes)
    });
    let bytes = finished.inspect_err(|_| drop(std::fs::remove_file(&unfinished)))?;
    Ok(Embedded {
        tiles: count(&tileset.root),
        of_tiles,
        triangles: shown,
        of_triangles: triangles.unwrap_or(shown),
        bytes,
    })
}

/// The name of the page until it is complete.
fn unfinished(page: &Path) -> PathBuf {
    let mut name = page.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.tmp", std::process::id()));
    page.with_file_name(name)
}

fn walk<'a>(tile: &'a Tile, visit: &mut impl FnMut(&'a Tile)) {
    visit(tile);
    tile.children.iter().for_each(|child| walk(child, visit));
}

fn count(root: &Tile) -> u64 {
    let mut tiles = 0;
    walk(root, &mut |_| tiles += 1);
    tiles
}

/// Identifies a tile in an unchanged tree.
fn address(tile: &Tile) -> usize {
    std::ptr::from_ref(tile).addr()
}

/// Removes the children of tiles that are not to be refined.
fn prune(tile: &mut Tile, refined: &BTreeSet<usize>) {
    // Children do not move while their own ones are removed.
    if refined.contains(&address(tile)) {
        for child in &mut tile.children {
            prune(child, refined);
        }
    } else {
        tile.children.clear();
    }
}

/// The choice of the tiles that fit.
struct Choice<'a> {
    files: &'a Folder,
    /// Bytes of the page so far.
    bytes: u64,
}

/// A tile that may be refined; the one with the largest error comes first, of several the earlier one.
struct Next<'a>(&'a Tile, u64);

impl Ord for Next<'_> {
    fn cmp(&self, other: &Self) -> Ordering {
        let errors = self.0.error.total_cmp(&other.0.error);
        errors.then(other.1.cmp(&self.1))
    }
}

impl PartialOrd for Next<'_> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Next<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Next<'_> {}

impl<'a> Choice<'a> {
    fn new(files: &'a Folder, tileset: &Tileset) -> Result<Self> {
        let fixed = [PAGE, SCRIPT, STYLE, LICENCES].map(|asset| asset.bytes.len());
        let fixed = fixed.iter().sum::<usize>() + POLICY.len();
        let more = json(&(&tileset.asset, &tileset.more))?.len() + 1024;
        Ok(Self {
            files,
            bytes: (fixed + more) as u64,
        })
    }

    /// Bytes of a tile in the page, at most.
    fn cost(&self, tile: &Tile) -> Result<u64> {
        let mut bytes = json(&(tile.error, &tile.content, &tile.more))?.len() as u64 + 80;
        if let Some(content) = &tile.content {
            let opened = open(self.files, &content.uri)?;
            let uri = content.uri.len() as u64;
            bytes += opened.length.div_ceil(3) * 4 + 2 * uri + 80;
        }
        Ok(bytes)
    }

    /// The tiles to refine, by address.
    fn choose(&mut self, root: &Tile, limit: u64) -> Result<BTreeSet<usize>> {
        self.bytes += self.cost(root)?;
        if self.bytes > limit {
            return Err(Error::Parameter {
                name: "html_limit",
                found: format!("{limit} bytes"),
                expected: format!("at least {} for the page and the coarsest tile", self.bytes),
            });
        }
        let mut refined = BTreeSet::new();
        let (mut queue, mut number) = (BinaryHeap::from([Next(root, 0)]), 0);
        while let Some(Next(tile, _)) = queue.pop() {
            if tile.children.is_empty() {
                continue;
            }
            let costs = tile.children.iter().map(|child| self.cost(child));
            let cost: u64 = costs.sum::<Result<u64>>()?;
            if self.bytes.saturating_add(cost) > limit {
                continue;
            }
            self.bytes += cost;
            refined.insert(address(tile));
            for child in &tile.children {
                number += 1;
                queue.push(Next(child, number));
            }
        }
        Ok(refined)
    }
}

fn json<T: Serialize>(value: &T) -> Result<String> {
    // Inside a script element no text may end it.
    let text = serde_json::to_string(value).map(|text| text.replace('<', "\\u003c"));
    text.map_err(|e| Error::io("the page", "write JSON", e.into()))
}

/// The file of a tile.
fn open(files: &Folder, uri: &str) -> Result<Opened> {
    files.open(uri.split('/')).ok_or_else(|| {
        let found = format!("the tile {uri:?}, which cannot be read");
        Error::input(
            files.path().join(super::tileset::NAME),
            "content",
            found,
            "a .glb file below the folder",
        )
    })
}

/// Writes the page and returns its length.
fn write(tileset: &Tileset, files: &Folder, uris: &[String], path: &Path) -> Result<u64> {
    let failed = |e: io::Error| Error::io(path, "write the page", e);
    let mut out = BufWriter::new(File::create(path).map_err(failed)?);
    let page = String::from_utf8_lossy(PAGE.bytes);
    let invalid = || failed(io::Error::other("the viewer's page is not as expected"));
    let (head, rest) = page.split_once(STYLE_PLACE).ok_or_else(invalid)?;
    let (middle, tail) = rest.split_once(SCRIPT_PLACE).ok_or_else(invalid)?;
    let tree = json(tileset)?;
    let parts: [&[u8]; 11] = [
        head.as_bytes(),
        POLICY.as_bytes(),
        b"<style>",
        STYLE.bytes,
        b"</style>",
        middle.as_bytes(),
        b"<script type=\"text/plain\" id=\"licences\">",
        LICENCES.bytes,
        b"</script>\n<script type=\"application/json\" id=\"embedded-tileset\">",
        tree.as_bytes(),
        b"</script>\n",
    ];
    parts
        .iter()
        .try_for_each(|part| out.write_all(part))
        .map_err(failed)?;
    for uri in uris {
        let opened = open(files, uri)?;
        embed(&mut out, uri, opened).map_err(failed)?;
    }
    let parts: [&[u8]; 4] = [
        b"<script type=\"module\">",
        SCRIPT.bytes,
        b"</script>",
        tail.as_bytes(),
    ];
    parts
        .iter()
        .try_for_each(|part| out.write_all(part))
        .map_err(failed)?;
    let file = out.into_inner().map_err(|e| failed(e.into_error()))?;
    file.sync_all().map_err(failed)?;
    Ok(file.metadata().map_err(failed)?.len())
}

/// Writes a tile as base64, under its name, which is base64 too, so that no name ends an element.
fn embed(out: &mut impl Write, uri: &str, opened: Opened) -> io::Result<()> {
    out.write_all(b"<script type=\"text/plain\" data-uri=\"")?;
    out.write_all(STANDARD.encode(uri).as_bytes())?;
    out.write_all(b"\">")?;
    let mut encoder = EncoderWriter::new(&mut *out, &STANDARD);
    let copied = io::copy(&mut opened.file.take(opened.length), &mut encoder)?;
    encoder.finish()?;
    drop(encoder);
    if copied != opened.length {
        return Err(io::Error::other(format!("{uri} became shorter")));
    }
    out.write_all(b"</script>\n")
}
