//! Height rasters of meshes and clouds of any size, in bounded memory, with orthophotos and contours.
//!
//! Triangles are sampled at the middles of cells (`mesh`), points in the cells in which they are (`cloud`). The samples
//! are sorted by cell on disk (`samples`), and the one that counts becomes the cell's height (`cells`). Rasters are
//! written as GeoTIFF (`geotiff`), and lines between their cells as GeoJSON (`contours`).

mod cells;
mod cloud;
mod contours;
mod geotiff;
mod grid;
mod keys;
mod lines;
mod mesh;
mod output;
mod report;
mod samples;
#[cfg(test)]
mod tests;

pub use report::{Contours, Raster, Source, Surface};

use crate::pieces;
use crate::units::system;
use cells::{Found, Level, pyramid};
use cloud::Cloud;
use contours::Map;
use geotiff::{Kind, Picture};
use grid::Grid;
use keys::Keys;
use mesh::Columns;
use outcrop_codecs::ply_mesh::holds_faces;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::Sorter;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::region::Region;
use outcrop_points::{Crs, Ingest, Spool, is_remote};
use samples::{Choice, Samples, Scale};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Name of the option for the length of cells.
const CELL: &str = "cell";

/// Name of that for the interval of contours.
const INTERVAL: &str = "contours";

/// Name of that for the raster.
const OUTPUT: &str = "output";

/// The number that stands for no height, unless heights are as low.
const NOTHING: f32 = -9999.0;

/// The files of a raster, the length of its cells, and the heights that they have.
#[derive(Debug, Clone, Serialize)]
pub struct Options {
    /// The GeoTIFF file of heights.
    pub output: PathBuf,
    /// Length of the sides of a cell, in the unit of the coordinates.
    pub cell: f64,
    /// Which heights the cells have.
    pub surface: Surface,
    /// The region in plan: cells with their middles outside have no height. Everywhere without one.
    pub crop: Option<Region>,
    /// The GeoTIFF file of colours, if there is to be one.
    pub orthophoto: Option<PathBuf>,
    /// Height between two contours, if they are to be made, and their GeoJSON file.
    pub contours: Option<(f64, PathBuf)>,
}

impl Options {
    /// Refuses names that are not those of the formats, and options that make no sense together.
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn check(&self, source: &Path) -> Result<()> {
        let tiff = "a name that ends with .tif";
        check_name(&self.output, OUTPUT, &["tif", "tiff"], tiff)?;
        if let Some(path) = &self.orthophoto {
            check_name(path, "orthophoto", &["tif", "tiff"], tiff)?;
        }
        if let Some((_, path)) = &self.contours {
            let expected = "a name that ends with .geojson";
            check_name(path, "contours_output", &["geojson", "json"], expected)?;
        }
        let refuse = |name, found: String, expected: &str| {
            Err(Error::Parameter {
                name,
                found,
                expected: expected.into(),
            })
        };
        if self.orthophoto.is_some() && self.surface == Surface::GroundClass {
            let expected = "another surface with an orthophoto: ground has no colours of its own";
            return refuse("surface", "ground-class".into(), expected);
        }
        if let Some(region @ Region::Box { z: Some(_), .. }) = &self.crop {
            let expected = "a region in plan: minx,miny,maxx,maxy or polygons";
            return refuse("crop", region.to_string(), expected);
        }
        let contours = self.contours.as_ref().map(|(_, path)| path);
        let all = [Some(&self.output), self.orthophoto.as_ref(), contours];
        let mut seen = vec![source.to_path_buf()];
        for path in all.into_iter().flatten() {
            if seen.contains(path) {
                let expected = "a file that is nothing else of this run";
                return refuse(OUTPUT, path.display().to_string(), expected);
            }
            seen.push(path.clone());
        }
        Ok(())
    }

    fn columns(&self) -> Columns {
        match (self.surface, &self.orthophoto) {
            (Surface::GroundClass, _) => Columns::Ground,
            (_, Some(_)) => Columns::Colours,
            _ => Columns::None,
        }
    }

    /// The cells for what has this box.
    fn grid(&self, bounds: [[f64; 3]; 2], source: &Path) -> Result<Grid> {
        let mut plan = bounds.map(|[x, y, _]| [x, y]);
        if let Some(region) = &self.crop {
            let [low, high] = region.bounds();
            plan[0] = [0, 1].map(|k| plan[0][k].max(low[k]));
            plan[1] = [0, 1].map(|k| plan[1][k].min(high[k]));
            if (0..2).any(|k| plan[0][k] > plan[1][k]) {
                let shown = bounds.map(|[x, y, _]| format!("{x},{y}")).join(" to ");
                return Err(Error::input(
                    source,
                    "region",
                    region.to_string(),
                    format!("one that meets {shown}"),
                ));
            }
        }
        Grid::around(plan, self.cell)
    }
}

/// Refuses a name without one of these extensions, and that of a file on a server.
fn check_name(path: &Path, name: &'static str, extensions: &[&str], expected: &str) -> Result<()> {
    let own = path.extension().unwrap_or_default();
    let is_one = extensions.iter().any(|e| own.eq_ignore_ascii_case(e));
    if is_one && !is_remote(path) {
        return Ok(());
    }
    Err(Error::Parameter {
        name,
        found: path.display().to_string(),
        expected: match is_one {
            true => "a file of this machine: rasters are not written to servers".into(),
            false => expected.into(),
        },
    })
}

/// What samples are taken from.
enum Sampled {
    Mesh(Box<pieces::Surface>),
    Cloud(Box<Cloud>),
}

impl Sampled {
    fn open(path: &Path, options: &Options, ingest: Ingest, workspace: &Workspace) -> Result<Self> {
        let columns = options.columns();
        if path.is_file() && holds_faces(path)? {
            let surface = pieces::Surface::wanting(path, columns.names(), workspace)?;
            return Ok(Self::Mesh(Box::new(surface)));
        }
        // A cell at the edge of the region has points beyond it.
        let region = options.crop.as_ref().map(|region| (region, options.cell));
        let cloud = Cloud::read(path, columns, region, ingest, workspace)?;
        Ok(Self::Cloud(Box::new(cloud)))
    }

    fn bounds(&self) -> [[f64; 3]; 2] {
        match self {
            Self::Mesh(surface) => [surface.bounds().min, surface.bounds().max],
            Self::Cloud(cloud) => cloud.bounds,
        }
    }

    fn system(&self, path: &Path, workspace: &Workspace) -> Result<Option<Crs>> {
        match self {
            Self::Mesh(_) => system(path, workspace),
            Self::Cloud(cloud) => Ok(cloud.stats().crs.clone()),
        }
    }

    fn source(&self, path: &Path, system: Option<&Crs>) -> Source {
        let [mut triangles, mut points] = [None, None];
        match self {
            Self::Mesh(surface) => triangles = Some(surface.faces()),
            Self::Cloud(cloud) => points = Some(cloud.stats().kept),
        }
        Source {
            path: path.to_path_buf(),
            triangles,
            points,
            system: system.map(Crs::label),
        }
    }
}

/// Makes a height raster of a mesh, or of a cloud, which `ingest` reads.
///
/// # Errors
/// [`Error::Input`] for a file that cannot be read, or has no such columns; [`Error::Parameter`] for options that make
/// no sense; [`Error::Memory`] if the budget is too small; [`Error::Io`], [`Error::Disk`], [`Error::Corrupt`],
/// [`Error::Cancelled`].
pub fn raster(
    source: &Path,
    options: &Options,
    ingest: Ingest,
    workspace: &Workspace,
) -> Result<Raster> {
    options.check(source)?;
    // When all is done, the files of the steps inside may be gone.
    workspace.once("raster", |_| {
        let sampled = |unit: &Unit<'_>| sampled(source, options, ingest, unit, workspace);
        let mut made = workspace.once("cells", sampled)?;
        // Not before: an attempt that was killed needs it again.
        let spool = made.spool.take();
        spool.map_or(Ok(()), |spool| spool.release(workspace))?;
        let raster = made.write(options, workspace)?;
        made.level.release(workspace)?;
        Ok(raster)
    })
}

/// The cells, and what is told of them.
fn sampled(
    source: &Path,
    options: &Options,
    ingest: Ingest,
    unit: &Unit<'_>,
    workspace: &Workspace,
) -> Result<Made> {
    let sampled = Sampled::open(source, options, ingest, workspace)?;
    let system = sampled.system(source, workspace)?;
    let keys = Keys::of(system.as_ref());
    if let (false, Some(system)) = (keys.is_known, &system) {
        workspace.observer.warn(&format!(
            "the reference system {} has no code of EPSG: the raster has its name only",
            system.label()
        ));
    }
    let grid = options.grid(sampled.bounds(), source)?;
    let about = sampled.source(source, system.as_ref());
    let (level, found) = fill(&sampled, &grid, options, unit, workspace)?;
    if found.cells == 0 {
        let expected = match options.surface {
            Surface::GroundClass => "some that are classified as ground, or a larger region",
            _ => "one or more: shorter cells, or a larger region",
        };
        return Err(Error::input(
            source,
            "cells",
            "none with a height",
            expected,
        ));
    }
    if let Some((interval, _)) = options.contours {
        contours::check(interval, found.heights)?;
    }
    Ok(Made {
        source: about,
        grid,
        keys,
        level,
        found,
        spool: match sampled {
            Sampled::Mesh(_) => None,
            Sampled::Cloud(cloud) => Some(cloud.into_spool()),
        },
        system: system.as_ref().and_then(|system| system.horizontal),
    })
}

/// The cells of a raster.
fn fill(
    sampled: &Sampled,
    grid: &Grid,
    options: &Options,
    unit: &Unit<'_>,
    workspace: &Workspace,
) -> Result<(Level, Found)> {
    let [low, high] = sampled.bounds();
    let bytes = options.crop.as_ref().map_or(0, Region::area_bytes);
    let _area = workspace.reserve("raster: region", bytes)?;
    let buffer = workspace.memory.available() / 2;
    let held = workspace.reserve("raster: samples", buffer)?;
    let samples = Samples {
        grid: *grid,
        choice: match (options.surface, sampled) {
            (Surface::Lowest, _) => Choice::Lowest,
            (Surface::GroundClass, Sampled::Cloud(_)) => Choice::Mean,
            _ => Choice::Highest,
        },
        scale: Scale::of([low[2], high[2]]),
        area: options.crop.as_ref().map(Region::area),
        sorter: Sorter::new(workspace, "raster.samples", buffer).reporting(held),
    };
    match sampled {
        Sampled::Mesh(surface) => mesh::sample(surface, options.columns(), &samples, workspace)?,
        Sampled::Cloud(cloud) => cloud.sample(&samples, workspace)?,
    }
    Level::of_samples(grid, samples, unit, workspace)
}

/// A raster with all that is known of it.
#[derive(Serialize, Deserialize)]
struct Made {
    source: Source,
    grid: Grid,
    keys: Keys,
    level: Level,
    found: Found,
    /// The file of the points.
    spool: Option<Spool>,
    /// Code of EPSG.
    system: Option<u32>,
}

impl Made {
    /// The number that stands for no height.
    fn nothing(&self) -> f32 {
        match self.found.heights[0] > NOTHING {
            true => NOTHING,
            false => f32::MIN,
        }
    }

    /// Writes all files, but for those that an earlier attempt wrote.
    fn write(&self, options: &Options, workspace: &Workspace) -> Result<Raster> {
        let levels = pyramid(self.level.clone(), workspace)?;
        let picture = |kind| Picture {
            grid: &self.grid,
            kind,
            keys: &self.keys,
        };
        let heights = picture(Kind::Heights(self.nothing()));
        let write = |_: &Unit<'_>| heights.write(&options.output, &levels, workspace);
        let bytes = workspace.once("heights", write)?;
        let photo = options.orthophoto.as_ref().map(|path| {
            let colours = picture(Kind::Colours);
            workspace.once("colours", |_| colours.write(path, &levels, workspace))
        });
        let contours = options.contours.as_ref().map(|(interval, path)| {
            let map = Map {
                grid: &self.grid,
                interval: *interval,
                system: self.system,
            };
            workspace.once("contours", |_| map.write(path, &self.level, workspace))
        });
        let made = self.report(options, bytes, levels.len() - 1);
        for level in &levels[1..] {
            level.release(workspace)?;
        }
        Ok(Raster {
            orthophoto: options.orthophoto.clone(),
            orthophoto_bytes: photo.transpose()?,
            contours: contours.transpose()?,
            ..made
        })
    }

    fn report(&self, options: &Options, bytes: u64, overviews: usize) -> Raster {
        let ([west, north], [east, south]) = (self.grid.corner(), self.grid.far_corner());
        Raster {
            source: self.source.clone(),
            path: options.output.clone(),
            bytes,
            surface: options.surface,
            cell: self.grid.cell,
            columns: self.grid.columns,
            rows: self.grid.rows,
            min: [west, south],
            max: [east, north],
            cells: self.found.cells,
            lowest: self.found.heights[0],
            highest: self.found.heights[1],
            nothing: self.nothing(),
            overviews,
            orthophoto: None,
            orthophoto_bytes: None,
            contours: None,
        }
    }
}
