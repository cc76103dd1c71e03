//! A unit of work: the handle with which work reads, writes and sends, holds memory, and reports progress.

use super::Workspace;
use super::memory::{Holding, Usage};
use super::place::Put;
use std::cell::{Cell, RefCell};
use std::ops::Deref;

/// A unit of work. It belongs to one thread, which writes to segments of its own.
pub struct Unit<'w> {
    workspace: &'w Workspace,
    number: usize,
    worker: usize,
    usage: Usage,
    notes: RefCell<Vec<Put>>,
    items: Cell<u64>,
}

/// The parts of files that a unit wrote, and its progress.
#[derive(Debug)]
pub(super) struct Notes {
    pub puts: Vec<Put>,
    pub items: u64,
}

impl<'w> Unit<'w> {
    pub(super) fn new(workspace: &'w Workspace, number: usize, usage: Usage) -> Self {
        Self {
            workspace,
            number,
            worker: workspace.files.worker(),
            usage,
            notes: RefCell::default(),
            items: Cell::new(0),
        }
    }

    /// Its number within its step.
    #[must_use]
    pub fn number(&self) -> usize {
        self.number
    }

    /// The number of the thread that does the unit.
    #[must_use]
    pub fn worker(&self) -> usize {
        self.worker
    }

    /// Reports that the unit holds `bytes` as long as the result lives.
    pub fn hold(&self, bytes: u64) -> Holding<'_> {
        self.usage.hold(bytes)
    }

    /// Reduces the reservation of the unit by `bytes`, once its sizes are known.
    pub fn give_back(&self, bytes: u64) {
        self.usage.give_back(bytes);
    }

    /// Reports progress to the observer. A unit that is found finished when a run is resumed reports the same
    /// progress again.
    pub fn advance(&self, items: u64) {
        self.items.set(self.items.get() + items);
        self.workspace.observer.advance(items);
    }

    /// Notes a part of a file that the unit wrote and that a later attempt at the run may need.
    pub fn note(&self, put: Put) {
        if self.workspace.is_resumable() {
            self.notes.borrow_mut().push(put);
        }
    }

    /// Ends the unit.
    pub(super) fn end(self) -> (Notes, Usage) {
        let notes = Notes {
            puts: self.notes.into_inner(),
            items: self.items.get(),
        };
        (notes, self.usage)
    }
}

impl std::fmt::Debug for Unit<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "unit {} on thread {}", self.number, self.worker)
    }
}

impl Deref for Unit<'_> {
    type Target = Workspace;

    fn deref(&self) -> &Workspace {
        self.workspace
    }
}
