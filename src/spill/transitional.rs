//! Transitional.
#![allow(missing_docs, clippy::missing_errors_doc)]
use super::{Shuffle, Table, Word};
use crate::error::Result;
use crate::workspace::Workspace;

pub type Sections<const N: usize> = Table<[u32; N]>;
pub type Exchange<const N: usize> = Shuffle<[u32; N]>;
pub type Record<const N: usize> = [u32; N];
pub type Layout<const N: usize> = [Word; N];
pub mod layouts {
    use super::{Layout, Word};
    pub const TRIANGLE: Layout<3> = [Word::Above; 3];
    pub const LABELLED: Layout<4> = [Word::Above; 4];
    pub const SENT: Layout<4> = [Word::Above; 4];
    pub const SENT_LABELLED: Layout<5> = [Word::Above; 5];
    pub const ORIENTED: Layout<3> = [Word::Above; 3];
}
impl<const N: usize> Table<[u32; N]> {
    pub fn with_layout(w: &Workspace, name: &str, count: usize, _: Layout<N>) -> Result<Self> {
        Self::create(w, name, count)
    }
    pub fn unpacked(w: &Workspace, name: &str, count: usize) -> Result<Self> {
        Self::create(w, name, count)
    }
    pub fn passing(w: &Workspace, name: &str, _: Layout<N>) -> Result<Self> {
        Self::temporary(w, name)
    }
    pub fn records(&self, section: usize) -> usize {
        self.rows(section)
    }
}
impl<const N: usize> Shuffle<[u32; N]> {
    pub fn packed(self, _: Layout<N>) -> Self {
        self
    }
    pub fn between(
        w: &Workspace,
        name: &str,
        buffer: u64,
        senders: usize,
        _: Layout<N>,
    ) -> Result<Self> {
        Self::between_units(w, name, buffer, senders)
    }
}
