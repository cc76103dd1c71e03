//! The list of mesh formats, and what is asked of a format before there is a mesh.

use super::file::is_compressed;
use super::format::{CoordinateType, Mesh, MeshFormat};
use super::{glb, obj, ply, stl};
use outcrop_disk::error::{Error, Result, Setting};
use outcrop_disk::workspace::progress::Observer;
use std::path::Path;

/// All formats.
pub const FORMATS: [&dyn MeshFormat; 4] = [&ply::Ply, &obj::Obj, &stl::Stl, &glb::Glb];

/// The format for the extension of `output`, or for that before the one of compression.
///
/// # Errors
/// [`Error::Parameter`] if no format has this extension.
pub fn format_of(output: &Path) -> Result<&'static dyn MeshFormat> {
    let name = match is_compressed(output) {
        true => Path::new(output.file_stem().unwrap_or_default()),
        false => output,
    };
    let extension = name.extension().unwrap_or_default();
    let is = |known: &&str| extension.eq_ignore_ascii_case(known);
    let mut formats = FORMATS.into_iter();
    let named = formats.find(|format| format.extensions().iter().any(is));
    named.ok_or_else(|| Error::Parameter {
        name: "output",
        found: output.display().to_string(),
        expected: format!(
            "a name that ends with {} (compressed with .zst behind it, as in .ply.zst)",
            in_words(extensions(), "or")
        ),
    })
}

/// The extensions of all formats.
pub fn extensions() -> impl Iterator<Item = &'static str> {
    extensions_of(|_| true)
}

/// The extensions of those formats.
fn extensions_of(
    which: impl Fn(&'static dyn MeshFormat) -> bool,
) -> impl Iterator<Item = &'static str> {
    let formats = FORMATS.into_iter().filter(move |format| which(*format));
    formats.flat_map(|format| format.extensions()).copied()
}

/// Extensions in words, with `last` before the last one.
fn in_words(extensions: impl Iterator<Item = &'static str>, last: &str) -> String {
    let names: Vec<String> = extensions.map(|e| format!(".{e}")).collect();
    match names.split_last() {
        Some((end, before)) if !before.is_empty() => format!("{} {last} {end}", before.join(", ")),
        _ => names.concat(),
    }
}

/// Checks that the extension of a mesh is known, and that the format has compression of its own if that is asked
/// for by `compress`.
///
/// # Errors
/// [`Error::Parameter`].
pub fn check_name(output: &Path, compress: bool) -> Result<()> {
    let format = format_of(output)?;
    if compress && (!format.has_compression() || is_compressed(output)) {
        return Err(Error::Parameter {
            name: "compress_glb",
            found: output.display().to_string(),
            expected: "a mesh that ends with .glb".into(),
        });
    }
    Ok(())
}

/// Bytes of the uncompressed file of a mesh; as PLY if the extension of `output` is unknown.
pub fn mesh_bytes(output: &Path, mesh: &Mesh) -> u64 {
    let format = format_of(output).unwrap_or(FORMATS[0]);
    format.layout(mesh).bytes
}

/// Checks that a mesh does not exceed a limit of its format; `estimated` if its size is not known yet.
///
/// # Errors
/// [`Error::TooLarge`].
pub fn check_size(output: &Path, mesh: &Mesh, estimated: bool) -> Result<()> {
    let format = format_of(output)?;
    let Some(exceeded) = format.exceeded(mesh) else {
        return Ok(());
    };
    Err(Error::TooLarge {
        path: output.to_path_buf(),
        format: format.name(),
        unit: exceeded.unit,
        most: exceeded.most,
        found: match estimated {
            true => format!("about {}", exceeded.found),
            false => exceeded.found.to_string(),
        },
        finished: !estimated,
    })
}

/// Warnings about what the format of `output` leaves out of a mesh whose coordinates are up to `largest`.
pub fn left_out(
    output: &Path,
    mesh: &Mesh,
    largest: f64,
    observer: &dyn Observer,
) -> Result<Vec<String>> {
    let format = format_of(output)?;
    let mut warnings = Vec::new();
    let lost = mesh.columns.iter().filter(|c| !format.holds(mesh, c));
    let lost: Vec<&str> = lost.map(|column| &*column.name).collect();
    if !lost.is_empty() {
        let (name, lost) = (format.name(), lost.join(", "));
        warnings.push(format!(
            "{name} cannot store {lost} at vertices: left out; .ply keeps them"
        ));
    }
    if mesh.coordinates == CoordinateType::Double && !format.holds_doubles() {
        let largest = (largest as f32).min(f32::MAX / 2.0);
        warnings.push(format!(
            "{} has 32-bit floats only: coordinates of this cloud are rounded to steps of up to {}; \
             {} keep them, or give {}",
            format.name(),
            largest.next_up() - largest,
            in_words(extensions_of(MeshFormat::holds_doubles), "and"),
            observer.spell(&Setting::Value("origin", "auto".to_owned())),
        ));
    }
    Ok(warnings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_select_formats_and_unknown_ones_are_refused() {
        for (name, format) in [
            ("mesh.ply", "PLY"),
            ("MESH.PLY", "PLY"),
            ("a.b/mesh.v2.obj", "OBJ"),
            ("mesh.stl.zst", "STL"),
            ("mesh.Glb.ZST", "GLB"),
        ] {
            assert_eq!(format_of(Path::new(name)).unwrap().name(), format, "{name}");
        }
        for name in [
            "mesh",
            "mesh.",
            ".ply",
            "mesh.zst",
            "ply",
            "mesh.gltf",
            "mesh.ply.gz",
            "mesh.ply/x",
            "mesh.las",
            "mesh.ply.zst.zst",
            "mesh.plyx",
        ] {
            let error = format_of(Path::new(name)).err().unwrap().to_string();
            assert!(
                error.contains(".ply, .obj, .stl or .glb") && error.contains(name),
                "{error}"
            );
        }
    }
}
