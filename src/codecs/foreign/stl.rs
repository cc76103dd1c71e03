//! STL, binary and ASCII: each triangle with its corners, of which those at the same position become one vertex.

use super::Mesh;
use super::spool::{NO_MATERIAL, Spool};
use super::weld::Weld;
use outcrop_disk::error::{Error, Result};
use std::io::{BufRead, BufReader, Read};

/// Bytes before the triangles of a binary file: a text and their number.
const HEADER: u64 = 84;

/// Bytes of a triangle: a normal, three corners, and two bytes for anything.
const TRIANGLE: usize = 50;

/// Longest line of an ASCII file, in bytes.
const LINE: u64 = 4096;

/// Reads a mesh.
pub(super) fn read(mesh: &Mesh<'_>, spool: &mut Spool<'_>) -> Result<()> {
    match binary(mesh)? {
        Some(triangles) => {
            spool.floats = true;
            let mut weld = Weld::new(mesh, spool, 3 * triangles)?;
            read_binary(mesh, triangles, &mut weld)?;
            join(weld, spool)
        }
        None => {
            // The shortest triangle has 60 bytes or so, and three corners.
            let mut weld = Weld::new(mesh, spool, mesh.bytes / 20)?;
            read_text(mesh, &mut weld)?;
            join(weld, spool)
        }
    }
}

/// Number of triangles of a binary file; none for an ASCII file.
fn binary(mesh: &Mesh<'_>) -> Result<Option<u64>> {
    let mut head = [0; HEADER as usize];
    let known = mesh.bytes.min(HEADER) as usize;
    mesh.read_at(0, &mut head[..known])?;
    let count = u64::from(u32::from_le_bytes([head[80], head[81], head[82], head[83]]));
    let bytes = HEADER + count * TRIANGLE as u64;
    let is_text = head.trim_ascii_start().starts_with(b"solid");
    if known == head.len() && bytes == mesh.bytes {
        return Ok(Some(count));
    }
    if is_text {
        return Ok(None);
    }
    // Some writers append bytes of their own.
    if known == head.len() && bytes < mesh.bytes {
        return Ok(Some(count));
    }
    let found = format!("{count} triangles in {} bytes", mesh.bytes);
    let expected = format!("{bytes} bytes, or a file that begins with \"solid\"");
    Err(mesh.error("header", found, &expected))
}

fn read_binary(mesh: &Mesh<'_>, triangles: u64, weld: &mut Weld<'_>) -> Result<()> {
    const MOST: u64 = 1 << 14;
    let mut bytes = Vec::new();
    let mut at = 0;
    while at < triangles {
        let count = MOST.min(triangles - at);
        bytes.resize(count as usize * TRIANGLE, 0);
        mesh.read_at(HEADER + at * TRIANGLE as u64, &mut bytes)?;
        for (triangle, number) in bytes.chunks_exact(TRIANGLE).zip(at..) {
            for corner in triangle[12..48].chunks_exact(12) {
                let position = [0, 4, 8].map(|k| {
                    f32::from_le_bytes([corner[k], corner[k + 1], corner[k + 2], corner[k + 3]])
                });
                if !position.iter().all(|x| x.is_finite()) {
                    let place = format!("triangle {number}");
                    let found = format!("the corner {position:?}");
                    return Err(mesh.error(place, found, "finite coordinates"));
                }
                weld.push(position.map(f64::from), None)?;
            }
        }
        at += count;
    }
    Ok(())
}

fn read_text(mesh: &Mesh<'_>, weld: &mut Weld<'_>) -> Result<()> {
    let mut reader = BufReader::with_capacity(1 << 18, &mesh.file);
    let (mut line, mut number, mut corners) = (Vec::new(), 0u64, 0u64);
    loop {
        line.clear();
        let got = reader.by_ref().take(LINE).read_until(b'\n', &mut line);
        let got = got.map_err(|e| Error::io(mesh.shown, "read", e))?;
        if got == 0 {
            break;
        }
        number += 1;
        if number.is_multiple_of(1 << 16) {
            mesh.workspace.check_cancel()?;
        }
        let text = std::str::from_utf8(&line).unwrap_or_default();
        let mut words = text.split_ascii_whitespace();
        match words.next() {
            Some(word) if word.eq_ignore_ascii_case("vertex") => {
                let position: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
                let Ok(position) = <[f64; 3]>::try_from(position) else {
                    return Err(wrong(mesh, number, text, "vertex and three numbers"));
                };
                if !position.iter().all(|x| x.is_finite()) {
                    return Err(wrong(mesh, number, text, "finite coordinates"));
                }
                corners += 1;
                weld.push(position, None)?;
            }
            Some(word) if word.eq_ignore_ascii_case("endfacet") && corners % 3 != 0 => {
                return Err(wrong(mesh, number, text, "three corners before it"));
            }
            _ => {}
        }
    }
    mesh.workspace.io.add_read(mesh.bytes);
    match corners % 3 {
        0 => Ok(()),
        _ => Err(mesh.error(
            "end",
            format!("{corners} corners"),
            "three for each triangle",
        )),
    }
}

fn wrong(mesh: &Mesh<'_>, line: u64, text: &str, expected: &str) -> Error {
    let found: String = text.trim().chars().take(60).collect();
    mesh.error(format!("line {line}"), format!("{found:?}"), expected)
}

/// Triangles of three vertices each.
fn join(weld: Weld<'_>, spool: &mut Spool<'_>) -> Result<()> {
    let mut corners = Vec::with_capacity(3);
    weld.finish(spool, |spool, vertex| {
        corners.push(vertex);
        if let [a, b, c] = corners[..] {
            corners.clear();
            spool.triangle([a, b, c], NO_MATERIAL)?;
        }
        Ok(())
    })
}
