//! The arguments of `outcrop change`, `outcrop raster` and `outcrop volume`.

use super::{Again, Limits};
use crate::cli::parse::{above, region};
use crate::params::Region;
use clap::{Args as ClapArgs, ValueEnum};
use outcrop_survey::raster;
use outcrop_survey::volume::{Above, Options};
use std::path::PathBuf;

/// `outcrop change`
#[derive(Debug, ClapArgs)]
#[command(
    after_help = "The map has the columns change (positive: growth), uncertainty (at 95 %) and significant: 1 if the change is larger, 2 if only the new mesh is there, 3 at vertices without a triangle."
)]
pub struct Change {
    /// The old surface: a mesh (PLY with faces, OBJ, STL or GLB) or a cloud (LAS, LAZ, EPT, E57, PLY, PCD, PTX, OFF, XYZ
    /// text, or a folder of them)
    #[arg(value_name = "OLD")]
    pub old: PathBuf,
    /// The new mesh
    #[arg(value_name = "NEW")]
    pub new: PathBuf,
    /// Write the new mesh with its changes
    #[arg(long, short, value_name = "MAP.ply")]
    pub output: Option<PathBuf>,
    /// Error of the registration of both, in their unit
    #[arg(long, value_name = "LENGTH", default_value_t = 0.0)]
    pub registration: f64,
    /// Radius in which positions are averaged [default: three times the mean distance of vertices]
    #[arg(long, value_name = "LENGTH")]
    pub radius: Option<f64>,
    /// The largest change that is looked for [default: fifty times the radius]
    #[arg(long, value_name = "LENGTH")]
    pub farthest: Option<f64>,
    /// Write the areas of change, as .csv or .geojson
    #[arg(long, value_name = "FILE")]
    pub areas: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Write a page with a map
    #[arg(long, value_name = "FILE.html")]
    pub html: Option<PathBuf>,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub again: Again,
}

/// Which height a cell has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Surface {
    /// The highest
    Highest,
    /// The lowest
    Lowest,
    /// That of class 2, ground: of a mesh with classes, or of a cloud (the mean)
    GroundClass,
}

/// `outcrop raster`
#[derive(Debug, ClapArgs)]
pub struct Raster {
    /// A mesh (PLY with faces, OBJ, STL or GLB) or a cloud (LAS, LAZ, EPT, E57, PLY, PCD, PTX, OFF, XYZ text, or a
    /// folder of them)
    #[arg(value_name = "MESH|CLOUD")]
    pub source: PathBuf,
    /// The raster of heights, a cloud-optimised GeoTIFF file
    #[arg(long, short, value_name = "DEM.tif")]
    pub output: PathBuf,
    /// Length of the sides of a cell, in the unit of the coordinates
    #[arg(long, value_name = "LENGTH")]
    pub cell: f64,
    /// Which height a cell has
    #[arg(long, value_enum, value_name = "WHICH", default_value_t = Surface::Highest)]
    pub surface: Surface,
    /// Only inside this region: minx,miny,maxx,maxy in the coordinates of the file, or a file with polygons (WKT or
    /// GeoJSON)
    #[arg(
        long,
        value_name = "REGION",
        value_parser = region,
        allow_hyphen_values = true
    )]
    pub crop: Option<Region>,
    /// Write the colours of the same cells, as a second GeoTIFF file
    #[arg(long, value_name = "PHOTO.tif")]
    pub orthophoto: Option<PathBuf>,
    /// Write lines of equal height, this far apart, as GeoJSON
    #[arg(long, value_name = "HEIGHT")]
    pub contours: Option<f64>,
    /// The file of contours [default: the name of the raster, with -contours.geojson]
    #[arg(long, value_name = "FILE.geojson", requires = "contours")]
    pub contours_output: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub limits: Limits,
    #[command(flatten)]
    pub again: Again,
}

impl Raster {
    /// The options of the library.
    pub fn options(&self) -> raster::Options {
        let file = self.contours_output.clone();
        let beside = || {
            let stem = self.output.file_stem().unwrap_or_default();
            let name = format!("{}-contours.geojson", stem.to_string_lossy());
            self.output.with_file_name(name)
        };
        raster::Options {
            output: self.output.clone(),
            cell: self.cell,
            surface: match self.surface {
                Surface::Highest => raster::Surface::Highest,
                Surface::Lowest => raster::Surface::Lowest,
                Surface::GroundClass => raster::Surface::GroundClass,
            },
            crop: self.crop.clone(),
            orthophoto: self.orthophoto.clone(),
            contours: self
                .contours
                .map(|interval| (interval, file.unwrap_or_else(beside))),
        }
    }
}

/// `outcrop volume`
#[derive(Debug, ClapArgs)]
pub struct Volume {
    /// The mesh (PLY, OBJ, STL or GLB, also as .zst)
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// Measure from here on, what is above and what is below: a level in the mesh's coordinates, or another mesh
    /// [default: what the mesh encloses]
    #[arg(
        long,
        value_name = "Z|OTHER",
        value_parser = above,
        allow_hyphen_values = true
    )]
    pub above: Option<Above>,
    /// Only inside this region: minx,miny,maxx,maxy in the mesh's coordinates, or a file with polygons (WKT or
    /// GeoJSON)
    #[arg(
        long,
        value_name = "REGION",
        value_parser = region,
        allow_hyphen_values = true
    )]
    pub crop: Option<Region>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub limits: Limits,
}

impl Volume {
    /// What is measured.
    pub fn options(&self) -> Options {
        Options {
            above: self.above.clone(),
            crop: self.crop.clone(),
        }
    }
}
