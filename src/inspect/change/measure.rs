//! The change at each vertex of one surface, measured on all threads, in the order of the vertices.

use super::gather::Gatherer;
use super::patch::{Axis, Layer, Patch, Point, grown};
use super::surface::{PIECE, Points, Surface, Vertex};
use super::{ChangeRow, Scale, State};
use crate::compare::pages::Pages;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::{Unit, Workspace, lock};
use outcrop_geom::vector::{Box3, V3};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::Mutex;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

/// Bytes of the patches of a thread, by which its share of memory is divided.
const PATCHES: u64 = 4 << 20;

/// A measurement of the distances along the normals from the vertices of one surface to another one.
pub(super) struct Measure<'a> {
    pub from: &'a Surface<'a>,
    pub to: &'a Surface<'a>,
    pub scale: Scale,
    /// True if only what the other one does not have is wanted.
    pub presence: bool,
}

impl Measure<'_> {
    /// Number of pieces of the surface.
    pub fn pieces(&self) -> usize {
        self.vertices().map_or(0, |vertices| {
            vertices.total().div_ceil(PIECE as u64) as usize
        })
    }

    fn vertices(&self) -> Option<&Pages<Vertex>> {
        match &self.from.items {
            Points::Mesh(vertices, _) => Some(vertices),
            Points::Cloud(_) => None,
        }
    }

    /// Reads the vertices of a piece into `piece`.
    pub fn read(&self, number: usize, piece: &mut Vec<Vertex>) -> Result<()> {
        piece.clear();
        let Some(vertices) = self.vertices() else {
            return Ok(());
        };
        let (page, mut some) = (vertices.page(), Vec::new());
        let end = ((number + 1) * PIECE).min(vertices.total() as usize);
        let mut next = number * PIECE;
        while next < end {
            vertices.get_into(next / page, &mut some)?;
            let first = next % page;
            let count = some.len().saturating_sub(first).min(end - next);
            if count == 0 {
                break;
            }
            piece.extend_from_slice(&some[first..first + count]);
            next += count;
        }
        Ok(())
    }

    /// Measures all pieces in the step `step`, those of earlier attempts not again. `work` gets the vertices of a piece
    /// and the results at them, `each` what it returns, in any order.
    pub fn each<T: Serialize + DeserializeOwned + Send>(
        &self,
        step: &'static str,
        workspace: &Workspace,
        work: impl Fn(&Unit<'_>, &[Vertex], &[ChangeRow]) -> Result<T> + Sync,
        mut each: impl FnMut(T) + Send,
    ) -> Result<()> {
        let Some(vertices) = self.vertices() else {
            return Ok(());
        };
        let threads = workspace.threads as u64;
        let share = workspace.memory.available() / 8 / threads;
        let page = self.from.page_bytes() + self.to.page_bytes();
        let pages = (share.saturating_sub(PATCHES) / page).clamp(1, 1 << 14);
        let bytes = threads * (pages * page + PATCHES);
        let at_hand = Mutex::new(workspace.reserve("change: surfaces at hand", bytes)?);
        let (workers, patches) = (Mutex::new(Vec::new()), AtomicU64::new(PATCHES));
        let piece = PIECE * (size_of::<Vertex>() + size_of::<ChangeRow>());
        let piece = piece as u64 + vertices.page_bytes();
        let one = |unit: &Unit<'_>| {
            let worker = lock(&workers).pop();
            let mut worker = worker.unwrap_or_else(|| Worker::new(self, pages as usize));
            let _held = unit.hold(piece);
            let mut piece = Vec::with_capacity(PIECE);
            self.read(unit.number(), &mut piece)?;
            let mut rows = Vec::with_capacity(piece.len());
            for group in self.from.cells.groups(&piece, Vertex::position) {
                workspace.check_cancel()?;
                worker.group(group, &mut rows)?;
            }
            let before = patches.fetch_max(worker.bytes(), Relaxed);
            if worker.bytes() > before {
                let more = worker.bytes() - PATCHES;
                lock(&at_hand).at_least(bytes + threads * more)?;
            }
            lock(&workers).push(worker);
            unit.advance(piece.len() as u64);
            work(unit, &piece, &rows)
        };
        let name = (step, "change: pieces");
        workspace.units(
            name,
            self.pieces(),
            |_| piece,
            one,
            |_, found| {
                each(found);
                Ok(())
            },
        )
    }
}

/// Measures in one thread.
struct Worker<'a> {
    measure: &'a Measure<'a>,
    from: Gatherer<'a>,
    to: Gatherer<'a>,
    own: Patch,
    other: Patch,
    /// The other surface around one vertex alone.
    far: Patch,
}

impl<'a> Worker<'a> {
    fn new(measure: &'a Measure<'a>, pages: usize) -> Self {
        Self {
            measure,
            from: Gatherer::new(measure.from, pages),
            to: Gatherer::new(measure.to, pages),
            own: Patch::default(),
            other: Patch::default(),
            far: Patch::default(),
        }
    }

    /// Bytes of its patches.
    fn bytes(&self) -> u64 {
        let patches = [&self.own, &self.other, &self.far];
        patches.iter().map(|patch| patch.bytes()).sum()
    }

    fn group(&mut self, group: &[Vertex], rows: &mut Vec<ChangeRow>) -> Result<()> {
        let radius = self.measure.scale.radius;
        let positions = group.iter().map(Vertex::position);
        let around = positions.fold(Box3::EMPTY, Box3::with);
        // The ends of the cylinder that holds points up to a radius before and behind a vertex.
        self.from
            .gather(&grown(around, 1.5 * radius), radius, &mut self.own)?;
        // A layer up to a radius away, and what belongs to it a radius behind.
        self.to
            .gather(&grown(around, 2.25 * radius), radius, &mut self.other)?;
        for vertex in group {
            rows.push(ChangeRow {
                index: vertex.number(),
                ..self.vertex(&vertex.point())?
            });
        }
        Ok(())
    }

    /// Measures change, uncertainty, area and volume at a vertex.
    fn vertex(&mut self, vertex: &Point) -> Result<ChangeRow> {
        let Scale {
            radius,
            farthest,
            registration,
        } = self.measure.scale;
        let Some(along) = self.own.normal(vertex, radius) else {
            return Ok(ChangeRow::of(State::Unused, [f64::NAN; 2], [0.0; 2]));
        };
        let axis = Axis {
            at: vertex.position,
            along,
        };
        let area = vertex.weight;
        let near = radius.min(farthest);
        if self.measure.presence {
            let is_there = self.other.has(&axis, radius, near) || self.layer(&axis)?.is_some();
            let state = if is_there { State::Same } else { State::Alone };
            return Ok(ChangeRow::of(state, [0.0; 2], [area, 0.0]));
        }
        let there = self.layer(&axis)?;
        let here = self.own.layer(&axis, radius, 0.0, |_| Ok(None))?;
        let (Some(there), Some(here)) = (there, here) else {
            let volume = self.volume(vertex, along, None)?;
            return Ok(ChangeRow::of(State::Alone, [f64::NAN; 2], [area, volume]));
        };
        let change = here.mean - there.mean;
        let error = (here.error2 + there.error2).sqrt();
        let uncertainty = NORMAL_95 * (error + registration);
        let is_significant = change.abs() > uncertainty;
        let (state, volume) = match is_significant {
            true => (State::Changed, self.volume(vertex, along, Some(change))?),
            false => (State::Same, 0.0),
        };
        Ok(ChangeRow::of(state, [change, uncertainty], [area, volume]))
    }

    /// The layer of the other surface that the cylinder meets. Farther away than a radius it is believed only if no part
    /// of that surface is nearer than half of its distance: a new wall has not moved there from the next wall behind it.
    fn layer(&mut self, axis: &Axis) -> Result<Option<Layer>> {
        let Scale {
            radius, farthest, ..
        } = self.measure.scale;
        let Self { to, other, far, .. } = self;
        let near = radius.min(farthest);
        let found = other.layer(axis, radius, near, |least| to.hit(axis, near, least))?;
        if found.is_some() {
            return Ok(found);
        }
        let most = farthest.min(2.0 * to.distance(axis.at)?);
        let mut reach = 2.0 * radius;
        loop {
            let limit = reach.min(most);
            to.gather(&axis.around(radius, limit + radius), radius, far)?;
            let found = far.layer(axis, radius, limit, |least| to.hit(axis, limit, least))?;
            if found.is_some() || limit >= most {
                return Ok(found);
            }
            reach *= 2.0;
        }
    }

    /// The volume between the surfaces that a vertex stands for: its area seen from above times the vertical
    /// distance. Above and below a cloud, which has no triangles, the distance along the normal tells it.
    fn volume(&mut self, vertex: &Point, along: V3, change: Option<f64>) -> Result<f64> {
        let plan = vertex.facing[2];
        if let Points::Cloud(_) = self.measure.to.items {
            let is_steep = along[2].abs() < STEEP;
            let change = change.filter(|_| !is_steep);
            return Ok(change.map_or(0.0, |change| plan * change / along[2]));
        }
        let up = Axis {
            at: vertex.position,
            along: [0.0, 0.0, if along[2] < 0.0 { -1.0 } else { 1.0 }],
        };
        let Scale {
            radius, farthest, ..
        } = self.measure.scale;
        let mut far = 2.0 * radius;
        loop {
            let limit = far.min(farthest);
            if let Some(t) = self.to.hit(&up, limit, 0.0)? {
                return Ok(-t * plan * up.along[2]);
            }
            if limit >= farthest {
                return Ok(0.0);
            }
            far *= 2.0;
        }
    }
}

/// Vertical part of a normal below which its surface is a wall: it has no height over a cloud.
const STEEP: f64 = 0.2;

/// Standard deviations within which 95 % of normally distributed errors lie.
const NORMAL_95: f64 = 1.96;
