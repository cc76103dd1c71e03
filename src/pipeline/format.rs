//! The format of scratch files.

/// A checksum of all rows, all results and all names of steps that scratch folders hold, as the source defines them: a
/// program with another one does not resume a run. `tests/house/architecture/scratch.rs` compares it, and writes it with
/// `OUTCROP_WRITE=1`.
pub(super) const FORMAT: &str = "19ff7bb3";
