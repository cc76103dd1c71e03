//! Rows on disk: tables of numbered sections, shuffles and the external sorter.
//!
//! A row is a struct of 32-bit words, compared lexicographically; its fields are known only to the
//! stage that writes it. Every part of a file carries a CRC-32 that is checked when it is read.

mod beside;
mod compress;
mod local;
mod pack;
mod release;
mod row;
mod runs;
mod shuffle;
mod sort;
mod sorter;
mod table;

pub use local::LocalTable;
pub use release::release;
pub use row::row;
pub use row::{Row, Word};
pub use shuffle::{Inbox, Shuffle};
pub use sort::sort;
pub use sorter::{Sorted, SortedRuns, Sorter};
pub use table::Table;
