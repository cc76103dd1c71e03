//! The program against the reference, which is written from `docs/method.md` and slow: whole meshes
//! ([`pipeline`]), stitching, repair and export of arbitrary triples ([`stitch`]), and the exact side of a corner
//! ([`predicate`]); and the tests of the reference itself ([`own`]).

mod own;
mod pipeline;
mod predicate;
#[path = "../reference/mod.rs"]
mod reference;
mod stitch;
