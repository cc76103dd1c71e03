//! Pictures and histograms, in bounded memory, whatever they are of.

pub mod histogram;
#[cfg(feature = "pictures")]
pub mod picture;
