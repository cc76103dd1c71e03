//! The parameters of a reconstruction, with their ranges.

mod close;
mod facing;
mod lengths;
mod origin;
mod smooth;

pub use close::Close;
pub use facing::Facing;
pub use lengths::{MaxWidth, Radius};
pub use origin::Origin;
use outcrop_disk::error::{Error, Result, Setting};
use outcrop_disk::workspace::progress::Observer;
pub use outcrop_geom::region::{NoRegion, Region};
pub use outcrop_mesh::surface::evidence::Division;
use outcrop_paper::method::METHOD;
use outcrop_points::{
    Attributes, Classes, Crop, GivenCrs, IngestStats, Layout, Selection, TextColumns,
};
pub use outcrop_stages::normals::InputNormals;
pub use outcrop_stages::smooth::Smoothing;
use outcrop_stages::spacing::{Limits, Width};
pub use smooth::Smooth;

/// The variant of the method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// The paper's cells on relaxed positions, oriented by evidence, torn boundaries closed.
    Robust,
    /// The paper's method as it is written.
    Paper,
}

impl std::str::FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "robust" => Ok(Method::Robust),
            "paper" => Ok(Method::Paper),
            _ => Err(format!("{text:?} is not robust or paper")),
        }
    }
}

/// All parameters that decide the mesh. Equal parameters and equal points give the same bytes.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Params {
    /// Classes of the points that are read.
    pub classes: Classes,
    /// Names of the columns of text files, if they are not to be read as they say.
    pub columns: Option<TextColumns>,
    /// Lines at the beginning of text files that are passed over.
    pub skip_lines: u64,
    /// The mesh inside this region only.
    pub crop: Option<Region>,
    /// Width of the margin around the region within which points are read as well, in the input's unit.
    /// `None`: a twentieth of the shorter side of the box around the region.
    pub crop_margin: Option<f64>,
    /// One mesh for each square of this side in x and y, in the input's unit, instead of one for all.
    pub split: Option<f64>,
    /// The mesh with this number of triangles, or with all it has if these are fewer.
    pub triangles: Option<u64>,
    /// Close the boundary of the mesh.
    pub close: Option<Close>,
    /// Round positions and values in a tileset, as `outcrop tiles --lossy` does.
    pub lossy: bool,
    /// Columns of the points that the mesh keeps, such as colours.
    pub attributes: Attributes,
    /// Colours with 16 bits instead of 8.
    pub wide_colors: bool,
    /// Keep at most one point in each cube of this side, in the input's unit.
    pub thin: Option<f64>,
    /// Drop points whose spacing is more than this factor times that of the points around them.
    pub drop_outliers: Option<f64>,
    /// Variant of the method; [`Params::paper`] has the defaults of the paper's.
    pub method: Method,
    /// Neighbours for planes and smoothing (paper: 30).
    pub neighbors: usize,
    /// Rounds of smoothing (paper: 0 to 2), or only where points are noisy.
    pub smooth: Smooth,
    /// Method of smoothing in rounds; points that are smoothed because they are noisy keep edges.
    pub smoothing: Smoothing,
    /// Largest number of rounds in which noisy points move: for the connectivity only, or with
    /// [`Smooth::Auto`] in the mesh too.
    pub relax: u32,
    /// Disk radius.
    pub radius: Radius,
    /// Largest angle between neighbouring normals for T12 triangles, in degrees (paper: 60).
    pub max_angle: f64,
    /// Fill holes of up to this many edges (paper: 500).
    pub max_hole_edges: usize,
    /// Remove components with fewer triangles (paper: 10). `None`: 10; if at least half of the points are
    /// noisy, or with rounds of smoothing, one for each 5000 points, from 10 to 150.
    pub min_component: Option<u64>,
    /// Keep points off the surface: those far from their neighbours for the density of the surroundings. The
    /// paper's method always keeps them, and has no limits of length.
    pub keep_all: bool,
    /// Longest side of a triangle; a longer one stays if the surface is as sparse at one of its ends.
    pub max_edge: MaxWidth,
    /// Largest triangle of a filling, as the side of an equilateral triangle of the same area; a larger one
    /// stays likewise.
    pub max_fill: MaxWidth,
    /// Remove bridges and small components, fill holes (paper, section 3.6).
    pub repair: bool,
    /// Keep points far from all others, even if the lattice of the positions is coarser for them.
    pub keep_far: bool,
    /// Vertices have normals, in formats that hold them.
    pub normals: bool,
    /// GLB with meshopt compression.
    pub compress_glb: bool,
    /// Which side of the surface is out.
    pub facing: Facing,
    /// Do not use the positions of scanners that files give: what a scanner saw is out otherwise (robust).
    pub ignore_scanners: bool,
    /// What is done with the normals that points bring.
    pub input_normals: InputNormals,
    /// Take coordinates as they are if files give different reference systems, which is an error otherwise.
    pub ignore_crs: bool,
    /// The reference system of the cloud, instead of what files say of it.
    pub crs: Option<GivenCrs>,
    /// Origin of the coordinates in the mesh file.
    pub origin: Origin,
    /// Points per block, the unit of insertion; changes the result.
    #[serde(skip)]
    pub block: u32,
    /// Division of blocks for the orientation; changes the result.
    #[serde(skip)]
    pub division: Division,
}

/// A factor for [`Params::drop_outliers`] that suits most clouds.
pub const OUTLIER_FACTOR: f64 = 5.0;

/// The margin around a region, as a share of the shorter side of the box around it. The local spacing of the
/// points, which decides how wide it must be, is not known before they are read (docs/decisions.md).
const MARGIN: f64 = 0.05;

/// A margin of so many spacings is wide enough: at the cut no more triangles differ than elsewhere.
const SPACINGS: f64 = 16.0;

/// Largest number of neighbours.
pub const MAX_NEIGHBORS: usize = 255;

impl Default for Params {
    fn default() -> Self {
        Self {
            classes: Classes::All,
            columns: None,
            skip_lines: 0,
            crop: None,
            crop_margin: None,
            split: None,
            triangles: None,
            close: None,
            lossy: false,
            attributes: Attributes::None,
            wide_colors: false,
            thin: None,
            drop_outliers: None,
            method: Method::Robust,
            neighbors: METHOD.plane.neighbors,
            smooth: Smooth::Auto,
            smoothing: Smoothing::Edges,
            relax: METHOD.noise.rounds,
            radius: Radius::Auto,
            max_angle: METHOD.admissibility.angle,
            max_hole_edges: METHOD.filling.longest,
            min_component: None,
            keep_all: false,
            max_edge: MaxWidth::Spacings(METHOD.admissibility.edge),
            max_fill: MaxWidth::Spacings(METHOD.admissibility.edge),
            repair: true,
            keep_far: false,
            normals: false,
            compress_glb: false,
            facing: Facing::Auto,
            ignore_scanners: false,
            input_normals: InputNormals::Auto,
            ignore_crs: false,
            crs: None,
            origin: Origin::None,
            block: METHOD.curve.block,
            division: Division::default(),
        }
    }
}

impl Params {
    /// The paper's method with its defaults.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            method: Method::Paper,
            smooth: Smooth::Rounds(0),
            smoothing: Smoothing::Plain,
            relax: 0,
            max_angle: 60.0,
            keep_all: true,
            input_normals: InputNormals::Use,
            max_edge: MaxWidth::None,
            max_fill: MaxWidth::None,
            max_hole_edges: 500,
            min_component: Some(10),
            ..Self::default()
        }
    }

    /// The points that are read.
    #[must_use]
    pub fn selection(&self) -> Selection {
        let crop = |region: &Region| {
            let [min, max] = region.bounds();
            let shorter = (max[0] - min[0]).min(max[1] - min[1]);
            Crop {
                region: region.clone(),
                margin: self.crop_margin.unwrap_or(shorter * MARGIN),
            }
        };
        Selection {
            classes: self.classes.clone(),
            crop: self.crop.as_ref().map(crop),
            attributes: self.attributes.clone(),
            scanners: self.scanners(),
            normals: self.input_normals != InputNormals::Ignore,
            layout: Layout {
                columns: self.columns.clone(),
                skip_lines: self.skip_lines,
            },
            depths: false,
            crs: self.crs.clone(),
        }
    }

    /// A warning if the default margin around the region is narrow for the density of the points read.
    pub(crate) fn narrow_margin(
        &self,
        input: &IngestStats,
        observer: &dyn Observer,
    ) -> Option<String> {
        let margin = self.selection().crop?.margin;
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for file in &input.files {
            let (Some(min), Some(max)) = (file.min, file.max) else {
                continue;
            };
            for axis in 0..2 {
                low[axis] = low[axis].min(min[axis]);
                high[axis] = high[axis].max(max[axis]);
            }
        }
        let area = (high[0] - low[0]) * (high[1] - low[1]);
        let spacing = (area / input.kept.max(1) as f64).sqrt();
        let narrow = self.crop_margin.is_none() && margin < SPACINGS * spacing;
        narrow.then(|| {
            format!(
                "the margin around the region is {margin}, {:.0} times the mean spacing of the points: at the cut \
                 the mesh may differ from that of the whole cloud; {} is wide enough",
                margin / spacing,
                observer.spell(&Setting::Value("crop_margin", format!("{:.3}", SPACINGS * spacing)))
            )
        })
    }

    /// True if points off the surface are dropped.
    #[must_use]
    pub fn off_surface(&self) -> bool {
        self.method == Method::Robust && !self.keep_all
    }

    /// True if the positions of scanners decide which side is out.
    #[must_use]
    pub fn scanners(&self) -> bool {
        let auto = self.facing == Facing::Auto && !self.ignore_scanners;
        auto && self.method == Method::Robust
    }

    /// The limits of length on a lattice with this step.
    #[must_use]
    pub fn limits(&self, step: f64) -> Limits {
        let width = |max| match max {
            MaxWidth::Spacings(spacings) => Width::Spacings(spacings),
            MaxWidth::Length(length) => Width::Steps(length / step),
            MaxWidth::None => Width::Any,
        };
        Limits {
            off_surface: self.off_surface(),
            edge: width(self.max_edge),
            fill: width(self.max_fill),
        }
    }

    /// The least number of triangles of a component that stays, in a cloud of `points` points; `noisy` if the
    /// component is.
    #[must_use]
    pub fn least_component(&self, points: u64, noisy: bool) -> u64 {
        let limits = METHOD.components;
        let usual = match noisy || self.smooth.rounds() > 0 {
            true => (points / limits.each_if_noisy).min(limits.most_if_noisy),
            false => 0,
        };
        self.min_component
            .unwrap_or_else(|| usual.max(limits.least))
    }

    /// # Errors
    /// [`Error::Parameter`] for the first value out of its range.
    pub fn check(&self) -> Result<()> {
        let error = |name, found: String, expected: &str| {
            Err(Error::Parameter {
                name,
                found,
                expected: expected.into(),
            })
        };
        if let Some(Err(why)) = self.crop.as_ref().map(Region::check) {
            return error("crop", why.found, &why.expected);
        }
        if let Some(margin) = self.crop_margin
            && !(margin >= 0.0 && margin.is_finite())
        {
            return error("crop_margin", margin.to_string(), "a length, or 0");
        }
        if let Some(side) = self.split
            && !(side > 0.0 && side.is_finite())
        {
            return error("split", side.to_string(), "a positive length");
        }
        if let Some(triangles) = self.triangles {
            let refuse = |expected| error("triangles", triangles.to_string(), expected);
            match () {
                () if triangles == 0 => return refuse("1 or more"),
                () if self.split.is_some() => return refuse("no mesh in squares at the same time"),
                () if self.compress_glb => return refuse("no compressed GLB at the same time"),
                () => {}
            }
        }
        if self.close.is_some() && (self.split.is_some() || self.compress_glb) {
            let found = "with split or compress_glb".to_owned();
            return error("close", found, "a single mesh, not compressed");
        }
        if let Some(side) = self.thin
            && !(side > 0.0 && side.is_finite())
        {
            return error("thin", side.to_string(), "a positive length");
        }
        if let Some(factor) = self.drop_outliers
            && !(factor >= 1.0 && factor.is_finite())
        {
            return error("drop_outliers", factor.to_string(), "1 or more");
        }
        if let (true, Attributes::List(names)) = (self.normals, &self.attributes)
            && let Some(name) = names.iter().find(|n| ["nx", "ny", "nz"].contains(&&***n))
        {
            let expected = "other columns: the mesh has normals of its own";
            return error("attributes", name.clone(), expected);
        }
        if !(3..=MAX_NEIGHBORS).contains(&self.neighbors) {
            return error("neighbors", self.neighbors.to_string(), "3 to 255");
        }
        if !(self.max_angle > 0.0 && self.max_angle <= 180.0) {
            return error(
                "max_angle",
                self.max_angle.to_string(),
                "more than 0, up to 180",
            );
        }
        let widths = [("max_edge", self.max_edge), ("max_fill", self.max_fill)];
        for (name, width) in widths {
            if let MaxWidth::Spacings(x) | MaxWidth::Length(x) = width
                && !(x > 0.0 && x.is_finite())
            {
                return error(name, x.to_string(), "a positive number");
            }
        }
        if let Origin::At(at) = self.origin
            && !at.iter().all(|c| c.is_finite())
        {
            return error("origin", format!("{at:?}"), "finite coordinates");
        }
        if let Facing::At(at) = self.facing
            && !at.iter().all(|c| c.is_finite())
        {
            return error("facing", format!("{at:?}"), "finite coordinates");
        }
        if self.smooth.rounds() > 100 {
            return error("smooth", self.smooth.to_string(), "auto, or 0 to 100");
        }
        if self.relax > 100 {
            return error("relax", self.relax.to_string(), "0 to 100");
        }
        if self.max_hole_edges > 10_000 {
            return error(
                "max_hole_edges",
                self.max_hole_edges.to_string(),
                "0 to 10000",
            );
        }
        match self.radius {
            Radius::Percent(x) | Radius::Length(x) if !(x > 0.0 && x.is_finite()) => {
                error("radius", x.to_string(), "a positive number")
            }
            _ if self.block == 0 => error("block_points", "0".into(), "at least 1"),
            _ => Ok(()),
        }
    }

    /// Cosine of the largest angle, computed by a library with the same bits on every machine.
    #[must_use]
    pub fn cos_max_angle(&self) -> f64 {
        if self.max_angle == 60.0 {
            0.5
        } else {
            libm::cos(self.max_angle.to_radians())
        }
    }
}
