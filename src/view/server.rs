//! The server: threads that answer connections from this machine.

use super::connection::Site;
use super::scene::{Part, Scene};
use super::watching::Watching;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::progress::Observer;
use std::collections::HashMap;
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Most connections at a time; a browser opens six.
const CONNECTIONS: usize = 64;

/// Stack of the thread of a connection, in bytes.
const STACK: usize = 256 << 10;

/// Bytes of the secret part of the URL.
const TOKEN: usize = 16;

/// Time that a page has to ask why there will be no more, and between two looks whether it has: it asks twice a second.
const FAREWELL: Duration = Duration::from_millis(1500);
const LOOK: Duration = Duration::from_millis(20);

/// A server that shows levels of detail to browsers on this machine: of one mesh or two, and of points beside them. It reads only, answers only
/// those who know the secret in its URL, and ends when it is dropped.
#[derive(Debug)]
pub struct Server {
    shared: Arc<Shared>,
    listening: Option<JoinHandle<()>>,
}

/// The part of a server that its threads share.
#[derive(Debug)]
struct Shared {
    site: Site,
    stop: AtomicBool,
    /// The open connections by number.
    open: Mutex<HashMap<u64, TcpStream>>,
}

impl Shared {
    fn open(&self) -> MutexGuard<'_, HashMap<u64, TcpStream>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Server {
    /// Serves a folder that has a `tileset.json`, on a port of 127.0.0.1: the given one, or a free one.
    ///
    /// # Errors
    /// If the folder cannot be read or has no valid tileset, or the port is taken.
    pub fn start(folder: &Path, port: Option<u16>) -> Result<Self> {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let scene = Scene::new(&[(Part::First, name.into_owned())]);
        scene.show(Part::First, folder)?;
        Self::serve(scene, port)
    }

    /// Serves parts with these names, none of which is there yet: the page waits for them, and shows how far they are.
    ///
    /// # Errors
    /// If the port is taken.
    pub fn open(parts: &[(Part, String)], port: Option<u16>) -> Result<Self> {
        Self::serve(Scene::new(parts), port)
    }

    fn serve(scene: Scene, port: Option<u16>) -> Result<Self> {
        let port = port.unwrap_or(0);
        let failed =
            |e: std::io::Error| Error::io(format!("127.0.0.1:{port}"), "serve the mesh", e);
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(failed)?;
        let bound = listener.local_addr().map_err(failed)?.port();
        let site = Site {
            scene: Arc::new(scene),
            token: token().map_err(failed)?,
            port: bound,
        };
        let shared = Arc::new(Shared {
            site,
            stop: AtomicBool::new(false),
            open: Mutex::default(),
        });
        let listening = {
            let shared = shared.clone();
            let thread = thread::Builder::new().name("view".into());
            thread.spawn(move || listen(&listener, &shared))
        };
        Ok(Self {
            shared,
            listening: Some(listening.map_err(failed)?),
        })
    }

    /// Shows a part from now on, whose tileset is in this folder. The first mesh comes first: the others are placed
    /// beside it.
    ///
    /// # Errors
    /// If the folder cannot be read or has no valid tileset, or if nothing tells where it lies beside the first one.
    pub fn show(&self, part: Part, folder: &Path) -> Result<()> {
        self.shared.site.scene.show(part, folder)
    }

    /// An observer of the work on a part, which the page shows; it passes everything on to another one.
    #[must_use]
    pub fn observer(&self, part: Part, other: Arc<dyn Observer>) -> Arc<dyn Observer> {
        Arc::new(Watching {
            scene: self.shared.site.scene.clone(),
            part,
            other,
        })
    }

    /// Tells the page why there will be no more, and waits for a moment until it knows.
    pub fn fail(&self, why: &str) {
        let scene = &self.shared.site.scene;
        let since = Instant::now();
        if scene.fail(why) {
            while !scene.is_told() && since.elapsed() < FAREWELL {
                thread::sleep(LOOK);
            }
        }
    }

    /// The URL of the page, with the secret.
    #[must_use]
    pub fn url(&self) -> String {
        let Site { token, port, .. } = &self.shared.site;
        format!("http://127.0.0.1:{port}/{token}/")
    }

    /// The port.
    #[must_use]
    pub fn port(&self) -> u16 {
        self.shared.site.port
    }

    /// Ends the server and its connections.
    pub fn stop(self) {
        drop(self);
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::SeqCst);
        // The listener waits for a connection: this one.
        let woken = TcpStream::connect((Ipv4Addr::LOCALHOST, self.port())).is_ok();
        if let Some(listening) = self.listening.take().filter(|_| woken) {
            // A panic of that thread has been reported already.
            let _ = listening.join();
        }
        for stream in self.shared.open().values() {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }
}

/// Accepts connections, each with a thread of its own, until the server is to stop.
fn listen(listener: &TcpListener, shared: &Arc<Shared>) {
    for (number, stream) in (0..).zip(listener.incoming()) {
        if shared.stop.load(Ordering::SeqCst) {
            return;
        }
        let Ok(stream) = stream else {
            // Out of file descriptors, for instance: connections that end give some back.
            thread::sleep(std::time::Duration::from_millis(50));
            continue;
        };
        let Ok(known) = stream.try_clone() else {
            continue;
        };
        let mut open = shared.open();
        if open.len() >= CONNECTIONS {
            continue;
        }
        open.insert(number, known);
        drop(open);
        let thread = thread::Builder::new().stack_size(STACK);
        let mine = shared.clone();
        let spawned = thread.spawn(move || {
            // A browser that goes away is no error.
            let _ = mine.site.serve(stream);
            mine.open().remove(&number);
        });
        if spawned.is_err() {
            shared.open().remove(&number);
        }
    }
}

/// A secret of 128 random bits, in hexadecimal digits.
fn token() -> std::io::Result<String> {
    let mut bytes = [0; TOKEN];
    getrandom::fill(&mut bytes).map_err(|e| std::io::Error::other(e.to_string()))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
