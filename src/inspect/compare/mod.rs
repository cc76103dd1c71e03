//! Distances between two meshes or clouds of any size, in bounded memory.
//!
//! Each side is read once and written in curve order to pages on disk, with a tree of boxes in memory
//! (`pages`). Distances are taken at *samples* of one side, to the nearest point of the other: of its surface
//! if it is a mesh, otherwise of its points. The distance of a sample is exact up to rounding; only the
//! positions of the samples are random.
//!
//! * A cloud is sampled at its points, without repetition; if there are more than [`Options::samples`], that
//!   number of them is drawn with equal chances.
//! * A mesh is sampled at the vertices of its triangles, at most half of the samples, drawn likewise if
//!   there are more. The other samples are points on its faces: the area is divided into equal parts, along
//!   the curve, with a random point in each. Mean, RMS and percentiles are those of the points on faces, so
//!   they do not depend on the triangulation of the surface; vertices count for the maximum. A mesh without
//!   area is sampled at its vertices alone, and then these count.
//!
//! The result depends only on the files, the number of samples and the seed.

mod cloud;
mod corners;
#[cfg(feature = "pictures")]
mod drawing;
mod figures;
mod measure;
mod mesh;
pub(crate) mod pages;
mod samples;
pub(crate) mod shape;
#[cfg(test)]
mod tests;
mod triangles;

pub use cloud::Clouds;
#[cfg(feature = "pictures")]
pub use drawing::Illustration;
use figures::DistanceRow;
pub use figures::{Comparison, Distances, Figures};
pub use shape::{Kind, Side};

#[cfg(feature = "pictures")]
use drawing::Drawing;
#[cfg(feature = "pictures")]
pub(crate) use drawing::Sketch;
use figures::Sums;
use outcrop_codecs::ply_mesh::holds_faces;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::{Unit, Workspace};
#[cfg(feature = "pictures")]
use outcrop_draw::picture::Picture;
use samples::Numbers;
use shape::Shape;
use std::path::Path;

/// Number and seed of the samples.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Largest number of samples of each side.
    pub samples: u64,
    /// Seed of all random choices.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            samples: 1_000_000,
            seed: 0,
        }
    }
}

/// Reads a mesh or a cloud; `name` distinguishes the scratch files of the two sides.
pub(crate) fn read_side(
    path: &Path,
    name: &'static str,
    options: &Options,
    clouds: Clouds,
    workspace: &Workspace,
) -> Result<Shape> {
    read_by(path, name, options, (clouds, None), workspace)
}

/// If there is a unit, the pages survive the attempt once it is finished.
fn read_by(
    path: &Path,
    name: &'static str,
    options: &Options,
    (clouds, unit): (Clouds, Option<&Unit<'_>>),
    workspace: &Workspace,
) -> Result<Shape> {
    if path.is_file() && holds_faces(path)? {
        mesh::read(path, name, options, unit, workspace)
    } else {
        cloud::read(path, name, clouds, unit, workspace)
    }
}

/// As [`read_side`], without samples; what an earlier attempt read is not read again.
pub(crate) fn read_side_once(
    path: &Path,
    name: &'static str,
    clouds: Clouds,
    workspace: &Workspace,
) -> Result<Shape> {
    let options = Options {
        samples: 0,
        seed: 0,
    };
    let make = |unit: &Unit<'_>| {
        let shape = read_by(path, name, &options, (clouds, Some(unit)), workspace)?;
        let kept = shape.kept();
        Ok((shape, kept))
    };
    workspace.once_opened(name, make, |kept| kept.open(path, name, workspace))
}

/// Distances between two shapes, each a mesh (PLY with faces) or a cloud, which `clouds` reads.
///
/// # Errors
/// [`Error::Input`] for a file that cannot be read, is empty, or has faces that are not triangles;
/// [`Error::Parameter`] without samples; [`Error::Io`], [`Error::Corrupt`] from the scratch folder;
/// [`Error::Memory`] if the free part of the budget is too small; [`Error::Cancelled`].
pub fn compare(
    both: [&Path; 2],
    options: &Options,
    clouds: Clouds,
    workspace: &Workspace,
) -> Result<Comparison> {
    let compared = measured(both, options, clouds, workspace, |_, _, _| Ok(()));
    compared.map(|(comparison, ())| comparison)
}

/// As [`compare`], with pictures and distributions for `outcrop::page::comparison`.
///
/// # Errors
/// See [`compare`].
#[cfg(feature = "pictures")]
pub fn illustrated(
    both: [&Path; 2],
    options: &Options,
    clouds: Clouds,
    workspace: &Workspace,
) -> Result<(Comparison, Illustration)> {
    let draw = |a: &Shape, b: &Shape, diagonal: f64| Drawing::of(a, b, diagonal, workspace);
    let (comparison, drawing) = measured(both, options, clouds, workspace, draw)?;
    let illustration = drawing.finish(comparison.symmetric.figures.p99, workspace)?;
    Ok((comparison, illustration))
}

/// Sees each distance between the two sides.
trait Witness {
    /// Takes a distance from the first side (0) or the second (1), and the position where it was measured.
    fn take(&mut self, way: usize, position: [f64; 3], distance: f64);
}

impl Witness for () {
    fn take(&mut self, _: usize, _: [f64; 3], _: f64) {}
}

/// Pictures of a mesh with marks; faces that cannot be drawn are left out.
#[cfg(feature = "pictures")]
pub(crate) fn marked(
    path: &Path,
    marks: &[[f64; 3]],
    workspace: &Workspace,
) -> Result<Vec<Picture>> {
    let options = Options {
        samples: 0,
        seed: 0,
    };
    let shape = mesh::read_sound(path, "verify.picture", &options, workspace)?;
    let sketch = Sketch::of(&shape, workspace)?;
    marks.iter().for_each(|mark| sketch.mark(*mark));
    sketch.pictures("Mesh", (0.0, 0.0), workspace)
}

/// Measures, and shows each distance to the witness that `begin` makes of both sides and their diagonal.
fn measured<W: Witness>(
    [a, b]: [&Path; 2],
    options: &Options,
    clouds: Clouds,
    workspace: &Workspace,
    begin: impl FnOnce(&Shape, &Shape, f64) -> Result<W>,
) -> Result<(Comparison, W)> {
    let Options { samples, seed } = *options;
    if samples == 0 {
        return Err(Error::Parameter {
            name: "samples",
            found: "0".into(),
            expected: "1 or more".into(),
        });
    }
    let a = read_side(a, "compare.a", options, clouds, workspace)?;
    let b = read_side(b, "compare.b", options, clouds, workspace)?;
    let number = Numbers::of(&a, samples).all() + Numbers::of(&b, samples).all();
    let bytes = number * size_of::<DistanceRow>() as u64;
    let buffer = bytes.min(workspace.memory.available() / 8) + (1 << 20);
    let (sorter, _held) = triangles::sorter(workspace, "compare.distances", buffer)?;
    let diagonal = a.side.bounds().diagonal();
    let mut witness = begin(&a, &b, diagonal)?;
    let mut sums = [Sums::default(); 2];
    for (way, (from, to)) in [(&a, &b), (&b, &a)].into_iter().enumerate() {
        measure::distances(from, to, options, workspace, |sample, distance| {
            sums[way].add(&sample, distance);
            witness.take(way, sample.position, distance);
            if sample.counts {
                sorter.push(&[DistanceRow::new(distance, way)])?;
            }
            Ok(())
        })?;
    }
    let sums = [sums[0], sums[1], sums[0].with(sums[1])];
    let percentiles = figures::percentiles(sorter, &sums, workspace)?;
    let distances = |way: usize| Distances::new(&sums[way], percentiles[way], diagonal);
    let comparison = Comparison {
        a_to_b: distances(0),
        b_to_a: distances(1),
        symmetric: distances(2),
        a: a.side,
        b: b.side,
        diagonal,
        most_samples: samples,
        seed,
    };
    Ok((comparison, witness))
}

/// A point of a cloud and its distance to a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Rank among the distinct points of the cloud in curve order: its id in a reconstruction.
    pub index: u64,
    /// Its position.
    pub position: [f64; 3],
    /// Distance to the nearest point of the other shape.
    pub distance: f64,
}

/// Distances of all distinct points of a cloud to a mesh or cloud, in order of their index. Returns their
/// number. If `cloud` is a mesh, its vertices are the points.
///
/// # Errors
/// Errors of `each`; see [`compare`].
pub fn distances(
    cloud: &Path,
    to: &Path,
    clouds: Clouds,
    workspace: &Workspace,
    mut each: impl FnMut(Measured) -> Result<()>,
) -> Result<u64> {
    let cloud = cloud::read(cloud, "compare.a", clouds, None, workspace)?;
    let options = |samples| Options { samples, seed: 0 };
    let to = read_side(to, "compare.b", &options(0), clouds, workspace)?;
    let mut index = 0;
    let all = options(u64::MAX);
    measure::distances(&cloud, &to, &all, workspace, |sample, distance| {
        let position = sample.position;
        each(Measured {
            index,
            position,
            distance,
        })?;
        index += 1;
        Ok(())
    })?;
    Ok(index)
}
