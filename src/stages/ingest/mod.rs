//! Formats in, lattice positions out.
