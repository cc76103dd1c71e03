//! PCD 0.6 and 0.7: text, binary, and binary packed field by field.

use super::lzf;
use crate::error::{Error, Result};
use std::path::Path;

/// True for the first bytes of a PCD file.
pub(super) fn is(head: &[u8]) -> bool {
    let mut lines = head.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
    first.is_some_and(|line| line.starts_with(b"VERSION") || line.starts_with(b"FIELDS"))
}

/// All points, including those with coordinates that are not finite.
pub(super) fn read(path: &Path) -> Result<Vec<[f64; 3]>> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    let bad = |what: &str| Error::input(path, format!("PCD: {what}"));
    let (header, body) = Header::read(&bytes).map_err(|what| bad(&what))?;
    let cut = || bad("the file ends early");
    match header.data.as_str() {
        "ascii" => header
            .text(body)
            .ok_or_else(|| bad("a line without x, y and z")),
        "binary" => {
            let row = header.row();
            let wanted = row.checked_mul(header.points).ok_or_else(cut)?;
            let rows = body.get(..wanted).ok_or_else(cut)?;
            Ok(header.points(|point, field| {
                let at = point * row + header.before(field, |f| f.bytes());
                header.fields[field].value(&rows[at..])
            }))
        }
        "binary_compressed" => {
            let size = |at: usize| {
                let bytes = body.get(at..at + 4)?.try_into().ok()?;
                usize::try_from(u32::from_le_bytes(bytes)).ok()
            };
            let (packed, length) = size(0).zip(size(4)).ok_or_else(cut)?;
            let packed = body[8..].get(..packed).ok_or_else(cut)?;
            if header.row().checked_mul(header.points) != Some(length) {
                return Err(bad("its size is not that of its points"));
            }
            let columns = lzf::unpack(packed, length).ok_or_else(|| bad("it does not unpack"))?;
            Ok(header.points(|point, field| {
                // All of one field, then all of the next.
                let at = header.before(field, |f| f.bytes()) * header.points
                    + point * header.fields[field].bytes();
                header.fields[field].value(&columns[at..])
            }))
        }
        other => Err(bad(&format!("DATA {other:?} is not known"))),
    }
}

/// A field: one or more numbers of one type.
#[derive(Debug, Clone, Default)]
struct Field {
    name: String,
    kind: char,
    size: usize,
    count: usize,
}

impl Field {
    fn bytes(&self) -> usize {
        self.size * self.count
    }

    /// The first number.
    fn value(&self, bytes: &[u8]) -> f64 {
        let mut wide = [0u8; 8];
        wide[..self.size].copy_from_slice(&bytes[..self.size]);
        let unused = 64 - 8 * self.size as u32;
        match (self.kind, self.size) {
            ('F', 4) => f64::from(f32::from_le_bytes([wide[0], wide[1], wide[2], wide[3]])),
            ('F', _) => f64::from_le_bytes(wide),
            ('I', _) => (i64::from_le_bytes(wide) << unused >> unused) as f64,
            _ => u64::from_le_bytes(wide) as f64,
        }
    }
}

#[derive(Debug, Default)]
struct Header {
    fields: Vec<Field>,
    points: usize,
    /// Indices of x, y and z.
    axes: [usize; 3],
    data: String,
}

impl Header {
    /// The header and the bytes after it.
    fn read(bytes: &[u8]) -> Result<(Self, &[u8]), String> {
        let mut header = Self::default();
        let mut rest = bytes;
        let mut points = None;
        while header.data.is_empty() {
            let end = rest.iter().position(|b| *b == b'\n');
            let end = end.ok_or("no line DATA")?;
            let line = String::from_utf8_lossy(&rest[..end]).into_owned();
            rest = &rest[end + 1..];
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let Some((&key, values)) = words.split_first() else {
                continue;
            };
            match key {
                "FIELDS" => header.name(values),
                "SIZE" => header.set(values, |f, v| {
                    f.size = v.parse().ok().filter(|s| (1..=8).contains(s))?;
                    Some(())
                })?,
                "TYPE" => header.set(values, |f, v| {
                    f.kind = v.chars().next().filter(|c| "FIU".contains(*c))?;
                    Some(())
                })?,
                "COUNT" => header.set(values, |f, v| {
                    f.count = v.parse().ok().filter(|c| (1..=1 << 16).contains(c))?;
                    Some(())
                })?,
                "POINTS" => points = values.first().and_then(|v| v.parse().ok()),
                "DATA" => header.data = (*values.first().ok_or("DATA what?")?).to_owned(),
                _ => {}
            }
        }
        header.points = points.ok_or("no number of POINTS")?;
        let sound = |f: &Field| f.kind != 'F' || f.size == 4 || f.size == 8;
        if !header
            .fields
            .iter()
            .all(|f| f.size > 0 && f.kind != '\0' && sound(f))
        {
            return Err("fields without SIZE and TYPE".into());
        }
        for (axis, name) in header.axes.iter_mut().zip(["x", "y", "z"]) {
            let at = header.fields.iter().position(|f| f.name == name);
            *axis = at.ok_or_else(|| format!("no field {name}"))?;
        }
        Ok((header, rest))
    }

    fn name(&mut self, names: &[&str]) {
        let field = |name: &&str| Field {
            name: (*name).to_owned(),
            count: 1,
            ..Field::default()
        };
        self.fields = names.iter().map(field).collect();
    }

    fn set(
        &mut self,
        values: &[&str],
        each: impl Fn(&mut Field, &str) -> Option<()>,
    ) -> Result<(), String> {
        if values.len() != self.fields.len() {
            return Err(format!(
                "{} values for {} fields",
                values.len(),
                self.fields.len()
            ));
        }
        for (field, value) in self.fields.iter_mut().zip(values) {
            each(field, value).ok_or_else(|| format!("{value:?} for field {}", field.name))?;
        }
        Ok(())
    }

    /// Sum over the fields before `field`.
    fn before(&self, field: usize, each: impl Fn(&Field) -> usize) -> usize {
        self.fields[..field].iter().map(each).sum()
    }

    /// Bytes of a point.
    fn row(&self) -> usize {
        self.before(self.fields.len(), Field::bytes)
    }

    fn points(&self, value: impl Fn(usize, usize) -> f64) -> Vec<[f64; 3]> {
        let point = |n| self.axes.map(|field| value(n, field));
        (0..self.points).map(point).collect()
    }

    fn text(&self, body: &[u8]) -> Option<Vec<[f64; 3]>> {
        let columns = self.axes.map(|field| self.before(field, |f| f.count));
        let text = String::from_utf8_lossy(body);
        let lines = text.lines().filter(|line| !line.trim().is_empty());
        let point = |line: &str| {
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let at = |column: usize| words.get(column)?.parse().ok();
            Some([at(columns[0])?, at(columns[1])?, at(columns[2])?])
        };
        let points: Option<Vec<_>> = lines.take(self.points).map(point).collect();
        points.filter(|points| points.len() == self.points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(data: &str, body: &[u8]) -> tempfile::NamedTempFile {
        let header = format!(
            "# .PCD v0.7\nVERSION 0.7\nFIELDS n x y z\nSIZE 1 4 8 2\nTYPE U F F I\nCOUNT 3 1 1 1\n\
             WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA {data}\n"
        );
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), [header.as_bytes(), body].concat()).unwrap();
        assert!(is(header.as_bytes()));
        file
    }

    const POINTS: [[f64; 3]; 2] = [[0.5, 1.25, -3.0], [-7.0, 1e300, 300.0]];

    #[test]
    fn all_three_bodies() {
        let text = file("ascii", b"1 2 3 0.5 1.25 -3\n4 5 6 -7 1e300 300\n");
        assert_eq!(read(text.path()).unwrap(), POINTS);

        let mut rows = Vec::new();
        let mut columns = [vec![1, 2, 3, 4, 5, 6], vec![], vec![], vec![]];
        for (n, [x, y, z]) in POINTS.into_iter().enumerate() {
            let (x, y, z) = (
                (x as f32).to_le_bytes(),
                y.to_le_bytes(),
                (z as i16).to_le_bytes(),
            );
            rows.extend(&columns[0][3 * n..3 * n + 3].to_vec());
            rows.extend(x.iter().chain(&y).chain(&z));
            columns[1].extend(x);
            columns[2].extend(y);
            columns[3].extend(z);
        }
        assert_eq!(read(file("binary", &rows).path()).unwrap(), POINTS);

        let columns = columns.concat();
        let mut packed = Vec::new();
        for part in columns.chunks(32) {
            packed.push(part.len() as u8 - 1);
            packed.extend(part);
        }
        let sizes = [packed.len() as u32, columns.len() as u32].map(u32::to_le_bytes);
        let body = [sizes.concat(), packed].concat();
        assert_eq!(
            read(file("binary_compressed", &body).path()).unwrap(),
            POINTS
        );

        for (data, body) in [
            ("binary", &rows[..rows.len() - 1]),
            ("binary_compressed", &body[..body.len() - 1]),
            ("binary_compressed", &body[..6]),
            ("ascii", b"1 2 3 0.5 1.25 -3\n"),
            ("zip", &rows),
        ] {
            assert!(matches!(
                read(file(data, body).path()),
                Err(Error::Input { .. })
            ));
        }
    }
}
