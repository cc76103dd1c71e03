//! Objects of a server that misbehaves, each in its way.

use super::{Counts, Location, Object, Room, Whole};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How a server behaves.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Manner {
    Good,
    /// It sends whole files only.
    NoRanges,
    /// Every third answer is `503`, to be repeated at once.
    Busy,
    /// Every third answer ends in the middle.
    BreaksOff,
    /// From the fourth request on the file is another one.
    Changes,
    Absent,
    Closed,
    /// Every answer is `503`.
    Down,
}

/// Serves `content` until the test ends; returns the URL.
fn serve(content: Vec<u8>, manner: Manner) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/a%20b/scan.laz", listener.local_addr().unwrap());
    let count = Arc::new(AtomicUsize::new(0));
    let content = Arc::new(content);
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let (content, count) = (content.clone(), count.clone());
            std::thread::spawn(move || while answer(&stream, &content, manner, &count) {});
        }
    });
    url
}

/// Answers one request; false if no other can follow.
fn answer(mut stream: &TcpStream, content: &[u8], manner: Manner, count: &AtomicUsize) -> bool {
    let mut request = Vec::new();
    let mut byte = [0];
    while !request.ends_with(b"\r\n\r\n") {
        match stream.read(&mut byte) {
            Ok(1) => request.push(byte[0]),
            _ => return false,
        }
    }
    let text = String::from_utf8(request).unwrap();
    assert!(text.starts_with("GET /a%20b/scan.laz "), "{text}");
    let number = count.fetch_add(1, Ordering::Relaxed);
    let status = match manner {
        Manner::Busy if number % 3 == 2 => "503 Busy\r\nRetry-After: 0",
        Manner::Absent => "404 Not Found",
        Manner::Closed => "403 Forbidden",
        Manner::Down => "503 Busy",
        _ => "",
    };
    if !status.is_empty() {
        let head = format!("HTTP/1.1 {status}\r\nContent-Length: 0\r\n\r\n");
        return stream.write_all(head.as_bytes()).is_ok();
    }
    let range = text.lines().find_map(|line| {
        line.to_ascii_lowercase()
            .strip_prefix("range: bytes=")
            .map(str::to_owned)
    });
    let tag = match manner {
        Manner::Changes if number >= 3 => "\"two\"",
        _ => "\"one\"",
    };
    let matches = text
        .lines()
        .find_map(|line| line.strip_prefix("if-match: "));
    if matches.is_some_and(|wanted| wanted != tag) {
        let head = "HTTP/1.1 412 Precondition Failed\r\nContent-Length: 0\r\n\r\n";
        return stream.write_all(head.as_bytes()).is_ok();
    }
    let (mut head, body) = match range.filter(|_| manner != Manner::NoRanges) {
        Some(range) => {
            let (low, high) = range.split_once('-').unwrap();
            let low: usize = low.parse().unwrap();
            let high = content.len().min(high.parse::<usize>().unwrap() + 1);
            let place = format!("bytes {low}-{}/{}", high - 1, content.len());
            let head = format!("HTTP/1.1 206 Partial Content\r\nContent-Range: {place}\r\n");
            (head, &content[low..high])
        }
        None => ("HTTP/1.1 200 OK\r\n".to_owned(), content),
    };
    head += &format!("ETag: {tag}\r\nContent-Length: {}\r\n\r\n", body.len());
    stream.write_all(head.as_bytes()).unwrap();
    if manner == Manner::BreaksOff && number % 3 == 1 {
        let _ = stream.write_all(&body[..body.len() / 2]);
        let _ = stream.shutdown(std::net::Shutdown::Both);
        return false;
    }
    stream.write_all(body).is_ok()
}

fn content() -> Vec<u8> {
    let mut state = 1u32;
    let next = |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..9_000_000).map(next).collect()
}

fn open(url: &str) -> std::io::Result<Object> {
    Object::open(&Location::of(Path::new(url))?, &Arc::<Counts>::default())
}

fn room(bytes: u64) -> Room {
    Room {
        bytes,
        is_ahead: true,
    }
}

/// Reads all of an object from several places at once, in an order that is not that of the file.
fn read_all(object: &Object) -> std::io::Result<Vec<u8>> {
    let size = object.size() as usize;
    let mut all = vec![0; size];
    let part = 700_001;
    let results: Vec<std::io::Result<()>> = std::thread::scope(|scope| {
        let threads = all.chunks_mut(part).enumerate().rev().map(|(n, chunk)| {
            scope.spawn(move || {
                let mut done = 0;
                while done < chunk.len() {
                    done += object.read_at(&mut chunk[done..], (n * part + done) as u64)?;
                }
                Ok(())
            })
        });
        let threads: Vec<_> = threads.collect();
        threads.into_iter().map(|t| t.join().unwrap()).collect()
    });
    results.into_iter().collect::<std::io::Result<()>>()?;
    Ok(all)
}

#[test]
fn the_bytes_are_those_of_the_file_however_a_server_behaves() {
    let content = content();
    for manner in [Manner::Good, Manner::Busy, Manner::BreaksOff] {
        let url = serve(content.clone(), manner);
        for memory in [None, Some(0), Some(8 << 20)] {
            let object = open(&url).unwrap();
            if let Some(memory) = memory {
                object.expect(std::iter::once(0..object.size()), room(memory));
            }
            assert!(
                read_all(&object).unwrap() == content,
                "{manner:?}, {memory:?}"
            );
        }
    }
}

#[test]
fn what_is_fetched_before_is_asked_for_once() {
    let content = content();
    let object = open(&serve(content.clone(), Manner::Good)).unwrap();
    object.expect(std::iter::once(0..object.size()), room(16 << 20));
    let mut whole = Vec::new();
    Whole::of(&object).unwrap().read_to_end(&mut whole).unwrap();
    assert!(whole == content);
    // The first request is for the beginning, of which nothing is fetched again.
    assert_eq!(object.counts().requests(), 1 + 3);
    assert_eq!(object.counts().bytes(), content.len() as u64);
}

#[test]
fn only_what_is_expected_is_fetched() {
    let object = open(&serve(content(), Manner::Good)).unwrap();
    object.expect([5_000_000..5_000_100, 5_000_200..5_001_000], room(8 << 20));
    let mut buffer = [0; 800];
    assert_eq!(object.read_at(&mut buffer, 5_000_200).unwrap(), 800);
    assert_eq!(object.counts().bytes(), (64 << 10) + 1_000);
}

#[test]
fn a_server_without_ranges_sends_whole_files() {
    let content = content();
    let object = open(&serve(content.clone(), Manner::NoRanges)).unwrap();
    assert!(!object.has_parts());
    let mut head = vec![0; 1 << 20];
    assert_eq!(object.read_at(&mut head, 0).unwrap(), head.len());
    assert!(head == content[..1 << 20]);
    let mut whole = Vec::new();
    Whole::of(&object).unwrap().read_to_end(&mut whole).unwrap();
    assert!(whole == content);
}

#[test]
fn a_file_that_changes_is_an_error() {
    let object = open(&serve(content(), Manner::Changes)).unwrap();
    let error = read_all(&object).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::InvalidData);
    assert!(error.to_string().contains("has changed"), "{error}");
}

#[test]
fn one_client_opens_and_reads_a_file() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/a%20b/scan.laz", listener.local_addr().unwrap());
    let connections = Arc::new(AtomicUsize::new(0));
    let count = connections.clone();
    std::thread::spawn(move || {
        let (content, requests) = (content(), AtomicUsize::new(0));
        for stream in listener.incoming().flatten() {
            count.fetch_add(1, Ordering::Relaxed);
            while answer(&stream, &content, Manner::Good, &requests) {}
        }
    });
    let object = open(&url).unwrap();
    for at in [1 << 20, 2 << 20, 3 << 20] {
        assert_eq!(object.read_at(&mut [0; 100], at).unwrap(), 100);
    }
    assert_eq!(object.counts().requests(), 4);
    assert_eq!(connections.load(Ordering::Relaxed), 1);
}

#[test]
fn a_server_that_is_down_from_the_start_is_told_after_seconds() {
    let begin = std::time::Instant::now();
    let error = open(&serve(content(), Manner::Down)).unwrap_err();
    assert!(error.to_string().contains("503"), "{error}");
    let took = begin.elapsed().as_secs();
    assert!((10..40).contains(&took), "{took} s");
}

#[test]
fn errors_have_the_kind_of_local_files_and_the_status() {
    for (manner, kind, status) in [
        (Manner::Absent, ErrorKind::NotFound, "404"),
        (Manner::Closed, ErrorKind::PermissionDenied, "403"),
    ] {
        let error = open(&serve(content(), manner)).unwrap_err();
        assert_eq!(error.kind(), kind);
        let text = error.to_string();
        assert!(text.contains(status) && !text.contains('\n'), "{text}");
    }
}

#[test]
fn an_empty_file_has_no_bytes() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/x", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            let mut request = [0; 4096];
            let got = stream.read(&mut request).unwrap();
            let ranged = request[..got]
                .windows(6)
                .any(|w| w.eq_ignore_ascii_case(b"range:"));
            let status = if ranged {
                "416 Range Not Satisfiable"
            } else {
                "200 OK"
            };
            let head =
                format!("HTTP/1.1 {status}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
            stream.write_all(head.as_bytes()).unwrap();
        }
    });
    let object = open(&url).unwrap();
    assert_eq!(object.size(), 0);
    assert_eq!(object.read_at(&mut [0; 4], 0).unwrap(), 0);
}
