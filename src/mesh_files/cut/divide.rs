//! The triangles of a block, divided into squares, with the numbers of the block's vertices in each.

use super::grid::Square;
use super::{FarCorner, Normal, Source};
use outcrop_disk::error::Result;
use outcrop_disk::spill::row;
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::Point;
use outcrop_geom::triangle::{add, direction, normal};
use outcrop_mesh::repair::OrientedTriangle;
use outcrop_mesh::surface::star::{Link, Star, sorted};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Id, Ids};
use outcrop_stages::located::Located;
use std::ops::Range;

/// Number of a vertex that is in another block.
const FAR: u32 = u32::MAX;

row! {
    /// The part of a square in a block.
    pub struct Part {
        /// The square.
        square: Square,
        /// Number of vertices of the block, of further copies of pinched ones, and of triangles whose smallest
        /// vertex is in the block.
        counts: [u32; 3],
        /// Edges with one triangle whose smaller vertex is in the block.
        boundary_edges: u32,
        /// Lowest and highest coordinates of the vertices.
        bounds: [Point; 2],
    }
    unpacked
}

/// The triangles that touch a block, by square.
pub struct Divided {
    ids: Ids,
    /// By square, then ascending by sorted ids.
    triangles: Vec<OrientedTriangle>,
    /// For each corner of each triangle the number of its vertex among those that its square has in the block:
    /// twice the number of the vertex, or twice the number of the copy and 1; or [`FAR`].
    numbers: Vec<[u32; 3]>,
    squares: Vec<Divide>,
    /// Triangles left out, counted in the block of their smallest vertex.
    pub outside: u64,
}

/// A square in a block.
pub struct Divide {
    part: Part,
    triangles: Range<usize>,
    /// Ids of its vertices in the block, ascending.
    vertices: Vec<Id>,
    /// Ids of its copies.
    copies: Vec<Id>,
    /// Normals of vertices and copies, if wanted.
    normals: [Vec<Normal>; 2],
}

impl Divided {
    /// Divides the triangles of the unit's block.
    pub fn of(unit: &Unit<'_>, source: &Source<'_>) -> Result<Self> {
        let block = unit.number();
        let ids = source.blocks.ids(block);
        let (mut triangles, _) = source.surface.load(unit, block)?;
        let filled = source.filled.get(unit, block)?;
        triangles.extend(filled.iter().map(|f| f.triangle));
        triangles.sort_unstable_by_key(|t| sorted(*t));
        let vertices = triangles.iter().flatten().copied();
        let points = Located::load(source.store, source.blocks, block, vertices)?;
        let _held = unit.hold(bytes_of(&triangles) + bytes_of(&filled) + points.bytes());
        let whole = source.normals.then(|| Fans::of(ids, &triangles));
        let _fans = unit.hold(whole.as_ref().map_or(0, Fans::bytes));
        let outside = source.leave_out(&mut triangles, &points, ids);
        let mut squares: Vec<(Square, u32)> = Vec::new();
        if let Some(grid) = &source.grid {
            let of = |t: &OrientedTriangle| grid.of(points.corners(*t));
            squares = triangles.iter().map(of).zip(0..).collect();
            squares.sort_unstable();
            triangles = squares
                .iter()
                .map(|(_, n)| triangles[*n as usize])
                .collect();
        } else if !triangles.is_empty() {
            squares = vec![([0, 0], 0); triangles.len()];
        }
        let mut divided = Self {
            ids,
            numbers: vec![[FAR; 3]; triangles.len()],
            triangles,
            squares: Vec::new(),
            outside,
        };
        let mut start = 0;
        for square in squares.chunk_by(|a, b| a.0 == b.0) {
            let triangles = start..start + square.len();
            start = triangles.end;
            divided.number(square[0].0, triangles, &points, whole.as_ref());
        }
        Ok(divided)
    }

    /// Numbers the vertices of a square.
    fn number(
        &mut self,
        square: Square,
        range: Range<usize>,
        points: &Located,
        whole: Option<&Fans>,
    ) {
        let own = |v: &Id| self.ids.contains(v);
        let triangles = &self.triangles[range.clone()];
        let mut corners: Vec<(Id, u32)> = Vec::with_capacity(3 * triangles.len());
        for (t, number) in triangles.iter().zip(0..) {
            corners.extend(t.iter().filter(|v| own(v)).map(|v| (*v, number)));
        }
        // Triangles ascend, so fans are numbered by their smallest triangles.
        corners.sort_unstable();
        let numbers = &mut self.numbers[range.clone()];
        let (mut link, mut higher) = (Link::default(), Vec::new());
        let (mut vertices, mut copies, mut boundary_edges) = (Vec::new(), Vec::new(), 0);
        let mut normals = [Vec::new(), Vec::new()];
        let mut bounds = [[i32::MAX; 3], [i32::MIN; 3]];
        for star in corners.chunk_by(|a, b| a.0 == b.0) {
            let v = star[0].0;
            link.set(v, star.iter().map(|(_, n)| triangles[*n as usize]));
            for (index, (_, n)) in star.iter().enumerate() {
                let number = match link.group(index).checked_sub(1) {
                    None => 2 * vertices.len() as u32,
                    Some(fan) => 2 * (copies.len() + fan) as u32 + 1,
                };
                let corner = triangles[*n as usize].iter().position(|c| *c == v);
                numbers[*n as usize][corner.unwrap_or(0)] = number;
                let others = triangles[*n as usize].iter().filter(|c| **c > v);
                higher.extend(others.copied());
            }
            higher.sort_unstable();
            let edges = higher.chunk_by(|a, b| a == b);
            boundary_edges += edges.filter(|edge| edge.len() == 1).count() as u32;
            higher.clear();
            if let Some(whole) = whole {
                let first = |group| (0..star.len()).find(|n| link.group(*n) == group);
                let firsts = (0..link.groups()).filter_map(first);
                for (group, n) in firsts.enumerate() {
                    let t = triangles[star[n].1 as usize];
                    normals[group.min(1)].push(whole.normal(v, t, points));
                }
            }
            copies.extend((1..link.groups()).map(|_| v));
            vertices.push(v);
            let p = points.at(v);
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(p[axis]);
                bounds[1][axis] = bounds[1][axis].max(p[axis]);
            }
        }
        let faces = triangles.iter().filter(|t| own(&t[0])).count() as u32;
        self.squares.push(Divide {
            part: Part {
                square,
                counts: [vertices.len() as u32, copies.len() as u32, faces],
                boundary_edges,
                bounds,
            },
            triangles: range,
            vertices,
            copies,
            normals,
        });
    }

    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        let lists = |s: &Divide| {
            let normals: u64 = s.normals.iter().map(bytes_of).sum();
            bytes_of(&s.vertices) + bytes_of(&s.copies) + normals
        };
        let squares: u64 = self.squares.iter().map(lists).sum();
        squares + bytes_of(&self.squares) + bytes_of(&self.triangles) + bytes_of(&self.numbers)
    }

    /// The parts of all squares in the block, ascending by square.
    pub fn parts(&self) -> Vec<Part> {
        self.squares.iter().map(|square| square.part).collect()
    }

    /// The squares, ascending.
    pub fn squares(&self) -> &[Divide] {
        &self.squares
    }

    /// The numbers of the block's vertices in triangles of other blocks.
    pub fn far_corners(&self, blocks: Blocks) -> Vec<FarCorner> {
        let mut far = Vec::new();
        for (t, numbers) in self.triangles.iter().zip(&self.numbers) {
            if self.ids.contains(&t[0]) {
                continue;
            }
            for (vertex, number) in t.iter().zip(numbers).filter(|(_, n)| **n != FAR) {
                far.push(FarCorner {
                    to: blocks.of(t[0]),
                    triangle: sorted(*t),
                    vertex: *vertex,
                    number: *number,
                });
            }
        }
        far
    }

    /// The triangles of a square whose smallest vertex is in the block, each with the numbers of its corners;
    /// `None` for those in other blocks.
    pub fn faces(
        &self,
        square: &Divide,
    ) -> impl Iterator<Item = (OrientedTriangle, [Option<u32>; 3])> {
        let range = square.triangles.clone();
        let triangles = self.triangles[range.clone()].iter();
        let all = triangles.zip(&self.numbers[range]);
        let own = all.filter(|(t, _)| self.ids.contains(&t[0]));
        own.map(|(t, n)| (*t, n.map(|n| Some(n).filter(|n| *n != FAR))))
    }
}

impl Divide {
    /// The square.
    pub fn square(&self) -> Square {
        self.part.square
    }

    /// Ids of its vertices in the block, ascending.
    pub fn vertices(&self) -> &[Id] {
        &self.vertices
    }

    /// Normals of the vertices, then of the copies; none if they are not wanted.
    pub fn normals(&self) -> Vec<Normal> {
        self.normals.concat()
    }

    /// Ids of its copies of pinched vertices in the block.
    pub fn copies(&self) -> &[Id] {
        &self.copies
    }
}

/// The triangles around the vertices of a block, before any are left out.
struct Fans {
    triangles: Vec<OrientedTriangle>,
    star: Star,
}

impl Fans {
    fn of(ids: Ids, triangles: &[OrientedTriangle]) -> Self {
        Self {
            star: Star::of(ids, triangles),
            triangles: triangles.to_vec(),
        }
    }

    fn bytes(&self) -> u64 {
        bytes_of(&self.triangles) + self.star.bytes()
    }

    /// The normal of the fan around a vertex that has a triangle: the sum of those of its triangles, weighed by
    /// their areas.
    fn normal(&self, v: Id, triangle: OrientedTriangle, points: &Located) -> Normal {
        let star = self.star.at(v).iter().map(|n| self.triangles[n.index()]);
        let mut link = Link::default();
        link.set(v, star.clone());
        let own = star.clone().position(|t| t == triangle);
        let own = own.map(|own| link.group(own));
        let mut sum = [0; 3];
        for (n, t) in star.enumerate() {
            if Some(link.group(n)) == own {
                let [a, b, c] = points.corners(t);
                add(&mut sum, normal(a, b, c));
            }
        }
        Normal {
            direction: direction(&sum),
        }
    }
}

impl Source<'_> {
    /// Removes the triangles with a corner outside the region; returns the number of those whose smallest vertex
    /// is in the block with the ids `ids`.
    fn leave_out(&self, triangles: &mut Vec<OrientedTriangle>, points: &Located, ids: Ids) -> u64 {
        let Some(area) = &self.area else { return 0 };
        let inside = |v: Id| area.contains(self.lattice.position(points.at(v)));
        let own: Vec<bool> = ids.iter().map(inside).collect();
        let is_inside = |v: &Id| match own.get(ids.find(*v)) {
            Some(inside) => *inside,
            None => inside(*v),
        };
        let mut outside = 0;
        triangles.retain(|t| {
            let keep = t.iter().all(is_inside);
            outside += u64::from(!keep && ids.contains(&t[0]));
            keep
        });
        outside
    }
}
