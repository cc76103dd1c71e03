//! Showing a mesh in a browser: a server for this machine only, and a page that needs no server.
//!
//! Both show a folder with levels of detail (`tileset.json` and its tiles). The page itself is a part of the
//! program (`tools/viewer`); nothing is fetched from anywhere else.
//!
//! ```no_run
//! use outcrop_view::Server;
//!
//! let server = Server::start("mesh-tiles".as_ref(), None)?;
//! println!("open {}", server.url());
//! // Later; dropping it does the same.
//! server.stop();
//! # Ok::<(), outcrop_disk::Error>(())
//! ```

mod assets;
mod connection;
mod folder;
mod html;
mod request;
mod server;
mod tileset;

pub use html::{Embedded, write_html};
pub use server::Server;
