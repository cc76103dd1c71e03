//! Vertices, edges and normals that cells share. Cells tell the blocks of vertices what they have; the
//! blocks tell the cells who else has it.

use super::cells::Cells;
use super::columns::octahedral;
use super::intake::{BLOCK, Intake, Stored};
use super::node::{Bounds, INNER, Node, open_edges};
use super::rounding::common;
use super::rows::{
    CellEdge, CellTriangle, CellVertex, PartNormal, SeamEdge, SharedVertex, WholeNormal,
};
use super::tree::common_depth;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Shuffle};
use outcrop_disk::workspace::{Unit, Workspace};

/// Bytes of memory for a triangle of a cell while its node is made.
const EACH: u64 = 220;

/// Bytes of memory for a triangle of a cell while its vertices are listed.
const SHARE_EACH: u64 = 96;

/// Receives what the blocks tell the cells.
pub(super) struct Shared<'a> {
    intake: &'a Intake,
    cells: &'a Cells,
    /// The low bits of positions that each cell rounds away; none without any.
    rounding: &'a [u8],
    vertices: Inbox<SharedVertex>,
    /// The seams and the normals, once they are known.
    known: Option<(Inbox<SeamEdge>, Inbox<WholeNormal>)>,
    /// The bounds of the cells' vertices.
    pub bounds: Vec<Bounds>,
}

/// The names of all shuffles, in the order in which they are made.
const VERTICES: &str = "levels.cell vertices";
const SHARED: &str = "levels.shared vertices";
const EDGES: &str = "levels.cell edges";
const SEAMS: &str = "levels.seam edges";
const PARTS: &str = "levels.part normals";
const WHOLES: &str = "levels.whole normals";

/// Bytes of memory for the node of a cell.
pub(super) fn bytes(intake: &Intake, triangles: u32) -> u64 {
    let values = 8 * intake.columns.words() as u64;
    u64::from(triangles) * (EACH + values) + 2 * intake.part_bytes() + (1 << 20)
}

/// The numbers of the vertices of a cell, ascending, and its triangles as indices in that list.
pub(super) fn local(rows: &[CellTriangle]) -> (Vec<u32>, Vec<[u32; 3]>) {
    let mut corners: Vec<u64> = Vec::with_capacity(3 * rows.len());
    for (number, row) in rows.iter().enumerate() {
        let numbered = row.corners.iter().zip(3 * number..);
        corners.extend(numbered.map(|(vertex, at)| u64::from(*vertex) << 32 | at as u64));
    }
    radsort(&mut corners);
    let (mut ids, mut triangles) = (Vec::new(), vec![[0; 3]; rows.len()]);
    for corner in corners {
        let (id, at) = ((corner >> 32) as u32, corner as u32 as usize);
        if ids.last() != Some(&id) {
            ids.push(id);
        }
        triangles[at / 3][at % 3] = (ids.len() - 1) as u32;
    }
    (ids, triangles)
}

/// Sorts numbers by their upper halves, stably, if the lower halves ascend already.
fn radsort(all: &mut Vec<u64>) {
    let mut other = vec![0; all.len()];
    let changing = all
        .iter()
        .fold((u64::MAX, 0), |(and, or), x| (and & x, or | x));
    for shift in [32, 43, 54] {
        let digit = |x: u64| (x >> shift) as usize & 0x7ff;
        // A digit that all have in common needs no pass.
        if digit(changing.0) == digit(changing.1) {
            continue;
        }
        let mut starts = [0usize; 2049];
        all.iter().for_each(|x| starts[digit(*x) + 1] += 1);
        (0..2048).for_each(|d| starts[d + 1] += starts[d]);
        for &x in all.iter() {
            other[starts[digit(x)]] = x;
            starts[digit(x)] += 1;
        }
        std::mem::swap(all, &mut other);
    }
}

/// The vertices of cells go to their blocks; the blocks tell which have several cells, with the word that `tell`
/// makes of the cells of a vertex. `names` are those of the two shuffles; `ending` ends the names of the steps.
pub(super) fn share_vertices<C: Stored + Sync>(
    intake: &Intake<C>,
    cells: &Cells,
    (names, ending): ([&str; 2], &str),
    tell: impl Fn(&[CellVertex]) -> u32 + Sync,
    workspace: &Workspace,
) -> Result<()> {
    let (list, sent) = (&cells.cells, Shuffle::<CellVertex>::new(names[0]));
    let bytes_of = |n: usize| u64::from(list[n].triangles) * SHARE_EACH + (1 << 20);
    let work = |unit: &Unit<'_>| {
        let cell = unit.number();
        let mut ids = Vec::new();
        for row in cells.table.get(unit, cell)? {
            ids.extend_from_slice(&row.corners);
        }
        let mut all: Vec<u64> = ids.iter().map(|id| u64::from(*id) << 32).collect();
        radsort(&mut all);
        all.dedup();
        let rows = all
            .iter()
            .map(|id| (id >> 32) as u32)
            .map(|vertex| CellVertex {
                block: vertex / BLOCK as u32,
                vertex,
                cell: cell as u32,
            });
        unit.advance(u64::from(list[cell].triangles));
        sent.send(unit, cell, rows.collect())
    };
    workspace.units(
        (format!("vertices of cells{ending}"), "levels: cells"),
        list.len(),
        bytes_of,
        work,
        |_, ()| Ok(()),
    )?;
    let inbox = sent.open(workspace, intake.blocks())?;
    let shared = Shuffle::<SharedVertex>::new(names[1]);
    let bytes_of = |block: usize| 48 * inbox.rows(block) as u64 + (1 << 20);
    let work = |unit: &Unit<'_>| {
        let rows = inbox.get(unit, unit.number())?;
        let mut told = Vec::new();
        for same in rows.chunk_by(|a, b| a.vertex == b.vertex) {
            if same.len() < 2 {
                continue;
            }
            let depth = tell(same);
            told.extend(same.iter().map(|row| SharedVertex {
                cell: row.cell,
                vertex: row.vertex,
                depth,
            }));
        }
        shared.send(unit, unit.number(), told)
    };
    let name = (format!("shared vertices{ending}"), "levels: blocks");
    workspace.units(name, intake.blocks(), bytes_of, work, |_, ()| Ok(()))?;
    sent.release(workspace)
}

/// The edges between shared vertices, and the parts of their normals, go to the blocks; these tell which edges
/// have several cells, and the normals.
fn share_edges(shared: &Shared<'_>, workspace: &Workspace) -> Result<Vec<Bounds>> {
    let (intake, list) = (shared.intake, &shared.cells.cells);
    let edges = Shuffle::<CellEdge>::new(EDGES);
    let parts = Shuffle::<PartNormal>::new(PARTS);
    let work = |unit: &Unit<'_>| {
        let cell = unit.number() as u32;
        let (node, sums) = shared.vertices_of(unit, cell as usize)?;
        let block = |id: u32| id / BLOCK as u32;
        let own: Vec<u32> = (0..node.ids.len() as u32)
            .filter(|v| node.depths[*v as usize] != INNER)
            .collect();
        let normals = own.iter().filter(|_| !intake.columns.has_normals());
        let normals = normals.map(|&v| PartNormal {
            block: block(node.ids[v as usize]),
            vertex: node.ids[v as usize],
            cell,
            sum: sums[v as usize].map(f32::to_bits),
        });
        parts.send(unit, unit.number(), normals.collect())?;
        let inner = |v: u32| node.depths[v as usize] == INNER;
        let mut ends = Vec::new();
        for [a, b, c] in node.triangles.iter().copied() {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                if a != b && !inner(a) && !inner(b) {
                    ends.push([a, b].map(|v| node.ids[v as usize]));
                }
            }
        }
        ends.iter_mut().for_each(|ends| ends.sort_unstable());
        ends.sort_unstable();
        let rows = ends.chunk_by(|a, b| a == b).map(|same| CellEdge {
            block: block(same[0][0]),
            ends: same[0],
            cell,
            triangles: same.len() as u32,
        });
        unit.advance(node.triangles.len() as u64);
        edges.send(unit, unit.number(), rows.collect())?;
        // As they are drawn.
        Ok(node.rounded().fold(Bounds::EMPTY, Bounds::with))
    };
    let bytes_of = |n: usize| bytes(intake, list[n].triangles);
    let mut bounds = vec![Bounds::EMPTY; list.len()];
    let name = ("edges of cells", "levels: cells");
    workspace.units(name, list.len(), bytes_of, work, |cell, found| {
        bounds[cell] = found;
        Ok(())
    })?;
    let (edges_in, parts_in) = (
        edges.open(workspace, intake.blocks())?,
        parts.open(workspace, intake.blocks())?,
    );
    let (seams, wholes) = (
        Shuffle::<SeamEdge>::new(SEAMS),
        Shuffle::<WholeNormal>::new(WHOLES),
    );
    let work = |unit: &Unit<'_>| {
        let mut told = Vec::new();
        for same in edges_in
            .get(unit, unit.number())?
            .chunk_by(|a, b| a.ends == b.ends)
        {
            if same.len() > 1 {
                let to = same.iter().map(|row| row.cell);
                told.extend(to.map(|cell| SeamEdge {
                    cell,
                    ends: same[0].ends,
                }));
            }
        }
        seams.send(unit, unit.number(), told)?;
        let mut told = Vec::new();
        for same in parts_in
            .get(unit, unit.number())?
            .chunk_by(|a, b| a.vertex == b.vertex)
        {
            let mut sum = [0.0; 3];
            for row in same {
                (0..3).for_each(|axis| sum[axis] += f64::from(f32::from_bits(row.sum[axis])));
            }
            let [x, y] = octahedral(sum).map(i8::cast_unsigned);
            told.extend(same.iter().map(|row| WholeNormal {
                cell: row.cell,
                vertex: row.vertex,
                normal: u32::from(x) | u32::from(y) << 8,
            }));
        }
        wholes.send(unit, unit.number(), told)
    };
    let bytes_of =
        |block: usize| 80 * (edges_in.rows(block) + parts_in.rows(block)) as u64 + (1 << 20);
    workspace.units(
        ("seams", "levels: blocks"),
        intake.blocks(),
        bytes_of,
        work,
        |_, ()| Ok(()),
    )?;
    edges.release(workspace)?;
    parts.release(workspace)?;
    Ok(bounds)
}

impl<'a> Shared<'a> {
    /// Finds what the cells have in common. They round away so many low bits of positions, if there are any.
    pub fn find(
        intake: &'a Intake,
        cells: &'a Cells,
        rounding: &'a [u8],
        workspace: &Workspace,
    ) -> Result<Self> {
        let depth = |same: &[CellVertex]| {
            let ends = [same[0], same[same.len() - 1]];
            let [a, b] = ends.map(|row| &cells.cells[row.cell as usize]);
            let bits = match rounding.is_empty() {
                true => 0,
                false => common(same.iter().map(|row| rounding[row.cell as usize])),
            };
            common_depth(a, b) | u32::from(bits) << 8
        };
        share_vertices(intake, cells, ([VERTICES, SHARED], ""), depth, workspace)?;
        let count = cells.cells.len();
        let mut shared = Self {
            intake,
            cells,
            rounding,
            vertices: Shuffle::new(SHARED).open(workspace, count)?,
            known: None,
            bounds: Vec::new(),
        };
        shared.bounds = share_edges(&shared, workspace)?;
        let seams = Shuffle::new(SEAMS).open(workspace, count)?;
        let normals = Shuffle::new(WHOLES).open(workspace, count)?;
        shared.known = Some((seams, normals));
        Ok(shared)
    }

    /// The node of a cell without seams, and the sums of normals, if the file has none.
    fn vertices_of(&self, unit: &Unit<'_>, cell: usize) -> Result<(Node, Vec<[f32; 3]>)> {
        let rows = self.cells.table.get(unit, cell)?;
        let (ids, triangles) = local(&rows);
        drop(rows);
        let mut node = Node {
            depths: vec![INNER; ids.len()],
            normals: vec![[0, 0]; ids.len()],
            triangles,
            ..Node::default()
        };
        let all = ids.iter().copied();
        let columns = &self.intake.columns;
        self.intake.vertices(unit, all, |vertex| {
            let values = &mut node.values;
            let normal = columns.load(vertex.stored, |word| values.push(word));
            if let Some(normal) = normal {
                node.normals[node.points.len()] = normal;
            }
            node.points.push(vertex.point);
        })?;
        node.ids = ids;
        let mut at = 0;
        let own = self.rounding.get(cell).copied().unwrap_or(0);
        node.rounding = vec![own; node.ids.len()];
        for row in self.vertices.get(unit, cell)? {
            at += node.ids[at..].partition_point(|id| *id < row.vertex);
            node.depths[at] = row.depth as u8;
            node.rounding[at] = (row.depth >> 8) as u8;
        }
        let sums = match columns.has_normals() {
            true => Vec::new(),
            false => sums(&node),
        };
        Ok((node, sums))
    }

    /// The node of a cell.
    pub fn node(&self, unit: &Unit<'_>, cell: usize) -> Result<Node> {
        let (mut node, sums) = self.vertices_of(unit, cell)?;
        for (normal, sum) in node.normals.iter_mut().zip(&sums) {
            *normal = octahedral(sum.map(f64::from));
        }
        let Some((edges, normals)) = &self.known else {
            return Ok(node);
        };
        let mut at = 0;
        for row in normals.get(unit, cell)? {
            at += node.ids[at..].partition_point(|id| *id < row.vertex);
            node.normals[at] = [row.normal as u8, (row.normal >> 8) as u8].map(u8::cast_signed);
        }
        let index = |id: u32| node.ids.partition_point(|other| *other < id) as u32;
        let seams = edges.get(unit, cell)?;
        node.seams = seams.iter().map(|row| row.ends.map(index)).collect();
        Ok(node)
    }

    /// Deletes the files.
    pub fn release(self, workspace: &Workspace) -> Result<()> {
        drop((self.vertices, self.known));
        [SHARED, SEAMS, WHOLES]
            .iter()
            .try_for_each(|name| workspace.files.release(name))
    }
}

/// Edges of a node that have one triangle in the whole mesh, in its direction.
pub(super) fn boundary(node: &Node) -> Vec<[u32; 2]> {
    let mut open = open_edges(node.ids.len(), &node.triangles);
    open.retain(|[a, b]| node.seams.binary_search(&[*a.min(b), *a.max(b)]).is_err());
    open
}

/// Sums of the normals of the triangles around each vertex, weighted by area.
fn sums(node: &Node) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0f32; 3]; node.ids.len()];
    for triangle in &node.triangles {
        let [a, b, c] = triangle.map(|v| node.points[v as usize].map(f64::from));
        let [u, v]: [[f64; 3]; 2] = [b, c].map(|p| std::array::from_fn(|k| p[k] - a[k]));
        let normal = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        for corner in triangle {
            let sum = &mut sums[*corner as usize];
            (0..3).for_each(|axis| sum[axis] += normal[axis] as f32);
        }
    }
    sums
}
