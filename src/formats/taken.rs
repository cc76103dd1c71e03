//! What was read of text files whose columns are not plainly named, for the user.

use outcrop_disk::error::{Error, Result};
use outcrop_points::Format;
use outcrop_points::Layout;
use std::path::Path;

/// The columns taken of all text files.
#[derive(Default)]
pub(super) struct Taken {
    /// What was taken of files that do not say it plainly; the first of these files, and the number of others.
    guessed: Vec<(String, String, u64)>,
    /// True if a file is text.
    texts: bool,
}

impl Taken {
    /// Adds a file, and what was taken of it; true with that if the file does not say it plainly.
    pub(super) fn add(&mut self, path: &Path, format: Format, taken: Option<(&str, bool)>) {
        self.texts |= format == Format::TEXT;
        let Some((taken, true)) = taken else {
            return;
        };
        match self.guessed.iter_mut().find(|(known, ..)| known == taken) {
            Some((.., more)) => *more += 1,
            None => {
                let path = path.display().to_string();
                self.guessed.push((taken.to_owned(), path, 0));
            }
        }
    }

    /// A line for each way in which columns were taken.
    pub(super) fn warnings(self) -> impl Iterator<Item = String> {
        let guessed = self.guessed.into_iter();
        guessed.map(|(taken, path, more)| match more {
            0 => format!("{path}: {taken}"),
            1 => format!("{path} and 1 other: {taken}"),
            _ => format!("{path} and {more} others: {taken}"),
        })
    }

    /// # Errors
    /// [`Error::Parameter`] if columns of text are given, and no file is text.
    pub(super) fn check(&self, layout: &Layout) -> Result<()> {
        let (name, found) = match &layout.columns {
            _ if self.texts || layout.is_default() => return Ok(()),
            Some(columns) => ("columns", columns.to_string()),
            None => ("skip_lines", layout.skip_lines.to_string()),
        };
        Err(Error::Parameter {
            name,
            found,
            expected: "a text file among the inputs".into(),
        })
    }
}
