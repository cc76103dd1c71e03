//! The mesh or cloud of a PLY file, relative to its centre.

use crate::error::{Error, Result};
use outcrop_ply::Mesh;
use outcrop_raster::vec3::{Vec3, sub};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// The drawn data: a cloud if there are no triangles.
#[derive(Debug)]
pub(crate) struct Scene {
    /// Vertices relative to `origin`.
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Colours of the vertices; empty if there are none.
    pub colors: Vec<[u8; 3]>,
    /// Centre of the bounding box; subtracted so that coordinates are small.
    pub origin: Vec3,
}

/// Reads a whole file.
pub(crate) fn read(path: &Path) -> Result<Scene> {
    let file = File::open(path).map_err(|e| Error::io(path, "open", e))?;
    let bytes = file.metadata().map_err(|e| Error::io(path, "examine", e))?;
    let file = BufReader::with_capacity(1 << 20, file);
    let mesh = Mesh::read(file, bytes.len()).map_err(|e| Error::ply(path, e))?;
    Ok(centred(mesh))
}

fn centred(mesh: Mesh) -> Scene {
    let mut scene = Scene {
        positions: mesh.vertices,
        triangles: mesh.triangles,
        colors: mesh.colors,
        origin: [0.0; 3],
    };
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in &scene.positions {
        if p.iter().all(|c| c.is_finite()) {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
    }
    if low[0] <= high[0] {
        scene.origin = std::array::from_fn(|k| low[k] / 2.0 + high[k] / 2.0);
        for p in &mut scene.positions {
            *p = sub(*p, scene.origin);
        }
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_are_not_finite_do_not_move_the_middle() {
        let vertices = vec![[0.0, 0.0, 0.5], [2.0, 4.0, 0.5], [f64::NAN, 9.0, 9.0]];
        let scene = centred(Mesh {
            vertices,
            ..Mesh::default()
        });
        assert_eq!(scene.origin, [1.0, 2.0, 0.5]);
        assert_eq!(scene.positions[1], [1.0, 2.0, 0.0]);
    }
}
