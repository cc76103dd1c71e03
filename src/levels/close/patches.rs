//! Patches of all loops, batch by batch.

use super::base::{Base, block};
use super::lid::{Loop, Patch, TAUT, lid, taut};
use super::membrane::{self, membrane};
use super::near::{Near, Placed};
use super::rows::{NewVertex, PatchTriangle, PlacedPatch};
use super::{Kind, Way};
use crate::meet::norm;
use outcrop_disk::error::Result;
use outcrop_disk::spill::Table;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::vector::{V3, add, cross, sub};
use serde::{Deserialize, Serialize};

/// A loop is closed smoothly where the triangles of the mesh along it lean by less than 60 degrees from its plane, in
/// the mean: there the surface runs on into the hole. The border of a half sphere has 90 degrees, and an outline 180.
const RUNS_ON: f64 = 0.5;

/// The way in which a loop was closed, and counts of its new triangles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Closing {
    /// How it is closed.
    pub way: Way,
    /// Edges of the loop.
    pub edges: u64,
    /// Triangles.
    pub triangles: u64,
    /// Their area.
    pub area: f64,
    /// Triangles of a floor that overlap others.
    pub overlaps: u64,
    /// True if it was to be smooth and is too long.
    pub is_too_long: bool,
}

/// Patches by batch, of the first try or a later one.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Patches {
    pub vertices: Table<NewVertex>,
    pub triangles: Table<PatchTriangle>,
    /// The triangles with positions, to be tested.
    pub placed: Table<PlacedPatch>,
}

/// The shape of the patches that are made in one try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// As is asked for.
    Wanted(Kind),
    /// Lids.
    Lid,
    /// Lids of least area; loops that are too long for them are not closed in this try.
    Taut,
}

/// Which loops are closed, and how.
pub(super) struct Wish<'a> {
    /// Number of the try.
    pub number: u32,
    pub shape: Shape,
    pub base: &'a Base,
    /// The loops that are closed, ascending; all if it is none.
    pub only: Option<&'a [u32]>,
}

impl Wish<'_> {
    fn way(&self, number: u32, around: &Loop) -> (Way, bool) {
        if self.base.loops.binary_search(&number).is_ok() {
            return (Way::Base, false);
        }
        let smooth = match self.shape {
            Shape::Lid | Shape::Taut | Shape::Wanted(Kind::Lids) => false,
            Shape::Wanted(Kind::Smooth) => true,
            Shape::Wanted(Kind::Auto | Kind::Base(_)) => around.runs_on() >= RUNS_ON,
        };
        let is_too_long = smooth && around.len() > membrane::LONGEST;
        match smooth && !is_too_long {
            true => (Way::Smooth, false),
            false => (Way::Lid, is_too_long),
        }
    }

    /// The loops of a batch that are closed.
    fn wants(&self, number: u32) -> bool {
        self.only
            .is_none_or(|only| only.binary_search(&number).is_ok())
    }
}

/// Bytes of memory for closing a loop of so many vertices: ears and their grid, or a refined patch.
fn bytes(longest: u64, shape: Shape) -> u64 {
    let smooth = !matches!(shape, Shape::Lid | Shape::Taut | Shape::Wanted(Kind::Lids));
    let inside = match smooth && longest <= membrane::LONGEST as u64 {
        true => (longest * longest / 4).min(membrane::MOST as u64),
        false => 0,
    };
    // The table of the triangulation of least weight.
    let table = longest.min(TAUT as u64).pow(2) * 64;
    400 * longest + 900 * inside + table + (1 << 20)
}

/// Closes the loops.
pub(super) fn close(
    near: &Near<'_>,
    wish: &Wish<'_>,
    workspace: &Workspace,
) -> Result<(Patches, Vec<(u32, Closing)>)> {
    let number = wish.number;
    let name = |what: &str| format!("close.{what} {number}");
    let batches = near.batches();
    let patches = Patches {
        vertices: Table::new(&name("vertices"), batches),
        triangles: Table::new(&name("triangles"), batches),
        placed: Table::new(&name("placed"), batches),
    };
    let observer = &workspace.observer;
    let all = (0..batches).map(|batch| near.batch(batch).vertices).sum();
    observer.begin("close loops", "edges", all);
    let mut closings = Vec::new();
    workspace.units(
        (format!("patches {number}"), "close: patches"),
        batches,
        |batch| near.bytes(batch) + bytes(near.batch(batch).longest, wish.shape),
        |unit| one(unit, near, wish, &patches),
        |_, found: Vec<(u32, Closing)>| {
            closings.extend(found);
            Ok(())
        },
    )?;
    observer.end();
    closings.sort_unstable_by_key(|(number, _)| *number);
    Ok((patches, closings))
}

fn one(
    unit: &Unit<'_>,
    near: &Near<'_>,
    wish: &Wish<'_>,
    patches: &Patches,
) -> Result<Vec<(u32, Closing)>> {
    let batch = unit.number();
    let first = near.batch(batch).first;
    let last = first + near.batch(batch).loops;
    let mut made = Made::default();
    if (first..last).any(|number| wish.wants(number)) {
        for (number, placed) in (first..).zip(near.load(unit, batch)?) {
            unit.check_cancel()?;
            if wish.wants(number) {
                made.add(number, &placed, wish);
            }
        }
    }
    unit.advance(near.batch(batch).vertices);
    patches.vertices.put(unit, batch, &made.vertices)?;
    patches.triangles.put(unit, batch, &made.triangles)?;
    patches.placed.put(unit, batch, &made.placed)?;
    Ok(made.closings)
}

/// The patches of a batch.
#[derive(Default)]
struct Made {
    vertices: Vec<NewVertex>,
    triangles: Vec<PatchTriangle>,
    placed: Vec<PlacedPatch>,
    closings: Vec<(u32, Closing)>,
}

impl Made {
    fn add(&mut self, number: u32, placed: &Placed, wish: &Wish<'_>) {
        let around = &placed.around;
        let (way, is_too_long) = wish.way(number, around);
        let (patch, overlaps) = match way {
            Way::Smooth => (membrane(around, &placed.ring), 0),
            Way::Lid if wish.shape == Shape::Taut => match taut(around) {
                Some(patch) => (patch, 0),
                None => return,
            },
            Way::Lid => (lid(around), 0),
            Way::Base => block(around, wish.base.z - placed.origin[2]),
        };
        let area = self.take(number, placed, &patch);
        let closing = Closing {
            way,
            edges: around.len() as u64,
            triangles: patch.triangles.len() as u64,
            area,
            overlaps,
            is_too_long,
        };
        self.closings.push((number, closing));
    }

    /// Appends a patch; returns its area.
    fn take(&mut self, number: u32, placed: &Placed, patch: &Patch) -> f64 {
        let (n, before) = (placed.around.len() as u32, self.vertices.len() as u32);
        let numbered = |corners: [u32; 3]| {
            let new = |k: usize| corners[k] >= n;
            let mask = (0..3).map(|k| u32::from(new(k)) << k).sum();
            let vertex = |k: usize| match new(k) {
                true => before + corners[k] - n,
                false => placed.around.vertices[corners[k] as usize],
            };
            (mask, [0, 1, 2].map(vertex))
        };
        for (position, parents) in patch.new.iter().zip(&patch.parents) {
            let (mask, parents) = numbered(*parents);
            self.vertices.push(NewVertex {
                mask,
                parents,
                position: add(*position, placed.origin),
            });
        }
        let point = |v: u32| match v.checked_sub(n) {
            None => placed.around.points[v as usize],
            Some(new) => patch.new[new as usize],
        };
        let mut area = 0.0;
        for corners in &patch.triangles {
            let points: [V3; 3] = corners.map(point);
            let [a, b, c] = points;
            area += norm(cross(sub(b, a), sub(c, a))) / 2.0;
            let positions = corners.map(|v| match v.checked_sub(n) {
                None => placed.exact[v as usize],
                Some(new) => add(patch.new[new as usize], placed.origin),
            });
            let (mask, corners) = numbered(*corners);
            self.triangles.push(PatchTriangle {
                number,
                mask,
                corners,
            });
            self.placed.push(PlacedPatch {
                number,
                unused: 0,
                positions,
            });
        }
        area
    }
}
