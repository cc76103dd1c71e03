//! The house: the source code and the documents themselves.

mod architecture;
mod documents;
mod source;
