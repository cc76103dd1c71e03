//! The points of the nodes.

use super::super::columns::Column;
use super::super::input::Input;
use super::super::las::Laz;
use super::super::native::Native;
use super::super::spool::{Sink, SourceWriter, sink_bytes};
use super::hierarchy::Node;
use super::info::{Data, Info, agrees};
use super::rows::Rows;
use outcrop_disk::error::Result;

/// Bytes of a file besides its rows: the header and records of LAZ.
const HEAD: u64 = 256 << 10;

/// What reads a node.
pub(super) enum Kind {
    /// LAZ, with the header of the root's file.
    Laz(Box<Laz>),
    /// Rows of numbers, compressed or not.
    Rows(Box<Rows>),
}

impl Kind {
    pub(super) fn of(input: &Input, info: &Info) -> Result<Self> {
        match info.data {
            Data::Laszip => {
                let name = name(info, "0-0-0-0");
                let most = HEAD + info.row() as u64 * info.points.min(1 << 20);
                let bytes = input.beside(&name, most)?;
                let root = Input::of_memory(input.path.with_file_name(&name), bytes);
                Ok(Self::Laz(Box::new(Laz::open(&root)?)))
            }
            Data::Binary | Data::Zstandard => Rows::of(input, info).map(Box::new).map(Self::Rows),
        }
    }

    pub(super) fn native(&self) -> Native {
        match self {
            Self::Laz(laz) => laz.native(),
            Self::Rows(rows) => rows.native,
        }
    }

    pub(super) fn knows_classes(&self) -> bool {
        matches!(self, Self::Laz(_))
    }

    pub(super) fn columns(&self) -> Vec<Column> {
        match self {
            Self::Laz(laz) => laz.columns(),
            Self::Rows(rows) => rows.columns(),
        }
    }

    /// A box in numbers of the spool's type.
    pub(super) fn in_native(&self, [low, high]: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
        let Native::Las { scale, offset } = self.native() else {
            return [low, high];
        };
        let of = |c: f64, axis: usize| {
            let steps = ((c - offset[axis]) / scale[axis]).round();
            steps.clamp(i32::MIN.into(), i32::MAX.into())
        };
        let ends = [0, 1, 2].map(|axis| {
            let (a, b) = (of(low[axis], axis), of(high[axis], axis));
            [a.min(b), a.max(b)]
        });
        [ends.map(|e| e[0]), ends.map(|e| e[1])]
    }

    /// Reads nodes on all threads.
    pub(super) fn read(
        &self,
        input: &Input,
        info: &Info,
        nodes: &[Node],
        target: &SourceWriter<'_>,
    ) -> Result<()> {
        let most = |node: &Node| HEAD + node.points * info.row() as u64;
        let names = nodes
            .iter()
            .map(|node| (name(info, &node.key.name()), most(node)));
        let files = input.expect_beside(names.collect(), target.workspace)?;
        match self {
            Self::Laz(laz) => {
                let memory = |unit: usize| most(&nodes[unit]) + Laz::MEMORY + sink_bytes::<i32>();
                let work = |unit: usize, sink: &mut Sink<'_, i32>| {
                    let tile = Input::of_memory(files.path(unit), files.take(unit)?);
                    let points = laz.read_all(&tile, target, sink)?;
                    agrees(input, &files.name(unit), points, nodes[unit].points)
                };
                target.units("EPT nodes", nodes.len(), memory, work)
            }
            Self::Rows(rows) => match rows.native {
                Native::Las { .. } => rows.read(input, nodes, &files, target, |c| c as i32),
                Native::F32 => rows.read(input, nodes, &files, target, |c| c as f32),
                Native::F64 => rows.read(input, nodes, &files, target, |c| c),
            },
        }
    }
}

/// The name of a node's file.
fn name(info: &Info, key: &str) -> String {
    format!("ept-data/{key}.{}", info.data.extension())
}
