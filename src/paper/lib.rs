//! What the paper's cells need, on the integer lattice of `outcrop-geom`: planes, exact predicates and clipped cells;
//! the vector kernels of the inner loops; and the constants of the method.

pub mod clip;
pub mod kernels;
pub mod method;
pub mod plane;
pub mod predicate;
