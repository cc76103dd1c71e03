//! Connected areas of change: vertices that changed in the same direction and are joined by edges.

use super::{ChangeRow, ROWS, State};
use outcrop_codecs::ply_mesh::{PlyMesh, Sink};
use outcrop_disk::error::Result;
use outcrop_disk::spill::LocalTable;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_geom::vector::{Box3, V3};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Fewer vertices are no area of their own: about as many as a cylinder holds.
const LEAST: u8 = 30;

/// A connected area of change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Area {
    /// Its vertices.
    pub vertices: u64,
    /// Its surface, in square units of the files.
    pub area: f64,
    /// Volume that the new surface has more, in cubic units.
    pub gained: f64,
    /// Volume that it has less.
    pub lost: f64,
    /// The largest change, along the normal; negative for a loss. None if only the new surface is there.
    pub largest: Option<f64>,
    /// Where it is, or a vertex of the area.
    pub largest_at: [f64; 3],
    /// Lowest corner of the box around the area.
    pub min: [f64; 3],
    /// Highest corner.
    pub max: [f64; 3],
}

/// Exact sums of rounded numbers: they do not depend on the order.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Sums {
    vertices: u64,
    area: i128,
    gained: i128,
    lost: i128,
}

/// Units of the sums.
#[derive(Debug, Clone, Copy)]
pub(super) struct Units {
    area: f64,
    volume: f64,
}

impl Units {
    /// For surfaces in a box: a 2^-80th of a square and cube of its diagonal.
    pub fn of(bounds: &Box3) -> Self {
        let diagonal = bounds.diagonal();
        let side = match diagonal > 0.0 && diagonal.is_finite() {
            true => diagonal,
            false => 1.0,
        };
        let part = 2f64.powi(-80);
        Self {
            area: side * side * part,
            volume: side * side * side * part,
        }
    }
}

impl Sums {
    pub fn add(&mut self, row: &ChangeRow, units: &Units) {
        let [area, volume] = row.sizes();
        self.vertices += 1;
        self.area += (area / units.area) as i128;
        let part = (volume / units.volume) as i128;
        match part > 0 {
            true => self.gained += part,
            false => self.lost -= part,
        }
    }

    /// Adds the sums of other vertices.
    pub fn join(&mut self, more: &Self) {
        self.vertices += more.vertices;
        self.area += more.area;
        self.gained += more.gained;
        self.lost += more.lost;
    }

    pub fn vertices(&self) -> u64 {
        self.vertices
    }

    pub fn area(&self, units: &Units) -> f64 {
        self.area as f64 * units.area
    }

    pub fn gained(&self, units: &Units) -> f64 {
        self.gained as f64 * units.volume
    }

    pub fn lost(&self, units: &Units) -> f64 {
        self.lost as f64 * units.volume
    }
}

/// Which vertices belong together.
pub(super) struct Joined {
    /// The direction of change of each vertex: 0 none, 1 growth, 2 loss.
    ways: Vec<u8>,
    /// The next vertex of the same area on the way to its first one, which is its own.
    parents: Vec<u32>,
    _held: Reservation,
}

impl Joined {
    /// Joins the vertices of a mesh by its edges.
    pub fn of(
        path: &Path,
        rows: &LocalTable<ChangeRow>,
        vertices: u64,
        workspace: &Workspace,
    ) -> Result<Self> {
        let held = workspace.reserve("change: areas", vertices * 5)?;
        let mut ways = vec![0; vertices as usize];
        let mut some = Vec::new();
        for section in 0..rows.count() {
            rows.get_into(section, &mut some)?;
            for row in &some {
                if let Some(way) = ways.get_mut(row.index as usize) {
                    *way = row.way();
                }
            }
        }
        let mut joined = Self {
            ways,
            parents: (0..vertices as u32).collect(),
            _held: held,
        };
        let mesh = PlyMesh::open_any(path, workspace)?;
        let observer = &workspace.observer;
        observer.begin("areas", "triangles", mesh.faces());
        mesh.read(&mut Edges(&mut joined, workspace))?;
        observer.end();
        Ok(joined)
    }

    fn first(&mut self, mut vertex: u32) -> u32 {
        loop {
            let parent = self.parents[vertex as usize];
            if parent == vertex {
                return vertex;
            }
            let next = self.parents[parent as usize];
            self.parents[vertex as usize] = next;
            vertex = next;
        }
    }

    /// Joins two vertices that changed in the same direction. The first vertex of an area is its least one, whatever
    /// the order of the edges.
    fn join(&mut self, a: u32, b: u32) {
        let way = |v: u32| self.ways.get(v as usize).copied().unwrap_or(0);
        if way(a) == 0 || way(a) != way(b) {
            return;
        }
        let [a, b] = [self.first(a), self.first(b)];
        self.parents[a.max(b) as usize] = a.min(b);
    }
}

struct Edges<'a>(&'a mut Joined, &'a Workspace);

impl Sink for Edges<'_> {
    fn vertices(&mut self, _: &[V3]) -> Result<()> {
        Ok(())
    }

    fn triangles(&mut self, triangles: &[[u32; 3]]) -> Result<()> {
        for [a, b, c] in triangles {
            self.0.join(*a, *b);
            self.0.join(*b, *c);
            self.0.join(*c, *a);
        }
        self.1.observer.advance(triangles.len() as u64);
        self.1.check_cancel()
    }
}

/// The areas of change, and the sums of those that are too small to be told.
pub(super) struct Areas {
    /// The areas, the largest volume first.
    pub areas: Vec<Area>,
    /// The sums of the others.
    pub small: Sums,
}

/// An area that is being measured.
struct Open {
    sums: Sums,
    largest: Option<(f32, V3)>,
    bounds: Box3,
}

/// Measures areas, vertex by vertex in the order of the file.
struct Measuring<'a> {
    joined: Joined,
    rows: &'a LocalTable<ChangeRow>,
    section: Option<(usize, Vec<ChangeRow>)>,
    next: usize,
    units: Units,
    /// The areas by their first vertex, but small ones.
    open: FxHashMap<u32, Open>,
    small: Sums,
    held: Reservation,
}

impl Measuring<'_> {
    /// The result at the next vertex.
    fn row(&mut self) -> Result<ChangeRow> {
        let section = self.next / ROWS;
        if self.section.as_ref().is_none_or(|s| s.0 != section) {
            let mut rows = self.section.take().map(|s| s.1).unwrap_or_default();
            self.rows.get_into(section, &mut rows)?;
            self.section = Some((section, rows));
        }
        let rows = self.section.iter().map(|s| &s.1);
        let row = rows.flatten().nth(self.next % ROWS).copied();
        self.next += 1;
        Ok(row.unwrap_or_else(|| ChangeRow::of(State::Unused, [f64::NAN; 2], [0.0; 2])))
    }
}

impl Sink for Measuring<'_> {
    fn vertices(&mut self, positions: &[V3]) -> Result<()> {
        for position in positions {
            let row = self.row()?;
            if row.way() == 0 {
                continue;
            }
            let first = self.joined.first(row.index);
            let Some(open) = self.open.get_mut(&first) else {
                self.small.add(&row, &self.units);
                continue;
            };
            open.sums.add(&row, &self.units);
            open.bounds = open.bounds.with(*position);
            let [change, _] = row.changes();
            let is_larger =
                |(largest, _): (f32, V3)| largest.is_nan() || change.abs() > largest.abs();
            if open.largest.is_none_or(is_larger) {
                open.largest = Some((change, *position));
            }
        }
        Ok(())
    }

    fn triangles(&mut self, _: &[[u32; 3]]) -> Result<()> {
        Ok(())
    }
}

/// Measures the areas of a mesh.
pub(super) fn measured(
    path: &Path,
    rows: &LocalTable<ChangeRow>,
    units: Units,
    vertices: u64,
    workspace: &Workspace,
) -> Result<Areas> {
    let mut joined = Joined::of(path, rows, vertices, workspace)?;
    let mut held = workspace.reserve("change: list of areas", 0)?;
    // The number of vertices of each area, as far as it tells which are large, at its first one; then only those are kept.
    let counted = workspace.reserve("change: sizes of areas", vertices)?;
    let mut sizes = vec![0u8; vertices as usize];
    for vertex in 0..vertices as u32 {
        if joined.ways[vertex as usize] != 0 {
            let size = &mut sizes[joined.first(vertex) as usize];
            *size = size.saturating_add(1);
        }
    }
    let large = |(first, size): (u32, &u8)| (*size >= LEAST).then_some(first);
    let number = sizes.iter().filter(|size| **size >= LEAST).count();
    held.at_least(2 * (number * (size_of::<Open>() + 8 + size_of::<Area>())) as u64)?;
    let empty = |first| {
        let open = Open {
            sums: Sums::default(),
            largest: None,
            bounds: Box3::EMPTY,
        };
        (first, open)
    };
    let open = (0..).zip(&sizes).filter_map(large).map(empty).collect();
    drop((sizes, counted));
    let mut measuring = Measuring {
        joined,
        rows,
        section: None,
        next: 0,
        units,
        open,
        small: Sums::default(),
        held,
    };
    PlyMesh::open_any(path, workspace)?.read_in_place(&mut measuring)?;
    let Measuring {
        open, small, held, ..
    } = measuring;
    let mut areas: Vec<(u32, Area)> = open
        .into_iter()
        .map(|(first, open)| (first, open.finished(&units)))
        .collect();
    let volume = |area: &Area| area.gained + area.lost;
    areas.sort_unstable_by(|a, b| {
        let by_volume = volume(&b.1).total_cmp(&volume(&a.1));
        by_volume.then(a.0.cmp(&b.0))
    });
    drop(held);
    Ok(Areas {
        areas: areas.into_iter().map(|(_, area)| area).collect(),
        small,
    })
}

impl Open {
    fn finished(self, units: &Units) -> Area {
        let (largest, largest_at) = self.largest.unwrap_or((f32::NAN, self.bounds.min));
        let Box3 { min, max } = self.bounds;
        Area {
            vertices: self.sums.vertices,
            area: self.sums.area(units),
            gained: self.sums.gained(units),
            lost: self.sums.lost(units),
            largest: (!largest.is_nan()).then(|| f64::from(largest)),
            largest_at,
            min,
            max,
        }
    }
}
