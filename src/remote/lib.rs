//! Files that lie behind a URL: on a web server (`https://`, `http://`), or in a store of objects (`s3://`, `gs://`,
//! `az://`). They are read by ranges, as a local file is read at positions.
//!
//! A [`Location`] names one, an [`Object`] reads it, [`Beside`] reads small files in its folder, and [`list`] finds those
//! below a prefix. A [`Bucket`] takes files, large ones in parts, and [`Scratch`] has the files of a run. Requests
//! block the thread that makes them; there is no runtime beside. Credentials come from the environment and the files
//! that the stores' own tools use (`stores`), and appear in no name, message or error.

mod agent;
mod ahead;
mod answer;
mod aws;
mod beside;
mod errors;
mod list;
mod location;
mod metadata;
mod object;
mod pieces;
mod scratch;
mod stores;
#[cfg(test)]
mod tests;
mod unfinished;
mod upload;
mod wait;
mod whole;

pub use agent::Counts;
pub use ahead::Room;
pub use beside::{Beside, Expected};
pub use list::{Listed, list};
pub use location::Location;
pub use object::{Object, Version};
pub use pieces::GAP;
pub use scratch::{Found, Scratch};
pub use upload::{Bucket, Existing};
pub use whole::Whole;
