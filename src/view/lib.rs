//! Showing a mesh in a browser: a server for this machine only, and a page that needs no server.
//!
//! Both show a folder with levels of detail (`tileset.json` and its tiles); the server also two meshes in one place, and
//! points beside them, and it is there before they are. The page itself is a part of the
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
mod frame;
mod html;
mod request;
mod scene;
mod server;
mod tileset;
mod watching;

pub use html::{Embedded, write_html};
pub use scene::Part;
pub use server::Server;
pub use tileset::{Place, check};
