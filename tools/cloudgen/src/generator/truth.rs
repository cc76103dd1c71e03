//! What points are measurements of, and files.

use std::path::Path;

use super::{Generator, Source};
use crate::error::Result;
use crate::reference;
use crate::surface::Sample;
use crate::vec3::add;
use crate::write::{self, Format};

impl Generator {
    /// The place on the true surface of which point `index` is a measurement, in the coordinates of the
    /// points; None for outliers, for points between near and far, and where there is no normal.
    pub fn exact(&self, index: u64) -> Option<Sample> {
        let index = self.source_of(index);
        if self.outlier(index).is_some() {
            return None;
        }
        if let Source::Scene(made) = &self.source
            && !made.points[self.rank(index) as usize].real
        {
            return None;
        }
        let sample = self.place(index);
        let position = add(sample.position, self.cloud.offset);
        (sample.normal != [0.0; 3]).then_some(Sample { position, ..sample })
    }

    /// Writes the cloud to a file.
    pub fn write(&self, path: impl AsRef<Path>, format: Format) -> Result<()> {
        write::write_part(self, path.as_ref(), format, 0, 1)
    }

    /// Writes the places that were measured: see [`Cloud::write_seen`](crate::Cloud::write_seen).
    pub fn write_seen(&self, path: impl AsRef<Path>) -> Result<()> {
        write::write_seen(self, path.as_ref())
    }

    /// Writes the true surface: see [`Cloud::write_reference`](crate::Cloud::write_reference).
    pub fn write_reference(&self, path: impl AsRef<Path>, tolerance: f64) -> Result<()> {
        let made = match &self.source {
            Source::Scene(made) => Some(&made.truth),
            _ => None,
        };
        let mesh = reference::reference(&self.cloud, tolerance, made)?;
        write::write_reference(&mesh, path.as_ref())
    }
}
