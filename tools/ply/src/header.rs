//! The header of a file.

use crate::error::{Error, Result};
use crate::place::Place;
use crate::system::System;
use crate::types::{Encoding, Property, Scalar};

/// The header of a PLY file.
#[derive(Debug, Clone)]
pub struct Header {
    /// Encoding of the elements.
    pub encoding: Encoding,
    /// The elements, in the order of the file.
    pub elements: Vec<Element>,
    /// Bytes of the header: the offset of the elements.
    pub bytes: u64,
    /// The place of the coordinates, if comments give one.
    pub place: Place,
    /// The reference system, as far as comments tell it.
    pub system: System,
}

/// A property of one number: its index among the element's properties, and its type.
pub type Field = (usize, Scalar);

/// An element: entries that all have the same properties.
#[derive(Debug, Clone)]
pub struct Element {
    /// Its name.
    pub name: String,
    /// Number of entries.
    pub count: u64,
    /// The properties and their names, in the order of the file.
    pub properties: Vec<(String, Property)>,
}

impl Header {
    /// True for a mesh, false for a cloud.
    #[must_use]
    pub fn holds_faces(&self) -> bool {
        let mut elements = self.elements.iter();
        elements.any(|e| e.name == "face" && e.count > 0)
    }

    /// The element with this name, and its index.
    ///
    /// # Errors
    /// [`Error::Input`] if there are several.
    pub fn element(&self, name: &str) -> Result<Option<(usize, &Element)>> {
        let mut named = self
            .elements
            .iter()
            .enumerate()
            .filter(|e| e.1.name == name);
        let first = named.next();
        match named.count() {
            0 => Ok(first),
            more => Err(Error::input(
                "PLY header",
                format!("{} elements named {name}", more + 1),
                "one",
            )),
        }
    }
}

impl Element {
    fn wrong(&self, found: impl Into<String>, expected: &str) -> Error {
        let place = format!("PLY header, element {}", self.name);
        Error::input(place, found, expected)
    }

    /// Number and type of the properties x, y and z.
    ///
    /// # Errors
    /// [`Error::Input`] unless there is one of each, a number.
    pub fn coordinates(&self) -> Result<[Field; 3]> {
        let mut coordinates = [(0, Scalar::F32); 3];
        for (to, name) in coordinates.iter_mut().zip(["x", "y", "z"]) {
            let named = || self.properties.iter().enumerate().filter(|p| p.1.0 == name);
            let several = named().count();
            *to = match named().next() {
                _ if several > 1 => {
                    let found = format!("{several} properties named {name}");
                    return Err(self.wrong(found, "one"));
                }
                Some((at, (_, Property::One(scalar)))) => (at, *scalar),
                Some(_) => {
                    let found = format!("the list \"{name}\"");
                    return Err(self.wrong(found, "a number for each vertex, not a list"));
                }
                None => {
                    let found = format!("no property {name}");
                    return Err(self.wrong(found, "the properties x, y and z"));
                }
            };
        }
        Ok(coordinates)
    }

    /// Index of the property that lists the corners of a face, and the types of its count and items.
    ///
    /// # Errors
    /// [`Error::Input`] unless there is one, of integers.
    pub fn corners(&self) -> Result<(usize, Scalar, Scalar)> {
        let mut lists = self
            .properties
            .iter()
            .enumerate()
            .filter_map(|(at, p)| match p {
                (name, Property::List { count, item })
                    if name == "vertex_indices" || name == "vertex_index" =>
                {
                    Some((at, *count, *item))
                }
                _ => None,
            });
        match lists.next() {
            Some(found) if found.2.is_integer() => Ok(found),
            Some(_) => Err(self.wrong(self.names(), "integer vertex indices")),
            None => Err(self.wrong(self.names(), "a list vertex_indices or vertex_index")),
        }
    }

    /// The first of the properties' names, for a message.
    fn names(&self) -> String {
        let names: Vec<&str> = self.properties.iter().map(|p| &*p.0).take(20).collect();
        format!("properties [{}]", names.join(", ").escape_debug())
    }

    /// Bytes of an entry in a binary file; none if it has a list.
    #[must_use]
    pub fn record_bytes(&self) -> Option<usize> {
        self.bytes_before(self.properties.len())
    }

    /// Bytes of an entry before the property with this index; none if there is a list.
    #[must_use]
    pub fn bytes_before(&self, property: usize) -> Option<usize> {
        bytes_of(&self.properties[..property])
    }

    /// Least number of bytes of an entry.
    #[must_use]
    pub fn least_bytes(&self, encoding: Encoding) -> u64 {
        let least = |(_, property): &(String, Property)| match *property {
            _ if encoding == Encoding::Ascii => 2,
            Property::One(scalar) => scalar.bytes() as u64,
            Property::List { count, .. } => count.bytes() as u64,
        };
        self.properties.iter().map(least).sum()
    }
}

/// Bytes of these properties in a binary file; none if one is a list.
pub(crate) fn bytes_of(properties: &[(String, Property)]) -> Option<usize> {
    properties.iter().map(|p| p.1.bytes()).sum()
}
