//! The list of surfaces.

use std::{fmt, str::FromStr};

use crate::error::Error;
use crate::odd::Odd;
use crate::scene::Scene;

/// A surface with known geometry and topology.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// A sphere.
    Sphere,
    /// A torus around the z axis, its tube 0.4 of the ring.
    Torus,
    /// A smooth closed surface of genus 5 with bumps.
    Bumpy,
    /// A height field with hills and roughness over a square.
    Terrain,
    /// Two rooms with a doorway, a pillar and a table, seen from inside; genus 4.
    Room,
    /// A square.
    Plane,
    /// An exact integer grid in a plane.
    Grid,
    /// Three orthogonal squares that meet at a sharp corner.
    Corner,
    /// A given triangle mesh.
    Mesh,
    /// Hilly ground with houses, trees, walls and wires, as an aerial scan; always 400 x 400.
    Outdoor,
    /// A cloud without a surface, or with one unfit for reconstruction.
    Odd(Odd),
    /// A scene as virtual scanners measure it, or a sample of a surface with a known mesh.
    Scene(Scene),
}

impl Kind {
    /// All kinds with one surface that need no file.
    pub const ALL: [Kind; 8] = [
        Kind::Sphere,
        Kind::Torus,
        Kind::Bumpy,
        Kind::Terrain,
        Kind::Room,
        Kind::Plane,
        Kind::Grid,
        Kind::Corner,
    ];

    /// Name as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Sphere => "sphere",
            Kind::Torus => "torus",
            Kind::Bumpy => "bumpy",
            Kind::Terrain => "terrain",
            Kind::Room => "room",
            Kind::Plane => "plane",
            Kind::Grid => "grid",
            Kind::Corner => "corner",
            Kind::Mesh => "mesh",
            Kind::Outdoor => "outdoor",
            Kind::Odd(odd) => odd.name(),
            Kind::Scene(scene) => scene.name(),
        }
    }

    /// Euler characteristic of the surface if it is closed: 2 - 2 * genus.
    pub fn euler_characteristic(self) -> Option<i64> {
        match self {
            Kind::Sphere => Some(2),
            Kind::Torus => Some(0),
            Kind::Bumpy => Some(-8),
            Kind::Room => Some(-6),
            Kind::Scene(scene) => scene.euler_characteristic(),
            Kind::Terrain
            | Kind::Plane
            | Kind::Grid
            | Kind::Corner
            | Kind::Mesh
            | Kind::Outdoor
            | Kind::Odd(_) => None,
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Kind {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let odd = || Odd::ALL.into_iter().map(Kind::Odd);
        let scenes = || Scene::ALL.into_iter().map(Kind::Scene);
        let kinds = || {
            Kind::ALL
                .into_iter()
                .chain([Kind::Mesh, Kind::Outdoor])
                .chain(odd())
                .chain(scenes())
        };
        let names: Vec<_> = kinds().map(Kind::name).collect();
        let names = names.join(", ");
        kinds()
            .find(|kind| kind.name() == text)
            .ok_or_else(|| Error::parameter("kind", text, format!("one of {names}")))
    }
}
