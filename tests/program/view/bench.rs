//! A tileset that is served, and requests for it.

use outcrop_view::Server;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// A folder `mesh` with a tileset of three tiles: a root of 300 bytes, and children of 3000 bytes each.
pub struct Bench(pub tempfile::TempDir);

impl Bench {
    pub fn new() -> Self {
        let bench = Self(tempfile::tempdir().unwrap());
        std::fs::create_dir_all(bench.mesh().join("tiles")).unwrap();
        let tile = |error: f64, n: u32, triangles: u32| {
            format!(
                "\"boundingVolume\":{{\"box\":[0,0,0,1,0,0,0,1,0,0,0,1]}},\"geometricError\":{error},\
                 \"content\":{{\"uri\":\"tiles/{n}.glb\"}},\"extras\":{{\"outcrop\":{{\"level\":0,\"triangles\":{triangles}}}}}"
            )
        };
        let tileset = format!(
            "{{\"asset\":{{\"version\":\"1.1\"}},\"geometricError\":9,\"extras\":{{\"outcrop\":{{\"triangles\":70,\
             \"source\":\"</script><b>.ply\"}}}},\"root\":{{\"refine\":\"REPLACE\",{},\"children\":[{{{}}},{{{}}}]}}}}",
            tile(1.5, 2, 7),
            tile(0.0, 0, 30),
            tile(0.0, 1, 40),
        );
        std::fs::write(bench.mesh().join("tileset.json"), tileset).unwrap();
        for (n, length) in [(0, 3000), (1, 3000), (2, 300)] {
            let bytes: Vec<u8> = (0..length).map(|k| (k * 7 + n) as u8).collect();
            std::fs::write(bench.mesh().join(format!("tiles/{n}.glb")), bytes).unwrap();
        }
        std::fs::write(bench.0.path().join("outside.glb"), "secret").unwrap();
        std::fs::write(bench.mesh().join("notes.txt"), "secret").unwrap();
        bench
    }

    pub fn mesh(&self) -> std::path::PathBuf {
        self.0.path().join("mesh")
    }
}

/// An answer: status, header in lower case, body.
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: Vec<u8>,
}

/// Sends bytes on a connection of its own, and reads until the server closes it.
pub fn raw(server: &Server, bytes: &[u8]) -> Vec<u8> {
    let mut stream = TcpStream::connect(("127.0.0.1", server.port())).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(60)))
        .unwrap();
    // A server that has refused may have closed the connection already.
    let _ = stream.write_all(bytes);
    let _ = stream.shutdown(std::net::Shutdown::Write);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    answer
}

pub fn answers(bytes: &[u8]) -> Answer {
    let end = bytes.windows(4).position(|four| four == b"\r\n\r\n");
    let end = end.unwrap_or_else(|| panic!("no head in {:?}", String::from_utf8_lossy(bytes)));
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    Answer {
        status: head.split(' ').nth(1).unwrap().parse().unwrap(),
        head: head.to_ascii_lowercase(),
        body: bytes[end + 4..].to_vec(),
    }
}

/// A request with a method, a target, and a value of `Host`.
pub fn ask(server: &Server, method: &str, target: &str, host: &str) -> Answer {
    let text = format!("{method} {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    answers(&raw(server, text.as_bytes()))
}

pub fn get(server: &Server, target: &str) -> Answer {
    ask(
        server,
        "GET",
        target,
        &format!("127.0.0.1:{}", server.port()),
    )
}

/// The path of the page, with the secret: `/…/`.
pub fn root(server: &Server) -> String {
    let url = server.url();
    let path = url.strip_prefix(&format!("http://127.0.0.1:{}", server.port()));
    path.unwrap().to_owned()
}
