//! The uploads of a file that a store holds unfinished: what a killed run began and could not note.

use super::answer::Answer;
use super::errors::told;
use super::location::Location;
use super::stores::{Door, Patience};
use super::upload::{Bucket, Store};
use super::wait::wait;
use http::{Method, Request, StatusCode};
use object_store::client::{HttpConnector, HttpRequestBody};
use object_store::path::Path;
use object_store::signer::{SignedUrlOptions, Signer};
use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};
use url::Url;

/// How long a signed request is good: it is made at once.
const SOON: Duration = Duration::from_secs(60);

/// How long a list that fails is asked for again, and the pause between.
const AGAIN: Duration = Duration::from_secs(8);
const PAUSE: Duration = Duration::from_millis(500);

/// Most bytes of a list: it has at most 1000 uploads.
const LONGEST: usize = 4 << 20;

impl Bucket {
    /// The names of the uploads of this very file that are begun and not completed, at most 1000. Azure has none: parts
    /// that belong to no file go by themselves after a week.
    ///
    /// # Errors
    /// [`ErrorKind::Unsupported`] if the store does not tell them, [`ErrorKind::PermissionDenied`] if it does not tell
    /// us; what ends a request.
    pub fn unfinished(&self, of: &Location) -> io::Result<Vec<String>> {
        let path = of.path().map_err(told)?;
        let query = [("uploads", ""), ("prefix", path.as_ref())];
        let (url, token) = match &self.store {
            Store::Azure(_) => return Ok(Vec::new()),
            Store::Amazon(store) => {
                let options = SignedUrlOptions::new().with_query(query);
                let root = Path::default();
                let signed = store.signed_url_opts(Method::GET, &root, SOON, &options);
                (wait(signed)?.map_err(told)?, None)
            }
            Store::Google(store, address) => {
                let bucket = of.url.host_str().unwrap_or_default();
                let url = Url::parse_with_params(&format!("{address}/{bucket}"), query);
                let token = wait(store.credentials().get_credential())?;
                (url.map_err(io::Error::other)?, token.ok())
            }
        };
        let text = self.get(&url, token.map(|token| token.bearer.clone()))?;
        Ok(uploads_of(&text, path.as_ref()))
    }

    /// The answer to a request with this token. A failure that may pass is tried again, for seconds.
    fn get(&self, url: &Url, token: Option<String>) -> io::Result<String> {
        let token = token.filter(|token| !token.is_empty());
        let begun = Instant::now();
        loop {
            match self.once(url, token.as_deref()) {
                Err(e) if e.kind() == ErrorKind::Other && begun.elapsed() < AGAIN => {
                    std::thread::sleep(PAUSE);
                }
                done => return done,
            }
        }
    }

    fn once(&self, url: &Url, token: Option<&str>) -> io::Result<String> {
        // The URL has a signature in it, so that no error tells it.
        let failed = |kind: ErrorKind, why: &str| {
            let why = format!("the list of unfinished uploads: {why}");
            io::Error::new(kind, why)
        };
        let client = Door::new(Patience::Short, &self.counts)
            .client(url.as_str(), false)
            .connect(&Default::default());
        let mut request = Request::get(url.as_str());
        if let Some(token) = token {
            request = request.header("authorization", format!("Bearer {token}"));
        }
        let request = request.body(HttpRequestBody::empty());
        let request = request.map_err(|_| failed(ErrorKind::Unsupported, "no request"))?;
        let answer = wait(client.map_err(told)?.execute(request))?;
        let answer = answer.map_err(|_| failed(ErrorKind::Other, "no answer"))?;
        let status = answer.status();
        if !status.is_success() {
            return Err(failed(kind_of(status), &status.to_string()));
        }
        let body = Answer::of_body(answer.into_body()).all(LONGEST as u64)?;
        let none = |_| failed(ErrorKind::Unsupported, "it is no text");
        String::from_utf8(body.into()).map_err(none)
    }
}

/// What a status means for a list that was asked for.
fn kind_of(status: StatusCode) -> ErrorKind {
    match status {
        StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN => ErrorKind::PermissionDenied,
        // The store is busy, or out of order.
        StatusCode::REQUEST_TIMEOUT | StatusCode::TOO_MANY_REQUESTS => ErrorKind::Other,
        status if status.is_server_error() && status != StatusCode::NOT_IMPLEMENTED => {
            ErrorKind::Other
        }
        _ => ErrorKind::Unsupported,
    }
}

/// The uploads of the file `key` in a list.
fn uploads_of(list: &str, key: &str) -> Vec<String> {
    let entries = list.split("<Upload>").skip(1);
    let of_key = entries.filter(|entry| inside(entry, "Key").as_deref() == Some(key));
    of_key
        .filter_map(|entry| inside(entry, "UploadId"))
        .collect()
}

/// The text of an element.
fn inside(entry: &str, name: &str) -> Option<String> {
    let (_, after) = entry.split_once(&format!("<{name}>"))?;
    let (text, _) = after.split_once(&format!("</{name}>"))?;
    let plain = [
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("&quot;", "\""),
        ("&apos;", "'"),
        ("&amp;", "&"),
    ];
    let plain = plain.iter();
    Some(plain.fold(text.to_owned(), |text, (from, to)| text.replace(from, to)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uploads_are_those_of_the_very_file() {
        let entry = |key: &str, id: &str| {
            format!("<Upload><Key>{key}</Key><UploadId>{id}</UploadId><X/></Upload>")
        };
        let list = format!(
            "<?xml?><R><Prefix>a</Prefix>{}{}{}</R>",
            entry("a &amp; b.ply", "one"),
            entry("a &amp; b.ply.zst", "two"),
            entry("a &amp; b.ply", "three&lt;")
        );
        assert_eq!(uploads_of(&list, "a & b.ply"), ["one", "three<"]);
        assert!(uploads_of("<Upload><Key>a", "a").is_empty());
        assert!(uploads_of("", "").is_empty());
    }

    #[test]
    fn only_a_store_that_does_not_tell_its_uploads_has_no_list() {
        for (status, kind) in [
            (400, ErrorKind::Unsupported),
            (403, ErrorKind::PermissionDenied),
            (405, ErrorKind::Unsupported),
            (429, ErrorKind::Other),
            (500, ErrorKind::Other),
            (501, ErrorKind::Unsupported),
            (503, ErrorKind::Other),
        ] {
            assert_eq!(kind_of(StatusCode::from_u16(status).unwrap()), kind);
        }
    }
}
