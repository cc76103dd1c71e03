//! Records on disk: sections written in any order, and the external sorter.
//!
//! Every record is an array of `N` 32-bit words, compared lexicographically; what the words mean
//! is known only to the stage that writes them. Every part of a file carries a CRC-32 that is
//! checked when it is read.

mod exchange;
mod pack;
mod runs;
mod sections;
mod sort;
mod sorter;

pub use exchange::Exchange;
pub use pack::{Layout, Word, layouts};
pub use sections::Sections;
pub use sorter::{Sorted, Sorter};

/// A record of `N` words.
pub type Record<const N: usize> = [u32; N];
