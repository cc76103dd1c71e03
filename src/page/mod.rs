//! Pages for people: a report, or a description, as HTML in one file. A page has its pictures and its style inside,
//! needs no script, and fetches nothing.
//!
//! These functions only put into words and pictures what their arguments have.

mod advice;
mod charts;
mod cloud;
mod comparison;
mod report;
mod sheet;
mod verdict;
mod words;

pub use cloud::cloud;
pub use comparison::comparison;
pub use report::report;
pub use verdict::verdict;
