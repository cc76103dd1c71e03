//! Examination of one piece of the mesh ([`super::homes`]): all vertices at home that are not shared, with
//! all their triangles. What touches a shared vertex is left for the sweep over the ranges.

use super::bounds::Bounds;
use super::collinear::collinear;
use super::homes::{AT_A_TIME, AWAY, Division, Homes, Shared};
use super::places::Kind;
use super::star::{self, Inspector, NO_MORE, scratch_bytes};
use super::volume::Volume;
use outcrop_codecs::ply_mesh::AnyPlace;
use outcrop_disk::error::Result;

/// Marks a vertex that is not in a graph.
const NONE: u32 = u32::MAX;

/// Marks of a vertex: it is shared; a triangle with a shared corner has it.
const SHARED: u8 = 1;
const OPEN: u8 = 2;

/// Counts and open triangles of a piece.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// Triangles in the file, those with a corner that is no vertex, and those with two equal corners.
    pub(super) triangles: u64,
    pub(super) out_of_range: u64,
    pub(super) degenerate: u64,
    /// Triangles without area.
    pub(super) zero_area: u64,
    /// The volume of triangles without a shared corner.
    pub(super) volume: Volume,
    /// Vertices with coordinates that are not finite; the box around the others.
    pub(super) non_finite: u64,
    pub(super) bounds: Option<Bounds>,
    /// Components, of triangles and of boundary edges, that no triangle with a shared corner touches.
    pub(super) complete: [u64; 2],
    /// Triangles with a shared corner.
    pub(super) open: Vec<[u32; 3]>,
    /// Edges, lower end first, that connect vertices of those triangles as the piece connects them: by
    /// triangles, and by boundary edges.
    pub(super) edges: [Vec<[u32; 2]>; 2],
}

/// The memory for a piece.
#[derive(Debug, Default)]
pub(super) struct Piece {
    pub(super) found: Found,
    pub(super) inspector: Inspector,
    number: u32,
    bytes: Vec<u8>,
    slice: Vec<[u32; 3]>,
    /// Sound triangles.
    triangles: Vec<[u32; 3]>,
    groups: Vec<u32>,
    /// For each vertex at home: its position, marks, and the number of its triangles.
    positions: Vec<[f64; 3]>,
    marks: Vec<u8>,
    degree: Vec<u32>,
    /// For each vertex the place of its next triangle.
    end: Vec<u32>,
    links: Vec<[u32; 2]>,
    /// Union–find over vertices: by triangles, and by boundary edges.
    parents: [Vec<u32>; 2],
    /// For each root the last vertex found.
    last: Vec<u32>,
}

impl Piece {
    /// Bytes of the memory for a piece.
    pub(super) fn bytes(division: &Division, entries: [usize; 2]) -> u64 {
        let faces = division.piece as u64;
        let vertices = (division.most_groups as u64) << division.shift;
        // Edges between them: each list grows by doubling.
        let per_vertex = 24 + 1 + 5 * 4 + 2 * 2 * 8;
        let read = entries[0] as u64 * vertices + (AT_A_TIME * (12 + entries[1])) as u64;
        faces * (12 + 3 * 8 + 2 * 12) + vertices * per_vertex + scratch_bytes(division.piece) + read
    }

    /// Examines a piece; `advance` is told of vertices and faces.
    pub(super) fn examine(
        &mut self,
        mesh: &AnyPlace,
        (homes, shared): (&Homes, &Shared),
        number: usize,
        advance: impl Fn(u64),
    ) -> Result<()> {
        self.number = number as u32;
        self.begin(mesh, homes, shared)?;
        advance(self.positions.len() as u64);
        let mut faces = homes.division.faces_of(number);
        while !faces.is_empty() {
            let now = (faces.end - faces.start).min(AT_A_TIME as u64) as usize;
            mesh.triangles((faces.start, now), &mut self.bytes, &mut self.slice)?;
            self.take(homes);
            faces.start += now as u64;
            advance(now as u64);
        }
        self.gather(homes);
        self.inspect(homes);
        for graph in 0..2 {
            self.close(homes, graph);
        }
        Ok(())
    }

    /// The number in the mesh of a vertex at home.
    fn vertex(&self, homes: &Homes, local: usize) -> u32 {
        let shift = homes.division.shift;
        (self.groups[local >> shift] << shift) | (local as u32 & ((1 << shift) - 1))
    }

    /// The vertices that are needed outside of the piece, with their positions.
    pub(super) fn needed<'a>(
        &'a self,
        homes: &'a Homes,
    ) -> impl Iterator<Item = (u32, [f64; 3])> + 'a {
        let needed = self
            .marks
            .iter()
            .enumerate()
            .filter(|(_, marks)| **marks != 0);
        needed.map(|(at, _)| (self.vertex(homes, at), self.positions[at]))
    }

    /// Reads the vertices at home; the piece is empty.
    fn begin(&mut self, mesh: &AnyPlace, homes: &Homes, shared: &Shared) -> Result<()> {
        self.found = Found {
            open: std::mem::take(&mut self.found.open),
            edges: std::mem::take(&mut self.found.edges),
            volume: Volume::from(self.found.volume.origin),
            ..Found::default()
        };
        self.found.open.clear();
        self.found.edges.iter_mut().for_each(Vec::clear);
        self.triangles.clear();
        self.positions.clear();
        self.marks.clear();
        self.groups.clear();
        self.groups.extend(homes.groups_of(self.number as usize));
        for run in Division::runs(&self.groups) {
            let vertices = homes.division.vertices_of(run);
            let count = (vertices.end - vertices.start) as usize;
            mesh.positions(
                (vertices.start, count),
                &mut self.bytes,
                &mut self.positions,
            )?;
            let mark = |vertex: u64| if shared.has(vertex as u32) { SHARED } else { 0 };
            self.marks.extend(vertices.map(mark));
        }
        for position in &self.positions {
            if position.iter().all(|c| c.is_finite()) {
                self.found.bounds = Some(Bounds::with(self.found.bounds, *position));
            } else {
                self.found.non_finite += 1;
            }
        }
        let [surface, boundary] = &mut self.parents;
        for (words, value) in [
            (&mut self.degree, 0),
            (&mut self.end, 0),
            (surface, NONE),
            (boundary, NONE),
        ] {
            words.clear();
            words.resize(self.positions.len(), value);
        }
        Ok(())
    }

    /// Takes the triangles of `slice`.
    fn take(&mut self, homes: &Homes) {
        let [surface, _] = &mut self.parents;
        let found = &mut self.found;
        found.triangles += self.slice.len() as u64;
        for &triangle in &self.slice {
            let [x, y, z] = triangle;
            if x.max(y).max(z) >= homes.division.vertices {
                found.out_of_range += 1;
                continue;
            }
            if x == y || y == z || z == x {
                found.degenerate += 1;
                self.inspector.places.note(Kind::Degenerate, x);
                continue;
            }
            self.triangles.push(triangle);
            let local = triangle.map(|vertex| homes.local(vertex, self.number));
            let home = local
                .iter()
                .filter(|at| **at != AWAY)
                .map(|at| *at as usize);
            let mut open = local.contains(&AWAY);
            for at in home.clone() {
                self.degree[at] += 1;
                open |= self.marks[at] & SHARED != 0;
            }
            if open {
                found.open.push(triangle);
                home.clone().for_each(|at| self.marks[at] |= OPEN);
            } else {
                let corners = local.map(|at| self.positions[at as usize]);
                let finite = corners.iter().flatten().all(|c| c.is_finite());
                found.zero_area += u64::from(finite && collinear(corners));
                if finite {
                    found.volume.add(corners);
                }
            }
            if let Some(first) = home.clone().next() {
                home.for_each(|at| join(surface, first as u32, at as u32));
            }
        }
    }

    /// Collects the triangles at each vertex at home.
    fn gather(&mut self, homes: &Homes) {
        let mut sum = 0;
        for (end, degree) in self.end.iter_mut().zip(&self.degree) {
            *end = sum;
            sum += degree;
        }
        self.links
            .resize((sum as usize).max(self.links.len()), [0; 2]);
        for &[x, y, z] in &self.triangles {
            for (vertex, link) in [(x, [y, z]), (y, [z, x]), (z, [x, y])] {
                let at = homes.local(vertex, self.number);
                if let Some(end) = self.end.get_mut(at as usize) {
                    self.links[*end as usize] = link;
                    *end += 1;
                }
            }
        }
    }

    /// Examines the vertices at home that are not shared, and joins those of boundary edges.
    fn inspect(&mut self, homes: &Homes) {
        let mut links = &mut self.links[..];
        for (at, &degree) in self.degree.iter().enumerate() {
            let (star, later) = links.split_at_mut(degree as usize);
            links = later;
            if degree == 0 || self.marks[at] & SHARED != 0 {
                continue;
            }
            let shift = homes.division.shift;
            let vertex = (self.groups[at >> shift] << shift) | (at as u32 & ((1 << shift) - 1));
            self.inspector.inspect(vertex, star);
            let [_, boundary] = &mut self.parents;
            let others = star.as_flattened().iter().take_while(|w| **w != NO_MORE);
            for &other in others {
                touch(boundary, at as u32);
                match homes.local(other, self.number) {
                    // Any other edge is found at its other end.
                    _ if other > vertex => {}
                    AWAY => self.found.edges[1].push([other, vertex]),
                    other => join(boundary, other, at as u32),
                }
            }
        }
    }

    /// Counts the components of a graph that no triangle with a shared corner touches, and connects the
    /// vertices of such triangles in each of the others.
    fn close(&mut self, homes: &Homes, graph: usize) {
        self.last.clear();
        self.last.resize(self.positions.len(), NONE);
        for at in 0..self.positions.len() {
            if self.parents[graph][at] == NONE || self.marks[at] & OPEN == 0 {
                continue;
            }
            let root = star::root(&mut self.parents[graph], at as u32);
            let last = std::mem::replace(&mut self.last[root as usize], at as u32);
            let high = self.vertex(homes, at);
            match last {
                // Vertices of triangles are known in the sweep, those of boundary edges not always.
                NONE if graph == 0 => {}
                NONE => self.found.edges[graph].push([high, high]),
                low => {
                    let low = self.vertex(homes, low as usize);
                    self.found.edges[graph].push([low, high]);
                }
            }
        }
        let roots = self.parents[graph].iter().zip(&self.last).enumerate();
        let complete = roots.filter(|&(at, (&up, &last))| up == at as u32 && last == NONE);
        self.found.complete[graph] = complete.count() as u64;
    }
}

fn touch(parent: &mut [u32], at: u32) {
    let up = &mut parent[at as usize];
    if *up == NONE {
        *up = at;
    }
}

fn join(parent: &mut [u32], a: u32, b: u32) {
    // Most are joined already, and know it.
    let [up, other] = [a, b].map(|at| parent[at as usize]);
    if up == other && up != NONE {
        return;
    }
    touch(parent, a);
    touch(parent, b);
    let (a, b) = (star::root(parent, a), star::root(parent, b));
    parent[a.max(b) as usize] = a.min(b);
}
