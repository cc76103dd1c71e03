//! The points of the nodes.

use super::super::input::Input;
use super::super::las::Laz;
use super::super::remote::Version;
use super::hierarchy::Node;
use super::info::{Data, Info, agrees};
use super::pins::Pinned;
use super::rows::Rows;
use outcrop_disk::error::Result;
use outcrop_points::columns::Column;
use outcrop_points::native::Native;
use outcrop_points::spool::{Sink, SourceWriter, sink_bytes};

/// Bytes of a file besides its rows: the header and records of LAZ.
const HEAD: u64 = 256 << 10;

/// The root's file: its size in bytes, and its version on a server.
pub(super) struct Root {
    bytes: u64,
    version: Option<Pinned>,
}

/// What reads a node.
pub(super) enum Kind {
    /// LAZ, with the header of the root's file.
    Laz(Box<Laz>, Root),
    /// Rows of numbers, compressed or not.
    Rows(Box<Rows>),
}

impl Kind {
    pub(super) fn of(input: &Input, info: &Info) -> Result<Self> {
        match info.data {
            Data::Laszip => {
                let (name, bytes, version) = root(input, info)?;
                let root = Input::of_memory(input.path.with_file_name(&name), bytes);
                let about = Root {
                    bytes: root.bytes,
                    version: version.map(|version| (name, version)),
                };
                Ok(Self::Laz(Box::new(Laz::open(&root)?), about))
            }
            Data::Binary | Data::Zstandard => Rows::of(input, info).map(Box::new).map(Self::Rows),
        }
    }

    pub(super) fn native(&self) -> Native {
        match self {
            Self::Laz(laz, _) => laz.native(),
            Self::Rows(rows) => rows.native,
        }
    }

    pub(super) fn knows_classes(&self) -> bool {
        matches!(self, Self::Laz(..))
    }

    pub(super) fn columns(&self) -> Vec<Column> {
        match self {
            Self::Laz(laz, _) => laz.columns(),
            Self::Rows(rows) => rows.columns(),
        }
    }

    /// Bytes and points of the root, for an estimate of the others; of rows that are not compressed, those of a point.
    pub(super) fn sample(&self, input: &Input, info: &Info) -> Result<(u64, u64)> {
        match self {
            Self::Laz(laz, root) => Ok((root.bytes, laz.points())),
            Self::Rows(_) if info.data == Data::Binary => Ok((info.row() as u64, 1)),
            Self::Rows(rows) => {
                let (name, bytes, _) = root(input, info)?;
                Ok((bytes.len() as u64, rows.count(input, &name, &bytes)?))
            }
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

    /// The file of the root, if it was read on a server to open the set.
    pub(super) fn root(&self) -> Option<&Pinned> {
        match self {
            Self::Laz(_, root) => root.version.as_ref(),
            Self::Rows(_) => None,
        }
    }

    /// Reads nodes on all threads. Those on a server must not have changed after `begun`, in seconds since 1970.
    pub(super) fn read(
        &self,
        input: &Input,
        info: &Info,
        (nodes, begun): (&[Node], Option<i64>),
        target: &SourceWriter<'_>,
    ) -> Result<()> {
        let most = |node: &Node| HEAD + node.points * info.row() as u64;
        let names = nodes
            .iter()
            .map(|node| (name(info, &node.key.name()), most(node)));
        let files = input.expect_beside(names.collect(), begun, target.workspace)?;
        match self {
            Self::Laz(laz, _) => {
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

/// The name of the root's file, its content, and its version on a server.
fn root(input: &Input, info: &Info) -> Result<(String, Vec<u8>, Option<Version>)> {
    let name = name(info, "0-0-0-0");
    let most = HEAD + info.row() as u64 * info.points.min(1 << 20);
    let (bytes, version) = input.beside(&name, most)?;
    Ok((name, bytes, version))
}

/// The name of a node's file.
fn name(info: &Info, key: &str) -> String {
    format!("ept-data/{key}.{}", info.data.extension())
}
