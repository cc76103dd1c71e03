//! Mesh files: the finished mesh as a whole or in squares, in every format.

pub mod cut;
pub mod export;
