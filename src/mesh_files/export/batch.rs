//! Records in batches.

/// Records encoded at a time.
const BATCH: usize = 1024;

/// Collects records and passes them on in batches.
pub struct Batch<T, F: FnMut(&[T])> {
    records: Vec<T>,
    put: F,
}

impl<T, F: FnMut(&[T])> Batch<T, F> {
    pub(super) fn new(put: F) -> Self {
        Self {
            records: Vec::with_capacity(BATCH),
            put,
        }
    }

    /// Adds a record.
    #[inline]
    pub fn push(&mut self, record: T) {
        self.records.push(record);
        if self.records.len() == BATCH {
            (self.put)(&self.records);
            self.records.clear();
        }
    }

    /// Passes on the remaining records.
    pub fn finish(mut self) {
        (self.put)(&self.records);
    }
}
