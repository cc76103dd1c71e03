//! A cloud as the program processes it, with the true normals.

use crate::Arguments;
use crate::candidates::Candidate;
use crate::error::Result;
use outcrop::params::Params;
use outcrop_cloudgen::{Cloud, Generator, Kind};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_geom::Point;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::{TileRanges, Widen};
use outcrop_stages::cells::{each_neighborhood, each_plane};
use outcrop_stages::ids::Id;
use outcrop_stages::order::{Orderer, PAGE, PointStore};
use outcrop_stages::smooth::{Relaxing, relax};
use outcrop_stages::tiles::neighbors::Neighbors;
use std::collections::HashMap;
use std::sync::Arc;

/// Steps of the lattice per size of a cloud.
const STEPS: f64 = (1u64 << 28) as f64;

/// Distance of a stray point from the surface, in mean spacings.
const STRAY: f64 = 3.0;

/// A cloud, ordered and relaxed.
pub(crate) struct World {
    pub(crate) store: PointStore,
    pub(crate) generator: Generator,
    pub(crate) workspace: Workspace,
    /// Root of the area per point.
    pub(crate) spacing: f64,
    /// The relaxed positions, if any point moved.
    relaxed: Option<PointStore>,
    neighbors: usize,
    /// True normals by id.
    truth: Vec<[f64; 3]>,
}

/// Name of the world in the table.
pub(crate) fn name(kind: Kind, args: &Arguments) -> String {
    let mut name = kind.to_string();
    if let Some(ratio) = args.scanlines {
        name += &format!(", lines 1:{ratio}");
    }
    if let Some(offset) = args.layers {
        name += &format!(", 2 layers {offset}×");
    }
    if args.noise > 0.0 {
        name += &format!(", noise {}", args.noise);
    }
    if args.strays > 0.0 {
        name += &format!(", {} % strays", 100.0 * args.strays);
    }
    name
}

/// The way, in spacings along the normal, by which a point is off the surface: 0 for most.
fn stray(index: u64, fraction: f64) -> f64 {
    if fraction <= 0.0 {
        return 0.0;
    }
    let every = (1.0 / fraction).round().max(1.0) as u64;
    match index % (2 * every) {
        0 => STRAY,
        n if n == every => -STRAY,
        _ => 0.0,
    }
}

impl World {
    pub(crate) fn new(kind: Kind, args: &Arguments) -> Result<Self> {
        let mut cloud = Cloud::new(kind).points(args.points).seed(args.seed);
        cloud.scanlines = args.scanlines;
        let area = cloud.generator()?.area().unwrap_or_default();
        let spacing = (area / args.points.max(1) as f64).sqrt();
        cloud.noise = args.noise * spacing;
        if let Some(offset) = args.layers {
            cloud = cloud.layers(2, offset * spacing);
        }
        let generator = cloud.generator()?;
        let mut normals: HashMap<Point, [f64; 3]> = HashMap::new();
        let step = cloud.size / STEPS;
        for index in 0..generator.len() {
            let sample = generator.sample(index);
            let away = stray(index, args.strays) * spacing;
            let place = std::array::from_fn(|axis| {
                let c = sample.position[axis] + away * sample.normal[axis];
                ((c + cloud.size) / step).round() as i32
            });
            normals.entry(place).or_insert(sample.normal);
        }
        let points: Vec<Point> = normals.keys().copied().collect();
        let pool = MemoryPool::new(outcrop::default_memory())?;
        let threads = outcrop::default_threads();
        let folder = std::env::temp_dir();
        let workspace = Workspace::new(&folder, pool, threads, Arc::new(Silent), Cancel::new())?;
        let orderer = Orderer::new(&workspace)?;
        orderer.push(&workspace, &points)?;
        let store = orderer.finish(&workspace, PAGE)?.0.open(&workspace)?;
        let block = Params::default().block;
        let tiles = TileRanges::new(Blocks::new(store.len(), block), block);
        let relaxing = Relaxing {
            neighbors: args.neighbors,
            rounds: Params::default().relax,
            step: 1.0,
        };
        let relaxed = relax(&store, tiles, relaxing, &workspace)?.store;
        let relaxed = relaxed.map(|store| store.open(&workspace)).transpose()?;
        let ordered = store.slice(0..store.len())?;
        let truth = ordered.iter().map(|p| normals.get(p).copied());
        Ok(Self {
            truth: truth.map(Option::unwrap_or_default).collect(),
            neighbors: args.neighbors,
            relaxed,
            store,
            generator,
            workspace,
            spacing,
        })
    }

    pub(crate) fn tiles(&self) -> TileRanges {
        let block = Params::default().block;
        TileRanges::new(Blocks::new(self.store.len(), block), block)
    }

    /// Positions of a store in the generator's unit.
    pub(crate) fn positions(&self, store: &PointStore) -> Result<Vec<[f64; 3]>> {
        let size = self.generator.cloud().size;
        let unit = |p: &Point| p.map(|c| f64::from(c) * (size / STEPS) - size);
        Ok(store.slice(0..store.len())?.iter().map(unit).collect())
    }

    /// For each id: a neighbour's true normal makes an angle with this cosine or less.
    pub(crate) fn near_edges(&self, cosine: f64) -> Result<Vec<bool>> {
        let k = self.neighbors;
        let mut found = vec![false; self.store.len()];
        let of = |_, near: &Neighbors| -> Vec<Id> { near.iter().take(k).map(|n| n.id).collect() };
        let (unit, all) = (self.workspace.unit(), 0..self.store.len());
        each_neighborhood(&unit, &self.store, all, k, of, |id, _, near| {
            let own = self.truth[id];
            found[id] = near.iter().any(|&n| {
                let other = self.truth[n.index()];
                own[0] * other[0] + own[1] * other[1] + own[2] * other[2] <= cosine
            });
        })?;
        Ok(found)
    }

    /// The relaxed positions, by which the robust method connects points.
    pub(crate) fn shape(&self) -> &PointStore {
        self.relaxed.as_ref().unwrap_or(&self.store)
    }

    /// Normals of the program's planes.
    pub(crate) fn planes(&self, store: &PointStore, widen: Widen) -> Result<Vec<Option<[f64; 3]>>> {
        let mut normals = vec![None; store.len()];
        each_plane(
            &self.workspace.unit(),
            store,
            0..store.len(),
            self.neighbors,
            widen,
            |_| true,
            |id, _, fit| {
                normals[id] = fit.plane.normal.map(|n| n.map(f64::from));
            },
        )?;
        Ok(normals)
    }

    /// Normals by another method.
    pub(crate) fn tried(
        &self,
        store: &PointStore,
        candidate: &Candidate,
    ) -> Result<Vec<Option<[f64; 3]>>> {
        let mut normals = vec![None; store.len()];
        let count = candidate.most * self.neighbors;
        let of = |_, near: &_| (candidate.normal)(near, self.neighbors);
        let (unit, all) = (self.workspace.unit(), 0..store.len());
        each_neighborhood(&unit, store, all, count, of, |id, _, normal| {
            normals[id] = *normal;
        })?;
        Ok(normals)
    }

    /// Angles to the true normals in degrees; 90 where there is no normal.
    pub(crate) fn errors(&self, normals: &[Option<[f64; 3]>]) -> Vec<f64> {
        let angle = |(n, t): (&Option<[f64; 3]>, &[f64; 3])| {
            let Some(n) = n else { return 90.0 };
            let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let cosine = dot(n, t).abs() / (dot(n, n) * dot(t, t)).sqrt();
            cosine.min(1.0).acos().to_degrees()
        };
        normals.iter().zip(&self.truth).map(angle).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[test]
    fn a_plane_has_no_errors_and_a_layer_is_where_it_was_put() {
        let args =
            Arguments::parse_from(["normals", "plane", "--points", "2000", "--layers", "0.5"]);
        let world = World::new(Kind::Plane, &args).unwrap();
        let truth: Vec<_> = world
            .truth
            .iter()
            .map(|n| Some(n.map(|c| -7.0 * c)))
            .collect();
        assert!(world.errors(&truth).iter().all(|e| *e < 1e-5));
        assert!(world.errors(&vec![None; 2000]).iter().all(|e| *e == 90.0));
        let positions = world.positions(&world.store).unwrap();
        let off: Vec<_> = positions
            .iter()
            .map(|p| world.generator.distance(*p) / world.spacing)
            .collect();
        let near = |d: f64| off.iter().filter(|o| (*o - d).abs() < 1e-3).count();
        assert_eq!((near(0.0), near(0.5)), (1000, 1000));
        assert!(world.near_edges(0.866).unwrap().iter().all(|n| !n));
    }
}
