//! The description of a file, and its scans.

use super::super::input::{Input, u32_at, u64_at};
use super::super::point_format::{Claims, Head, PointFile};
use super::pages::PAGE;
use super::scan::{Kind, Name, Scan};
use super::xml::Description;
use super::{read, shades};
use outcrop_disk::error::Result;
use outcrop_ply::Scalar;
use outcrop_points::Crs;
use outcrop_points::Format;
use outcrop_points::colors::Depth;
use outcrop_points::columns::{Column, NO_SCANNER, SCANNER};
use outcrop_points::native::Native;
use outcrop_points::spool::SourceWriter;
use outcrop_points::wkt::well_known;

/// Bytes of the header.
const HEADER: usize = 48;

/// Scales and offsets for which whole numbers stay what they are; the limits of LAS.
const SCALES: std::ops::RangeInclusive<f64> = 1e-15..=1e9;
const LARGEST_OFFSET: f64 = 1e15;

/// Reads the header and the description.
pub(super) fn open(input: &Input, head: &Head) -> Result<Box<dyn PointFile>> {
    let bytes = &head.bytes;
    if bytes.len() < HEADER {
        let found = format!("the end of the file after {} bytes", bytes.len());
        return Err(input.error("E57 header", found, format!("{HEADER} bytes")));
    }
    let (version, length, page) = (u32_at(bytes, 8), u64_at(bytes, 16), u64_at(bytes, 40));
    if version != 1 {
        return Err(input.error("version at byte 8", version.to_string(), "1"));
    }
    if page != PAGE {
        return Err(input.error("size of pages at byte 40", page.to_string(), "1024"));
    }
    // The length of compressed content may be an estimate.
    if length > input.bytes && !input.is_compressed() {
        let expected = format!("at most {}, the size of the file", input.bytes);
        return Err(input.error("length at byte 16", format!("{length} bytes"), expected));
    }
    match Description::read(input, u64_at(bytes, 24), u64_at(bytes, 32)) {
        Ok(description) => Ok(Box::new(Scans::of(description))),
        // The description is behind the points, and only the beginning of the content is at hand.
        Err(_) if input.is_compressed() => Ok(Box::new(Beginning {
            length: length.min(input.bytes),
        })),
        Err(e) => Err(e),
    }
}

/// The beginning of a compressed file, without its description.
struct Beginning {
    /// Bytes of the content.
    length: u64,
}

/// Bytes of a record in a file whose description is not known.
const USUAL: u64 = 16;

impl PointFile for Beginning {
    fn claims(&self, input: &Input) -> Claims {
        let points = self.length / USUAL;
        Claims {
            points: None,
            ..Claims::new(input, Format::E57, Native::F64, points, 1)
        }
    }

    fn is_described(&self) -> bool {
        false
    }

    fn read(&self, input: &Input, _: &SourceWriter<'_>) -> Result<Vec<String>> {
        Err(input.error("description", "the beginning of the file", "the whole file"))
    }
}

/// The scans of a file.
struct Scans {
    /// Those with points.
    filled: Vec<Scan>,
    native: Native,
    columns: Vec<Column>,
    /// The scale of the colours, if the file says it.
    depth: Option<Depth>,
    system: String,
}

impl Scans {
    fn of(description: Description) -> Self {
        let mut filled = description.scans;
        filled.retain(|scan| scan.points > 0);
        let known = filled.iter_mut().filter(|scan| scan.scanner().is_some());
        for (number, scan) in (0..NO_SCANNER).zip(known) {
            scan.number = Some(number);
        }
        let depth = shades::scale(&mut filled);
        Self {
            depth,
            native: native(&filled),
            columns: columns(&filled),
            filled,
            system: description.system,
        }
    }

    fn points(&self) -> u64 {
        let points = self.filled.iter().map(|scan| scan.points);
        points.fold(0, u64::saturating_add)
    }
}

/// The type of the coordinates of points that stay where they are.
fn own_type(scan: &Scan) -> Native {
    let axes = scan.three(Name::Cartesian);
    let rests = scan.motion().is_some_and(|motion| motion.rests());
    let Some(axes) = axes.filter(|_| rests && scan.three(Name::Spherical).is_none()) else {
        return Native::F64;
    };
    let kinds = axes.map(|axis| scan.fields[axis].kind);
    if kinds == [Kind::Single; 3] {
        return Native::F32;
    }
    let grid = kinds.map(|kind| match kind {
        Kind::Integer {
            lowest,
            highest,
            scale,
            offset,
        } => {
            let narrow = i32::try_from(lowest).is_ok() && i32::try_from(highest).is_ok();
            let sound = SCALES.contains(&scale) && offset.abs() <= LARGEST_OFFSET;
            (narrow && sound).then_some((scale, offset))
        }
        _ => None,
    });
    match grid {
        [Some(x), Some(y), Some(z)] => Native::Las {
            scale: [x.0, y.0, z.0],
            offset: [x.1, y.1, z.1],
        },
        _ => Native::F64,
    }
}

/// The type in the spool: that of all scans, else doubles.
fn native(scans: &[Scan]) -> Native {
    let mut all = scans.iter().map(own_type);
    let first = all.next().unwrap_or(Native::F64);
    match all.all(|other| other == first) {
        true => first,
        false => Native::F64,
    }
}

/// The columns of all scans; of another type than in the first scan, they become doubles.
fn columns(scans: &[Scan]) -> Vec<Column> {
    let mut all: Vec<Column> = Vec::new();
    let found = scans.iter().flat_map(Scan::columns);
    for column in found {
        match all.iter_mut().find(|other| other.name == column.name) {
            Some(same) if same.scalar != column.scalar => same.scalar = Scalar::F64,
            Some(_) => {}
            None => all.push(column),
        }
    }
    if scans.iter().any(|scan| scan.number.is_some()) {
        all.push(Column::new(SCANNER, Scalar::U16));
    }
    all
}

impl PointFile for Scans {
    fn claims(&self, input: &Input) -> Claims {
        let bits = self.filled.iter().map(Scan::bits).min().unwrap_or(1);
        let most = input.bytes.saturating_mul(8) / bits.max(1);
        Claims {
            likely_points: self.points().min(most),
            ..Claims::new(input, Format::E57, self.native, self.points(), 1)
        }
    }

    fn crs(&self, _: &Input) -> Option<Crs> {
        let text = self.system.trim();
        text.contains('[').then(|| well_known(text))
    }

    fn columns(&self) -> Vec<Column> {
        self.columns.clone()
    }

    fn color_depth(&self) -> Option<Depth> {
        self.depth
    }

    fn scanners(&self) -> Vec<[f64; 3]> {
        self.filled.iter().filter_map(Scan::scanner).collect()
    }

    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>> {
        if self.filled.is_empty() {
            return Ok(vec!["it has no scan with points".into()]);
        }
        match self.native {
            Native::F32 => read::scans(
                input,
                &self.filled,
                false,
                |p| Ok(p.map(|c| c as f32)),
                target,
            ),
            Native::F64 => read::scans(input, &self.filled, false, Ok, target),
            Native::Las { .. } => read::scans(input, &self.filled, true, read::whole, target),
        }?;
        Ok(Vec::new())
    }
}
