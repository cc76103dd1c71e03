//! Places of defects: the vertices with the lowest numbers.

use serde::Serialize;

/// Most vertices of each kind.
pub(super) const MOST: usize = 256;

/// Kinds of defects that have a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A triangle with two equal corners.
    Degenerate,
    /// A triangle with the corners of another one.
    Repeated,
    /// An edge with more than two triangles.
    NonManifold,
    /// An edge whose two triangles run in the same direction.
    Inconsistent,
    /// A vertex whose triangles form several fans.
    Pinched,
}

/// All kinds.
pub(super) const KINDS: [Kind; 5] = [
    Kind::Degenerate,
    Kind::Repeated,
    Kind::NonManifold,
    Kind::Inconsistent,
    Kind::Pinched,
];

impl Kind {
    /// The defect, as in the verdict.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Degenerate => "degenerate triangle",
            Self::Repeated => "repeated triangle",
            Self::NonManifold => "non-manifold edge",
            Self::Inconsistent => "inconsistently oriented edge",
            Self::Pinched => "pinched vertex",
        }
    }
}

/// For each kind the lowest vertices.
#[derive(Debug, Default)]
pub(super) struct Places(pub(super) [Vec<u32>; KINDS.len()]);

impl Places {
    /// Notes a vertex. Those of one kind come in ascending order, or are merged later.
    pub(super) fn note(&mut self, kind: Kind, vertex: u32) {
        let list = &mut self.0[kind as usize];
        if list.len() < MOST && list.last() != Some(&vertex) {
            list.push(vertex);
        }
    }

    /// Keeps the lowest of both.
    pub(super) fn with(mut self, other: Self) -> Self {
        for (own, more) in self.0.iter_mut().zip(other.0) {
            own.extend(more);
            own.sort_unstable();
            own.dedup();
            own.truncate(MOST);
        }
        self
    }
}
