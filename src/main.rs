//! Command line of `outcrop`.
fn main() {}
