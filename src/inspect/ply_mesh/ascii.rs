//! Bodies of ascii PLY files: numbers separated by white space; line ends have no meaning.

use super::binary::index;
use super::source::Source;
use super::{Role, SLICE, Sink};
use crate::error::Result;
use outcrop_ply::{Element, Property, Scalar};
use std::str::FromStr;

pub(super) fn element(
    element: &Element,
    role: Role,
    source: &mut Source,
    sink: &mut impl Sink,
) -> Result<()> {
    if element.properties.is_empty() {
        return Ok(());
    }
    match role {
        Role::Vertices(axes) => {
            let mut slice = Vec::with_capacity(SLICE);
            for _ in 0..element.count {
                let mut position = [0.0; 3];
                for (i, (name, property)) in element.properties.iter().enumerate() {
                    match axes.iter().position(|axis| axis.0 == i) {
                        Some(axis) => position[axis] = number(source, name, "a number")?,
                        None => skip_property(name, *property, source)?,
                    }
                }
                slice.push(position);
                if slice.len() == SLICE {
                    sink.vertices(&slice)?;
                    slice.clear();
                }
            }
            sink.vertices(&slice)
        }
        Role::Faces(corners, ..) => faces(element, corners, source, sink),
        Role::Other => {
            for _ in 0..element.count {
                for (name, property) in &element.properties {
                    skip_property(name, *property, source)?;
                }
            }
            Ok(())
        }
    }
}

fn number<T: FromStr>(source: &mut Source, name: &str, expected: &str) -> Result<T> {
    let word = source.word(expected)?;
    if let Some(value) = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()) {
        return Ok(value);
    }
    let (length, word) = (
        word.len() as u64,
        String::from_utf8_lossy(word).into_owned(),
    );
    let word: String = word.chars().take(40).collect();
    let found = format!("'{}' as property {name}", word.escape_debug());
    Err(source.refuse(source.position() - length, &found, expected))
}

fn list_length(source: &mut Source, name: &str) -> Result<u64> {
    number(source, name, "a list's length")
}

fn skip_property(name: &str, property: Property, source: &mut Source) -> Result<()> {
    match property {
        Property::One(scalar) => skip_number(name, scalar, source),
        Property::List { item, .. } => {
            for _ in 0..list_length(source, name)? {
                skip_number(name, item, source)?;
            }
            Ok(())
        }
    }
}

/// Parses a number to be skipped, so that a body that does not fit its header is noticed.
fn skip_number(name: &str, scalar: Scalar, source: &mut Source) -> Result<()> {
    if scalar.is_integer() {
        number::<i64>(source, name, "an integer").map(drop)
    } else {
        number::<f64>(source, name, "a number").map(drop)
    }
}

fn faces(
    element: &Element,
    corners: usize,
    source: &mut Source,
    sink: &mut impl Sink,
) -> Result<()> {
    let mut slice = Vec::with_capacity(SLICE);
    for _ in 0..element.count {
        for (i, (name, property)) in element.properties.iter().enumerate() {
            if i != corners {
                skip_property(name, *property, source)?;
                continue;
            }
            let length = list_length(source, name)?;
            let mut face = [0; 3];
            for corner in 0..length {
                let value = index(number(source, name, "an integer")?);
                if let Some(slot) = face.get_mut(corner as usize) {
                    *slot = value;
                }
            }
            if length == 3 {
                slice.push(face);
            } else {
                sink.non_triangles(1)?;
            }
        }
        if slice.len() == SLICE {
            sink.triangles(&slice)?;
            slice.clear();
        }
    }
    sink.triangles(&slice)
}
