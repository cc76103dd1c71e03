//! What was measured, as data and as text.

use super::sums::{Layers, Scales};
use crate::pieces::Surface;
use crate::units::Units;
use serde::Serialize;
use std::fmt;
use std::path::PathBuf;

/// Share of what faces down above which it is told.
const NOTABLE: f64 = 1e-3;

/// A mesh that was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Side {
    /// The file.
    pub path: PathBuf,
    /// Vertices in the file.
    pub vertices: u64,
    /// Triangles in the file.
    pub triangles: u64,
    /// Lowest corner of the box around all vertices.
    pub min: [f64; 3],
    /// Highest corner.
    pub max: [f64; 3],
}

impl Side {
    pub(crate) fn of(surface: &Surface) -> Self {
        let bounds = surface.bounds();
        Self {
            path: surface.path().to_path_buf(),
            vertices: surface.vertices(),
            triangles: surface.faces(),
            min: bounds.min,
            max: bounds.max,
        }
    }
}

/// What was measured of a mesh. Lengths are in the units of its coordinates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Volumes {
    /// The mesh.
    pub mesh: Side,
    /// What its reference system says of the units.
    pub units: Units,
    /// The level from which on heights are measured, if one was given.
    pub level: Option<f64>,
    /// The other mesh, if heights are measured from it on.
    pub other: Option<Side>,
    /// Area of the region, if one was given.
    pub crop_area: Option<f64>,
    /// What the mesh encloses, if neither level nor other mesh was given.
    pub body: Option<Body>,
    /// What lies above and below, otherwise.
    pub earth: Option<Earth>,
}

/// What a mesh encloses.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Body {
    /// True if no component has a boundary.
    pub is_closed: bool,
    /// The volume, negative if triangles face inwards; none unless the mesh is closed.
    pub volume: Option<f64>,
    /// Area of the surface.
    pub area: f64,
    /// Area in plan of what faces up.
    pub facing_up: f64,
    /// Area in plan of what faces down.
    pub facing_down: f64,
    /// The components without a boundary.
    pub closed: Group,
    /// Those with one, which have no volume of their own.
    pub open: Group,
    /// The closed ones of largest volume, the largest first; ten at most.
    pub largest: Vec<Component>,
    /// The closed ones that are not listed.
    pub rest: Group,
}

/// Components together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// Number of components.
    pub components: u64,
    /// Their triangles.
    pub triangles: u64,
    /// Their area.
    pub area: f64,
    /// Their volume; none of components with a boundary.
    pub volume: Option<f64>,
}

/// A closed component.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Component {
    /// Its volume.
    pub volume: f64,
    /// Area of its surface.
    pub area: f64,
    /// Its triangles.
    pub triangles: u64,
    /// Its vertex with the smallest number.
    pub vertex: u32,
    /// Where that is.
    pub position: [f64; 3],
}

/// What lies above and below a level or another surface.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Earth {
    /// Volume below the mesh, and above the level or the other surface.
    pub above: f64,
    /// Volume above the mesh, and below the level or the other surface.
    pub below: f64,
    /// `above` less `below`.
    pub net: f64,
    /// Area in plan where the mesh is above.
    pub above_area: f64,
    /// Area in plan where it is below.
    pub below_area: f64,
    /// Area in plan that the mesh covers, or both meshes; none if the mesh has no boundary: its layers cancel.
    pub covered: Option<f64>,
    /// Area of the region that is not covered; none without a region.
    pub not_covered: Option<f64>,
    /// Area that the mesh covers and the other does not.
    pub only_this: Option<f64>,
    /// Area that the other covers and the mesh does not.
    pub only_other: Option<f64>,
    /// True if the mesh has no boundary: a level then divides its volume.
    pub is_closed: bool,
    /// True if the mesh faces down, and was measured as if it faced up.
    pub is_turned: bool,
    /// The same of the other mesh.
    pub other_turned: bool,
    /// Area in plan of what faces up, of what was measured.
    pub facing_up: f64,
    /// Area in plan of what faces down: overhangs, or triangles that do not run like the others.
    pub facing_down: f64,
    /// The same of the other mesh.
    pub other_down: f64,
}

impl Earth {
    pub(crate) fn of(layers: &Layers, scales: &Scales) -> Self {
        let [above, below] = layers.volumes;
        let value = |sum| scales.volume.value(sum);
        let area = |sum| scales.area.value(sum);
        Self {
            above: value(above),
            below: value(below),
            net: value(above - below),
            above_area: area(layers.areas[0]),
            below_area: area(layers.areas[1]),
            facing_up: area(layers.facing[0]),
            facing_down: area(layers.facing[1]),
            ..Self::default()
        }
    }
}

impl Volumes {
    pub(crate) fn new(mesh: Side, units: Units) -> Self {
        Self {
            mesh,
            units,
            level: None,
            other: None,
            crop_area: None,
            body: None,
            earth: None,
        }
    }

    /// Adds what follows from the rest.
    pub(crate) fn finish(&mut self) {
        if let Some(earth) = &mut self.earth {
            let both = self.crop_area.zip(earth.covered);
            earth.not_covered = both.map(|(region, covered)| (region - covered).max(0.0));
        }
    }
}

/// A number with spaces between groups of three digits, and about eight digits in all.
fn shown(number: f64) -> String {
    let digits = format!("{:.0}", number.abs()).len();
    let decimals = 8usize.saturating_sub(digits).min(6);
    let text = format!("{number:.decimals$}");
    let (whole, rest) = text.split_once('.').unwrap_or((&text, ""));
    let rest = rest.trim_end_matches('0');
    let (sign, whole) = match whole.strip_prefix('-') {
        Some(whole) => ("-", whole),
        None => ("", whole),
    };
    let groups: Vec<_> = whole.as_bytes().rchunks(3).rev().collect();
    let whole = String::from_utf8_lossy(&groups.join(&b' ')).into_owned();
    match rest {
        "" if whole == "0" => whole,
        "" => format!("{sign}{whole}"),
        rest => format!("{sign}{whole}.{rest}"),
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let triangles = shown(self.triangles as f64);
        write!(f, "{}: {triangles} triangles", self.path.display())
    }
}

impl fmt::Display for Volumes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.mesh)?;
        match (&self.other, self.level) {
            (Some(other), _) => write!(f, "\nfrom {other}")?,
            (_, Some(level)) => write!(f, "\nfrom the level {level}")?,
            _ => {}
        }
        if let Some(earth) = &self.earth {
            self.tell_earth(earth, f)?;
        }
        if let Some(body) = &self.body {
            self.tell_body(body, f)?;
        }
        match (&self.units.system, self.units.cubic_metres()) {
            (Some(system), Some(cubic)) => {
                write!(f, "\n{system}; a unit of volume is {cubic} m³")
            }
            (Some(system), None) => write!(f, "\n{system}"),
            (None, _) => write!(
                f,
                "\nin the units of the mesh, which tells no reference system"
            ),
        }
    }
}

impl Volumes {
    fn tell_earth(&self, earth: &Earth, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [area, volume] = self.units.names();
        let rows = [
            ("above", earth.above, Some(earth.above_area)),
            ("below", earth.below, Some(earth.below_area)),
            ("net", earth.net, None),
        ];
        for (name, value, over) in rows {
            write!(f, "\n{name:<12}{:>18} {volume}", shown(value))?;
            if let Some(over) = over {
                write!(f, " over {} {area}", shown(over))?;
            }
        }
        let covered = match self.other {
            Some(_) => "both cover",
            None => "covered",
        };
        let areas = [
            ("region", self.crop_area),
            (covered, earth.covered),
            ("not covered", earth.not_covered),
            ("only MESH", earth.only_this),
            ("only OTHER", earth.only_other),
        ];
        for (name, value) in areas {
            if let Some(value) = value {
                write!(f, "\n{name:<12}{:>18} {area}", shown(value))?;
            }
        }
        for note in self.notes(earth) {
            write!(f, "\n{note}")?;
        }
        Ok(())
    }

    /// What the reader has to know of the surfaces.
    fn notes(&self, earth: &Earth) -> Vec<String> {
        let mut notes = Vec::new();
        if earth.is_closed {
            notes.push(
                "the mesh is closed: what it encloses above counts as above, what it encloses below as less than 0"
                    .to_owned(),
            );
        }
        for (name, turned) in [("MESH", earth.is_turned), ("OTHER", earth.other_turned)] {
            if turned {
                notes.push(format!(
                    "{name} faces down; it is measured as if it faced up"
                ));
            }
        }
        if let (Some(region), Some(covered)) = (self.crop_area, earth.covered)
            && covered > region * (1.0 + NOTABLE)
        {
            notes.push(
                "more is covered than the region: layers lie above each other, and each counts"
                    .to_owned(),
            );
        }
        let all = earth.facing_up + earth.facing_down;
        if !earth.is_closed && earth.facing_down > NOTABLE * all {
            notes.push(format!(
                "{:.1} % of MESH in plan faces down: overhangs, which count as layers, or triangles that do not run \
                 like the others (`outcrop verify` tells)",
                100.0 * earth.facing_down / all
            ));
        }
        notes
    }

    fn tell_body(&self, body: &Body, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [area, volume] = self.units.names();
        match body.volume {
            Some(value) => write!(f, "\nvolume      {:>18} {volume}", shown(value))?,
            None => write!(f, "\nvolume      {:>18} the mesh has a boundary", "none:")?,
        }
        let facing = [body.facing_up, body.facing_down].map(shown);
        write!(
            f,
            "\narea        {:>18} {area}; in plan {} {area} up, {} {area} down",
            shown(body.area),
            facing[0],
            facing[1]
        )?;
        for (name, group) in [("closed", &body.closed), ("open", &body.open)] {
            let count = shown(group.components as f64);
            write!(f, "\n{name:<12}{count:>18} components")?;
            if let Some(value) = group.volume {
                write!(f, ", {} {volume}", shown(value))?;
            }
        }
        if body.open.components > 0 {
            write!(
                f,
                ": what they enclose depends on a base, so it is left out; give a level, or close them"
            )?;
        }
        if body.closed.components > 1 {
            for one in &body.largest {
                let [x, y, z] = one.position;
                write!(
                    f,
                    "\n{:>30} {volume}, {} triangles, at {x} {y} {z}",
                    shown(one.volume),
                    shown(one.triangles as f64)
                )?;
            }
        }
        if let (1.., Some(value)) = (body.rest.components, body.rest.volume) {
            let count = shown(body.rest.components as f64);
            write!(f, "\n{:>30} {volume}, {count} others", shown(value))?;
        }
        if body.volume.is_some_and(|value| value < 0.0) {
            write!(f, "\nless than 0: the triangles of the mesh face inwards")?;
        }
        Ok(())
    }
}
