//! A run on an input behind a URL is bound to the version that it read.

use super::*;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};

/// A point, in text.
const CONTENT: &str = "0 0 0\n";

/// Serves `CONTENT` with the tag that is in `tag`; returns the URL.
fn serve(tag: &Arc<Mutex<String>>) -> PathBuf {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/scan.xyz", listener.local_addr().unwrap());
    let tag = tag.clone();
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            while answer(&mut stream, &tag) {}
        }
    });
    url.into()
}

/// Answers one request; false if no other follows.
fn answer(stream: &mut TcpStream, tag: &Mutex<String>) -> bool {
    let (mut request, mut byte) = (Vec::new(), [0]);
    while !request.ends_with(b"\r\n\r\n") {
        match stream.read(&mut byte) {
            Ok(1) => request.push(byte[0]),
            _ => return false,
        }
    }
    let (tag, size) = (tag.lock().unwrap().clone(), CONTENT.len());
    let head = format!(
        "HTTP/1.1 206 Partial Content\r\nContent-Range: bytes 0-{}/{size}\r\nETag: \"{tag}\"\r\n\
         Content-Length: {size}\r\n\r\n",
        size - 1
    );
    stream.write_all((head + CONTENT).as_bytes()).is_ok()
}

#[test]
fn another_version_behind_a_url_is_noticed() {
    let tag = Arc::new(Mutex::new("one".to_owned()));
    let inputs = [serve(&tag)];
    let (resources, output) = (Resources::default(), Path::new("out.tif"));
    let job = MeshJob {
        kind: "test",
        inputs: &inputs,
        output,
        options: &(),
        resources: &resources,
        delivery: None,
    };
    let began = Manifest::of(&job).unwrap().to_bytes(output).unwrap();
    Manifest::of(&job).unwrap().check(&began, output).unwrap();
    "two".clone_into(&mut tag.lock().unwrap());
    let now = Manifest::of(&job).unwrap();
    let error = now.check(&began, output).unwrap_err().to_string();
    assert!(
        error.contains("entity tag") && error.contains("scan.xyz"),
        "{error}"
    );
}
