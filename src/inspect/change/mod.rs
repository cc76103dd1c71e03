//! The signed distance between two surfaces at every vertex of the new one, with its uncertainty.
//!
//! The distance is that of M3C2 (Lague, Brodu and Leroux, *Accurate 3D comparison of complex topography with
//! terrestrial laser scanner*, ISPRS Journal 82, 2013), taken at the vertices of a mesh: a cylinder along the normal of
//! the new surface at a vertex holds a part of each surface, and the change is the distance of their means along the
//! axis, positive for growth. A vertex counts by its share of the area of the triangles around it, so the distance
//! does not depend on how densely they are sampled. Of several layers that the cylinder meets the nearest one counts,
//! among those that face the same way; if it is more than a radius away, it counts only if it is tilted by less than
//! 60° and no part of that surface is nearer than half of its distance. Else only the new surface is there, as a wall of a new house.
//!
//! The uncertainty is `1.96 (√(σ₁²/n₁ + σ₂²/n₂) + r)`: the roughness `σ` of `n` vertices of each surface along the axis,
//! and the error `r` of the registration, which the user knows. A change that is larger is significant at 95 %.
//!
//! Each surface lies on disk in pages (`compare`); the vertices of the new one come in curve order.

mod areas;
#[cfg(feature = "pictures")]
mod drawing;
mod gather;
mod grid;
mod measure;
mod patch;
mod report;
mod rows;
mod surface;
#[cfg(test)]
mod tests;

pub use areas::Area;
#[cfg(feature = "pictures")]
pub use drawing::Illustration;
pub use report::Change;
pub use rows::{ChangeRow, Changes, ROWS, State};

use crate::compare::shape::Shape;
use crate::compare::{Clouds, Kind, Side, read_side_once};
use areas::{Areas, Sums, Units};
use measure::Measure;
use outcrop_codecs::ply_mesh::PlyMesh;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::{LocalTable, Sorter};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::vector::V3;
use rows::sections;
use serde::{Deserialize, Serialize};
use std::path::Path;
use surface::{Points, Surface, Vertex};

/// Mean distances of vertices in the radius of the cylinder, if it is not given: about 28 vertices of the sparser
/// surface are in it. M3C2 wants 20 or more.
const SPACINGS: f64 = 3.0;

/// Radii to which the other surface is searched, if no distance is given.
const RADII: f64 = 50.0;

/// How change is measured; lengths in units of the files.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// Radius of the cylinder, and of the normals; without it three times the mean distance of vertices of the sparser
    /// surface.
    pub radius: Option<f64>,
    /// The largest change that is looked for; without it fifty times the radius.
    pub farthest: Option<f64>,
    /// Error of the registration of the two surfaces.
    pub registration: f64,
}

/// The lengths of a measurement.
#[derive(Debug, Clone, Copy)]
struct Scale {
    radius: f64,
    farthest: f64,
    registration: f64,
}

/// Sees what was found.
trait Witness {
    /// False if it looks at nothing.
    const SEES: bool;
    /// Takes a vertex of the new surface.
    fn take(&mut self, position: V3, row: &ChangeRow);
    /// Takes a vertex of the old surface where the new one is not.
    fn gone(&mut self, position: V3);
}

impl Witness for () {
    const SEES: bool = false;
    fn take(&mut self, _: V3, _: &ChangeRow) {}
    fn gone(&mut self, _: V3) {}
}

/// Measures what changed from an old surface or cloud to a new mesh; `clouds` reads
/// those.
///
/// # Errors
/// [`Error::Input`] for a file that cannot be read, is empty, or has faces that are not triangles, and for a new one
/// that is no mesh; [`Error::Parameter`] for lengths that are not positive; [`Error::Io`], [`Error::Corrupt`] from the
/// scratch folder; [`Error::Memory`]; [`Error::Cancelled`].
pub fn change(
    old: &Path,
    new: &Path,
    options: &Options,
    clouds: Clouds,
    workspace: &Workspace,
) -> Result<(Change, Changes)> {
    let (found, rows, ()) = seen([old, new], options, clouds, workspace, |_, _| Ok(()))?;
    Ok((found, rows))
}

/// As [`change`], with a map and a distribution for `outcrop::page::change`.
///
/// # Errors
/// See [`change`].
#[cfg(feature = "pictures")]
pub fn illustrated(
    old: &Path,
    new: &Path,
    options: &Options,
    clouds: Clouds,
    workspace: &Workspace,
) -> Result<(Change, Changes, Illustration)> {
    let draw = |new: &Shape, old: &Shape| drawing::Drawing::of(new, old, workspace);
    let (found, rows, drawing) = seen([old, new], options, clouds, workspace, draw)?;
    let illustration = drawing.finish(&found, &rows, workspace)?;
    Ok((found, rows, illustration))
}

/// Measures, and shows what it finds to the witness that `begin` makes of the new and the old surface.
fn seen<W: Witness>(
    [old, path]: [&Path; 2],
    options: &Options,
    clouds: Clouds,
    workspace: &Workspace,
    begin: impl FnOnce(&Shape, &Shape) -> Result<W>,
) -> Result<(Change, Changes, W)> {
    check(options)?;
    let new = read_side_once(path, "change.new", clouds, workspace)?;
    if new.side.kind == Kind::Cloud {
        return Err(Error::input(path, "new surface", "a cloud", "a mesh"));
    }
    let old = read_side_once(old, "change.old", clouds, workspace)?;
    let scale = lengths(options, &old.side, &new.side);
    let mut witness = begin(&new, &old)?;
    let units = Units::of(&old.side.bounds().union(new.side.bounds()));
    let from = Surface::of(&new, scale.radius, workspace)?;
    let to = Surface::of(&old, scale.radius, workspace)?;
    let measure = |presence| Measure {
        from: if presence { &to } else { &from },
        to: if presence { &from } else { &to },
        scale,
        presence,
    };
    let (sums, rows) = measured(&measure(false), &units, &mut witness, workspace)?;
    let alone = match to.items {
        Points::Mesh(..) => Some(area_alone(&measure(true), &units, &mut witness, workspace)?),
        Points::Cloud(_) => None,
    };
    drop((from, to));
    // The lists of areas need the memory of the pages.
    let sides = [old, new].map(Shape::into_side);
    let vertices = rows.total();
    let areas = areas::measured(path, &rows, units, vertices, workspace)?;
    let found = told(sides, scale, (sums, &units), alone, areas);
    Ok((found, rows, witness))
}

/// The figures of sums by [`State`].
fn told(
    [old, new]: [Side; 2],
    scale: Scale,
    (sums, units): ([Sums; 4], &Units),
    only_old_area: Option<f64>,
    areas: Areas,
) -> Change {
    let [same, changed, alone, _] = sums;
    let Areas { areas, small } = areas;
    Change {
        old,
        new,
        radius: scale.radius,
        farthest: scale.farthest,
        registration: scale.registration,
        compared: same.vertices() + changed.vertices(),
        significant: changed.vertices(),
        compared_area: same.area(units) + changed.area(units),
        significant_area: changed.area(units),
        only_new_area: alone.area(units),
        only_old_area,
        gained: changed.gained(units) + alone.gained(units),
        lost: changed.lost(units) + alone.lost(units),
        areas,
        small_vertices: small.vertices(),
        small_area: small.area(units),
        small_gained: small.gained(units),
        small_lost: small.lost(units),
    }
}

/// Measures the change at all vertices; returns sums by [`State`], and the rows in order.
fn measured<W: Witness>(
    measure: &Measure<'_>,
    units: &Units,
    witness: &mut W,
    workspace: &Workspace,
) -> Result<([Sums; 4], Changes)> {
    let path = &measure.from.shape.side.path;
    let vertices = PlyMesh::open_any(path, workspace)?.vertices();
    let observer = &workspace.observer;
    observer.begin("change", "vertices", vertices);
    let found = LocalTable::<ChangeRow>::kept(workspace, "change.measured")?;
    let mut sums = [Sums::default(); 4];
    let put = |unit: &Unit<'_>, _: &[Vertex], rows: &[ChangeRow]| {
        let mut sums = [Sums::default(); 4];
        for row in rows {
            sums[row.state() as usize].add(row, units);
        }
        found.put_by(unit, unit.number(), rows)?;
        Ok(sums)
    };
    measure.each("measure", workspace, put, |some| {
        let both = sums.iter_mut().zip(some);
        both.for_each(|(all, some)| all.join(&some));
    })?;
    let bytes = vertices * size_of::<ChangeRow>() as u64;
    let buffer = bytes.min(workspace.memory.available() / 12) + (1 << 20);
    let _held = workspace.reserve("change: sort buffers", buffer + buffer / 2)?;
    let sorter = Sorter::new(workspace, "change.rows", buffer);
    let (mut rows, mut piece) = (Vec::new(), Vec::new());
    for number in 0..measure.pieces() {
        workspace.check_cancel()?;
        found.get_into(number, &mut rows)?;
        if W::SEES {
            measure.read(number, &mut piece)?;
            let both = piece.iter().zip(&rows);
            both.for_each(|(vertex, row)| witness.take(vertex.position(), row));
        }
        sorter.push(&rows)?;
    }
    drop(found);
    observer.end();
    Ok((sums, sections(sorter, vertices, workspace)?))
}

/// The area of a surface where the other one is not.
fn area_alone<W: Witness>(
    measure: &Measure<'_>,
    units: &Units,
    witness: &mut W,
    workspace: &Workspace,
) -> Result<f64> {
    let mut alone = Sums::default();
    let observer = &workspace.observer;
    let vertices = measure.from.shape.side.points;
    observer.begin("what only the old one has", "vertices", vertices);
    let places = LocalTable::<V3>::kept(workspace, "change.alone")?;
    let find = |unit: &Unit<'_>, vertices: &[Vertex], rows: &[ChangeRow]| {
        let (mut sums, mut some) = (Sums::default(), Vec::new());
        let both = vertices.iter().zip(rows);
        for (vertex, row) in both.filter(|(_, row)| row.state() == State::Alone) {
            sums.add(row, units);
            some.push(vertex.position());
        }
        places.put_by(unit, unit.number(), &some)?;
        Ok(sums)
    };
    measure.each("find what only the old one has", workspace, find, |some| {
        alone.join(&some)
    })?;
    let mut some = Vec::new();
    for number in (0..measure.pieces()).filter(|_| W::SEES) {
        places.get_into(number, &mut some)?;
        some.iter().for_each(|place| witness.gone(*place));
    }
    observer.end();
    Ok(alone.area(units))
}

fn check(options: &Options) -> Result<()> {
    let refuse = |name, found: f64, expected: &str| {
        Err(Error::Parameter {
            name,
            found: found.to_string(),
            expected: expected.into(),
        })
    };
    for (name, length) in [("radius", options.radius), ("farthest", options.farthest)] {
        if let Some(found) = length.filter(|length| !(*length > 0.0 && length.is_finite())) {
            return refuse(name, found, "a length above 0");
        }
    }
    let registration = options.registration;
    match registration >= 0.0 && registration.is_finite() {
        true => Ok(()),
        false => refuse("registration", registration, "a length of 0 or more"),
    }
}

/// The lengths for two surfaces.
fn lengths(options: &Options, old: &Side, new: &Side) -> Scale {
    // A cloud has the spacing of the mesh: its area is not known.
    let spacing = |side: &Side| match side.points > 0 && side.area > 0.0 {
        true => (side.area / side.points as f64).sqrt(),
        false => 0.0,
    };
    let usual = SPACINGS * spacing(old).max(spacing(new));
    let radius = options.radius.unwrap_or(usual);
    Scale {
        radius,
        farthest: options.farthest.unwrap_or(RADII * radius),
        registration: options.registration,
    }
}
