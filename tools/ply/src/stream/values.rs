//! Numbers and lists, in any encoding.

use super::index;
use super::source::Source;
use crate::error::FileError;
use crate::header::{Element, Field};
use crate::numbers::{integer, real};
use crate::types::{Property, Scalar};
use std::fmt::Display;

impl Source {
    /// The next number, of the property `name`. In text, a coordinate of an integer type may have a fraction.
    pub(super) fn number(
        &mut self,
        name: &str,
        scalar: Scalar,
        coordinate: bool,
    ) -> Result<f64, FileError> {
        match self.big() {
            Some(big) => Ok(real(scalar, self.take(scalar.bytes(), name)?, big)),
            None if coordinate || !scalar.is_integer() => self.parse(name, "a number"),
            None => Ok(self.parse::<i64>(name, "an integer")? as f64),
        }
    }

    fn length(&mut self, name: &str, count: Scalar) -> Result<u64, FileError> {
        const EXPECTED: &str = "a list's length";
        let Some(big) = self.big() else {
            return self.parse(name, EXPECTED);
        };
        let length = integer(count, self.take(count.bytes(), EXPECTED)?, big);
        let found = || format!("a list of {length} items");
        u64::try_from(length).map_err(|_| self.refuse(count.bytes(), found(), "0 or more"))
    }

    /// Skips numbers of the property `name`. Numbers in text are parsed, so that a body that does not fit its
    /// header is noticed.
    fn skip_numbers(
        &mut self,
        count: u64,
        scalar: Scalar,
        name: &str,
        what: impl Display,
    ) -> Result<(), FileError> {
        if self.big().is_none() {
            return (0..count).try_for_each(|_| self.number(name, scalar, false).map(drop));
        }
        self.skip(count.saturating_mul(scalar.bytes() as u64), what)
    }

    pub(super) fn skip_property(
        &mut self,
        name: &str,
        property: Property,
    ) -> Result<(), FileError> {
        let (count, scalar) = match property {
            Property::One(scalar) => (1, scalar),
            Property::List { count, item } => (self.length(name, count)?, item),
        };
        self.skip_numbers(count, scalar, name, format_args!("property {name}"))
    }

    /// Reads a vertex with these positions and types of the coordinates; appends the values of `columns`.
    pub(super) fn vertex(
        &mut self,
        element: &Element,
        axes: [Field; 3],
        columns: &[Field],
        values: &mut Vec<f64>,
    ) -> Result<[f64; 3], FileError> {
        let mut position = [0.0; 3];
        for (at, (name, property)) in element.properties.iter().enumerate() {
            let axis = axes.iter().position(|axis| axis.0 == at);
            match (axis, *property) {
                (Some(axis), Property::One(scalar)) => {
                    position[axis] = self.number(name, scalar, true)?;
                }
                (None, Property::One(scalar)) => {
                    let value = self.number(name, scalar, false)?;
                    if columns.iter().any(|column| column.0 == at) {
                        values.push(value);
                    }
                }
                (_, list) => self.skip_property(name, list)?,
            }
        }
        Ok(position)
    }

    /// Reads the list of a face, and passes on the triangles that it is divided into from its first corner. Returns
    /// the number of its corners.
    pub(super) fn fan<E: From<FileError>>(
        &mut self,
        name: &str,
        (_, count, item): (usize, Scalar, Scalar),
        mut each: impl FnMut([u32; 3]) -> Result<(), E>,
    ) -> Result<u64, E> {
        let length = self.length(name, count)?;
        let big = self.big();
        let least = length.saturating_mul(big.map_or(1, |_| item.bytes() as u64));
        if least > self.left() {
            let expected = format_args!("a face of {length} corners");
            return Err(self.truncated(self.left(), expected).into());
        }
        let (mut first, mut last) = (0, 0);
        for at in 0..length {
            let corner = index(match big {
                Some(big) => integer(item, self.take(item.bytes(), "a face")?, big),
                None => self.parse(name, "an integer")?,
            });
            match at {
                0 => first = corner,
                1 => {}
                _ => each([first, last, corner])?,
            }
            last = corner;
        }
        Ok(length)
    }
}
