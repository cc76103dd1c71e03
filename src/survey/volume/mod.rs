//! Volumes: what a closed mesh encloses, and what lies between a mesh and a level, or another mesh, in a region.
//!
//! The triangles are read piece by piece, on all threads (`pieces`). The volume of each is a prism: its area in
//! plan, positive if it faces up, times its mean height. Under a level, or between two surfaces, triangles are cut
//! where the heights change sign, and by the region (`crop`). So steep and overhanging parts count as the layers
//! that they are: the sum at a place is the material between the surfaces there. All sums are of integers
//! (`sums`), so they do not depend on threads or memory.

mod body;
mod components;
mod convex;
mod crop;
mod level;
mod overlay;
mod report;
mod sums;
#[cfg(test)]
mod tests;
mod tiles;

pub use super::units::Units;
pub use report::{Body, Component, Earth, Group, Side, Volumes};

use super::pieces::Surface;
use crop::Cutter;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::region::Region;
use std::path::{Path, PathBuf};

/// From where on heights are measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Above {
    /// A level, in the coordinates of the mesh.
    Level(f64),
    /// The surface of another mesh.
    Mesh(PathBuf),
}

/// The volume to measure: enclosed, or above and below a level or a mesh.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// From where on; none for the volume that the mesh encloses.
    pub above: Option<Above>,
    /// The region in plan; everywhere without one.
    pub crop: Option<Region>,
}

impl Options {
    fn check(&self) -> Result<()> {
        let refuse = |name, found: String, expected: &str| {
            Err(Error::Parameter {
                name,
                found,
                expected: expected.into(),
            })
        };
        match (&self.above, &self.crop) {
            (Some(Above::Level(level)), _) if !level.is_finite() => {
                refuse("above", level.to_string(), "a finite number")
            }
            (None, Some(region)) => {
                let expected = "a level or another mesh to measure from (above)";
                refuse("crop", region.to_string(), expected)
            }
            (_, Some(region @ Region::Box { z: Some(_), .. })) => {
                let expected = "a region in plan: minx,miny,maxx,maxy or polygons";
                refuse("crop", region.to_string(), expected)
            }
            _ => Ok(()),
        }
    }
}

/// Measures volumes of a mesh, in any format that is read.
///
/// # Errors
/// [`Error::Input`] for a file that is no mesh, and for coordinates that are not finite; [`Error::Parameter`] for
/// options that make no sense; [`Error::Memory`] if the budget is too small; [`Error::Io`], [`Error::Disk`],
/// [`Error::Corrupt`], [`Error::Cancelled`].
pub fn volume(mesh: &Path, options: &Options, workspace: &Workspace) -> Result<Volumes> {
    options.check()?;
    let units = Units::of(mesh, workspace)?;
    let surface = Surface::open(mesh, workspace)?;
    let mut volumes = Volumes::new(Side::of(&surface), units);
    let Some(above) = &options.above else {
        volumes.body = Some(body::measure(&surface, workspace)?);
        return Ok(volumes);
    };
    let origin = surface.bounds().min;
    let crop = options.crop.as_ref();
    let crop = crop.map(|region| Cutter::new(region, origin, workspace));
    let crop = crop.transpose()?;
    volumes.crop_area = crop.as_ref().map(Cutter::area);
    match above {
        Above::Level(level) => {
            let place = (origin, *level);
            let earth = level::measure(&surface, place, crop.as_ref(), workspace)?;
            (volumes.level, volumes.earth) = (Some(*level), Some(earth));
        }
        Above::Mesh(other) => {
            volumes.units.agree(other, workspace)?;
            let other = Surface::open(other, workspace)?;
            let earth = overlay::measure([&surface, &other], crop.as_ref(), workspace)?;
            (volumes.other, volumes.earth) = (Some(Side::of(&other)), Some(earth));
        }
    }
    volumes.finish();
    Ok(volumes)
}
