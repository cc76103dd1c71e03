//! Values as bytes: the results of finished steps, for a run that is resumed.

use super::Workspace;
use crate::error::{Error, Result};
use std::path::PathBuf;

/// A value that is saved in the journal and restored by a later attempt.
pub trait Persist: Sized {
    /// Appends the value to `out`.
    fn save(&self, out: &mut Vec<u8>);
    /// Restores the value.
    ///
    /// # Errors
    /// [`Error::Corrupt`] if the bytes are not such a value; errors of opening its files.
    fn load(from: &mut Saved<'_>) -> Result<Self>;
}

/// Saved values, read in sequence.
#[derive(Clone, Copy)]
pub struct Saved<'a> {
    bytes: &'a [u8],
    /// The workspace in which the files of the values are opened.
    pub workspace: &'a Workspace,
}

impl<'a> Saved<'a> {
    /// The values in `bytes`.
    #[must_use]
    pub fn new(bytes: &'a [u8], workspace: &'a Workspace) -> Self {
        Self { bytes, workspace }
    }

    /// The next bytes.
    ///
    /// # Errors
    /// [`Error::Corrupt`] if there are fewer than `count`.
    pub fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        match self.bytes.split_at_checked(count) {
            Some((taken, rest)) => {
                self.bytes = rest;
                Ok(taken)
            }
            None => Err(self.wrong(format!("{count} bytes"))),
        }
    }

    /// The error for an unexpected value.
    #[must_use]
    pub fn wrong(&self, expected: impl Into<String>) -> Error {
        Error::Corrupt {
            path: self.workspace.file(super::journal::NAME),
            offset: 0,
            found: format!("a result that ends after {} bytes", self.bytes.len()),
            expected: expected.into(),
        }
    }
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Persist for $number {
            fn save(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
            fn load(from: &mut Saved<'_>) -> Result<Self> {
                let bytes = from.take(size_of::<Self>())?;
                bytes.try_into().map(Self::from_le_bytes).map_err(|_| from.wrong("a number"))
            }
        }
    )*};
}
numbers!(u8, u16, u32, u64, i32, i64, f64);

impl Persist for usize {
    fn save(&self, out: &mut Vec<u8>) {
        (*self as u64).save(out);
    }
    fn load(from: &mut Saved<'_>) -> Result<Self> {
        Ok(u64::load(from)? as usize)
    }
}

impl Persist for bool {
    fn save(&self, out: &mut Vec<u8>) {
        out.push(u8::from(*self));
    }
    fn load(from: &mut Saved<'_>) -> Result<Self> {
        Ok(u8::load(from)? == 1)
    }
}

impl Persist for () {
    fn save(&self, _: &mut Vec<u8>) {}
    fn load(_: &mut Saved<'_>) -> Result<Self> {
        Ok(())
    }
}

impl Persist for String {
    fn save(&self, out: &mut Vec<u8>) {
        self.len().save(out);
        out.extend_from_slice(self.as_bytes());
    }
    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let length = usize::load(from)?;
        let bytes = from.take(length)?.to_vec();
        String::from_utf8(bytes).map_err(|_| from.wrong("text"))
    }
}

impl Persist for PathBuf {
    fn save(&self, out: &mut Vec<u8>) {
        let bytes = std::os::unix::ffi::OsStrExt::as_bytes(self.as_os_str());
        bytes.len().save(out);
        out.extend_from_slice(bytes);
    }
    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let length = usize::load(from)?;
        let bytes = from.take(length)?.to_vec();
        let name: std::ffi::OsString = std::os::unix::ffi::OsStringExt::from_vec(bytes);
        Ok(name.into())
    }
}

/// Plain bytes, for values that were saved one after another.
#[derive(Debug)]
pub(crate) struct Raw(pub Vec<u8>);

impl Persist for Raw {
    fn save(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.0);
    }
    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let rest = std::mem::take(&mut from.bytes);
        Ok(Self(rest.to_vec()))
    }
}

impl<T: Persist> Persist for Option<T> {
    fn save(&self, out: &mut Vec<u8>) {
        self.is_some().save(out);
        if let Some(value) = self {
            value.save(out);
        }
    }
    fn load(from: &mut Saved<'_>) -> Result<Self> {
        Ok(if bool::load(from)? {
            Some(T::load(from)?)
        } else {
            None
        })
    }
}

impl<T: Persist> Persist for Vec<T> {
    fn save(&self, out: &mut Vec<u8>) {
        self.len().save(out);
        self.iter().for_each(|value| value.save(out));
    }
    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let length = usize::load(from)?;
        // A length may be invalid, so it does not decide how much memory is allocated.
        let mut all = Vec::with_capacity(length.min(from.bytes.len()));
        for _ in 0..length {
            all.push(T::load(from)?);
        }
        Ok(all)
    }
}

impl<T: Persist + Copy + Default, const N: usize> Persist for [T; N] {
    fn save(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|value| value.save(out));
    }
    fn load(from: &mut Saved<'_>) -> Result<Self> {
        let mut all = [T::default(); N];
        for value in &mut all {
            *value = T::load(from)?;
        }
        Ok(all)
    }
}

impl<A: Persist, B: Persist> Persist for (A, B) {
    fn save(&self, out: &mut Vec<u8>) {
        self.0.save(out);
        self.1.save(out);
    }
    fn load(from: &mut Saved<'_>) -> Result<Self> {
        Ok((A::load(from)?, B::load(from)?))
    }
}

impl<A: Persist, B: Persist, C: Persist> Persist for (A, B, C) {
    fn save(&self, out: &mut Vec<u8>) {
        self.0.save(out);
        self.1.save(out);
        self.2.save(out);
    }
    fn load(from: &mut Saved<'_>) -> Result<Self> {
        Ok((A::load(from)?, B::load(from)?, C::load(from)?))
    }
}

/// Implements [`Persist`] for a struct, field by field.
macro_rules! persist {
    ($name:ty { $($field:ident),* $(,)? }) => {
        impl $crate::workspace::persist::Persist for $name {
            fn save(&self, out: &mut Vec<u8>) {
                $($crate::workspace::persist::Persist::save(&self.$field, out);)*
            }
            fn load(
                from: &mut $crate::workspace::persist::Saved<'_>,
            ) -> $crate::error::Result<Self> {
                Ok(Self {
                    $($field: $crate::workspace::persist::Persist::load(from)?,)*
                })
            }
        }
    };
}
pub(crate) use persist;
