//! The buffers of a sorter, and the thread that writes one of them.

use super::super::beside::Beside;
use super::super::runs::{FRAME, Run, RunWriter};
use crate::error::Result;
use crate::spill::Row;
use crate::workspace::memory::Reservation;

/// Sorted rows and the writer of their run.
type Job<R> = (Vec<R>, RunWriter<R>);

/// The run, and the buffer of its rows, which is empty now.
type Written<R> = Result<(Vec<R>, Run<R>)>;

fn write<R: Row>((mut rows, mut writer): Job<R>) -> Written<R> {
    for frame in rows.chunks(FRAME) {
        writer.frame(frame)?;
    }
    rows.clear();
    Ok((rows, writer.finish()?))
}

#[derive(Debug)]
pub(super) struct State<R: Row> {
    pub buffer: Vec<R>,
    /// Most rows in the buffer.
    pub capacity: usize,
    pub runs: Vec<Run<R>>,
    pub made: usize,
    /// Largest number of rows that were in the buffer; memory beyond them was never touched.
    touched: usize,
    /// Number of rows that are written beside.
    beside: usize,
    /// Writes a half of the memory while rows are added to the other half.
    writer: Option<Beside<Job<R>, Written<R>>>,
    /// The reservation to which the usage of the buffers is reported.
    pub held: Option<Reservation>,
}

impl<R: Row> State<R> {
    pub fn new(capacity: usize) -> Self {
        Self {
            buffer: Vec::new(),
            capacity,
            runs: Vec::new(),
            made: 0,
            touched: 0,
            beside: 0,
            writer: None,
            held: None,
        }
    }

    pub fn report_usage(&mut self, bytes: u64) {
        if let Some(held) = &mut self.held {
            held.set_held(bytes);
        }
    }

    /// Reports the usage of `rows` rows, besides those that are written.
    fn report_rows(&mut self, rows: usize) {
        self.report_usage(((self.beside + rows) * size_of::<R>()) as u64);
    }

    /// Adds the rows that there is room for; returns the others.
    pub fn add<'r>(&mut self, rows: &'r [R]) -> &'r [R] {
        let room = self.capacity - self.buffer.len();
        let (now, later) = rows.split_at(room.min(rows.len()));
        let wanted = self.buffer.len() + now.len();
        if wanted > self.buffer.capacity() {
            // Doubles the buffer, within the reservation.
            let target = wanted.max(2 * self.buffer.len()).min(self.capacity);
            // The old buffer and its copy.
            let both = 2 * self.buffer.len();
            self.buffer.reserve_exact(target - self.buffer.len());
            self.report_rows(both);
        }
        self.buffer.extend_from_slice(now);
        if self.buffer.len() > self.touched {
            self.touched = self.buffer.len();
            self.report_rows(self.touched);
        }
        later
    }

    /// Divides the memory of the empty buffer into two halves, of which one is filled while the other is
    /// written.
    pub fn divide(&mut self) {
        if self.writer.is_none() {
            self.writer = Some(Beside::start(write));
            self.capacity = (self.capacity / 2).max(1);
            self.buffer = Vec::with_capacity(self.capacity);
            self.touched = 0;
        }
    }

    /// Writes the sorted rows of the buffer, beside if the memory is divided.
    pub fn write(&mut self, to: RunWriter<R>) -> Result<()> {
        let rows = std::mem::take(&mut self.buffer);
        let Some(writer) = &mut self.writer else {
            let (empty, run) = write((rows, to))?;
            self.buffer = empty;
            self.runs.push(run);
            return Ok(());
        };
        let beside = rows.len();
        let before = writer.begin((rows, to)).transpose()?;
        self.beside = beside;
        match before {
            Some((empty, run)) => {
                (self.buffer, self.touched) = (empty, self.capacity);
                self.runs.push(run);
            }
            None => (self.buffer, self.touched) = (Vec::with_capacity(self.capacity), 0),
        }
        self.report_rows(self.touched);
        Ok(())
    }

    /// Waits until all runs are written.
    pub fn settle(&mut self) -> Result<()> {
        let last = self.writer.as_mut().and_then(Beside::end);
        if let Some((_, run)) = last.transpose()? {
            self.runs.push(run);
        }
        self.beside = 0;
        Ok(())
    }
}
