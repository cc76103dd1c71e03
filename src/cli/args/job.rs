//! The points, the mesh, and what decides it.

use super::super::parse::{count, region, system};
use crate::params::Close as Closed;
use crate::params::{
    Facing, InputNormals, MaxWidth, Method, Origin, Params, Radius, Region, Smooth, Smoothing,
};
use crate::pipeline::{Builder, Reconstruction};
use clap::Args as ClapArgs;
use outcrop_paper::method::METHOD;
use outcrop_points::{Attributes, Classes, GivenCrs, TextColumns};
use std::path::PathBuf;

/// Selection of points by class and region.
#[derive(Debug, ClapArgs)]
#[command(next_help_heading = "Points")]
pub struct Points {
    /// Leave out points of these classes (of LAS and LAZ, or a column classification), e.g. 7,18 for noise
    #[arg(
        long,
        value_name = "CLASSES",
        value_delimiter = ',',
        conflicts_with = "keep_classes"
    )]
    pub drop_classes: Vec<u8>,
    /// Read only points of these classes (of LAS and LAZ, or a column classification), e.g. 2,6 for ground and
    /// buildings
    #[arg(long, value_name = "CLASSES", value_delimiter = ',')]
    pub keep_classes: Vec<u8>,
    /// Only the part inside a region: a box, or polygons in x and y in a file (WKT or GeoJSON). The mesh
    /// inside is that of the whole cloud, up to the cut
    #[arg(
        long,
        value_name = "MINX,MINY,MAXX,MAXY|FILE",
        value_parser = region,
        allow_hyphen_values = true
    )]
    pub crop: Option<Region>,
    /// Width of the margin around the region within which points are read as well, in the cloud's unit
    /// [default: a twentieth of the region's shorter side]
    #[arg(long, value_name = "LENGTH", requires = "crop")]
    pub crop_margin: Option<f64>,
    /// Names of the columns of text files in their order, whatever the files say, like
    /// x,y,z,intensity,r,g,b,-: - passes a column over
    #[arg(long, value_name = "NAMES", allow_hyphen_values = true)]
    pub columns: Option<TextColumns>,
    /// Pass over this many lines at the beginning of text files
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub skip_lines: u64,
}

/// Columns that the mesh keeps.
#[derive(Debug, ClapArgs)]
#[command(next_help_heading = "Attributes")]
pub struct Columns {
    /// Keep the points' own values at the vertices: auto (colours, intensity and classification, unless they are
    /// the same everywhere), none, or a list of columns by name like color,intensity,gps_time; displacement is how
    /// far smoothing moved each point, confidence from 0 to 1 how many of the cells around a vertex agree on its
    /// triangles
    #[arg(long, value_name = "auto|none|LIST", default_value = "none")]
    pub attributes: Attributes,
    /// Write colours with 16 bits instead of 8
    #[arg(long)]
    pub wide_colors: bool,
}

/// Selection of points by position.
#[derive(Debug, ClapArgs)]
#[command(next_help_heading = "Points")]
pub struct Filters {
    /// Keep at most one point in each cube with this side, in the cloud's unit: the one nearest to its centre
    #[arg(long, value_name = "LENGTH")]
    pub thin: Option<f64>,
    /// Drop points FACTOR times as far from their neighbours as is usual around them [without a number: 5]
    #[arg(
        long,
        value_name = "FACTOR",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = OUTLIER_FACTOR_TEXT
    )]
    pub drop_outliers: Option<f64>,
}

/// [`crate::params::OUTLIER_FACTOR`] as text.
const OUTLIER_FACTOR_TEXT: &str = "5";

impl Points {
    /// The parameters that select points.
    pub fn params(&self) -> Params {
        Params {
            classes: self.classes(),
            columns: self.columns.clone(),
            skip_lines: self.skip_lines,
            crop: self.crop.clone(),
            crop_margin: self.crop_margin,
            ..Params::default()
        }
    }

    /// The selected classes.
    pub fn classes(&self) -> Classes {
        let sorted = |classes: &[u8]| {
            let mut classes = classes.to_vec();
            classes.sort_unstable();
            classes.dedup();
            classes
        };
        match (self.keep_classes.as_slice(), self.drop_classes.as_slice()) {
            ([], []) => Classes::All,
            ([], dropped) => Classes::Drop(sorted(dropped)),
            (kept, _) => Classes::Keep(sorted(kept)),
        }
    }
}

/// Geometric parameters.
#[derive(Debug, ClapArgs)]
#[command(next_help_heading = "Surface")]
pub struct Surface {
    /// Method: robust, for noisy scans, or paper, the published method unchanged
    #[arg(long, value_name = "robust|paper", default_value = "robust")]
    pub method: Method,
    /// Number of neighbours for the plane at each point
    #[arg(long, value_name = "N", default_value_t = METHOD.plane.neighbors)]
    pub neighbors: usize,
    /// Smoothing: auto moves noisy points, as much as they are noisy, and leaves clean ones where they are; a
    /// number of rounds moves all points; 0 keeps all where they were measured [default: auto; with --method
    /// paper 0]
    #[arg(long, value_name = "auto|ROUNDS")]
    pub smooth: Option<Smooth>,
    /// Rounds of smoothing move points: plain, to the plane of their neighbours; edges, preserving edges and
    /// without shrinking [default: edges; with --method paper plain]
    #[arg(long, value_name = "plain|edges")]
    pub smoothing: Option<Smoothing>,
    /// Largest number of rounds in which noisy points move. With --smooth 0 this only decides which points are
    /// connected: the mesh has them where they were measured [default: 3; with --method paper 0]
    #[arg(long, value_name = "ROUNDS")]
    pub relax: Option<u32>,
    /// Disk radius: auto (follows the local density), a percentage of the diagonal of the bounding box like
    /// 5%, or a length in the cloud's unit
    #[arg(long, value_name = "auto|PERCENT%|LENGTH", default_value = "auto")]
    pub radius: Radius,
    /// Largest angle between neighbouring normals where the surface is uncertain, in degrees [default: 143;
    /// with --method paper 60]
    #[arg(long, value_name = "DEGREES")]
    pub max_angle: Option<f64>,
    /// Keep points off the surface, such as birds and dust: those more than twice as far from their neighbours as
    /// is usual around them that fill space with these or lie beside their surface
    #[arg(long)]
    pub keep_all: bool,
    /// Longest side of a triangle: a length in the cloud's unit, a number of local spacings like 8x, or none
    /// [default: 8x; with --method paper none]
    #[arg(long, value_name = "LENGTH|Nx|none")]
    pub max_edge: Option<MaxWidth>,
    /// Which side is out: auto (that of the points' normals if neighbours agree in sign, else what scanners of E57
    /// and PTX files saw, else up), up (the topmost surface faces up), out (a body), in (rooms, tunnels), or a
    /// position that the whole surface faces, like 12.5,3,1.6
    #[arg(
        long,
        value_name = "auto|up|out|in|X,Y,Z",
        default_value = "auto",
        allow_hyphen_values = true
    )]
    pub facing: Facing,
    /// Do not use the positions of scanners in E57 and PTX files, by which the side that the scanner saw is out
    #[arg(long)]
    pub ignore_scanners: bool,
    /// Normals that the points bring: use them for the disks and, if neighbours agree in sign, for the outer side; auto
    /// uses each where it suits the points around it, and ignore none [default: auto; with --method paper use]
    #[arg(long, value_name = "auto|use|ignore")]
    pub input_normals: Option<InputNormals>,
}

/// Post-processing.
#[derive(Debug, ClapArgs)]
#[command(next_help_heading = "Repair")]
pub struct Repair {
    /// Fill holes of up to this many edges; 0 fills none (missing single triangles are still filled, except
    /// with --method paper) [default: 1500; with --method paper 500]
    #[arg(long, value_name = "N")]
    pub max_hole_edges: Option<usize>,
    /// Largest triangle of a filling, as the side of an equilateral triangle: a length in the cloud's unit, a
    /// number of local spacings like 8x, or none [default: 8x; with --method paper none]
    #[arg(long, value_name = "LENGTH|Nx|none")]
    pub max_fill: Option<MaxWidth>,
    /// Remove components with fewer triangles [default: 10; noisy ones, and all with rounds of --smooth, one for
    /// each 5000 points, from 10 to 150; with --method paper 10]
    #[arg(long, value_name = "N")]
    pub min_component: Option<u64>,
    /// No repair: keep bridges, holes and small components
    #[arg(long)]
    pub no_repair: bool,
}

/// Coordinates of the mesh.
#[derive(Debug, ClapArgs)]
#[command(next_help_heading = "Coordinates")]
pub struct Coordinates {
    /// Origin of the mesh's coordinates, for programs that round them to single precision: auto (a round
    /// position below the cloud, if single precision does not suffice), none (that of the cloud), or a position
    /// like 635000,848000,0; it is written into the mesh and MESH.origin.json
    #[arg(
        long,
        value_name = "auto|none|X,Y,Z",
        default_value = "none",
        allow_hyphen_values = true
    )]
    pub origin: Origin,
    /// Keep points so far from all others that coordinates have to be rounded for them; else they are left out
    #[arg(long)]
    pub keep_far: bool,
    /// Take coordinates as they are if files give different reference systems; the mesh then names none
    #[arg(long)]
    pub ignore_crs: bool,
    /// Reference system of the cloud, if files give none or a wrong one: EPSG codes of the plane and perhaps of
    /// heights, or a file with well-known text; coordinates stay as they are
    #[arg(long, value_name = "EPSG:N|EPSG:N+M|FILE", value_parser = system)]
    pub crs: Option<GivenCrs>,
}

/// The points, the mesh, and what decides it.
#[derive(Debug, ClapArgs)]
pub struct Job {
    /// Files (LAS, LAZ, EPT, E57, PLY, PCD, PTX, OFF, XYZ text; also as .gz, .zst and .zip), folders of files, or URLs; together they are one cloud
    #[arg(value_name = "INPUT", required = true)]
    pub inputs: Vec<PathBuf>,
    /// The mesh to write: .ply, .obj, .stl or .glb (all but OBJ binary), compressed with .zst behind it; or
    /// DIR/tileset.json for levels of detail; also the URL of one in a store (s3://, gs://, az://)
    #[arg(long, short, value_name = "MESH.ply")]
    pub output: PathBuf,
    /// Write a normal for each vertex (PLY, OBJ, GLB)
    #[arg(long)]
    pub normals: bool,
    /// Compress a .glb mesh, positions exactly (meshopt: EXT_meshopt_compression, which viewers read)
    #[arg(long)]
    pub compress_glb: bool,
    /// Write one mesh for each square with this side in x and y, in the cloud's unit: MESH_X_Y.ply, and
    /// MESH.index.json with a list of them
    #[arg(long, value_name = "LENGTH")]
    pub split: Option<f64>,
    /// Simplify the mesh to this number of triangles, e.g. 2e6, as `outcrop simplify` does
    #[arg(long, value_name = "N", value_parser = count)]
    pub triangles: Option<u64>,
    /// Close the boundary, as `outcrop close` does: auto (smooth where the surface runs on into the hole, else a lid),
    /// lids, smooth, or base (walls from outer rims down to a floor) [without a value: auto]
    #[arg(long, value_name = "auto|lids|smooth|base[=Z]", num_args = 0..=1, default_missing_value = "auto")]
    pub close: Option<Closed>,
    /// Round positions, normals, colours and other values of a tileset, as `outcrop tiles --lossy` does
    #[arg(long)]
    pub lossy: bool,
    #[command(flatten)]
    pub points: Points,
    #[command(flatten)]
    pub filters: Filters,
    #[command(flatten)]
    pub columns: Columns,
    #[command(flatten)]
    pub surface: Surface,
    #[command(flatten)]
    pub repair: Repair,
    #[command(flatten)]
    pub coordinates: Coordinates,
    /// Points per tile; does not change the result
    #[arg(long, value_name = "N", hide = true)]
    pub tile_points: Option<u32>,
    /// Points per block, for tests; changes the result
    #[arg(long, value_name = "N", hide = true, default_value_t = METHOD.curve.block)]
    pub block_points: u32,
}

impl Job {
    /// The builder of the reconstruction.
    pub fn builder(&self) -> Builder {
        let builder = Reconstruction::builder()
            .output(&self.output)
            .params(self.params())
            .tile_points(self.tile_points.unwrap_or(self.block_points));
        self.inputs.iter().fold(builder, Builder::input)
    }

    /// The parameters of the reconstruction.
    pub fn params(&self) -> Params {
        let selected = self.points.params();
        let usual = match self.surface.method {
            Method::Robust => Params::default(),
            Method::Paper => Params::paper(),
        };
        Params {
            classes: selected.classes,
            columns: selected.columns,
            skip_lines: selected.skip_lines,
            crop: selected.crop,
            crop_margin: selected.crop_margin,
            split: self.split,
            triangles: self.triangles,
            close: self.close,
            lossy: self.lossy,
            attributes: self.columns.attributes.clone(),
            wide_colors: self.columns.wide_colors,
            thin: self.filters.thin,
            drop_outliers: self.filters.drop_outliers,
            neighbors: self.surface.neighbors,
            smooth: self.surface.smooth.unwrap_or(usual.smooth),
            smoothing: self.surface.smoothing.unwrap_or(usual.smoothing),
            relax: self.surface.relax.unwrap_or(usual.relax),
            radius: self.surface.radius,
            max_angle: self.surface.max_angle.unwrap_or(usual.max_angle),
            keep_all: self.surface.keep_all || usual.keep_all,
            max_edge: self.surface.max_edge.unwrap_or(usual.max_edge),
            max_fill: self.repair.max_fill.unwrap_or(usual.max_fill),
            max_hole_edges: self.repair.max_hole_edges.unwrap_or(usual.max_hole_edges),
            min_component: self.repair.min_component.or(usual.min_component),
            repair: !self.repair.no_repair,
            normals: self.normals,
            compress_glb: self.compress_glb,
            origin: self.coordinates.origin,
            keep_far: self.coordinates.keep_far,
            ignore_crs: self.coordinates.ignore_crs,
            crs: self.coordinates.crs.clone(),
            facing: self.surface.facing,
            ignore_scanners: self.surface.ignore_scanners,
            input_normals: self.surface.input_normals.unwrap_or(usual.input_normals),
            block: self.block_points,
            ..usual
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_has_the_defaults_of_both_methods() {
        let options = crate::cli::call::options("reconstruct");
        let (robust, paper) = (Params::default(), Params::paper());
        for (name, of) in [
            ("relax", (|p| p.relax.to_string()) as fn(&Params) -> String),
            ("max-angle", |p| p.max_angle.to_string()),
            ("max-edge", |p| p.max_edge.to_string()),
            ("max-hole-edges", |p| p.max_hole_edges.to_string()),
            ("max-fill", |p| p.max_fill.to_string()),
            ("input-normals", |p| p.input_normals.to_string()),
        ] {
            let option = options.iter().find(|option| option.name == name).unwrap();
            let words: Vec<&str> = option.help.split_whitespace().collect();
            let wanted = format!(
                "[default: {}; with --method paper {}]",
                of(&robust),
                of(&paper)
            );
            assert!(
                words.join(" ").contains(&wanted),
                "{wanted}: {}",
                option.help
            );
        }
    }

    #[test]
    fn the_default_factor_is_what_the_library_says() {
        assert_eq!(
            OUTLIER_FACTOR_TEXT.parse(),
            Ok(crate::params::OUTLIER_FACTOR)
        );
    }
}
