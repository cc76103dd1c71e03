//! Reading a reference mesh: OBJ or PLY, by the extension.

use std::{
    fs::File,
    io::{BufRead, BufReader},
    path::Path,
};

use crate::error::{Error, Result};
use crate::surface::Tessellation;

/// Reads all triangles; polygons become fans.
pub(crate) fn read(path: &Path) -> Result<Tessellation> {
    let file = File::open(path).map_err(|e| Error::io(path, "open the mesh", e))?;
    let bytes = file.metadata().map_or(u64::MAX, |m| m.len());
    let file = BufReader::with_capacity(1 << 18, file);
    let extension = path.extension().and_then(|e| e.to_str());
    let mesh = match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("obj") => obj(file),
        Some("ply") => ply(file, bytes),
        _ => Err("not a mesh by its name; use .obj or .ply".to_owned()),
    };
    mesh.and_then(checked)
        .map_err(|what| Error::mesh(path, one_line(&what)))
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn checked(mesh: Tessellation) -> Result<Tessellation, String> {
    let count = mesh.vertices.len();
    if count > u32::MAX as usize {
        return Err("more vertices than 32-bit indices can name".to_owned());
    }
    let used = |t: &[u32; 3]| t.map(|v| mesh.vertices.get(v as usize));
    for triangle in &mesh.triangles {
        for vertex in used(triangle) {
            match vertex {
                None => return Err(format!("a corner beyond the {count} vertices")),
                Some(place) if place.iter().any(|c| !c.is_finite()) => {
                    return Err("a vertex that is not finite".to_owned());
                }
                Some(_) => {}
            }
        }
    }
    if mesh.triangles.is_empty() {
        return Err("no triangles".to_owned());
    }
    Ok(mesh)
}

fn ply(file: impl BufRead, bytes: u64) -> Result<Tessellation, String> {
    let mesh = outcrop_ply::Mesh::read(file, bytes).map_err(|e| e.to_string())?;
    Ok(Tessellation {
        vertices: mesh.vertices,
        triangles: mesh.triangles,
    })
}

fn obj(mut file: impl BufRead) -> Result<Tessellation, String> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    // Materials are not needed and not loaded.
    let no_material = |_: &Path| Ok(Default::default());
    let (models, _) =
        tobj::load_obj_buf(&mut file, &options, no_material).map_err(|e| e.to_string())?;
    let mut mesh = Tessellation::default();
    for model in models {
        // Vertices are numbered by object.
        let first = u32::try_from(mesh.vertices.len()).map_err(|e| e.to_string())?;
        mesh.vertices
            .extend(model.mesh.positions.as_chunks().0.iter().copied());
        for triangle in model.mesh.indices.as_chunks().0 {
            mesh.triangles
                .push(triangle.map(|v: u32| v.saturating_add(first)));
        }
    }
    Ok(mesh)
}
