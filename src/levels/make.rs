//! Makes the tiles: leaves from the cells, every other tile from its children.

use super::cells::Cells;
use super::distance::measure;
use super::glb;
use super::intake::Intake;
use super::lossy;
use super::nearest;
use super::node::{Bounds, INNER, Node};
use super::order;
use super::rows::LevelWord;
use super::shared::{Shared, boundary, bytes};
use super::simplify::{self, Manner, Surface};
use super::tree::TreeNode;
use super::writer::Grids;
use outcrop_disk::error::Result;
use outcrop_disk::spill::Table;
use outcrop_disk::workspace::{Unit, Workspace};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

/// Most bytes of the root.
pub(super) const ROOT_BYTES: usize = 1_000_000;

/// Fewest and most triangles for which a tile is simplified, if it can be: parts of the most that a cell has.
const TARGETS: [f64; 2] = [0.1875, 0.75];

/// The part of the children's triangles that a tile has otherwise.
const PART: usize = 6;

/// Factor for measured distances, which may be larger between two samples.
const MARGIN: f64 = 1.1;

/// Bytes of memory for each triangle of the children while a tile is made from them.
const EACH: u64 = 450;

/// A tile that was made.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Made {
    pub triangles: u32,
    /// Bytes of the GLB file.
    pub bytes: u32,
    /// Distance from the full mesh, measured at samples, with a margin; in its unit.
    pub error: f64,
    /// The part of the error by which vertices here or below were moved by rounding.
    #[serde(default)]
    pub moved: f64,
    /// Edges of the boundary of the mesh.
    pub boundary: u64,
    /// Triangles that rounding left out.
    #[serde(default)]
    pub collapsed: u64,
}

/// Inputs and state of the making of all tiles.
pub(super) struct Maker<'a> {
    pub intake: &'a Intake,
    pub cells: &'a Cells,
    pub nodes: Vec<TreeNode>,
    pub bounds: Vec<Bounds>,
    pub low_bits: Vec<u32>,
    /// True if positions were rounded, and attributes may be.
    pub lossy: bool,
    /// Most triangles of a cell.
    pub most: u32,
    /// The GLB files, as words, by tile.
    pub files: Table<LevelWord>,
    pub made: Vec<Made>,
}

/// The number of triangles to which `count` are simplified, if a cell has at most `most`.
pub(super) fn target(count: usize, most: u32) -> usize {
    let [least, most] = TARGETS.map(|part| (part * f64::from(most)) as usize);
    (count / PART).clamp(least, most).min(count / 2)
}

/// The bounds of all nodes.
pub(super) fn bounds(nodes: &[TreeNode], cells: &[Bounds]) -> Vec<Bounds> {
    let mut all: Vec<Bounds> = Vec::with_capacity(nodes.len());
    for (number, node) in nodes.iter().enumerate() {
        let children = node.children.iter().map(|child| all[*child]);
        let joined = children.fold(Bounds::EMPTY, Bounds::joined);
        all.push(cells.get(number).map_or(joined, |own| own.joined(joined)));
    }
    all
}

/// By depth: the low bits that tiles there and below cannot show.
pub(super) fn low_bits(nodes: &[TreeNode], bounds: &[Bounds]) -> Vec<u32> {
    let mut all = vec![0; super::cells::DEEPEST as usize + 1];
    for (node, bounds) in nodes.iter().zip(bounds) {
        let bits = glb::low_bits(bounds.half());
        let above = &mut all[..=node.depth as usize];
        above.iter_mut().for_each(|most| *most = bits.max(*most));
    }
    all
}

impl Maker<'_> {
    fn grids(&self) -> Grids<'_> {
        Grids {
            lattice: &self.intake.lattice,
            low_bits: &self.low_bits,
            lossy: self.lossy,
        }
    }

    /// The words of the nodes of a level.
    fn stored(level: u32) -> Table<LevelWord> {
        Table::new(&format!("levels.level {level}"), 0)
    }

    /// Makes all tiles. Without tiles above it, a large leaf gets one.
    pub fn make(&mut self, shared: Shared<'_>, workspace: &Workspace) -> Result<()> {
        self.leaves(&shared, workspace)?;
        shared.release(workspace)?;
        self.cells.table.release(workspace)?;
        self.intake.release(workspace)?;
        workspace.trim();
        if let [leaf] = &*self.made
            && leaf.bytes as usize > ROOT_BYTES
        {
            self.nodes.push(TreeNode {
                depth: 0,
                level: 1,
                children: vec![0],
            });
            self.bounds.push(self.bounds[0]);
        }
        let last = self.nodes.last().map_or(0, |root| root.level);
        for level in 1..=last {
            self.level(level, workspace)?;
            for below in 0..level {
                if self.last_use(below) == level {
                    Self::stored(below).release(workspace)?;
                }
            }
        }
        Self::stored(last).release(workspace)
    }

    /// The highest level with a tile that has children of this one.
    fn last_use(&self, level: u32) -> u32 {
        let above = self.nodes.iter().filter(|node| {
            let mut children = node.children.iter();
            children.any(|child| self.nodes[*child].level == level)
        });
        above.map(|node| node.level).max().unwrap_or(0)
    }

    fn leaves(&mut self, shared: &Shared<'_>, workspace: &Workspace) -> Result<()> {
        let list = &self.cells.cells;
        let observer = &workspace.observer;
        observer.begin("leaves", "triangles", self.intake.triangles);
        let mut all = vec![Made::default(); list.len()];
        let this = &*self;
        let stored = Self::stored(0);
        let work = |unit: &Unit<'_>| {
            let cell = unit.number();
            let node = shared.node(unit, cell)?;
            let node = ordered(&node);
            let mut made = this.write(unit, (cell, list[cell].depth), &node)?;
            made.error = made.moved;
            stored.put(unit, cell, &node.to_words())?;
            unit.advance(node.triangles.len() as u64);
            Ok(made)
        };
        let bytes_of = |n: usize| bytes(this.intake, list[n].triangles);
        workspace.units("leaves", list.len(), bytes_of, work, |cell, made| {
            all[cell] = made;
            Ok(())
        })?;
        observer.end();
        self.made = all;
        Ok(())
    }

    /// Puts the GLB file of a tile; its error is not known yet.
    fn write(&self, unit: &Unit<'_>, (number, depth): (usize, u32), node: &Node) -> Result<Made> {
        let grids = self.grids();
        let arranged = self.lossy.then(|| lossy::arranged(node, depth, &grids));
        let (node, drawn) = match &arranged {
            Some((arranged, drawn)) => (arranged, *drawn),
            None => (node, node.triangles.len()),
        };
        let lines = boundary(node);
        let triangles = &node.triangles[..drawn];
        let about = (&grids, &self.intake.columns);
        let written = glb::write((node, depth), triangles, &lines, about);
        let words: Vec<LevelWord> = bytemuck::allocation::pod_collect_to_vec(&written.file);
        self.files.put(unit, number, &words)?;
        Ok(Made {
            triangles: drawn as u32,
            bytes: written.file.len() as u32,
            error: 0.0,
            moved: written.moved * self.intake.lattice.step,
            boundary: lines.len() as u64,
            collapsed: (node.triangles.len() - drawn) as u64,
        })
    }

    /// Makes the tiles of a level; all below are made.
    fn level(&mut self, level: u32, workspace: &Workspace) -> Result<()> {
        let numbers: Vec<usize> = (0..self.nodes.len())
            .filter(|number| self.nodes[*number].level == level)
            .collect();
        let joined = |number: usize| {
            let children = self.nodes[numbers[number]].children.iter();
            children.map(|child| u64::from(self.made[*child].triangles))
        };
        let total = (0..numbers.len()).flat_map(joined).sum();
        let observer = &workspace.observer;
        observer.begin("level", "triangles", total);
        let this = &*self;
        let mut all = vec![Made::default(); numbers.len()];
        let values = 12 * self.intake.columns.words() as u64;
        let bytes_of = |n: usize| joined(n).sum::<u64>() * (EACH + values) + (2 << 20);
        let work = |unit: &Unit<'_>| {
            let made = this.inner(unit, numbers[unit.number()])?;
            unit.advance(joined(unit.number()).sum());
            Ok(made)
        };
        let name = (format!("level {level}"), "levels: tiles");
        workspace.units(name, numbers.len(), bytes_of, work, |n, made| {
            all[n] = made;
            Ok(())
        })?;
        observer.end();
        self.made.extend(all);
        Ok(())
    }

    fn inner(&self, unit: &Unit<'_>, number: usize) -> Result<Made> {
        let TreeNode {
            depth,
            level,
            children,
        } = &self.nodes[number];
        let mut nodes = Vec::with_capacity(children.len());
        for child in children {
            let level = self.nodes[*child].level;
            nodes.push(Node::of_words(&Self::stored(level).get(unit, *child)?));
        }
        let joined = join(nodes);
        let is_root = number + 1 == self.nodes.len();
        let count = joined.triangles.len();
        let mut target = target(count, self.most);
        let mut manner: Manner = simplify::careful;
        let below = children.iter().map(|child| &self.made[*child]);
        let (below, moved) = below.fold((0.0f64, 0.0f64), |(error, moved), child| {
            (error.max(child.error - child.moved), moved.max(child.moved))
        });
        let points = Points::of(&joined, *depth);
        loop {
            let triangles = points.simplify(&joined, target, manner);
            let node = joined.with_triangles(&triangles);
            let node = ordered(&node);
            let mut made = self.write(unit, (number, *depth), &node)?;
            if is_root && made.bytes as usize > ROOT_BYTES && !triangles.is_empty() {
                // Many small components do not become few triangles otherwise.
                if triangles.len() > target {
                    manner = simplify::coarse;
                }
                target = target.min(triangles.len()) * 2 / 3;
                continue;
            }
            let own = points.distance(&joined, &triangles);
            made.moved = made.moved.max(moved);
            made.error = below + self.error(own) + made.moved;
            Self::stored(*level).put(unit, number, &node.to_words())?;
            return Ok(made);
        }
    }

    /// The error of a tile besides that of its children, from the measured distance in steps; at least half a step,
    /// so that leaves are always better. Writing a lossy tile tells the error of hidden bits itself.
    fn error(&self, distance: f64) -> f64 {
        let hidden = match self.low_bits.first() {
            _ if self.lossy => 0.0,
            None | Some(0) => 0.0,
            Some(bits) => 3f64.sqrt() * f64::from(1u32 << bits),
        };
        ((distance * MARGIN).max(0.5) + hidden) * self.intake.lattice.step
    }
}

/// The node with its triangles in an order that compresses well.
fn ordered(node: &Node) -> Node {
    node.with_triangles(&order::of(node.ids.len(), &node.triangles))
}

/// The node that has the triangles of all these: vertices of several become one.
fn join(nodes: Vec<Node>) -> Node {
    let mut all = Node::default();
    let mut shared: FxHashMap<u32, u32> = FxHashMap::default();
    for node in nodes {
        let each = node.value_words();
        let mut new = Vec::with_capacity(node.ids.len());
        for vertex in 0..node.ids.len() {
            let (id, depth) = (node.ids[vertex], node.depths[vertex]);
            let next = all.ids.len() as u32;
            let index = match depth {
                INNER => next,
                _ => *shared.entry(id).or_insert(next),
            };
            new.push(index);
            if index == next {
                all.ids.push(id);
                all.points.push(node.points[vertex]);
                all.depths.push(depth);
                all.rounding.push(node.rounding[vertex]);
                all.normals.push(node.normals[vertex]);
                let values = &node.values[vertex * each..][..each];
                all.values.extend_from_slice(values);
            }
        }
        let corners = node.triangles.iter();
        all.triangles
            .extend(corners.map(|t| t.map(|corner| new[corner as usize])));
        let seams = node
            .seams
            .iter()
            .map(|ends| ends.map(|end| new[end as usize]));
        all.seams.extend(seams.map(|[a, b]| [a.min(b), a.max(b)]));
    }
    all.seams.sort_unstable();
    all.seams.dedup();
    all
}

/// Positions of a node from its middle, and which vertices are locked.
struct Points {
    points: Vec<[f64; 3]>,
    locked: Vec<bool>,
}

impl Points {
    fn of(node: &Node, depth: u32) -> Self {
        let middle = node.bounds().middle();
        let from = |p: &[u32; 3]| std::array::from_fn(|k| f64::from(p[k]) - f64::from(middle[k]));
        let vertices = 0..node.ids.len();
        Self {
            points: node.points.iter().map(from).collect(),
            locked: vertices.map(|v| node.is_locked(v, depth)).collect(),
        }
    }

    fn simplify(&self, node: &Node, target: usize, manner: Manner) -> Vec<[u32; 3]> {
        let surface = Surface {
            points: &self.points,
            triangles: &node.triangles,
            locked: &self.locked,
        };
        let triangles = manner(surface, target);
        // However it is simplified, tiles have no cracks.
        match self.keeps_borders(node, &triangles) {
            true => triangles,
            false => node.triangles.clone(),
        }
    }

    /// True if all locked vertices are corners of these triangles. One on the boundary of the mesh may be missing: the
    /// ear that it was the tip of is gone, which moves the boundary.
    fn keeps_borders(&self, node: &Node, triangles: &[[u32; 3]]) -> bool {
        let mut lost = self.locked.clone();
        triangles
            .as_flattened()
            .iter()
            .for_each(|v| lost[*v as usize] = false);
        if !lost.contains(&true) {
            return true;
        }
        for end in boundary(node).into_iter().flatten() {
            lost[end as usize] = false;
        }
        !lost.contains(&true)
    }

    /// The distance of these triangles from those of the node, in steps.
    fn distance(&self, node: &Node, triangles: &[[u32; 3]]) -> f64 {
        let surface = |triangles| nearest::Surface {
            points: &self.points,
            triangles,
        };
        measure(surface(&node.triangles), surface(triangles))
    }
}
