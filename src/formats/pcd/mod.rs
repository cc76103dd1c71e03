//! PCD, the format of the Point Cloud Library: text, binary, and compressed field by field.

mod header;
mod lzf;
mod parts;
mod read;

use super::input::Input;
use super::point_format::{Claims, Head, PointFile, PointFormat, Refusal};
use header::{Body, Header, Number};
use outcrop_disk::error::Result;
use outcrop_ply::Scalar;
use outcrop_points::Format;
use outcrop_points::columns::Column;
use outcrop_points::native::Native;
use outcrop_points::spool::SourceWriter;

/// The format PCD.
pub(super) struct Pcd;

impl PointFormat for Pcd {
    fn names(&self) -> &'static str {
        "PCD"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["pcd"]
    }

    fn recognize(&self, head: &Head) -> Result<bool, Refusal> {
        Ok(is_pcd(&head.bytes))
    }

    fn open(&self, input: &Input, _: &Head) -> Result<Box<dyn PointFile>> {
        Ok(Box::new(Header::read(input)?))
    }
}

/// True for the header of a PCD file.
fn is_pcd(head: &[u8]) -> bool {
    let line = head
        .split(|b| matches!(b, b'\n' | b'\r'))
        .map(<[u8]>::trim_ascii);
    let first = line.clone().find(|l| !l.is_empty() && !l.starts_with(b"#"));
    let keys: [&[u8]; 3] = [b"VERSION ", b"FIELDS ", b"COLUMNS "];
    head.starts_with(b"# .PCD") || first.is_some_and(|l| keys.iter().any(|key| l.starts_with(key)))
}

impl Header {
    /// The type in the spool. Numbers in text are taken as they are written, whatever their type.
    fn native(&self) -> Native {
        let single = Number::Scalar(Scalar::F32);
        let all = self.axes.iter().all(|a| self.fields[*a].number == single);
        match all && self.body != Body::Text {
            true => Native::F32,
            false => Native::F64,
        }
    }
}

impl PointFile for Header {
    fn claims(&self, input: &Input) -> Claims {
        let record = self.record_bytes(false);
        let (format, content, record) = match self.body {
            // A digit and a space for each coordinate.
            Body::Text => (Format::PCD_ASCII, input.bytes, 6),
            Body::Binary => (Format::PCD_BINARY, input.bytes, record),
            Body::Compressed => {
                let most = input.bytes.saturating_mul(lzf::MOST_PER_BYTE);
                (Format::PCD_COMPRESSED, most, record)
            }
        };
        Claims {
            text: self.body == Body::Text,
            likely_points: self.points.min(content / record.max(1)),
            ..Claims::new(input, format, self.native(), self.points, 1)
        }
    }

    fn scanners(&self) -> Vec<[f64; 3]> {
        self.sensor.into_iter().collect()
    }

    fn columns(&self) -> Vec<Column> {
        let parts = parts::parts(self).into_iter();
        parts.map(|part| part.column).collect()
    }

    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>> {
        match (self.body, self.native()) {
            (Body::Text, _) => return read::text(input, self, target),
            (Body::Binary, Native::F32) => read::binary::<f32>(input, self, target),
            (Body::Binary, _) => read::binary::<f64>(input, self, target),
            (Body::Compressed, Native::F32) => read::compressed::<f32>(input, self, target),
            (Body::Compressed, _) => read::compressed::<f64>(input, self, target),
        }?;
        Ok(Vec::new())
    }
}

#[cfg(test)]
mod tests {
    use super::is_pcd;

    #[test]
    fn knows_its_first_lines() {
        assert!(is_pcd(b"# .PCD v0.7\nVERSION 0.7\n"));
        assert!(is_pcd(b"# by hand\n\nFIELDS x y z\r\n"));
        assert!(!is_pcd(b"x y z\n1 2 3\n") && !is_pcd(b""));
    }
}
