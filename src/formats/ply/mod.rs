//! PLY: ascii and binary, vertices only.

mod ascii;
mod binary;
mod splat;

use super::input::{Input, Range};
use super::point_format::{Claims, Head, PointFile, PointFormat, Refusal};
use outcrop_disk::error::{Error, Result};
use outcrop_ply::{Element, Encoding, Field, Header, Place, Property, Scalar};
use outcrop_points::Crs;
use outcrop_points::Format;
use outcrop_points::colors::Depth;
use outcrop_points::columns::{Column, Wanted};
use outcrop_points::native::Native;
use outcrop_points::spool::SourceWriter;
use std::io::BufReader;

/// The format PLY, of which the vertices are read.
pub(super) struct Ply;

impl PointFormat for Ply {
    fn names(&self) -> &'static str {
        "PLY"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["ply"]
    }

    fn recognize(&self, head: &Head) -> Result<bool, Refusal> {
        let marked = head.bytes.strip_prefix(b"\xef\xbb\xbf");
        if marked.is_some_and(is_ply) {
            return Err(Refusal::Unknown("PLY behind a byte order mark".into()));
        }
        Ok(is_ply(&head.bytes))
    }

    fn open(&self, input: &Input, _: &Head) -> Result<Box<dyn PointFile>> {
        let header = Header::read(&mut input.stream(0, input.bytes));
        let header = header.map_err(|e| Error::ply(&input.path, e))?;
        let cloud = Cloud::of(header).map_err(|e| Error::ply(&input.path, e))?;
        Ok(Box::new(cloud))
    }
}

fn is_ply(head: &[u8]) -> bool {
    head.strip_prefix(b"ply").is_some_and(|rest| {
        let line = rest.split(|b| matches!(b, b'\n' | b'\r')).next();
        rest.len() > line.map_or(0, <[u8]>::len)
            && line.is_some_and(|l| l.iter().all(u8::is_ascii_whitespace))
    })
}

/// The description of the vertices in a header.
struct Cloud {
    encoding: Encoding,
    /// Offset of the first element.
    data: u64,
    /// The elements before the vertices.
    before: Vec<Element>,
    vertex: Option<Vertex>,
    /// The reference system, if comments give one.
    crs: Option<Crs>,
}

/// The element of the points.
struct Vertex {
    element: Element,
    /// Index and type of the properties x, y and z.
    coordinates: [Field; 3],
    /// The place of the coordinates, if comments give one.
    place: Option<Place>,
    /// True if the vertices are Gaussian splats.
    splats: bool,
}

/// A property that is a wanted column.
#[derive(Debug, Clone, Copy)]
struct Taken {
    /// Its index, and its type.
    field: Field,
    /// True for the coefficient of a colour of splats.
    coefficient: bool,
}

impl Taken {
    /// Appends the value of the column; `value` is that of the property.
    #[inline]
    fn put(&self, value: f64, values: &mut Vec<u8>) {
        let value = match self.coefficient {
            true => splat::color(value),
            false => value,
        };
        self.field.1.put(value, values);
    }
}

impl Cloud {
    fn of(header: Header) -> outcrop_ply::Result<Self> {
        let vertex = match header.element("vertex")? {
            Some((at, element)) => Some((at, element.coordinates()?)),
            None => None,
        };
        let place = header.place.origin().map(|_| header.place);
        let crs = Crs::of_comments(&header.system);
        let mut before = header.elements;
        let vertex = vertex.map(|(at, coordinates)| {
            before.truncate(at + 1);
            let element = before.remove(at);
            Vertex {
                splats: splat::is_splats(&element),
                element,
                coordinates,
                place,
            }
        });
        Ok(Self {
            encoding: header.encoding,
            data: header.bytes,
            before,
            vertex,
            crs,
        })
    }

    /// The type in the spool: single precision if all coordinates have it, and none is moved.
    fn native(&self) -> Native {
        let single =
            |v: &Vertex| v.place.is_none() && v.coordinates.iter().all(|c| c.1 == Scalar::F32);
        match self.vertex.as_ref().is_some_and(single) {
            true => Native::F32,
            false => Native::F64,
        }
    }
}

impl Vertex {
    /// Index and type of the properties that are columns: all numbers but the coordinates.
    fn columns(&self) -> Vec<Field> {
        let numbers = self.element.properties.iter().enumerate();
        let numbers = numbers.filter_map(|(at, (_, property))| match property {
            Property::One(scalar) => Some((at, *scalar)),
            Property::List { .. } => None,
        });
        let is_other = |(at, _): &Field| self.coordinates.iter().all(|c| c.0 != *at);
        numbers.filter(is_other).collect()
    }

    /// The properties that are wanted columns, ascending.
    fn wanted(&self, wanted: &Wanted) -> Vec<Taken> {
        let columns = self.columns();
        let taken = |number: &usize| {
            let field = columns[*number];
            let color = splat::color_of(&self.element.properties[field.0].0);
            let coefficient = self.splats && color.is_some();
            Taken { field, coefficient }
        };
        wanted.numbers.iter().map(taken).collect()
    }

    /// The name of the column of a property.
    fn name(&self, property: usize) -> &str {
        let own = &self.element.properties[property].0;
        let color = splat::color_of(own).filter(|_| self.splats);
        color.unwrap_or(own)
    }

    /// The position of a point with these coordinates in the file.
    #[inline]
    fn position(&self, local: [f64; 3]) -> [f64; 3] {
        match &self.place {
            None => local,
            Some(place) => place.position(local, self.coordinates.map(|c| c.1)),
        }
    }
}

impl PointFile for Cloud {
    fn claims(&self, input: &Input) -> Claims {
        let format = match self.encoding {
            Encoding::Ascii => Format::PLY_ASCII,
            Encoding::Little => Format::PLY_BINARY_LITTLE_ENDIAN,
            Encoding::Big => Format::PLY_BINARY_BIG_ENDIAN,
        };
        let (points, least) = self.vertex.as_ref().map_or((0, 1), |v| {
            (v.element.count, v.element.least_bytes(self.encoding))
        });
        Claims {
            text: self.encoding == Encoding::Ascii,
            ..Claims::new(input, format, self.native(), points, least)
        }
    }

    fn columns(&self) -> Vec<Column> {
        let Some(vertex) = &self.vertex else {
            return Vec::new();
        };
        let columns = vertex.columns().into_iter();
        columns
            .map(|(at, scalar)| Column::new(vertex.name(at), scalar))
            .collect()
    }

    fn crs(&self, _: &Input) -> Option<Crs> {
        self.crs.clone()
    }

    fn color_depth(&self) -> Option<Depth> {
        let splats = self.vertex.as_ref().is_some_and(|v| v.splats);
        splats.then_some(Depth::One)
    }

    fn read(&self, input: &Input, target: &SourceWriter<'_>) -> Result<Vec<String>> {
        let Some(vertex) = &self.vertex else {
            let why = "the header has no element \"vertex\", so there are no points";
            return Ok(vec![why.into()]);
        };
        match (self.encoding, self.native()) {
            (Encoding::Ascii, Native::F32) => ascii::read::<f32>(input, self, vertex, target),
            (Encoding::Ascii, _) => ascii::read::<f64>(input, self, vertex, target),
            (_, Native::F32) => binary::read::<f32>(input, self, vertex, target),
            (..) => binary::read::<f64>(input, self, vertex, target),
        }?;
        Ok(match vertex.splats {
            true => vec![splat::note(&*target.workspace.observer)],
            false => Vec::new(),
        })
    }
}

/// Offset in the file of the next byte.
fn position(source: &BufReader<Range<'_>>) -> u64 {
    source.get_ref().at - source.buffer().len() as u64
}
