//! The change at each vertex, as rows in order of the file.

use outcrop_disk::error::Result;
use outcrop_disk::spill::{LocalTable, Sorter, row};
use outcrop_disk::workspace::Workspace;

/// Vertices of a section of [`Changes`].
pub const ROWS: usize = 1 << 16;

/// Whether a vertex has changed, and whether the other surface is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum State {
    /// No significant change.
    Same = 0,
    /// A significant change.
    Changed = 1,
    /// Only this surface is here.
    Alone = 2,
    /// No triangle with an area uses the vertex.
    Unused = 3,
}

row! {
    /// The change at a vertex; rows sort by its number.
    pub struct ChangeRow {
        /// Number of the vertex in the file.
        index: u32,
        /// A [`State`] as a number.
        state: u32,
        /// The bits of two `f32`: change and uncertainty.
        change: [u32; 2],
        /// The bits of two `f64`: the area for which the vertex stands, and the volume that was gained or lost there.
        size: [u32; 4],
    }
    unpacked
}

impl ChangeRow {
    pub(super) fn of(state: State, change: [f64; 2], size: [f64; 2]) -> Self {
        Self {
            index: 0,
            state: state as u32,
            change: change.map(|x| (x as f32).to_bits()),
            size: bytemuck::cast(size),
        }
    }

    /// Change and uncertainty, in the unit of the files; NaN where only one surface is.
    #[must_use]
    pub fn changes(&self) -> [f32; 2] {
        self.change.map(f32::from_bits)
    }

    /// Whether the vertex has changed.
    #[must_use]
    pub fn state(&self) -> State {
        match self.state {
            0 => State::Same,
            1 => State::Changed,
            2 => State::Alone,
            _ => State::Unused,
        }
    }

    pub(super) fn sizes(&self) -> [f64; 2] {
        bytemuck::cast(self.size)
    }

    /// The direction of change: 0 none, 1 growth, 2 loss. Where only one surface is, the volume tells.
    pub(super) fn way(&self) -> u8 {
        let size = match self.state() {
            State::Changed => f64::from(self.changes()[0]),
            State::Alone => self.sizes()[1],
            State::Same | State::Unused => 0.0,
        };
        match size.partial_cmp(&0.0) {
            Some(std::cmp::Ordering::Greater) => 1,
            Some(std::cmp::Ordering::Less) => 2,
            _ => 0,
        }
    }
}

/// The change at all vertices, in order of the file: sections of [`ROWS`].
pub type Changes = LocalTable<ChangeRow>;

/// The rows in order, one for each vertex, in sections.
pub(super) fn sections(
    sorter: Sorter<ChangeRow>,
    vertices: u64,
    workspace: &Workspace,
) -> Result<Changes> {
    let rows = LocalTable::create(workspace, "change.sections")?;
    let _held = workspace.reserve("change: sections", (ROWS * size_of::<ChangeRow>()) as u64)?;
    let mut block = Vec::with_capacity(ROWS);
    let mut next = 0;
    let put = |row: ChangeRow, block: &mut Vec<ChangeRow>| {
        block.push(row);
        if block.len() == ROWS {
            rows.append(block)?;
            block.clear();
        }
        Ok(())
    };
    let unused = |index| ChangeRow {
        index,
        ..ChangeRow::of(State::Unused, [f64::NAN; 2], [0.0; 2])
    };
    sorter.finish(workspace)?.for_each(|row| {
        while next < row.index {
            put(unused(next), &mut block)?;
            next += 1;
        }
        next += 1;
        put(row, &mut block)
    })?;
    while u64::from(next) < vertices {
        put(unused(next), &mut block)?;
        next += 1;
    }
    if !block.is_empty() {
        rows.append(&block)?;
    }
    Ok(rows)
}
