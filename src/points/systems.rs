//! The reference systems of several files, and whether they are one.

use super::crs::Crs;
use outcrop_disk::error::{Error, Remedy, Result, Setting};
use std::path::{Path, PathBuf};

/// Two files with different reference systems.
#[derive(Debug, Clone)]
pub struct Mixed {
    /// A file, and its system.
    first: (PathBuf, String),
    /// Another file, and its system.
    other: (PathBuf, String),
}

impl Mixed {
    /// The error for a cloud that must have one system.
    #[must_use]
    pub fn refused(&self) -> Error {
        let ((first, system), (other, another)) = (&self.first, &self.other);
        let expected = format!("{system}, that of {}", first.display());
        let flag = Setting::Flag("ignore_crs");
        Error::input(other, "reference system", another, expected)
            .with(Remedy::Give(flag, "takes coordinates as they are"))
    }

    /// The two files, and their systems.
    pub(super) fn both(&self) -> [(&Path, &str); 2] {
        [&self.first, &self.other].map(|(path, system)| (&**path, &**system))
    }

    /// The warning for a cloud that may have several.
    pub(super) fn warning(&self) -> String {
        let ((first, system), (other, another)) = (&self.first, &self.other);
        format!(
            "{}: its reference system is {another}, that of {} is {system}; coordinates are taken as they \
             are, in no system",
            other.display(),
            first.display()
        )
    }
}

/// The reference systems of several files: one of each kind that may be the same as the others, so that few
/// texts are in memory.
#[derive(Debug, Default)]
pub struct Systems {
    known: Vec<(PathBuf, Crs)>,
    mixed: Option<Mixed>,
}

impl Systems {
    /// Takes the system of a file.
    pub fn add(&mut self, path: &Path, crs: Crs) {
        if self.mixed.is_some() {
            return;
        }
        if let Some((first, system)) = self.known.iter().find(|(_, known)| known.differs(&crs)) {
            self.mixed = Some(Mixed {
                first: (first.clone(), system.to_string()),
                other: (path.to_path_buf(), crs.to_string()),
            });
            return;
        }
        match self.known.iter_mut().find(|(_, known)| known.is_like(&crs)) {
            Some((_, known)) if crs.rank() < known.rank() => *known = crs,
            Some(_) => {}
            None => self.known.push((path.to_path_buf(), crs)),
        }
    }

    /// The system that tells most.
    ///
    /// # Errors
    /// Two files, if theirs are different.
    pub fn common(self) -> Result<Option<Crs>, Mixed> {
        match self.mixed {
            Some(mixed) => Err(mixed),
            None => {
                let known = self.known.into_iter().map(|(_, crs)| crs);
                Ok(known.min_by_key(Crs::rank))
            }
        }
    }
}
