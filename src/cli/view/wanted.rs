//! The meshes and points that the arguments name; invalid ones are refused before any work.

use super::super::args::View;
use super::super::jobs::local;
use outcrop_disk::error::{Error, Result};
use outcrop_view::{Part, Place, check};
use std::path::{Path, PathBuf};

/// A mesh or a cloud of the arguments.
pub struct Item<'a> {
    pub part: Part,
    /// Its name on the page.
    pub name: String,
    pub source: Source<'a>,
}

/// Where it comes from.
pub enum Source<'a> {
    /// Levels of detail that are there.
    Folder(PathBuf),
    /// A mesh, of which they are made.
    Mesh(&'a Path),
    /// A cloud, which is thinned.
    Cloud(&'a Path),
}

impl Source<'_> {
    fn path(&self) -> &Path {
        match self {
            Self::Folder(folder) => folder,
            Self::Mesh(path) | Self::Cloud(path) => path,
        }
    }

    /// The source of its reference system: the tileset, or the EPSG code of a mesh.
    fn place(&self) -> Result<Place<'_>> {
        Ok(match self {
            Self::Folder(folder) => Place::Folder(folder),
            Self::Mesh(path) => Place::Mesh(path, outcrop_levels::epsg(path)?),
            Self::Cloud(path) => Place::Mesh(path, None),
        })
    }
}

/// All that is to be shown.
pub fn items(args: &View) -> Result<Vec<Item<'_>>> {
    let mut sources = vec![(Part::First, source(&args.mesh)?)];
    if let Some(other) = &args.other {
        sources.push((Part::Second, source(other)?));
    }
    let made = |(_, source): &&(Part, Source<'_>)| matches!(source, Source::Mesh(_));
    if let Some(Some(kept)) = &args.keep
        && sources.iter().filter(made).count() > 1
    {
        return Err(Error::Parameter {
            name: "keep",
            found: format!("{} for two meshes", kept.display()),
            expected: "no folder, so that each is kept beside its mesh".into(),
        });
    }
    if let Some(cloud) = &args.points {
        readable_cloud(cloud)?;
        sources.push((Part::Points, Source::Cloud(cloud)));
    }
    let places = sources.iter().map(|(_, source)| source.place());
    check(&places.collect::<Result<Vec<_>>>()?)?;
    let paths: Vec<PathBuf> = sources
        .iter()
        .map(|(_, source)| source.path().to_path_buf())
        .collect();
    let items = sources.into_iter().enumerate();
    let items = items.map(|(number, (part, source))| Item {
        part,
        name: name(&paths, number),
        source,
    });
    Ok(items.collect())
}

/// Levels of detail, if the path has them, or a mesh that can be read.
fn source(path: &Path) -> Result<Source<'_>> {
    local(path)?;
    let tileset = path.file_name().is_some_and(|name| name == "tileset.json");
    if path.is_dir() || tileset {
        let folder = match path.parent().filter(|_| !path.is_dir()) {
            Some(parent) if parent.as_os_str().is_empty() => PathBuf::from("."),
            Some(parent) => parent.to_path_buf(),
            None => path.to_path_buf(),
        };
        return Ok(Source::Folder(folder));
    }
    std::fs::File::open(path).map_err(|e| Error::io(path, "open", e))?;
    Ok(Source::Mesh(path))
}

/// An error if a cloud has no file that can be read, as far as the beginning of the first one shows.
fn readable_cloud(cloud: &Path) -> Result<()> {
    let files = outcrop_formats::expand(&[cloud.to_path_buf()])?;
    files
        .first()
        .map_or(Ok(()), |file| outcrop_formats::probe(file).map(|_| ()))
}

/// The shortest end of one of these paths that none of the others has.
fn name(paths: &[PathBuf], number: usize) -> String {
    let whole = |path: &PathBuf| std::path::absolute(path).unwrap_or_else(|_| path.clone());
    let all: Vec<PathBuf> = paths.iter().map(whole).collect();
    let end = |path: &Path, parts: usize| -> PathBuf {
        let skipped = path.components().count().saturating_sub(parts);
        path.components().skip(skipped).collect()
    };
    let own = &all[number];
    let others = || all.iter().filter(|other| *other != own);
    let differs = |parts: &usize| others().all(|other| end(other, *parts) != end(own, *parts));
    let parts = (1..=own.components().count()).find(differs).unwrap_or(1);
    end(own, parts).display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_as_short_as_they_can_be_told_apart() {
        let named = |paths: &[&str]| {
            let paths: Vec<PathBuf> = paths.iter().map(PathBuf::from).collect();
            (0..paths.len())
                .map(|n| name(&paths, n))
                .collect::<Vec<_>>()
        };
        assert_eq!(
            named(&["/x/2023/mesh.ply", "/x/2024/mesh.ply"]),
            ["2023/mesh.ply", "2024/mesh.ply"]
        );
        assert_eq!(
            named(&["/x/before.ply", "/x/after.ply", "/y/c.laz"]),
            ["before.ply", "after.ply", "c.laz"]
        );
        assert_eq!(named(&["/x/a.ply", "/x/a.ply"]), ["a.ply", "a.ply"]);
    }
}
