//! How commands end.

use outcrop_disk::error::Error;

/// How a command ended that did not fail.
pub enum Ended {
    /// It is done, and a question is answered with yes.
    Yes,
    /// A question is answered with no.
    No,
    /// Something else has to be done before, as this text tells.
    TooEarly(String),
    /// The work of other tasks is damaged, as this error tells.
    Damaged(Error),
}
