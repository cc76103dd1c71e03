//! Uploads that are begun and given up.

#[cfg(test)]
mod tests;

use super::noted::{Note, State};
use super::there::{Delivery, media_type};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::progress::Observer;
use outcrop_remote::{Bucket, Location};
use std::io::ErrorKind;

impl Delivery {
    /// Gives up the uploads that are open; returns the files and uploads of which that failed.
    pub(super) fn give_up(
        &self,
        observer: &dyn Observer,
    ) -> Result<Vec<(String, String, std::io::Error)>> {
        let notes = self.notes();
        let open = notes.open()?;
        if open.is_empty() {
            return Ok(Vec::new());
        }
        let bucket = self.bucket(false);
        let mut failed = Vec::new();
        for (file, state) in open {
            let tried = match &bucket {
                Ok(bucket) => self.abort(bucket, &file, &state, observer),
                Err(e) => Err(std::io::Error::other(e.to_string())),
            };
            let gone = Note::Gone { file: file.clone() };
            let noted = tried.and_then(|()| notes.add(&gone).map_err(std::io::Error::other));
            if let Err(e) = noted {
                failed.push((file, state.upload.unwrap_or_default(), e));
            }
        }
        Ok(failed)
    }

    /// Gives up what may be open of a file; says so if nobody knows whether something is.
    fn abort(
        &self,
        bucket: &Bucket,
        file: &str,
        state: &State,
        observer: &dyn Observer,
    ) -> std::io::Result<()> {
        let at = self.folder.below(file);
        match (&state.upload, &state.begin) {
            (Some(upload), _) => bucket.abort(&at, upload),
            (None, Some(Some(others))) => abort_all_but(bucket, &at, others),
            (None, Some(None)) => {
                observer.warn(&unknown(&at, "an earlier attempt ended"));
                Ok(())
            }
            (None, None) => Ok(()),
        }
    }

    /// Begins an upload, or goes on with the one that is open. None if the store knows no parts.
    pub(super) fn begun(
        &self,
        bucket: &Bucket,
        file: &str,
        observer: &dyn Observer,
    ) -> Result<Option<String>> {
        let (notes, at) = (self.notes(), self.folder.below(file));
        let failed = |e| Error::io(at.to_string(), "begin an upload to", e);
        let state = notes.state(file)?;
        if let Some(upload) = state.upload {
            return Ok(Some(upload));
        }
        // The process ended while it began one.
        let aborted = self.abort(bucket, file, &state, observer);
        aborted.map_err(failed)?;
        let before = if_told(bucket.existing(&at)).map_err(failed)?.flatten();
        let others = if_told(bucket.unfinished(&at)).map_err(failed)?;
        notes.add(&Note::Begin {
            file: file.to_owned(),
            others: others.clone(),
            before: before.and_then(|before| before.tag),
        })?;
        let asked = bucket.requests();
        let file = file.to_owned();
        match bucket.begin(&at, media_type(&file)) {
            Ok(upload) => {
                // If the request was repeated, each may have begun one.
                match (others, bucket.requests() > asked + 1) {
                    (Some(mut known), true) => {
                        known.push(upload.clone());
                        abort_all_but(bucket, &at, &known).map_err(failed)?;
                    }
                    (None, true) => observer.warn(&unknown(&at, "a request was repeated")),
                    (_, false) => {}
                }
                notes.add(&Note::Begun {
                    file,
                    upload: upload.clone(),
                })?;
                Ok(Some(upload))
            }
            Err(e) if e.kind() == ErrorKind::Unsupported => {
                notes.add(&Note::Gone { file })?;
                Ok(None)
            }
            Err(e) => {
                if matches!(e.kind(), ErrorKind::PermissionDenied | ErrorKind::NotFound) {
                    // The store refused it, so that nothing has begun.
                    notes.add(&Note::Gone { file })?;
                }
                Err(failed(e))
            }
        }
    }
}

/// The warning about an upload that may have begun, and whose name nobody knows.
fn unknown(at: &Location, why: &str) -> String {
    format!(
        "{at}: {why} while an upload began, and the store does not tell which are unfinished; if one was left, its parts \
         stay until the store deletes them"
    )
}

/// What a store tells; none if it does not tell this, or not with these credentials.
fn if_told<T>(asked: std::io::Result<T>) -> std::io::Result<Option<T>> {
    match asked {
        Err(e)
            if matches!(
                e.kind(),
                ErrorKind::Unsupported | ErrorKind::PermissionDenied
            ) =>
        {
            Ok(None)
        }
        asked => asked.map(Some),
    }
}

/// Gives up all uploads of a file but these.
fn abort_all_but(bucket: &Bucket, at: &Location, known: &[String]) -> std::io::Result<()> {
    let unfinished = bucket.unfinished(at)?.into_iter();
    for upload in unfinished.filter(|upload| !known.contains(upload)) {
        bucket.abort(at, &upload)?;
    }
    Ok(())
}
