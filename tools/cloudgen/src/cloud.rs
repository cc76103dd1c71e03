//! The description of a cloud.

use std::path::{Path, PathBuf};

use crate::check::check;
use crate::error::{Error, Result};
use crate::generator::Generator;
use crate::kind::Kind;
use crate::outdoor::{self, GroundReport, Land, Objects};
use crate::reference;
use crate::sampling::Sampling;
use crate::scene::Measuring;
use crate::write::{self, Format};

/// Default diagonal of the bounding box.
pub(crate) const DEFAULT_SIZE: f64 = 1000.0;

/// Order of the points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Random order.
    #[default]
    Random,
    /// Along a sweep over the surface; with scan lines, line after line.
    Sorted,
}

/// Direction of the noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NoiseMode {
    /// Along the surface normal.
    #[default]
    Normal,
    /// The same in every direction.
    Isotropic,
}

/// The description of a cloud. Equal descriptions give equal points, to the bit.
///
/// ```
/// use outcrop_cloudgen::{Cloud, Kind};
///
/// # fn main() -> outcrop_cloudgen::Result<()> {
/// let cloud = Cloud::new(Kind::Torus).points(1000).seed(7).noise(0.1);
/// assert_eq!(cloud.euler_characteristic(), Some(0));
/// let mut tail = [[0.0; 3]; 10];
/// cloud.generator()?.fill(990, &mut tail);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Cloud {
    /// The surface.
    pub kind: Kind,
    /// The mesh file, OBJ or PLY, for the kind `Mesh` and scenes of one body. It is moved to the origin and
    /// scaled to the size.
    pub mesh: Option<PathBuf>,
    /// Distribution of the points on the surface.
    pub sampling: Sampling,
    /// Number of points, outliers and duplicates included; a scene has about as many.
    pub points: u64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Diagonal of the bounding box. The outdoor world has a fixed size.
    pub size: f64,
    /// Standard deviation of the noise.
    pub noise: f64,
    /// Direction of the noise.
    pub noise_mode: NoiseMode,
    /// Fraction of outliers: random points in a box 1.5 times the size; outdoors in the air, up to 30 above
    /// the ground.
    pub outliers: f64,
    /// Fraction of duplicates: exact copies of an earlier point.
    pub duplicates: f64,
    /// Number of copies of the surface among which the points are distributed.
    pub layers: u32,
    /// Distance between successive layers, along the normal.
    pub layer_offset: f64,
    /// If true, density falls with the squared distance from the scanner.
    pub falloff: bool,
    /// Position of the scanner in fractions of the bounding box; None for a default of the kind.
    pub scanner: Option<[f64; 3]>,
    /// Scan lines: points are this many times closer along a line than the lines are to each other.
    pub scanlines: Option<f64>,
    /// Rotation by the frame (2 1 2)/3, (-2 2 1)/3, (-1 -2 2)/3. A grid stays integer: its steps are then
    /// multiples of (2 1 2) and (-2 2 1).
    pub rotated: bool,
    /// Added to every coordinate at the end.
    pub offset: [f64; 3],
    /// Order of the points.
    pub order: Order,
    /// Objects of the outdoor world.
    pub objects: Objects,
    /// Errors of the measurement of a scene.
    pub measuring: Measuring,
}

impl Cloud {
    /// A clean cloud of 100 000 points of size 1000.
    pub fn new(kind: Kind) -> Self {
        Cloud {
            kind,
            mesh: None,
            sampling: Sampling::Uniform,
            points: 100_000,
            seed: 0,
            size: DEFAULT_SIZE,
            noise: 0.0,
            noise_mode: NoiseMode::Normal,
            outliers: 0.0,
            duplicates: 0.0,
            layers: 1,
            layer_offset: 0.0,
            falloff: false,
            scanner: None,
            scanlines: None,
            rotated: false,
            offset: [0.0; 3],
            order: Order::Random,
            objects: Objects::default(),
            measuring: Measuring::EXACT,
        }
    }

    /// A clean cloud of 100 000 points of size 1000 on the surface of a mesh file.
    pub fn of_mesh(path: impl Into<PathBuf>) -> Self {
        Cloud {
            mesh: Some(path.into()),
            ..Cloud::new(Kind::Mesh)
        }
    }

    /// Sets the distribution of the points on the surface.
    pub fn sampling(self, sampling: Sampling) -> Self {
        Cloud { sampling, ..self }
    }

    /// Distributes the points among layers, each `offset` further along the normal.
    pub fn layers(self, layers: u32, offset: f64) -> Self {
        Cloud {
            layers,
            layer_offset: offset,
            ..self
        }
    }

    /// Sets the number of points.
    pub fn points(self, points: u64) -> Self {
        Cloud { points, ..self }
    }

    /// Sets the seed.
    pub fn seed(self, seed: u64) -> Self {
        Cloud { seed, ..self }
    }

    /// Sets the diagonal of the bounding box.
    pub fn size(self, size: f64) -> Self {
        Cloud { size, ..self }
    }

    /// Sets the standard deviation of the noise.
    pub fn noise(self, noise: f64) -> Self {
        Cloud { noise, ..self }
    }

    /// Sets the direction of the noise.
    pub fn noise_mode(self, noise_mode: NoiseMode) -> Self {
        Cloud { noise_mode, ..self }
    }

    /// Sets the fraction of outliers.
    pub fn outliers(self, outliers: f64) -> Self {
        Cloud { outliers, ..self }
    }

    /// Sets the fraction of duplicates.
    pub fn duplicates(self, duplicates: f64) -> Self {
        Cloud { duplicates, ..self }
    }

    /// Switches the density falloff.
    pub fn falloff(self, falloff: bool) -> Self {
        Cloud { falloff, ..self }
    }

    /// Sets the position of the scanner, in fractions of the bounding box.
    pub fn scanner(self, scanner: [f64; 3]) -> Self {
        Cloud {
            scanner: Some(scanner),
            ..self
        }
    }

    /// Puts the points on scan lines, `ratio` times closer along than across.
    pub fn scanlines(self, ratio: f64) -> Self {
        Cloud {
            scanlines: Some(ratio),
            ..self
        }
    }

    /// Switches the rotation.
    pub fn rotated(self, rotated: bool) -> Self {
        Cloud { rotated, ..self }
    }

    /// Sets the offset.
    pub fn offset(self, offset: [f64; 3]) -> Self {
        Cloud { offset, ..self }
    }

    /// Sets the order.
    pub fn order(self, order: Order) -> Self {
        Cloud { order, ..self }
    }

    /// Sets the objects of the outdoor world.
    pub fn objects(self, objects: Objects) -> Self {
        Cloud { objects, ..self }
    }

    /// Sets the errors of the measurement of a scene.
    pub fn measuring(self, measuring: Measuring) -> Self {
        Cloud { measuring, ..self }
    }

    /// Euler characteristic of the surface if it is closed: 2 - 2 * genus.
    pub fn euler_characteristic(&self) -> Option<i64> {
        self.kind.euler_characteristic()
    }

    /// Prepares the surface; checks the settings.
    pub fn generator(&self) -> Result<Generator> {
        check(self)?;
        Generator::new(self)
    }

    /// Writes the cloud to a file.
    pub fn write(&self, path: impl AsRef<Path>, format: Format) -> Result<()> {
        self.generator()?.write(path, format)
    }

    /// Writes the cloud as a random partition into the files `NAME-0.EXT`, `NAME-1.EXT`, and so
    /// on, and returns their paths.
    pub fn write_split(
        &self,
        path: impl AsRef<Path>,
        format: Format,
        parts: u32,
    ) -> Result<Vec<PathBuf>> {
        if parts == 0 {
            return Err(Error::parameter("split", parts, "one part or more"));
        }
        let generator = self.generator()?;
        let mut paths = Vec::new();
        for part in 0..parts {
            let path = write::part_path(path.as_ref(), part);
            write::write_part(&generator, &path, format, part, parts)?;
            paths.push(path);
        }
        Ok(paths)
    }

    /// Writes the true surface as a PLY mesh, in the coordinates of the points: the first layer, without
    /// noise. Curved surfaces are approximated within `tolerance` times the size, terrain roughly.
    pub fn write_reference(&self, path: impl AsRef<Path>, tolerance: f64) -> Result<()> {
        check(self)?;
        let mesh = reference::reference(self, tolerance, None)?;
        write::write_reference(&mesh, path.as_ref())
    }

    /// Writes the places of the true surface that were measured, with its normals, as a PLY cloud: without
    /// noise and other errors, in no relation to the order of the points. Outliers and points between near
    /// and far are left out.
    pub fn write_seen(&self, path: impl AsRef<Path>) -> Result<()> {
        self.generator()?.write_seen(path)
    }

    /// Discs (x, y, radius) around the houses, trees and walls of the outdoor world, with a margin,
    /// in the coordinates of the points. They depend on seed, objects and offset only.
    pub fn discs(&self) -> Result<Vec<[f64; 3]>> {
        let mut discs = self.land_discs("discs")?;
        for disc in &mut discs {
            disc[0] += self.offset[0];
            disc[1] += self.offset[1];
        }
        Ok(discs)
    }

    /// Where the second survey of the outdoor world differs from the first, in the coordinates of the points without
    /// offset; none for the first.
    pub fn changes(&self) -> Option<outdoor::Changes> {
        Land::new(self.seed, &self.objects).changes
    }

    /// Compares a mesh of the outdoor world, a binary PLY file, with the ground. Only seed, objects and
    /// offset of the description are used.
    pub fn measure_mesh(&self, path: impl AsRef<Path>) -> Result<GroundReport> {
        let discs = self.land_discs("measuring a mesh")?;
        outdoor::measure(&discs, self.offset, path.as_ref())
    }

    fn land_discs(&self, purpose: &'static str) -> Result<Vec<[f64; 3]>> {
        check(self)?;
        if self.kind != Kind::Outdoor {
            return Err(Error::Conflict {
                first: purpose,
                second: self.kind.name(),
                why: "only the kind outdoor has open ground",
            });
        }
        Ok(Land::new(self.seed, &self.objects).discs())
    }
}
