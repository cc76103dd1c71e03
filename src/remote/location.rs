//! The name of a remote file.

use object_store::path::Path as StorePath;
use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};
use url::Url;

/// Parts of the names of query parameters that give access to whoever has them.
const SECRETS: [&str; 5] = ["signature", "sig", "token", "credential", "key"];

/// The URL of a remote file or of a prefix.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    pub(crate) url: Url,
}

impl Location {
    /// The location that a path names.
    ///
    /// # Errors
    /// [`ErrorKind::InvalidInput`] for what is no URL with a host, and for one with a password or a signature: it
    /// would appear in messages and reports.
    pub fn of(path: &Path) -> Result<Self> {
        let refused = |why: &str| Error::new(ErrorKind::InvalidInput, why.to_owned());
        let text = path.to_str().ok_or_else(|| refused("it is not UTF-8"))?;
        let url = Url::parse(text).map_err(|e| refused(&format!("it is no URL: {e}")))?;
        if url.host_str().is_none_or(str::is_empty) {
            return Err(refused("the URL has no host or bucket"));
        }
        if url.password().is_some() {
            return Err(refused(
                "the URL has a password, which would appear in reports",
            ));
        }
        let secret = |name: &str| {
            let name = name.to_ascii_lowercase();
            let mut words = name.split(['-', '_']);
            words.any(|word| SECRETS.contains(&word))
        };
        if let Some((name, _)) = url.query_pairs().find(|(name, _)| secret(name)) {
            return Err(refused(&format!(
                "the URL has a credential in it ({name}), which would appear in reports"
            )));
        }
        Ok(Self { url })
    }

    /// A URL without what may be secret in it, for the message that refuses it.
    #[must_use]
    pub fn masked(path: &Path) -> PathBuf {
        let text = path.to_string_lossy();
        let plain = text.split(['?', '#']).next().unwrap_or_default();
        let Some((scheme, rest)) = plain.split_once("://") else {
            return plain.into();
        };
        let (host, file) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
        let host = host.rsplit('@').next().unwrap_or_default();
        format!("{scheme}://{host}{file}").into()
    }

    /// True for a prefix: a bucket, or a URL that ends with a slash.
    #[must_use]
    pub fn is_prefix(&self) -> bool {
        self.url.path().is_empty() || self.url.path().ends_with('/')
    }

    /// True if it is on a web server, which lists no files.
    #[must_use]
    pub fn is_web(&self) -> bool {
        self.url.scheme().starts_with("http")
    }

    /// Its path in the store.
    pub(crate) fn path(&self) -> object_store::Result<StorePath> {
        StorePath::from_url_path(self.url.path().trim_start_matches('/'))
            .map_err(|source| object_store::Error::InvalidPath { source })
    }

    /// The location of a file below this one, which is a folder: `name` may have slashes.
    #[must_use]
    pub fn below(&self, name: &str) -> Self {
        let mut url = self.url.clone();
        if let Ok(mut path) = url.path_segments_mut() {
            path.pop_if_empty().extend(name.split('/'));
        }
        Self { url }
    }

    /// The folder in which the file lies, and its name as text; none for a prefix.
    #[must_use]
    pub fn parted(&self) -> Option<(Self, String)> {
        let name = self.path().ok()?.filename()?.to_owned();
        if self.is_prefix() {
            return None;
        }
        let mut url = self.url.clone();
        url.path_segments_mut().ok()?.pop();
        Some((Self { url }, name))
    }

    /// The location of another file in the same folder, or of one that is named from there.
    ///
    /// # Errors
    /// [`ErrorKind::InvalidInput`] for a name that is none, or that leads to another host.
    pub fn join(&self, name: &str) -> Result<Self> {
        let refused = || Error::new(ErrorKind::InvalidInput, format!("{name:?} is no name"));
        let url = self.url.join(name).map_err(|_| refused())?;
        let same = (url.scheme(), url.host_str(), url.port())
            == (self.url.scheme(), self.url.host_str(), self.url.port());
        same.then_some(Self { url }).ok_or_else(refused)
    }
}

impl std::fmt::Display for Location {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.url.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn credentials_in_a_url_are_refused_and_not_repeated() {
        for url in [
            "https://me:hush@host/a.laz",
            "https://host/a.laz?X-Amz-Signature=hush",
            "https://host/a.laz?sv=1&sig=hush",
            "https://host/a.laz?access_token=hush",
        ] {
            let error = Location::of(Path::new(url)).unwrap_err().to_string();
            assert!(!error.contains("hush"), "{error}");
            assert_eq!(
                Location::masked(Path::new(url)),
                Path::new("https://host/a.laz")
            );
        }
        assert!(Location::of(Path::new("https://host/a.laz?download=1")).is_ok());
        assert!(Location::of(Path::new("s3:///a.laz")).is_err());
    }

    #[test]
    fn names_beside_stay_on_the_host() {
        let ept = Location::of(Path::new("https://host/set/ept.json")).unwrap();
        let tile = ept.join("ept-data/0-0-0-0.laz").unwrap();
        assert_eq!(tile.to_string(), "https://host/set/ept-data/0-0-0-0.laz");
        assert!(ept.join("https://other/x").is_err());
        assert!(ept.join("//other/x").is_err());
    }
}
