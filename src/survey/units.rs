//! The units of a mesh, as its reference system says.

use outcrop_codecs::ply_mesh;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_points::{Crs, CrsKind, of_prj, prj_of};
use serde::Serialize;
use std::path::Path;

/// What is known of the units of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Units {
    /// The reference system, by its codes or its name; none if the mesh tells none.
    pub system: Option<String>,
    /// Metres in a unit of the plane, if known.
    pub plane: Option<f64>,
    /// Metres in a unit of heights, if known.
    pub heights: Option<f64>,
}

/// The system in the header of a mesh, or in the `.prj` file beside it.
pub(crate) fn system(mesh: &Path, workspace: &Workspace) -> Result<Option<Crs>> {
    if let Some(header) = Crs::of_comments(&ply_mesh::system(mesh)?) {
        return Ok(Some(header));
    }
    let (beside, warning) = of_prj(&prj_of(mesh));
    if let Some(warning) = warning {
        workspace.observer.warn(&warning);
    }
    Ok(beside)
}

impl Units {
    pub(crate) fn of(mesh: &Path, workspace: &Workspace) -> Result<Self> {
        let system = system(mesh, workspace)?;
        if let Some(system) = &system
            && system.kind == Some(CrsKind::Geographic)
        {
            let found = format!("{}, in degrees", system.label());
            let expected = "a system in a unit of length: degrees have no volume";
            return Err(Error::input(mesh, "reference system", found, expected));
        }
        let plane = system.as_ref().and_then(|system| system.unit);
        let heights = system.as_ref().and_then(|system| system.height_unit);
        Ok(Self {
            system: system.as_ref().map(Crs::label),
            plane,
            heights: heights.or(plane),
        })
    }

    /// Warns if another mesh has another system.
    pub(crate) fn agree(&self, other: &Path, workspace: &Workspace) -> Result<()> {
        let other_system = Self::of(other, workspace)?.system;
        if let (Some(own), Some(theirs)) = (&self.system, &other_system)
            && own != theirs
        {
            workspace.observer.warn(&format!(
                "{}: its reference system is {theirs}, that of the mesh {own}; coordinates are taken as they are",
                other.display()
            ));
        }
        Ok(())
    }

    /// A unit of length of this many metres, in short.
    fn short(metres: Option<f64>) -> &'static str {
        /// Feet, and US survey feet.
        const FEET: [f64; 2] = [0.3048, 1200.0 / 3937.0];
        let same = |unit: f64| metres.is_some_and(|metres| (metres / unit - 1.0).abs() < 1e-9);
        match () {
            () if same(1.0) => "m",
            () if same(FEET[0]) => "ft",
            () if same(FEET[1]) => "ft (US survey)",
            () => "units",
        }
    }

    /// The units of areas and of volumes.
    pub(crate) fn names(&self) -> [String; 2] {
        let (plane, heights) = (Self::short(self.plane), Self::short(self.heights));
        let power = |unit: &str, power: &str| match unit.split_once(' ') {
            Some((unit, rest)) => format!("{unit}{power} {rest}"),
            None => format!("{unit}{power}"),
        };
        match plane == heights {
            true => [power(plane, "²"), power(plane, "³")],
            false => [
                power(plane, "²"),
                format!("{} × {heights}", power(plane, "²")),
            ],
        }
    }

    /// Cubic metres in a unit of volume, if that is not 1.
    pub(crate) fn cubic_metres(&self) -> Option<f64> {
        let cubic = self.plane? * self.plane? * self.heights?;
        (cubic != 1.0).then_some(cubic)
    }
}
