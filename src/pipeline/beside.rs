//! The files beside the mesh: `MESH.origin.json` with the origin of its coordinates, and `MESH.prj` with the
//! well-known text of their reference system.
//!
//! They are written when the mesh has its name, each under a temporary name first; a resumed run writes them
//! again.

use crate::report::Report;
use outcrop_disk::error::{Error, Result};
use outcrop_mesh_files::export::{extensions, folder_of, is_compressed};
use outcrop_platform::canonical;
use outcrop_points::Crs;
use serde::Serialize;
use std::ffi::OsString;
use std::io::ErrorKind::NotFound;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// The beginning of every file with an origin, by which one of an earlier mesh is known.
const MADE_BY: &str = "outcrop ";

/// Most bytes of such a file.
const LONGEST: u64 = 4 << 20;

/// The content of `MESH.origin.json`.
#[derive(Serialize)]
struct OriginFile {
    made_by: String,
    mesh: String,
    /// Coordinates of the mesh plus these are those of the cloud; Metashape calls this the shift.
    origin: [f64; 3],
    /// The same as CloudCompare counts it: coordinates of the cloud plus these are those of the mesh.
    cloudcompare_global_shift: [f64; 3],
    /// A line for `global_shift_list.txt`, from which CloudCompare offers shifts.
    cloudcompare_global_shift_list: String,
    crs: Option<Crs>,
}

/// Path of the file beside a mesh: its name with another extension, after that of a compression is removed.
pub(super) fn path_beside(output: &Path, extension: &str) -> PathBuf {
    let plain = match is_compressed(output) {
        true => output.with_extension(""),
        false => output.to_path_buf(),
    };
    let mut path = plain.with_extension("").into_os_string();
    path.push(".");
    path.push(extension);
    path.into()
}

/// Writes the files beside the mesh. Those of an earlier mesh of the name that are not true any more are deleted;
/// returns warnings about them.
pub(super) fn write(
    output: &Path,
    inputs: &[PathBuf],
    report: &Report,
    wkt: Option<&str>,
) -> Result<Vec<String>> {
    let mut warnings = Vec::new();
    warnings.extend(write_origin(output, report)?);
    let path = path_beside(output, "prj");
    // That of an input stays as it is.
    let of_input = outcrop_formats::expand(inputs)?.iter().any(|input| {
        let other = canonical(&outcrop_points::prj_of(input));
        other.is_ok_and(|other| canonical(&path).is_ok_and(|path| path == other))
    });
    match wkt {
        _ if of_input => {}
        Some(wkt) => put(&path, format!("{wkt}\n").as_bytes())?,
        None => warnings.extend(without_prj(output, &path, report)?),
    }
    Ok(warnings)
}

/// Deletes a `.prj` file that an earlier mesh of the name left, for this one has none.
fn without_prj(output: &Path, path: &Path, report: &Report) -> Result<Option<String>> {
    let (Some(beside), _) = outcrop_points::of_prj(path) else {
        return Ok(None);
    };
    // It has no more than the codes of the same system.
    if report
        .input
        .crs
        .as_ref()
        .is_some_and(|crs| beside.agrees(crs))
    {
        return Ok(None);
    }
    let names = match &report.input.crs {
        Some(crs) => format!("gives {crs}"),
        None => "names no reference system".into(),
    };
    let shown = path.display();
    if let Some(other) = other_mesh(output) {
        let other = other.display();
        return Ok(Some(format!(
            "{shown}: it gives {beside}, and stays for {other}; the mesh {names}"
        )));
    }
    if !is_our_text(path) {
        return Ok(Some(format!(
            "{shown}: it gives {beside}, and stays, for it is not of outcrop; the mesh {names}"
        )));
    }
    std::fs::remove_file(path).map_err(|e| Error::io(path, "delete", e))?;
    Ok(Some(format!(
        "{shown}: deleted, it was of an earlier mesh of this name, in {beside}; this one {names}"
    )))
}

/// Another mesh to which the files beside this one may belong: meshes of one name share them.
fn other_mesh(output: &Path) -> Option<PathBuf> {
    let names = extensions().flat_map(|extension| {
        let plain = path_beside(output, extension);
        let mut packed = plain.clone().into_os_string();
        packed.push(".zst");
        [plain, packed.into()]
    });
    let others = names.into_iter().filter(|path| path != output);
    others.into_iter().find(|path| path.is_file())
}

/// True if a `.prj` file is as this program writes it: a text and one end of line.
fn is_our_text(path: &Path) -> bool {
    let read = std::fs::File::open(path).and_then(|file| {
        let mut bytes = Vec::new();
        file.take(LONGEST).read_to_end(&mut bytes).map(|_| bytes)
    });
    read.is_ok_and(|bytes| {
        let text = bytes.strip_suffix(b"\n");
        text.is_some_and(|text| text.trim_ascii() == text)
    })
}

/// Removes a mesh and the files beside it; they do no harm if they cannot be deleted.
pub(super) fn remove(mesh: &Path) {
    for path in [
        mesh,
        &path_beside(mesh, "prj"),
        &path_beside(mesh, "origin.json"),
    ] {
        let _ = std::fs::remove_file(path);
    }
}

fn write_origin(output: &Path, report: &Report) -> Result<Option<String>> {
    let path = path_beside(output, "origin.json");
    let Some(origin) = report.origin else {
        return match mesh_of(&path) {
            // It belongs to a mesh of another format, which is still there.
            Some(mesh) if mesh != output && mesh.is_file() => Ok(Some(format!(
                "{}: it stays for {}; the coordinates of this mesh are those of the cloud",
                path.display(),
                mesh.display()
            ))),
            Some(_) => {
                std::fs::remove_file(&path).map_err(|e| Error::io(&path, "delete", e))?;
                Ok(None)
            }
            None => Ok(None),
        };
    };
    let name = output.file_name().unwrap_or_default().to_string_lossy();
    let shift = origin.map(|c| 0.0 - c);
    let [x, y, z] = shift;
    let content = OriginFile {
        made_by: format!("{MADE_BY}{}", report.version),
        cloudcompare_global_shift_list: format!("{}; {x}; {y}; {z}; 1;", name.replace(';', " ")),
        mesh: name.into_owned(),
        origin,
        cloudcompare_global_shift: shift,
        crs: report.input.crs.clone(),
    };
    let json = serde_json::to_string_pretty(&content);
    let json = json.map_err(|e| Error::io(&path, "write JSON", e.into()))?;
    put(&path, (json + "\n").as_bytes())?;
    Ok(None)
}

/// The mesh of which a file with an origin is, if this program wrote it.
fn mesh_of(path: &Path) -> Option<PathBuf> {
    let file = std::fs::File::open(path).ok()?;
    let mut bytes = Vec::new();
    file.take(LONGEST).read_to_end(&mut bytes).ok()?;
    let value: serde_json::Value = serde_json::from_slice(&bytes).ok()?;
    let ours = value["made_by"].as_str()?.starts_with(MADE_BY);
    let name = value["mesh"].as_str().unwrap_or_default();
    // Only a name: what the file says must not lead elsewhere.
    let name = Path::new(name).file_name().unwrap_or_default();
    ours.then(|| path.with_file_name(name))
}

/// Writes a file under a temporary name, then renames it.
fn put(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".outcrop-part");
    let temporary = folder_of(path).join(name);
    let write = || {
        match std::fs::remove_file(&temporary) {
            Err(e) if e.kind() != NotFound => return Err(e),
            _ => {}
        }
        let mut file = std::fs::File::create_new(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        outcrop_platform::rename(&temporary, path)
    };
    write().map_err(|e| {
        let _ = std::fs::remove_file(&temporary);
        Error::io(path, "write", e)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_lie_beside_the_mesh() {
        for (output, beside) in [
            ("mesh.ply", "mesh.prj"),
            ("a/mesh.ply.zst", "a/mesh.prj"),
            ("a.b/site.1.PLY", "a.b/site.1.prj"),
            ("a.b/mesh", "a.b/mesh.prj"),
        ] {
            assert_eq!(path_beside(Path::new(output), "prj"), Path::new(beside));
        }
    }

    #[test]
    fn the_origin_of_an_earlier_mesh_is_deleted_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("mesh.ply");
        let path = folder.path().join("mesh.origin.json");
        let with = |origin| Report {
            version: "1",
            origin,
            ..Report::default()
        };
        write(&output, &[], &with(Some([635_000.0, 0.0, -0.5])), None).unwrap();
        let json: serde_json::Value =
            serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        assert_eq!(json["origin"], serde_json::json!([635_000.0, 0.0, -0.5]));
        let line = "mesh.ply; -635000; 0; 0.5; 1;";
        assert_eq!(json["cloudcompare_global_shift_list"], line);
        write(&output, &[], &with(None), None).unwrap();
        assert!(!path.exists());
        std::fs::write(&path, "{\"made_by\": \"hand\"}").unwrap();
        write(&output, &[], &with(None), None).unwrap();
        assert!(path.exists());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
