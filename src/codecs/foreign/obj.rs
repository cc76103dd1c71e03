//! OBJ: vertices, with colours that some writers append, and faces by their numbers; colours of materials from the
//! library beside the file.

use super::Mesh;
use super::spool::{NO_MATERIAL, Spool};
use outcrop_disk::error::{Error, Result};
use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Longest line, in bytes; a face of some 100 000 corners.
const LINE: u64 = 1 << 20;

/// Largest library of materials that is read, in bytes.
const LIBRARY: u64 = 16 << 20;

/// Reads a mesh.
pub(super) fn read(mesh: &Mesh<'_>, spool: &mut Spool<'_>) -> Result<()> {
    let mut lines = Lines::new(mesh);
    let mut parser = Parser {
        spool,
        largest: 0,
        corners: Vec::new(),
        materials: HashMap::new(),
        material: NO_MATERIAL,
        libraries: Vec::new(),
    };
    while lines.next()? {
        let wrong = |expected: &str| {
            let found: String = lines.text().trim().chars().take(60).collect();
            let place = format!("line {}", lines.number);
            mesh.error(place, format!("{found:?}"), expected)
        };
        parser.take(lines.text()).map_err(|failed| match failed {
            Failed::Expected(expected) => wrong(expected),
            Failed::Other(error) => error,
        })?;
    }
    let (largest, vertices) = (parser.largest, parser.spool.vertices());
    if largest > vertices {
        let found = format!("a corner with number {largest}");
        return Err(mesh.error("faces", found, &format!("numbers up to {vertices}")));
    }
    parser.paint(mesh);
    mesh.workspace.io.add_read(mesh.bytes);
    Ok(())
}

/// Lines of a file; a backslash at an end joins the next one.
struct Lines<'a> {
    mesh: &'a Mesh<'a>,
    reader: BufReader<&'a std::fs::File>,
    line: Vec<u8>,
    number: u64,
}

impl<'a> Lines<'a> {
    fn new(mesh: &'a Mesh<'a>) -> Self {
        Self {
            mesh,
            reader: BufReader::with_capacity(1 << 18, &mesh.file),
            line: Vec::new(),
            number: 0,
        }
    }

    /// Reads the next line; false at the end of the file.
    fn next(&mut self) -> Result<bool> {
        self.line.clear();
        loop {
            let rest = LINE - self.line.len() as u64;
            let mut part = self.reader.by_ref().take(rest);
            let got = part.read_until(b'\n', &mut self.line);
            let got = got.map_err(|e| Error::io(self.mesh.shown, "read", e))?;
            self.number += u64::from(got > 0);
            if self.line.len() as u64 == LINE {
                let place = format!("line {}", self.number);
                let expected = format!("lines of less than {LINE} bytes");
                return Err(self.mesh.error(place, "a longer line", &expected));
            }
            let end = self.line.trim_ascii_end().len();
            if got > 0 && self.line[..end].ends_with(b"\\") {
                self.line.truncate(end - 1);
                continue;
            }
            if self.number.is_multiple_of(1 << 16) {
                self.mesh.workspace.check_cancel()?;
            }
            return Ok(got > 0 || !self.line.is_empty());
        }
    }

    /// The line; what is no UTF-8 ends it.
    fn text(&self) -> &str {
        match std::str::from_utf8(&self.line) {
            Ok(text) => text,
            Err(e) => std::str::from_utf8(&self.line[..e.valid_up_to()]).unwrap_or_default(),
        }
    }
}

/// Why a line is not taken.
enum Failed {
    Expected(&'static str),
    Other(Error),
}

impl From<Error> for Failed {
    fn from(error: Error) -> Self {
        Self::Other(error)
    }
}

struct Parser<'p, 'a> {
    spool: &'p mut Spool<'a>,
    /// The largest number of a corner.
    largest: u64,
    corners: Vec<u32>,
    /// Numbers of materials by name.
    materials: HashMap<String, u16>,
    /// That of the next faces.
    material: u16,
    libraries: Vec<String>,
}

impl Parser<'_, '_> {
    fn take(&mut self, line: &str) -> std::result::Result<(), Failed> {
        let mut words = line.split_ascii_whitespace();
        let rest = |word: &str| line.trim_start()[word.len()..].trim().to_owned();
        match words.next() {
            Some("v") => self.vertex(words),
            Some("f") => self.face(words),
            Some(word @ "usemtl") => {
                self.use_material(rest(word));
                Ok(())
            }
            Some(word @ "mtllib") => {
                self.libraries.push(rest(word));
                Ok(())
            }
            Some("vt") => {
                self.leave_out("texture coordinates");
                Ok(())
            }
            Some("vn") => {
                self.leave_out("normals");
                Ok(())
            }
            Some("l" | "p") => {
                self.leave_out("lines and points");
                Ok(())
            }
            Some("curv" | "curv2" | "surf" | "cstype") => {
                self.leave_out("curves and free-form surfaces");
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn leave_out(&mut self, what: &'static str) {
        if !self.spool.left_out.contains(&what) {
            self.spool.left_out.push(what);
        }
    }

    /// A position; a weight, or a colour of three numbers from 0 to 1, may follow.
    fn vertex<'w>(
        &mut self,
        words: impl Iterator<Item = &'w str>,
    ) -> std::result::Result<(), Failed> {
        let mut numbers = [0.0f64; 8];
        let mut count = 0;
        for word in words {
            let Ok(number) = word.parse::<f64>() else {
                return Err(Failed::Expected("v and numbers"));
            };
            if count == numbers.len() {
                return Err(Failed::Expected("v and three to seven numbers"));
            }
            numbers[count] = number;
            count += 1;
        }
        let [x, y, z, rest @ ..] = numbers;
        if count < 3 || ![x, y, z].iter().all(|x| x.is_finite()) {
            return Err(Failed::Expected("v and three finite numbers"));
        }
        let colour = (count >= 6).then(|| [rest[0], rest[1], rest[2]].map(byte));
        Ok(self.spool.vertex([x, y, z], colour)?)
    }

    /// Corners, each a number of a vertex; numbers of a texture coordinate and a normal may follow it. They count
    /// from 1, or if negative backwards from the last vertex.
    fn face<'w>(
        &mut self,
        words: impl Iterator<Item = &'w str>,
    ) -> std::result::Result<(), Failed> {
        const CORNERS: &str = "f and numbers of vertices";
        self.corners.clear();
        let known = self.spool.vertices() as i64;
        for word in words {
            let number = word.split('/').next().unwrap_or_default();
            let number: i64 = number.parse().map_err(|_| Failed::Expected(CORNERS))?;
            let number = if number < 0 {
                known + 1 + number
            } else {
                number
            };
            let index = number.checked_sub(1).and_then(|x| u32::try_from(x).ok());
            let index = index.ok_or(Failed::Expected(CORNERS))?;
            self.largest = self.largest.max(number as u64);
            self.corners.push(index);
        }
        Ok(self.spool.face(&self.corners, self.material)?)
    }

    fn use_material(&mut self, name: String) {
        let next = u16::try_from(self.materials.len()).unwrap_or(NO_MATERIAL);
        let known = self.materials.get(&name).copied();
        self.material = known.unwrap_or(next);
        // More materials than numbers are as none.
        if known.is_none() && next < NO_MATERIAL {
            self.materials.insert(name, next);
        }
    }

    /// Reads the colours of the materials.
    fn paint(&mut self, mesh: &Mesh<'_>) {
        self.spool.palette = vec![None; self.materials.len()];
        for library in std::mem::take(&mut self.libraries) {
            let folder = mesh.shown.parent().unwrap_or(Path::new(""));
            let Ok(text) = read_library(&folder.join(&library)) else {
                self.leave_out("a library of materials that cannot be read");
                continue;
            };
            self.take_library(&text);
        }
    }

    fn take_library(&mut self, text: &str) {
        let mut material = None;
        for line in text.lines() {
            let line = line.trim();
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            match word {
                "newmtl" => material = self.materials.get(rest.trim()).copied(),
                "Kd" => {
                    let parts: Vec<f64> = rest
                        .split_ascii_whitespace()
                        .map_while(|x| x.parse().ok())
                        .collect();
                    if let (Some(material), [r, g, b]) = (material, &parts[..]) {
                        self.spool.palette[usize::from(material)] = Some([*r, *g, *b].map(byte));
                    }
                }
                "map_Kd" => self.leave_out("textures"),
                _ => {}
            }
        }
    }
}

/// A part of a colour, from 0 to 1, in 8 bits.
fn byte(part: f64) -> u8 {
    (part.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn read_library(path: &Path) -> std::io::Result<String> {
    let mut bytes = Vec::new();
    std::fs::File::open(path)?
        .take(LIBRARY)
        .read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
