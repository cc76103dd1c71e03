//! The files below a prefix of a store.

use super::agent::Counts;
use super::errors::told;
use super::location::Location;
use super::stores::{Patience, place};
use super::wait::wait;
use futures_util::StreamExt;
use object_store::ObjectStore;
use std::io;
use std::sync::Arc;

/// A file of a store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed {
    /// Its URL.
    pub url: String,
    /// Size in bytes.
    pub bytes: u64,
}

/// The files below a prefix whose URL is `wanted`, at most `most`, sorted by name.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] if there are more; as [`super::Object::open`].
pub fn list(
    prefix: &Location,
    most: usize,
    wanted: impl Fn(&str) -> bool,
    counts: &Arc<Counts>,
) -> io::Result<Vec<Listed>> {
    let (store, path) = place(prefix, Patience::Short, counts).map_err(told)?;
    let mut found = Vec::new();
    let all = wait(async {
        let mut files = store.list(Some(&path).filter(|path| !path.as_ref().is_empty()));
        while let Some(file) = files.next().await {
            let file = file.map_err(told)?;
            let mut url = prefix.url.clone();
            url.set_path(file.location.as_ref());
            if !wanted(url.as_str()) {
                continue;
            }
            if found.len() == most {
                return Err(io::Error::new(
                    io::ErrorKind::InvalidInput,
                    format!("more than {most} files are below it"),
                ));
            }
            found.push(Listed {
                url: url.as_str().to_owned(),
                bytes: file.size,
            });
        }
        Ok(())
    })?;
    all?;
    found.sort_by(|a: &Listed, b| a.url.cmp(&b.url));
    Ok(found)
}
