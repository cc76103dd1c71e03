//! Small files in the folder of a remote file, read whole.

use super::agent::Counts;
use super::ahead::Ahead;
use super::answer::Answer;
use super::errors::told;
use super::location::Location;
use super::object::{again, ask};
use super::stores::{Patience, Place, place};
use bytes::Bytes;
use object_store::path::Path;
use std::io;
use std::sync::Arc;

/// The folder of a remote file.
#[derive(Debug, Clone)]
pub struct Beside {
    place: Place,
    counts: Arc<Counts>,
}

impl Beside {
    /// The folder that has the file at `location`.
    ///
    /// # Errors
    /// As [`super::Object::open`].
    pub fn of(location: &Location, counts: &Arc<Counts>) -> io::Result<Self> {
        let (store, path) = place(location, Patience::Long, counts).map_err(told)?;
        let folder = path
            .as_ref()
            .rsplit_once('/')
            .map_or("", |(folder, _)| folder);
        let folder = Path::parse(folder).map_err(|e| told(e.into()))?;
        Ok(Self {
            place: (store, folder),
            counts: counts.clone(),
        })
    }

    /// Requests and bytes so far.
    #[must_use]
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// The bytes of the file `name`, which may have slashes; at most `most`.
    ///
    /// # Errors
    /// [`io::ErrorKind::NotFound`]; [`io::ErrorKind::InvalidData`] for a larger file; as [`super::Object::open`].
    pub fn read(&self, name: &str, most: u64) -> io::Result<Bytes> {
        let (store, folder) = &self.place;
        let path = match folder.as_ref() {
            "" => Path::parse(name),
            folder => Path::parse(format!("{folder}/{name}")),
        };
        let file = (store.clone(), path.map_err(|e| told(e.into()))?);
        again(|| Answer::of(ask(&file, None, None)?).all(most))
    }

    /// Files that will be read in this order, each with the most bytes that it may have: fetched before, as long as
    /// they hold at most `bytes`.
    #[must_use]
    pub fn expect(&self, files: Vec<(String, u64)>, bytes: u64) -> Expected {
        let sizes: Vec<u64> = files.iter().map(|(_, most)| *most).collect();
        let beside = self.clone();
        let fetch = move |file: usize| {
            let (name, most) = &files[file];
            beside.read(name, *most)
        };
        Expected(Ahead::of_files(sizes, bytes, fetch))
    }
}

/// Files that are fetched before they are read.
#[derive(Debug)]
pub struct Expected(Ahead);

impl Expected {
    /// The bytes of a file, by its number; it is fetched once.
    ///
    /// # Errors
    /// As [`Beside::read`].
    pub fn take(&self, file: usize) -> io::Result<Bytes> {
        self.0.take(file)
    }
}
