//! The head of an HTTP request, and the decision about it.

/// Longest head of a request, in bytes.
pub const LONGEST: usize = 16 << 10;

/// Most header lines of a request.
const HEADERS: usize = 64;

/// A request that can be answered.
#[derive(Debug, PartialEq, Eq)]
pub struct Request {
    /// True if the answer is to have no body.
    pub head_only: bool,
    /// The path without its query: decoded names, an empty one at the end for a folder.
    pub path: Vec<String>,
    /// Value of `Host`.
    pub host: String,
    /// True if further requests may follow on the connection.
    pub keep: bool,
}

/// Refusal of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Not HTTP, or a request that this server does not understand.
    Malformed,
    /// Another method than GET and HEAD.
    Method,
    /// A longer head than any browser sends.
    TooLong,
}

/// Length of the head in `bytes`, with its empty line; `None` if more bytes are needed.
pub fn head_length(bytes: &[u8]) -> Option<usize> {
    let end = bytes.windows(4).position(|four| four == b"\r\n\r\n");
    end.map(|at| at + 4)
}

/// Reads a complete head.
pub fn parse(head: &[u8]) -> Result<Request, Refusal> {
    let mut headers = [httparse::EMPTY_HEADER; HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    match parsed.parse(head) {
        Ok(httparse::Status::Complete(length)) if length == head.len() => {}
        Err(httparse::Error::TooManyHeaders) => return Err(Refusal::TooLong),
        _ => return Err(Refusal::Malformed),
    }
    let head_only = match parsed.method {
        Some("GET") => false,
        Some("HEAD") => true,
        _ => return Err(Refusal::Method),
    };
    let values = |name: &'static str| {
        let headers = parsed.headers.iter();
        let named = headers.filter(move |header| header.name.eq_ignore_ascii_case(name));
        named.map(|header| std::str::from_utf8(header.value).unwrap_or("?"))
    };
    // A body would be taken for the next request.
    let body = values("content-length").any(|length| length.trim() != "0");
    if body || values("transfer-encoding").next().is_some() {
        return Err(Refusal::Malformed);
    }
    let (mut hosts, closes) = (
        values("host"),
        values("connection").any(|value| value.to_ascii_lowercase().contains("close")),
    );
    let (Some(host), None) = (hosts.next(), hosts.next()) else {
        return Err(Refusal::Malformed);
    };
    Ok(Request {
        head_only,
        path: path(parsed.path.unwrap_or_default()).ok_or(Refusal::Malformed)?,
        host: host.trim().to_ascii_lowercase(),
        keep: parsed.version == Some(1) && !closes,
    })
}

/// The names of a path. `None` if it does not begin with a slash or is not valid text.
fn path(target: &str) -> Option<Vec<String>> {
    let path = target.split(['?', '#']).next()?.strip_prefix('/')?;
    path.split('/').map(decoded).collect()
}

/// A name with its `%` escapes replaced.
fn decoded(name: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        if first != b'%' {
            bytes.push(first);
            rest = after;
            continue;
        }
        let (digits, after) = after.split_at_checked(2)?;
        let digit = |d: u8| char::from(d).to_digit(16);
        bytes.push(u8::try_from(digit(digits[0])? * 16 + digit(digits[1])?).ok()?);
        rest = after;
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn get(target: &str) -> Result<Request, Refusal> {
        parse(format!("GET {target} HTTP/1.1\r\nHost: LocalHost:80\r\n\r\n").as_bytes())
    }

    #[test]
    fn paths_are_decoded_name_by_name() {
        let request = get("/t/mesh/tiles/a%20b.glb?x=/../y").unwrap();
        assert_eq!(request.path, ["t", "mesh", "tiles", "a b.glb"]);
        assert_eq!(request.host, "localhost:80");
        assert!(request.keep && !request.head_only);
        assert_eq!(get("/t/").unwrap().path, ["t", ""]);
        assert_eq!(get("/t/..%2f..%2Fetc").unwrap().path, ["t", "../../etc"]);
        for bad in ["/%", "/%4", "/%zz", "/%ff", "t", "http://a/b", "*", "/%+1"] {
            assert_eq!(get(bad), Err(Refusal::Malformed), "{bad}");
        }
    }

    #[test]
    fn other_requests_are_refused() {
        let refused = |text: &str| parse(text.as_bytes()).unwrap_err();
        for method in ["POST", "PUT", "DELETE", "OPTIONS", "get", "TRACE"] {
            let text = format!("{method} / HTTP/1.1\r\nHost: a\r\n\r\n");
            assert_eq!(refused(&text), Refusal::Method, "{method}");
        }
        for text in [
            "GET / HTTP/1.1\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: a\r\nHost: a\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n",
            "GET / HTTP/9.9\r\nHost: a\r\n\r\n",
            "GET /\r\n\r\n",
            "\u{16}\u{3}\u{1}\r\n\r\n",
        ] {
            assert_eq!(refused(text), Refusal::Malformed, "{text:?}");
        }
        let many = "X: 1\r\n".repeat(HEADERS + 1);
        let text = format!("GET / HTTP/1.1\r\n{many}\r\n");
        assert_eq!(refused(&text), Refusal::TooLong);
    }

    #[test]
    fn connections_end_when_asked_to() {
        let request = |text: &str| parse(text.as_bytes()).unwrap();
        assert!(!request("GET / HTTP/1.0\r\nHost: a\r\n\r\n").keep);
        assert!(!request("HEAD / HTTP/1.1\r\nHost: a\r\nConnection: Close\r\n\r\n").keep);
        assert!(request("HEAD / HTTP/1.1\r\nHost: a\r\n\r\n").head_only);
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = parse(&bytes);
        }

        #[test]
        fn any_target_is_read_or_refused(target in "[/%a-f0-9.\\\\?]{0,40}") {
            if let Ok(request) = get(&target) {
                prop_assert!(!request.path.is_empty());
            }
        }
    }
}
