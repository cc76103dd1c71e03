//! Pages for people: a report, or a description, as HTML in one file. A page has its pictures and its style inside,
//! needs no script, and fetches nothing.
//!
//! These functions only put into words and pictures what their arguments have.

mod advice;
mod charts;
mod report;
mod sheet;
mod words;

pub use report::report;
