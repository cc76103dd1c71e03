//! A region of the plane or of space, given by a box or by polygons.

mod area;
mod text;

pub use area::{Area, Polygon};

use serde::{Deserialize, Serialize};

/// A region, which contains its boundary. Coordinates are those of the cloud, in its unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Region {
    /// A box with sides along the axes.
    Box {
        /// Lowest x and y.
        min: [f64; 2],
        /// Highest x and y.
        max: [f64; 2],
        /// Lowest and highest z; `None` for any.
        z: Option<[f64; 2]>,
    },
    /// The points in any of these polygons, with any z.
    Polygons(Vec<Polygon>),
}

/// The reason why a text is no region.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{found}, expected {expected}")]
pub struct NoRegion {
    /// The content found.
    pub found: String,
    /// The content expected.
    pub expected: String,
}

impl NoRegion {
    fn new(found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self {
            found: found.into(),
            expected: expected.into(),
        }
    }
}

/// Largest coordinate of a region: products of differences stay far from overflow.
const LARGEST: f64 = 1e15;

/// Most corners of all polygons together, which bounds the memory for them.
const MOST_CORNERS: usize = 1 << 16;

impl Region {
    /// The box with these corners, with x and y or with x, y and z.
    ///
    /// # Errors
    /// [`NoRegion`] for other numbers of coordinates, coordinates that are no numbers, and a lowest one that
    /// is not below the highest.
    pub fn of_numbers(numbers: &[f64]) -> Result<Self, NoRegion> {
        let region = match *numbers {
            [ax, ay, bx, by] => Self::Box {
                min: [ax, ay],
                max: [bx, by],
                z: None,
            },
            [ax, ay, az, bx, by, bz] => Self::Box {
                min: [ax, ay],
                max: [bx, by],
                z: Some([az, bz]),
            },
            _ => {
                return Err(NoRegion::new(
                    format!("{} numbers", numbers.len()),
                    "minx,miny,maxx,maxy or minx,miny,minz,maxx,maxy,maxz",
                ));
            }
        };
        region.check()?;
        Ok(region)
    }

    /// Checks that the region has an area, and that its coordinates are in range.
    ///
    /// # Errors
    /// [`NoRegion`] with the first fault.
    pub fn check(&self) -> Result<(), NoRegion> {
        match self {
            Self::Box { min, max, z } => {
                let z = z.map(|[low, high]| ("z", low, high));
                let sides = [("x", min[0], max[0]), ("y", min[1], max[1])];
                for (name, low, high) in sides.into_iter().chain(z) {
                    in_range(low)?;
                    in_range(high)?;
                    if low >= high {
                        return Err(NoRegion::new(
                            format!("a lowest {name} of {low} and a highest of {high}"),
                            format!("a lowest {name} below the highest"),
                        ));
                    }
                }
                Ok(())
            }
            Self::Polygons(polygons) => area::check(polygons),
        }
    }

    /// The smallest box around it: lowest and highest x and y.
    #[must_use]
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        match self {
            Self::Box { min, max, .. } => [*min, *max],
            Self::Polygons(polygons) => area::bounds(polygons),
        }
    }

    /// The region prepared for tests of points.
    #[must_use]
    pub fn area(&self) -> Area<'_> {
        Area::of(self)
    }

    /// Bytes of memory that [`Region::area`] takes.
    #[must_use]
    pub fn area_bytes(&self) -> u64 {
        match self {
            Self::Box { .. } => 0,
            Self::Polygons(polygons) => area::bytes(polygons),
        }
    }
}

fn in_range(coordinate: f64) -> Result<(), NoRegion> {
    if coordinate.abs() <= LARGEST {
        return Ok(());
    }
    Err(NoRegion::new(
        format!("the coordinate {coordinate:e}"),
        format!("a number of at most {LARGEST:e}"),
    ))
}

impl std::fmt::Display for Region {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [[ax, ay], [bx, by]] = self.bounds();
        match self {
            Self::Box { z: None, .. } => write!(f, "the box {ax},{ay},{bx},{by}"),
            Self::Box {
                z: Some([az, bz]), ..
            } => write!(f, "the box {ax},{ay},{az},{bx},{by},{bz}"),
            Self::Polygons(polygons) => {
                let count = polygons.len();
                write!(f, "{count} polygon(s) inside {ax},{ay},{bx},{by}")
            }
        }
    }
}

#[cfg(test)]
mod tests;
