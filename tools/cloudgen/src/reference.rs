//! The true surface as a mesh, in the coordinates of the points.

use crate::cloud::Cloud;
use crate::error::{Error, Result};
use crate::kind::Kind;
use crate::mesh_file;
use crate::scene;
use crate::surface::{
    Bumpy, Corner, Grid, Mesh, Plane, Room, Sphere, Surface, Terrain, Tessellation, Torus, turned,
};
use crate::vec3::add;

/// A finer mesh would have some hundred million triangles.
const LEAST_TOLERANCE: f64 = 1e-8;

/// The surface of a kind that is not a grid.
pub(crate) fn surface(cloud: &Cloud) -> Result<Option<Box<dyn Surface>>> {
    let size = cloud.size;
    Ok(Some(match cloud.kind {
        Kind::Sphere => Box::new(Sphere::new(size)),
        Kind::Torus => Box::new(Torus::new(size)),
        Kind::Bumpy => Box::new(Bumpy::new(size)),
        Kind::Terrain => Box::new(Terrain::new(size)),
        Kind::Room => Box::new(Room::new(size)),
        Kind::Plane => Box::new(Plane::new(size)),
        Kind::Corner => Box::new(Corner::new(size)),
        Kind::Mesh => {
            let path = cloud.mesh.as_deref().unwrap_or_else(|| "".as_ref());
            Box::new(Mesh::new(&mesh_file::read(path)?, size, path)?)
        }
        Kind::Grid | Kind::Outdoor | Kind::Odd(_) | Kind::Scene(_) => return Ok(None),
    }))
}

/// The first layer, without noise; `tolerance` in units of the size. The surface of a scene is not made again
/// if it is there.
pub(crate) fn reference(
    cloud: &Cloud,
    tolerance: f64,
    scene: Option<&Tessellation>,
) -> Result<Tessellation> {
    if !(LEAST_TOLERANCE..1.0).contains(&tolerance) {
        let expected = format!("{LEAST_TOLERANCE:e} to below 1");
        return Err(Error::parameter("reference-tolerance", tolerance, expected));
    }
    if matches!(cloud.kind, Kind::Outdoor | Kind::Odd(_)) {
        return Err(Error::Conflict {
            first: "reference",
            second: cloud.kind.name(),
            why: "it has no surface of its own",
        });
    }
    let tolerance = tolerance * cloud.size;
    let (mut mesh, turn) = match (surface(cloud)?, cloud.kind) {
        (Some(surface), _) => (surface.reference(tolerance), cloud.rotated),
        (None, Kind::Scene(kind)) => {
            let made = scene.map_or_else(|| scene::truth(cloud, kind), |made| Ok(made.clone()));
            (made?, cloud.rotated)
        }
        (None, _) => {
            let grid = Grid::new(cloud.points, cloud.size, cloud.rotated)?;
            (grid.reference(), false)
        }
    };
    for vertex in &mut mesh.vertices {
        let place = if turn { turned(*vertex) } else { *vertex };
        *vertex = add(place, cloud.offset);
    }
    Ok(mesh)
}
