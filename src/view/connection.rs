//! One connection of the server: requests in, answers out.

use super::assets::{ALL, POLICY};
use super::folder::Opened;
use super::request::{LONGEST, Refusal, Request, head_length, parse};
use super::scene::Scene;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time after which a connection without a request ends.
const IDLE: Duration = Duration::from_secs(30);

/// Time in which the other side must take what is sent.
const SLOW: Duration = Duration::from_secs(30);

/// The name under which the page asks what is shown.
const SCENE: &str = "scene.json";

/// The files that are served, and the secret of their addresses.
#[derive(Debug)]
pub struct Site {
    /// What is shown.
    pub scene: Arc<Scene>,
    /// The secret part of the URL.
    pub token: String,
    /// The port, as in the header `Host`.
    pub port: u16,
}

/// The body of an answer.
enum Body {
    Bytes(&'static [u8]),
    Text(String),
    File(Opened),
}

/// An answer.
struct Answer {
    status: &'static str,
    kind: &'static str,
    /// Further header lines.
    more: String,
    body: Body,
}

impl Answer {
    /// An answer without content but its own status.
    fn plain(status: &'static str) -> Self {
        Self {
            status,
            kind: "text/plain; charset=utf-8",
            more: String::new(),
            body: Body::Bytes(status.as_bytes()),
        }
    }

    fn refused(refusal: Refusal) -> Self {
        match refusal {
            Refusal::Malformed => Self::plain("400 Bad Request"),
            Refusal::TooLong => Self::plain("431 Request Header Fields Too Large"),
            Refusal::Method => Self {
                more: "Allow: GET, HEAD\r\n".into(),
                ..Self::plain("405 Method Not Allowed")
            },
        }
    }
}

impl Site {
    /// The answer to a request.
    fn answer(&self, request: &Request) -> Answer {
        // A page of another site may send requests to this address by a name of its own, but not with ours.
        let ours = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        if !ours.contains(&request.host) {
            return Answer::plain("403 Forbidden");
        }
        let names: Vec<&str> = request.path.iter().map(String::as_str).collect();
        let absent = Answer::plain("404 Not Found");
        let Some((token, names)) = names.split_first() else {
            return absent;
        };
        if !same(token, &self.token) {
            return absent;
        }
        match names {
            [] => Answer {
                more: format!("Location: /{}/\r\n", self.token),
                ..Answer::plain("308 Permanent Redirect")
            },
            [SCENE] => Answer {
                status: "200 OK",
                kind: "application/json",
                more: String::new(),
                body: Body::Text(self.scene.json().to_string()),
            },
            [name] => {
                let asset = ALL.iter().find(|asset| asset.name == *name);
                asset.map_or(absent, |asset| Answer {
                    status: "200 OK",
                    kind: asset.kind,
                    more: format!("Content-Security-Policy: {POLICY}\r\n"),
                    body: Body::Bytes(asset.bytes),
                })
            }
            names => {
                let opened = self.scene.open(names);
                opened.map_or(absent, |opened| Answer {
                    status: "200 OK",
                    kind: opened.kind,
                    more: String::new(),
                    body: Body::File(opened),
                })
            }
        }
    }

    /// Answers the requests of a connection until it ends.
    pub fn serve(&self, mut stream: TcpStream) -> io::Result<()> {
        stream.set_write_timeout(Some(SLOW))?;
        stream.set_nodelay(true)?;
        let mut bytes = Vec::with_capacity(1024);
        loop {
            let Some(head) = next_head(&mut stream, &mut bytes)? else {
                if bytes.len() >= LONGEST {
                    send(&mut stream, Answer::refused(Refusal::TooLong), false, false)?;
                }
                return Ok(());
            };
            let (answer, head_only, keep) = match parse(&bytes[..head]) {
                Ok(request) => (self.answer(&request), request.head_only, request.keep),
                Err(refusal) => (Answer::refused(refusal), false, false),
            };
            bytes.drain(..head);
            send(&mut stream, answer, head_only, keep)?;
            if !keep {
                return Ok(());
            }
        }
    }
}

/// Reads until `bytes` begins with a whole head, and returns the head's length; `None` if the connection
/// ended, was idle for too long, or the head is too long.
fn next_head(stream: &mut TcpStream, bytes: &mut Vec<u8>) -> io::Result<Option<usize>> {
    let since = Instant::now();
    let mut part = [0; 2048];
    loop {
        if let Some(length) = head_length(bytes) {
            return Ok((length <= LONGEST).then_some(length));
        }
        let Some(left) = IDLE.checked_sub(since.elapsed()).filter(|t| !t.is_zero()) else {
            return Ok(None);
        };
        if bytes.len() >= LONGEST {
            return Ok(None);
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut part)? {
            0 => return Ok(None),
            read => bytes.extend_from_slice(&part[..read]),
        }
    }
}

/// Sends an answer.
fn send(stream: &mut TcpStream, answer: Answer, head_only: bool, keep: bool) -> io::Result<()> {
    let length = match &answer.body {
        Body::Bytes(bytes) => bytes.len() as u64,
        Body::Text(text) => text.len() as u64,
        Body::File(opened) => opened.length,
    };
    let head = format!(
        "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {length}\r\n{}\
         Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nConnection: {}\r\n\r\n",
        answer.status,
        answer.kind,
        answer.more,
        if keep { "keep-alive" } else { "close" },
    );
    stream.write_all(head.as_bytes())?;
    if head_only {
        return Ok(());
    }
    match answer.body {
        Body::Bytes(bytes) => stream.write_all(bytes),
        Body::Text(text) => stream.write_all(text.as_bytes()),
        Body::File(opened) => {
            let sent = io::copy(&mut opened.file.take(length), stream)?;
            // A file that became shorter: the end of the connection tells the browser.
            if sent == length {
                Ok(())
            } else {
                Err(io::ErrorKind::UnexpectedEof.into())
            }
        }
    }
}

/// True for equal texts; the time taken does not depend on where they differ.
fn same(a: &str, b: &str) -> bool {
    let differing = a.bytes().zip(b.bytes()).fold(0, |d, (a, b)| d | (a ^ b));
    a.len() == b.len() && differing == 0
}
