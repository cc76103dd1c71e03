//! Reading a reference mesh: OBJ or PLY, told by the extension.

use std::{
    fs::File,
    io::{BufRead, BufReader},
    path::Path,
};

use ply_rs_bw::{
    parser::{Parser, Reader},
    ply::{Property, PropertyAccess, PropertyAccessResult},
};

use crate::error::{Error, Result};
use crate::surface::Tessellation;

/// Reads all triangles; polygons become fans.
pub(crate) fn read(path: &Path) -> Result<Tessellation> {
    let file = File::open(path).map_err(|e| Error::io(path, "open the mesh", e))?;
    let file = BufReader::with_capacity(1 << 18, file);
    let extension = path.extension().and_then(|e| e.to_str());
    let mesh = match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("obj") => obj(file),
        Some("ply") => ply(file),
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

fn fan(polygon: &[u32], out: &mut Vec<[u32; 3]>) {
    for pair in polygon.get(1..).unwrap_or_default().windows(2) {
        out.push([polygon[0], pair[0], pair[1]]);
    }
}

fn obj(mut file: impl BufRead) -> Result<Tessellation, String> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..tobj::LoadOptions::default()
    };
    // Materials are of no interest, and must not be looked for.
    let no_material = |_: &Path| Ok(Default::default());
    let (models, _) =
        tobj::load_obj_buf(&mut file, &options, no_material).map_err(|e| e.to_string())?;
    let mut mesh = Tessellation::default();
    for model in models {
        // Vertices are numbered by model.
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

/// A row of any element.
struct Row {
    place: [f64; 3],
    corners: Vec<u32>,
}

impl PropertyAccess for Row {
    fn new() -> Self {
        Row {
            place: [f64::NAN; 3],
            corners: Vec::new(),
        }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        // A corner that no u32 names is one that no vertex has.
        let wide = |v: i64| u32::try_from(v).unwrap_or(u32::MAX);
        match (name, property) {
            ("x" | "y" | "z", property) => {
                let Some(value) = scalar(&property) else {
                    return PropertyAccessResult::UnsupportedType;
                };
                self.place[usize::from(name.as_bytes()[0] - b'x')] = value;
            }
            ("vertex_indices" | "vertex_index", property) => {
                self.corners = match property {
                    Property::ListChar(list) => list.into_iter().map(|v| wide(v.into())).collect(),
                    Property::ListUChar(list) => list.into_iter().map(u32::from).collect(),
                    Property::ListShort(list) => list.into_iter().map(|v| wide(v.into())).collect(),
                    Property::ListUShort(list) => list.into_iter().map(u32::from).collect(),
                    Property::ListInt(list) => list.into_iter().map(|v| wide(v.into())).collect(),
                    Property::ListUInt(list) => list,
                    _ => return PropertyAccessResult::UnsupportedType,
                }
            }
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn scalar(property: &Property) -> Option<f64> {
    Some(match *property {
        Property::Char(v) => v.into(),
        Property::UChar(v) => v.into(),
        Property::Short(v) => v.into(),
        Property::UShort(v) => v.into(),
        Property::Int(v) => v.into(),
        Property::UInt(v) => v.into(),
        Property::Float(v) => v.into(),
        Property::Double(v) => v,
        _ => return None,
    })
}

fn ply(file: impl BufRead) -> Result<Tessellation, String> {
    let mut reader = Reader::new(file);
    let parser = Parser::<Row>::new();
    let header = parser.read_header(&mut reader).map_err(|e| e.to_string())?;
    let mut mesh = Tessellation::default();
    for (name, element) in &header.elements {
        let rows = parser
            .read_payload_for_element(&mut reader, element, &header)
            .map_err(|e| e.to_string())?;
        match name.as_str() {
            "vertex" => mesh.vertices = rows.into_iter().map(|row| row.place).collect(),
            "face" => rows
                .iter()
                .for_each(|row| fan(&row.corners, &mut mesh.triangles)),
            _ => {}
        }
    }
    Ok(mesh)
}
