//! Small files in the folder of a remote file, read whole.

use super::ahead::{Ahead, Room};
use super::answer::Answer;
use super::errors::{newer, told};
use super::object::{Object, Version, again, ask};
use super::stores::Place;
use bytes::Bytes;
use object_store::path::Path;
use std::io;

/// The folder of a remote file.
#[derive(Debug, Clone)]
pub struct Beside(Place);

impl Beside {
    /// The folder that has `object`, asked by the same client.
    ///
    /// # Errors
    /// [`io::ErrorKind::Other`] for a path that the store does not take.
    pub fn of(object: &Object) -> io::Result<Self> {
        let (store, path) = &object.file.place;
        let folder = path.as_ref().rsplit_once('/');
        let folder = Path::parse(folder.map_or("", |(folder, _)| folder));
        Ok(Self((store.clone(), folder.map_err(|e| told(e.into()))?)))
    }

    /// The bytes of the file `name`, which may have slashes; at most `most`. And its version.
    ///
    /// # Errors
    /// [`io::ErrorKind::NotFound`]; [`io::ErrorKind::InvalidData`] for a larger file; as [`super::Object::open`].
    pub fn read(&self, name: &str, most: u64) -> io::Result<(Bytes, Version)> {
        let (store, folder) = &self.0;
        let path = match folder.as_ref() {
            "" => Path::parse(name),
            folder => Path::parse(format!("{folder}/{name}")),
        };
        let file = (store.clone(), path.map_err(|e| told(e.into()))?);
        again(|| {
            let got = ask(&file, None, None)?;
            let version = Version::of(&got.meta);
            Ok((Answer::of(got).all(most)?, version))
        })
    }

    /// Files that will be read in this order, each with the most bytes that it may have: fetched before, as `room`
    /// says. A file that has changed after `begun`, in seconds since 1970, is an error.
    #[must_use]
    pub fn expect(&self, files: Vec<(String, u64)>, room: Room, begun: Option<i64>) -> Expected {
        let sizes: Vec<u64> = files.iter().map(|(_, most)| *most).collect();
        let beside = self.clone();
        let fetch = move |file: usize| {
            let (name, most) = &files[file];
            let (bytes, version) = beside.read(name, *most)?;
            match begun.is_some_and(|begun| version.modified.0 > begun) {
                true => Err(newer()),
                false => Ok(bytes),
            }
        };
        Expected(Ahead::of_files(sizes, room, fetch))
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
