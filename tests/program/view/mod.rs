//! `outcrop view`: a tileset over HTTP, to whom it may be shown and to whom not; the page in one file; the program.

mod bench;
mod scene;

use bench::{Bench, answers, ask, get, raw, root};
use outcrop::Error;
use outcrop_view::{Server, write_html};
use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// For what comes at once, or never.
const PATIENCE: Duration = Duration::from_secs(60);

#[test]
fn the_page_and_the_tiles_are_served() {
    let bench = Bench::new();
    let server = Server::start(&bench.mesh(), None).unwrap();
    let root = root(&server);
    assert_eq!(root.len(), 34, "{root}");
    let page = get(&server, &root);
    assert_eq!(page.status, 200);
    for line in [
        "content-type: text/html",
        "content-security-policy: default-src 'none'",
        "referrer-policy: no-referrer",
        "cache-control: no-store",
        "x-content-type-options: nosniff",
    ] {
        assert!(page.head.contains(line), "no {line} in {}", page.head);
    }
    for name in ["viewer.js", "viewer.css", "THIRD-PARTY.txt", "?x#y"] {
        assert_eq!(get(&server, &format!("{root}{name}")).status, 200, "{name}");
    }
    for name in [
        "tileset.json",
        "tiles/0.glb",
        "tiles/2.glb",
        "tiles/%32.glb?again",
    ] {
        let answer = get(&server, &format!("{root}mesh/{name}"));
        let name = name.replace("%32", "2").replace("?again", "");
        assert_eq!(answer.status, 200, "{name}");
        assert_eq!(answer.body, std::fs::read(bench.mesh().join(name)).unwrap());
    }
    let head = ask(
        &server,
        "HEAD",
        &format!("{root}mesh/tiles/2.glb"),
        &format!("localhost:{}", server.port()),
    );
    assert_eq!((head.status, head.body.len()), (200, 0));
    assert!(head.head.contains("content-length: 300"), "{}", head.head);
    let moved = get(&server, root.trim_end_matches('/'));
    assert_eq!(moved.status, 308);
}

#[test]
fn several_requests_share_a_connection() {
    let bench = Bench::new();
    let server = Server::start(&bench.mesh(), None).unwrap();
    let (root, port) = (root(&server), server.port());
    let one = |last: &str| {
        format!("GET {root}mesh/tiles/2.glb HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{last}\r\n")
    };
    let bytes = raw(
        &server,
        [one(""), one(""), one("Connection: close\r\n")]
            .concat()
            .as_bytes(),
    );
    let starts = bytes.windows(12).filter(|at| at == b"HTTP/1.1 200").count();
    assert_eq!(starts, 3);
}

#[test]
fn without_the_secret_there_is_nothing() {
    let bench = Bench::new();
    let server = Server::start(&bench.mesh(), None).unwrap();
    let other = Server::start(&bench.mesh(), None).unwrap();
    let secret = root(&server);
    assert_ne!(secret, root(&other), "the secret is new each time");
    let wrong = format!("/{}/", "0".repeat(32));
    for target in [
        "/",
        "/mesh/tileset.json",
        "/viewer.js",
        "/favicon.ico",
        &wrong,
        &root(&other),
        &secret[..33],
        "//",
        "/%00/",
    ] {
        let answer = get(&server, target);
        let moved = target == &secret[..33];
        assert_eq!(answer.status, if moved { 308 } else { 404 }, "{target}");
        assert!(
            !String::from_utf8_lossy(&answer.body).contains("outcrop"),
            "{target}"
        );
    }
    let short = &secret[..secret.len() - 2];
    assert_eq!(get(&server, &format!("{short}/")).status, 404);
}

#[test]
fn nothing_outside_of_the_folder_is_served() {
    let bench = Bench::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        symlink("../../outside.glb", bench.mesh().join("tiles/link.glb")).unwrap();
        symlink("../..", bench.mesh().join("tiles/up")).unwrap();
        symlink("/etc/passwd", bench.mesh().join("tiles/passwd.json")).unwrap();
    }
    let server = Server::start(&bench.mesh(), None).unwrap();
    let root = root(&server);
    for path in [
        "mesh/",
        "mesh",
        "mesh/tiles",
        "mesh/tiles/",
        "mesh/notes.txt",
        "mesh/../outside.glb",
        "mesh/../../outside.glb",
        "mesh/tiles/../tileset.json",
        "mesh/%2e%2e/outside.glb",
        "mesh/..%2foutside.glb",
        "mesh/..%5coutside.glb",
        "mesh/tiles%2f0.glb",
        "mesh//tileset.json",
        "mesh/%2fetc%2fpasswd",
        "mesh/tiles/link.glb",
        "mesh/tiles/up/outside.glb",
        "mesh/tiles/passwd.json",
        "mesh/tiles/0.glb%00.glb",
        "mesh/tiles/9.glb",
        "../x",
        "viewer.js/",
        "index.html",
    ] {
        let answer = get(&server, &format!("{root}{path}"));
        assert_eq!(answer.status, 404, "{path}");
        assert!(!answer.body.windows(6).any(|at| at == b"secret"), "{path}");
    }
}

#[test]
fn other_hosts_and_methods_are_refused() {
    let bench = Bench::new();
    let server = Server::start(&bench.mesh(), None).unwrap();
    let (root, port) = (root(&server), server.port());
    let names = [
        "evil.example",
        "127.0.0.1",
        "localhost",
        "127.0.0.1:1",
        "127.0.0.1.evil.example",
        "",
    ];
    for host in names
        .iter()
        .map(ToString::to_string)
        .chain([format!("evil.example:{port}")])
    {
        assert_eq!(ask(&server, "GET", &root, &host).status, 403, "{host}");
    }
    let host = format!("127.0.0.1:{port}");
    for method in [
        "POST", "PUT", "DELETE", "PATCH", "OPTIONS", "CONNECT", "TRACE",
    ] {
        let answer = ask(&server, method, &root, &host);
        assert_eq!(answer.status, 405, "{method}");
        assert!(answer.head.contains("allow: get, head"), "{}", answer.head);
    }
}

#[test]
fn malformed_requests_are_refused_and_the_server_goes_on() {
    let bench = Bench::new();
    let server = Server::start(&bench.mesh(), None).unwrap();
    let (root, port) = (root(&server), server.port());
    let status = |text: &str| answers(&raw(&server, text.as_bytes())).status;
    assert_eq!(status("nonsense\r\n\r\n"), 400);
    assert_eq!(status("GET / HTTP/1.1\r\n\r\n"), 400);
    assert_eq!(
        status(&format!(
            "GET http://127.0.0.1:{port}/ HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n"
        )),
        400
    );
    let body =
        format!("GET {root} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: 3\r\n\r\nabc");
    assert_eq!(status(&body), 400);
    assert_eq!(
        status(&format!("GET /{} HTTP/1.1\r\n", "a".repeat(20_000))),
        431
    );
    assert!(raw(&server, b"GET / HT").len() < 500);
    let many: Vec<TcpStream> = (0..80)
        .map(|_| TcpStream::connect(("127.0.0.1", port)).unwrap())
        .collect();
    // Connections that are closed make room again: the server does so before it closes its own side.
    for mut stream in many {
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let _ = stream.shutdown(Shutdown::Write);
        // One that was too many may have been reset.
        let end = stream.read(&mut [0; 10]);
        assert!(
            !matches!(&end, Err(e) if e.kind() == ErrorKind::WouldBlock),
            "{end:?}"
        );
    }
    let text =
        format!("GET {root} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n");
    assert!(raw(&server, text.as_bytes()).starts_with(b"HTTP/1.1 200"));
}

#[test]
fn it_ends_with_its_connections() {
    let bench = Bench::new();
    let server = Server::start(&bench.mesh(), None).unwrap();
    let port = server.port();
    let page = server.url();
    let mut idle = TcpStream::connect(("127.0.0.1", port)).unwrap();
    idle.set_read_timeout(Some(PATIENCE)).unwrap();
    // Its first request is answered, so it is open; the second one is never whole.
    let whole = format!("GET /scene.json HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n");
    idle.write_all(whole.as_bytes()).unwrap();
    let mut head = [0; 12];
    idle.read_exact(&mut head).unwrap();
    assert_eq!(&head, b"HTTP/1.1 404");
    idle.write_all(b"GET /").unwrap();
    server.stop();
    let mut rest = Vec::new();
    let end = idle.read_to_end(&mut rest);
    assert!(
        !matches!(&end, Err(e) if e.kind() == ErrorKind::WouldBlock),
        "{end:?}"
    );
    // If somebody answers, it is the server of another test, which got the port and knows another secret.
    if let Ok(mut other) = TcpStream::connect(("127.0.0.1", port)) {
        let (_, target) = page.split_once(&port.to_string()).unwrap();
        let head =
            format!("GET {target} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n");
        other.write_all(head.as_bytes()).unwrap();
        let mut answer = String::new();
        let _ = other.read_to_string(&mut answer);
        assert!(!answer.starts_with("HTTP/1.1 200"), "{answer}");
    }
    // The port is free, and taken after that.
    let again = Server::start(&bench.mesh(), Some(port));
    if let Ok(again) = again {
        assert_eq!(again.port(), port);
        let taken = Server::start(&bench.mesh(), Some(port));
        assert!(matches!(taken, Err(Error::Io { .. })), "{taken:?}");
    }
}

#[test]
fn one_file_holds_what_fits() {
    let bench = Bench::new();
    let page = bench.0.path().join("page.html");
    let all = write_html(&bench.mesh(), &page, 20 << 20).unwrap();
    assert_eq!(
        (all.tiles, all.of_tiles, all.triangles, all.of_triangles),
        (3, 3, 70, 70)
    );
    let text = std::fs::read_to_string(&page).unwrap();
    assert_eq!(all.bytes, text.len() as u64);
    assert_eq!(text.matches("data-uri=").count(), 3);
    // The name of the mesh ends no element; nothing is loaded.
    assert!(text.contains("\\u003c/script>\\u003cb>.ply") && !text.contains("</script><b>"));
    assert!(text.contains("default-src 'none'") && !text.contains("src=\"viewer.js\""));
    let least = write_html(&bench.mesh(), &page, all.bytes - 3000).unwrap();
    assert_eq!((least.tiles, least.triangles), (1, 7));
    assert!(least.bytes <= all.bytes - 3000);
    let refused = write_html(&bench.mesh(), &page, 1000)
        .unwrap_err()
        .to_string();
    assert!(refused.starts_with("html_limit: 1000 bytes"), "{refused}");
    assert_eq!(
        std::fs::metadata(&page).unwrap().len(),
        least.bytes,
        "the page stays"
    );
    let names: Vec<_> = std::fs::read_dir(bench.0.path()).unwrap().collect();
    assert_eq!(names.len(), 3, "{names:?}");
}

#[test]
fn tiles_outside_of_the_folder_are_not_embedded() {
    let bench = Bench::new();
    let path = bench.mesh().join("tileset.json");
    let text = std::fs::read_to_string(&path).unwrap();
    for uri in [
        "../outside.glb",
        "tiles/9.glb",
        "/etc/passwd",
        "https://a/b.glb",
    ] {
        std::fs::write(&path, text.replace("tiles/2.glb", uri)).unwrap();
        let page = bench.0.path().join("page.html");
        let refused = write_html(&bench.mesh(), &page, 20 << 20).unwrap_err();
        assert!(matches!(refused, Error::Input { .. }), "{refused}");
        assert!(!page.exists());
    }
}

/// The program with arguments: exit code, standard output, messages.
fn program(args: &[&Path]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_outcrop"))
        .arg("view")
        .args(args)
        .arg("--no-browser")
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

#[test]
fn bad_folders_get_one_line() {
    let bench = Bench::new();
    let empty = tempfile::tempdir().unwrap();
    let cases: [(&Path, Option<&str>, &str); 6] = [
        (empty.path(), None, "no tileset.json"),
        (&empty.path().join("absent.ply"), None, "absent.ply"),
        (&empty.path().join("absent"), None, "absent"),
        (&bench.mesh(), Some("not JSON"), "line 1"),
        (
            &bench.mesh(),
            Some("{\"asset\":{\"version\":\"1.1\"}}"),
            "root",
        ),
        (
            &bench.mesh(),
            Some("{\"asset\":{\"version\":\"1.1\"},\"root\":{\"geometricError\":1,\"content\":3}}"),
            "line 1",
        ),
    ];
    for (folder, content, word) in cases {
        if let Some(content) = content {
            std::fs::write(folder.join("tileset.json"), content).unwrap();
        }
        let (code, out, err) = program(&[folder]);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{err}");
        assert!(err.starts_with("outcrop: ") && err.contains(word), "{err}");
        assert_eq!(err.lines().count(), 1, "{err}");
    }
    let left: Vec<_> = std::fs::read_dir(empty.path()).unwrap().collect();
    assert!(left.is_empty(), "{left:?}");
}

#[cfg(unix)]
#[test]
fn the_program_serves_until_a_signal() {
    use std::io::{BufRead, BufReader};
    let bench = Bench::new();
    for signal in ["-INT", "-TERM"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_outcrop"))
            .args(["view", "--no-browser"])
            .arg(bench.mesh().join("tileset.json"))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut url = String::new();
        let mut lines = BufReader::new(child.stdout.take().unwrap());
        lines.read_line(&mut url).unwrap();
        assert!(url.starts_with("http://127.0.0.1:"), "{url}");
        let port: u16 = url.split([':', '/']).nth(4).unwrap().parse().unwrap();
        assert!(TcpStream::connect(("127.0.0.1", port)).is_ok());
        let id = child.id().to_string();
        assert!(
            Command::new("kill")
                .args([signal, &id])
                .status()
                .unwrap()
                .success()
        );
        assert_eq!(child.wait().unwrap().code(), Some(0));
    }
}
