//! Files written to a store: at once, or in parts that become the file when all are there.

use super::agent::Counts;
use super::errors::told;
use super::location::Location;
use super::stores::{Door, Patience};
use super::wait::wait;
use bytes::Bytes;
use object_store::aws::AmazonS3;
use object_store::azure::MicrosoftAzure;
use object_store::gcp::GoogleCloudStorage;
use object_store::multipart::{MultipartStore, PartId};
use object_store::{
    Attribute, Attributes, ObjectStore, ObjectStoreExt, PutMultipartOptions, PutOptions, PutPayload,
};
use std::io::{self, ErrorKind};
use std::sync::Arc;

/// A bucket or container of a store, in which files are written.
#[derive(Debug)]
pub struct Bucket {
    pub(crate) store: Store,
    pub(crate) counts: Arc<Counts>,
}

/// The store that has a bucket.
#[derive(Debug)]
pub(crate) enum Store {
    Amazon(AmazonS3),
    /// With its address.
    Google(GoogleCloudStorage, String),
    Azure(MicrosoftAzure),
}

/// A file that a store has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Existing {
    /// Size in bytes.
    pub bytes: u64,
    /// The entity tag, if the store tells one.
    pub tag: Option<String>,
}

impl Bucket {
    /// The bucket of a location. Requests are repeated for seconds, or for minutes if it is `patient`.
    ///
    /// # Errors
    /// [`ErrorKind::Unsupported`] for a web server, which takes no files; [`ErrorKind::Other`] for credentials that are
    /// none.
    pub fn of(location: &Location, patient: bool) -> io::Result<Self> {
        let counts = Arc::<Counts>::default();
        let patience = match patient {
            true => Patience::Long,
            false => Patience::Short,
        };
        let door = Door::new(patience, &counts);
        let store = match location.url.scheme() {
            "http" | "https" => {
                let why = "web servers take no files";
                return Err(io::Error::new(ErrorKind::Unsupported, why));
            }
            "s3" | "s3a" => door.amazon(location).map(Store::Amazon),
            "gs" => door
                .google(location)
                .map(|(store, at)| Store::Google(store, at)),
            _ => door.azure(location).map(Store::Azure),
        };
        let store = store.map_err(told)?;
        Ok(Self { store, counts })
    }

    /// Requests so far.
    #[must_use]
    pub fn requests(&self) -> u64 {
        self.counts.requests()
    }

    fn files(&self) -> &dyn ObjectStore {
        match &self.store {
            Store::Amazon(store) => store,
            Store::Google(store, _) => store,
            Store::Azure(store) => store,
        }
    }

    fn parts(&self) -> &dyn MultipartStore {
        match &self.store {
            Store::Amazon(store) => store,
            Store::Google(store, _) => store,
            Store::Azure(store) => store,
        }
    }

    /// Writes a file at once; `kind` is its media type.
    ///
    /// # Errors
    /// [`ErrorKind::PermissionDenied`], [`ErrorKind::NotFound`] without the bucket; what ends a request.
    pub fn put(&self, to: &Location, bytes: Bytes, kind: &'static str) -> io::Result<()> {
        let options = PutOptions {
            attributes: typed(kind),
            ..PutOptions::default()
        };
        let path = to.path().map_err(told)?;
        let put = self
            .files()
            .put_opts(&path, PutPayload::from(bytes), options);
        wait(put)?.map(drop).map_err(told)
    }

    /// Begins a file of parts and returns the name of the upload. The file is there when it is [completed](Self::complete).
    ///
    /// # Errors
    /// [`ErrorKind::Unsupported`] if the store knows no parts; as [`Self::put`].
    pub fn begin(&self, to: &Location, kind: &'static str) -> io::Result<String> {
        let options = PutMultipartOptions {
            attributes: typed(kind),
            ..PutMultipartOptions::default()
        };
        let path = to.path().map_err(told)?;
        // Azure takes the type with the last request, which this interface has no place for.
        let begun = match &self.store {
            Store::Azure(store) => wait(store.create_multipart(&path))?,
            _ => wait(self.parts().create_multipart_opts(&path, options))?,
        };
        begun.map_err(|e| without_parts(told(e)))
    }

    /// Sends the part of this number, from 0; returns its tag.
    ///
    /// # Errors
    /// [`ErrorKind::NotFound`] if the store has forgotten the upload; as [`Self::put`].
    pub fn put_part(
        &self,
        to: &Location,
        upload: &str,
        part: usize,
        bytes: Bytes,
    ) -> io::Result<String> {
        let path = to.path().map_err(told)?;
        let upload = upload.to_owned();
        let put = self
            .parts()
            .put_part(&path, &upload, part, PutPayload::from(bytes));
        let part: PartId = wait(put)?.map_err(told)?;
        Ok(part.content_id)
    }

    /// Makes a file of all its parts, given their tags.
    ///
    /// # Errors
    /// As [`Self::put_part`].
    pub fn complete(&self, to: &Location, upload: &str, parts: Vec<String>) -> io::Result<()> {
        let path = to.path().map_err(told)?;
        let part = |content_id| PartId { content_id };
        let (upload, parts) = (upload.to_owned(), parts.into_iter().map(part).collect());
        let done = wait(self.parts().complete_multipart(&path, &upload, parts))?;
        done.map(drop).map_err(told)
    }

    /// Gives an upload up: the store deletes its parts. One that is not there any more is no error.
    ///
    /// # Errors
    /// As [`Self::put`].
    pub fn abort(&self, to: &Location, upload: &str) -> io::Result<()> {
        let path = to.path().map_err(told)?;
        let upload = upload.to_owned();
        gone(wait(self.parts().abort_multipart(&path, &upload))?.map_err(told))
    }

    /// The file that is there, if one is.
    ///
    /// # Errors
    /// As [`Self::put`].
    pub fn existing(&self, at: &Location) -> io::Result<Option<Existing>> {
        let path = at.path().map_err(told)?;
        match wait(self.files().head(&path))?.map_err(told) {
            Ok(meta) => Ok(Some(Existing {
                bytes: meta.size,
                tag: meta.e_tag,
            })),
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
            Err(e) => Err(e),
        }
    }

    /// Deletes a file. One that is not there is no error.
    ///
    /// # Errors
    /// As [`Self::put`].
    pub fn delete(&self, at: &Location) -> io::Result<()> {
        let path = at.path().map_err(told)?;
        gone(wait(self.files().delete(&path))?.map_err(told))
    }
}

/// The media type as an attribute of a file.
fn typed(kind: &'static str) -> Attributes {
    std::iter::once((Attribute::ContentType, kind)).collect()
}

/// What is not there any more is as wanted.
fn gone(done: io::Result<()>) -> io::Result<()> {
    match done {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(()),
        done => done,
    }
}

/// The error of a store that does not know how to begin a file of parts, as such.
fn without_parts(error: io::Error) -> io::Error {
    let text = error.to_string();
    match ["405", "501"].iter().any(|status| text.starts_with(status)) {
        true => io::Error::new(ErrorKind::Unsupported, text),
        false => error,
    }
}
