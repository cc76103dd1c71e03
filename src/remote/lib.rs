//! Files that lie behind a URL: on a web server (`https://`, `http://`), or in a store of objects (`s3://`, `gs://`,
//! `az://`). They are read by ranges, as a local file is read at positions.
//!
//! A [`Location`] names one, an [`Object`] reads it, [`Beside`] reads small files in its folder, and [`list`] finds those
//! below a prefix. Requests block the thread
//! that makes them; there is no runtime beside. Credentials come from the environment and the files that the
//! stores' own tools use (`stores`), and appear in no name, message or error.

mod agent;
mod ahead;
mod answer;
mod aws;
mod beside;
mod errors;
mod list;
mod location;
mod object;
mod stores;
#[cfg(test)]
mod tests;
mod wait;
mod whole;

pub use agent::Counts;
pub use beside::{Beside, Expected};
pub use list::{Listed, list};
pub use location::Location;
pub use object::Object;
pub use whole::Whole;
