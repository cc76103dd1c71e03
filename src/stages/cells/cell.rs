//! Computation of one cell: neighbours, plane, disk, clipping up to the radius of security (paper, 3.3 and
//! 3.4).

use super::directions::{Directions, DiskStats};
use crate::ids::Id;
use crate::order::PointStore;
use crate::spacing::{Density, Nearby, Standing};
use crate::tiles::near::{Query, Sums};
use crate::tiles::neighbors::Neighbors;
use crate::tiles::walk::{PageCache, Walk};
use crate::tiles::wanted::Wanted;
use outcrop_disk::error::Result;
use outcrop_geom::Point;
use outcrop_geom::aabb::Aabb;
use outcrop_geom::clip::wrap::Wrapper;
use outcrop_geom::clip::{Cell, Spheres};
use outcrop_geom::kernels::Level;
use outcrop_geom::method::METHOD;
use outcrop_geom::plane::{Moments, Normal, Plane};
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

/// A source of the neighbours of a point.
trait Source {
    /// The neighbours found so far, nearest first.
    fn near(&self) -> &Neighbors;
    /// Finds `count` neighbours, or all other points if there are fewer; false if they cannot be certified.
    fn reach(&mut self, count: usize) -> Result<bool>;
    /// The sums over the `count` nearest neighbours, or over all other points if there are fewer, and the
    /// number of points summed; `None` if they cannot be certified.
    fn sums(&mut self, count: usize) -> Result<Option<(Sums, usize)>>;
}

impl Source for Query<'_> {
    fn near(&self) -> &Neighbors {
        Query::near(self)
    }

    fn reach(&mut self, count: usize) -> Result<bool> {
        Ok(self.extend_to(count))
    }

    fn sums(&mut self, count: usize) -> Result<Option<(Sums, usize)>> {
        Ok(Query::sums(self, count).map(|sums| (sums, count)))
    }
}

/// A walk through the whole store, and the neighbours found so far.
impl Source for (Walk<'_>, Neighbors) {
    fn near(&self) -> &Neighbors {
        &self.1
    }

    fn reach(&mut self, count: usize) -> Result<bool> {
        let (walk, near) = self;
        while near.len() < count
            && let Some(next) = walk.advance()?
        {
            near.push(next);
        }
        Ok(true)
    }

    fn sums(&mut self, count: usize) -> Result<Option<(Sums, usize)>> {
        self.reach(count)?;
        let used = count.min(self.1.len());
        Ok(Some((self.1.sums(used, Level::best()), used)))
    }
}

/// The plane fitted to a point's neighbours, and the moments it follows from.
#[derive(Debug, Clone, Copy)]
pub struct Fit {
    /// The normal, and whether the neighbours span a plane.
    pub plane: Plane,
    /// The sums over the neighbours.
    pub moments: Moments,
    /// Squared distance of the last neighbour used.
    pub last2: u64,
    /// Squared distance of the last of the requested neighbours, before widening.
    pub near2: u64,
}

impl Fit {
    /// The plane of neighbours given by their sums.
    #[must_use]
    pub fn of(sums: Sums) -> Self {
        Self::with(sums.moments.plane(), sums)
    }

    /// As [`Fit::of`], if the plane of the sums is known.
    #[must_use]
    pub fn with(plane: Plane, sums: Sums) -> Self {
        Self {
            plane,
            moments: sums.moments,
            last2: sums.last2,
            near2: sums.last2,
        }
    }
}

fn fit_from(source: &mut impl Source, neighbors: usize, widen: Widen) -> Result<Option<Fit>> {
    if !source.reach(neighbors)? {
        return Ok(None);
    }
    let mut used = neighbors.min(source.near().len());
    let mut fit = Fit::of(source.near().sums(used, Level::best()));
    let mut wanted = neighbors;
    for _ in 0..METHOD.plane.doublings {
        if widen.is_enough(&fit.plane) || used < wanted {
            break;
        }
        // Only the set of neighbours matters here, not yet their order.
        wanted *= 2;
        let Some((sums, count)) = source.sums(wanted)? else {
            return Ok(None);
        };
        used = count;
        fit = Fit {
            near2: fit.near2,
            ..Fit::of(sums)
        };
    }
    Ok(Some(fit))
}

/// When the fit of a plane doubles the number of neighbours, up to eight times the requested one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Widen {
    /// Never: exactly the requested neighbours.
    Never,
    /// While the neighbours lie on a line.
    OnLines,
    /// While the neighbours lie on a narrow band, such as two scan lines.
    OnBands,
}

impl Widen {
    /// True if a plane needs no more neighbours.
    pub(super) fn is_enough(self, plane: &Plane) -> bool {
        match self {
            Self::Never => true,
            Self::OnLines => plane.spans,
            Self::OnBands => plane.wide,
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
    /// The points that are coarser than their patch, with their numbers.
    pub(super) coarse: Vec<(Id, u8)>,
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
            coarse: Vec::new(),
            directions: None,
            cell: Cell::new(0, [0, 0, 1 << 24], 1.0),
            wrapper: Box::default(),
        }
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
                Standing::Coarse(level) => self.coarse.push((id, level)),
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
            ids: &all.ids[..count],
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
        let Some(fit) = fit_from(query, self.neighbors, self.widen)? else {
            return Ok(Outcome::Uncertain);
        };
        if let Err(outcome) = self.start(Id::new(query.id()), &fit, query.near()) {
            return Ok(outcome);
        }
        Ok(self.clip(query, each))
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
        let mut source = (
            Walk::new(store, cache, id.get(), point),
            Neighbors::default(),
        );
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

/// The plane of the `neighbors` nearest, from the points in a tile and its halo; `None` if they cannot be
/// certified.
///
/// # Errors
/// None today; see `fit_in_store`.
pub fn fit_in_tile(query: &mut Query<'_>, neighbors: usize, widen: Widen) -> Result<Option<Fit>> {
    fit_from(query, neighbors, widen)
}

/// As [`fit_in_tile`], from the whole store.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub fn fit_in_store(
    store: &PointStore,
    cache: &mut PageCache,
    id: u32,
    point: Point,
    neighbors: usize,
    widen: Widen,
) -> Result<Option<Fit>> {
    let mut source = (Walk::new(store, cache, id, point), Neighbors::default());
    fit_from(&mut source, neighbors, widen)
}

/// As [`fit_in_store`], with the neighbours, nearest first: at least the `least` nearest.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub fn fit_and_near_in_store(
    store: &PointStore,
    cache: &mut PageCache,
    id: u32,
    point: Point,
    (neighbors, least): (usize, usize),
    widen: Widen,
) -> Result<Option<(Fit, Neighbors)>> {
    let mut source = (Walk::new(store, cache, id, point), Neighbors::default());
    let fit = fit_from(&mut source, neighbors, widen)?;
    source.reach(least)?;
    Ok(fit.map(|fit| (fit, source.1)))
}

/// The `count` nearest neighbours of a point, or all other points if there are fewer, from the whole store.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub fn near_in_store(
    store: &PointStore,
    cache: &mut PageCache,
    id: u32,
    point: Point,
    count: usize,
) -> Result<Neighbors> {
    let mut source = (Walk::new(store, cache, id, point), Neighbors::default());
    source.reach(count)?;
    Ok(source.1)
}
