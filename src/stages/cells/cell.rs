//! Computation of one cell: neighbours, plane, disk, clipping up to the radius of security (paper, 3.3 and
//! 3.4).

use super::directions::{Directions, DiskStats};
use super::fit::{Fit, Widen, fit_from};
use crate::ids::{Id, Ids};
use crate::levels::Levels;
use crate::order::PointStore;
use crate::spacing::{Density, Nearby, Standing};
use crate::tiles::near::Query;
use crate::tiles::neighbors::Neighbors;
use crate::tiles::walk::{PageCache, Walk};
use crate::tiles::wanted::Wanted;
use outcrop_disk::error::Result;
use outcrop_geom::Point;
use outcrop_geom::aabb::Aabb;
use outcrop_paper::clip::wrap::Wrapper;
use outcrop_paper::clip::{Cell, Spheres};
use outcrop_paper::method::METHOD;
use outcrop_paper::plane::Normal;
use std::cell::OnceCell;

/// The radius of the disk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DiskRadius {
    /// Twice the distance of the last neighbour used for the plane.
    Auto,
    /// Fixed, in steps.
    Steps(f64),
}

/// Outcome for one point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The cell is complete and certified; its triples were reported.
    Complete,
    /// The points of the tile do not certify the cell; nothing was reported.
    Uncertain,
    /// All neighbours are on one line: no plane, no cell.
    NoPlane,
    /// The point lies far off the surface of its neighbours: no cell.
    OffSurface,
}

/// How coarse points are, as [`coarseness`](crate::spacing::coarseness).
#[derive(Debug, Default)]
struct Coarse {
    /// The points that are noted.
    ids: Ids,
    /// By place; empty as long as none is coarse.
    levels: Levels,
}

impl Coarse {
    fn note(&mut self, id: Id, level: u8) {
        if self.levels.is_empty() {
            self.levels = Levels::new(self.ids.len());
        }
        if self.ids.contains(&id) {
            self.levels.set(self.ids.place(id), level);
        }
    }
}

/// Computes cells one after another in the same memory.
#[derive(Debug)]
pub struct CellMaker<'a> {
    pub(super) neighbors: usize,
    radius: DiskRadius,
    pub(super) widen: Widen,
    /// If given, points off the surface get no cell.
    density: Option<Density<'a>>,
    /// How coarse the points of its tile are.
    coarse: Coarse,
    /// The normals of the points, if they bring any.
    directions: Option<Directions>,
    pub(super) cell: Cell,
    pub(super) wrapper: Box<Wrapper>,
}

impl<'a> CellMaker<'a> {
    /// For planes through `neighbors` neighbours and disks of `radius`.
    #[must_use]
    pub fn new(
        neighbors: usize,
        radius: DiskRadius,
        widen: Widen,
        density: Option<Density<'a>>,
    ) -> Self {
        Self {
            neighbors,
            radius,
            widen,
            density,
            coarse: Coarse::default(),
            directions: None,
            cell: Cell::new(0, [0, 0, 1 << 24], 1.0),
            wrapper: Box::default(),
        }
    }

    /// Notes how coarse the points of a tile are, which takes [`Levels::size`] bytes.
    pub(super) fn note_coarse(&mut self, ids: Ids) {
        self.coarse.ids = ids;
    }

    /// How coarse the points of the tile are, by place; empty if none is.
    pub(super) fn coarse(self) -> Levels {
        self.coarse.levels
    }

    /// Takes the directions of disks from the normals of the points, too.
    pub(super) fn set_directions(&mut self, directions: Directions) {
        self.directions = Some(directions);
    }

    /// Bytes and counts of the normals of the points.
    pub(super) fn of_directions(&self) -> (u64, DiskStats) {
        let directions = self.directions.as_ref();
        directions.map_or_else(Default::default, |d| (d.bytes(), d.stats()))
    }

    /// The normal and the radius of a point's disk, or the reason why it has none. `near` are its nearest
    /// neighbours.
    pub(super) fn disk(
        &mut self,
        id: Id,
        fit: &Fit,
        near: Nearby<'_>,
    ) -> std::result::Result<(Normal, f64), Outcome> {
        let estimated = fit.plane.normal;
        let directions = self.directions.as_mut();
        let fitted = (&fit.moments, fit.last2);
        let normal = directions.map_or(estimated, |d| d.choose(id, estimated, fitted));
        let normal = normal.ok_or(Outcome::NoPlane)?;
        // How a point lies to its neighbours depends on these, not on the normal that it brings.
        if let (Some(density), Some(_)) = (self.density, estimated) {
            match density.standing(id, fit.near2, &fit.moments, near) {
                Standing::Off => return Err(Outcome::OffSurface),
                Standing::Coarse(level) => self.coarse.note(id, level),
                Standing::Usual => {}
            }
        }
        let radius = match self.radius {
            DiskRadius::Auto => METHOD.disk.reach * (fit.last2 as f64).sqrt(),
            DiskRadius::Steps(steps) => steps,
        };
        Ok((normal, radius))
    }

    /// Starts the cell of a point with the neighbours `near`, or returns the reason why it has none.
    fn start(&mut self, id: Id, fit: &Fit, near: &Neighbors) -> std::result::Result<(), Outcome> {
        let all = near.columns();
        let count = self.neighbors.min(near.len());
        let near = Nearby {
            ids: bytemuck::cast_slice(&all.ids[..count]),
            differences: [all.x, all.y, all.z].map(|axis| &axis[..count]),
        };
        let (normal, radius) = self.disk(id, fit, near)?;
        self.cell.start(id.get(), normal, radius);
        Ok(())
    }

    /// Computes the cell of a point from the points in its tile and halo. `each` receives the ids at its
    /// corners.
    ///
    /// # Errors
    /// None today; the signature is that of [`CellMaker::from_store`].
    pub fn from_tile(
        &mut self,
        query: &mut Query<'_>,
        each: impl FnMut(u32, u32),
    ) -> Result<Outcome> {
        let fit = fit_from(query, self.neighbors, self.widen)?;
        Ok(fit.map_or(Outcome::Uncertain, |fit| self.from_fit(query, &fit, each)))
    }

    /// As [`CellMaker::from_tile`], if the plane is known.
    pub fn from_fit(
        &mut self,
        query: &mut Query<'_>,
        fit: &Fit,
        each: impl FnMut(u32, u32),
    ) -> Outcome {
        match self.start(query.id(), fit, query.near()) {
            Ok(()) => self.clip(query, each),
            Err(outcome) => outcome,
        }
    }

    /// Clips the cell by the points that a query lists, and by farther ones, until it is complete.
    pub(super) fn clip(&mut self, query: &mut Query<'_>, each: impl FnMut(u32, u32)) -> Outcome {
        loop {
            let next = self.cell.clip_nearest(query.near().columns(), 0);
            if next < query.near().len() || self.cell.reach2() <= query.complete2() {
                self.cell.triples(each);
                return Outcome::Complete;
            }
            // On scan lines, thousands of points are nearer than the farthest one that can touch the cell.
            let wanted = Touching::new(&self.cell, query.point());
            if !query.extend_where(self.cell.reach2(), &wanted) {
                return Outcome::Uncertain;
            }
        }
    }

    /// Computes the cell of a point from the whole store.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn from_store(
        &mut self,
        store: &PointStore,
        cache: &mut PageCache,
        id: Id,
        point: Point,
        each: impl FnMut(u32, u32),
    ) -> Result<Outcome> {
        let mut source = (Walk::new(store, cache, id, point), Neighbors::default());
        let Some(fit) = fit_from(&mut source, self.neighbors, self.widen)? else {
            return Ok(Outcome::Uncertain);
        };
        if let Err(outcome) = self.start(id, &fit, &source.1) {
            return Ok(outcome);
        }
        let (mut walk, mut near) = source;
        while !near.is_empty() && self.cell.clip_nearest(near.columns(), 0) == near.len() {
            let wanted = Touching::new(&self.cell, point);
            walk.list_where(self.cell.reach2(), &wanted, &mut near)?;
        }
        self.cell.triples(each);
        Ok(Outcome::Complete)
    }
}

/// Selects the points that can change the cell of the point `own`.
struct Touching<'a> {
    cell: &'a Cell,
    own: Point,
    spheres: OnceCell<Spheres<'a>>,
}

impl<'a> Touching<'a> {
    fn new(cell: &'a Cell, own: Point) -> Self {
        let spheres = OnceCell::new();
        Self { cell, own, spheres }
    }
}

impl Wanted for Touching<'_> {
    fn may_be_in(&self, bounds: &Aabb) -> bool {
        let from = |at: Point| std::array::from_fn(|k| f64::from(at[k]) - f64::from(self.own[k]));
        let spheres = self.spheres.get_or_init(|| self.cell.spheres());
        spheres.meet(from(bounds.min), from(bounds.max))
    }

    fn pick(&self, columns: [&[i32]; 3], places: &mut Vec<u32>) {
        self.cell.touching(columns, self.own, places);
    }
}
