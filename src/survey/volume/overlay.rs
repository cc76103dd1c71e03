//! The volumes between two surfaces, over where both are.
//!
//! The plan is divided into tiles ([`super::tiles`]), and each triangle is sent to the tiles that its box touches.
//! In a tile a grid finds the pairs of triangles whose boxes meet. The common part of a pair is a convex polygon;
//! there both are planes, and so is their difference, which is split where it changes sign. The sign of a part is
//! the product of those of both triangles: positive if both face up, or both down. So where several layers lie
//! above each other, material counts and the air between does not.

use super::convex::Convex;
use super::crop::Cutter;
use super::level::Found;
use super::report::Earth;
use super::sums::{Layers, Scales, plan_area};
use super::tiles::{Counts, Grid, Tiles};
use crate::pieces::{Pass, Piece, Surface};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Shuffle, row};
use outcrop_disk::workspace::{Unit, Workspace, lock};
use outcrop_geom::vector::V3;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

row! {
    /// A triangle, or a part of one, sent to a tile.
    pub(super) struct TileTriangle {
        /// The tile.
        tile: u32,
        /// The surface: 0 or 1.
        side: u32,
        /// Its corners, from the origin on.
        corners: [[f64; 3]; 3],
    }
    unpacked
}

/// Rows that are sorted by tile at a time.
const BATCH: usize = 1 << 15;

/// Bytes of a row while a batch is sent: rows, their copy in the order of tiles, and what is written.
const SENDING: u64 = 3 * size_of::<TileTriangle>() as u64;

/// Bytes of a row while a tile is measured: the row and its copy while parts are merged; box, cells and place.
const MEASURING: u64 = 2 * size_of::<TileTriangle>() as u64 + size_of::<Placed>() as u64 + 32;

/// Triangles of the second surface for each cell of a tile's grid.
const IN_CELL: usize = 2;

type P2 = [f64; 2];

/// Two surfaces with a common origin.
struct Pair<'a> {
    surfaces: [&'a Surface; 2],
    origin: V3,
    /// The box in plan where both are, from the origin on.
    bounds: [P2; 2],
    scales: Scales,
    crop: Option<&'a Cutter>,
}

impl<'a> Pair<'a> {
    fn of(surfaces: [&'a Surface; 2], crop: Option<&'a Cutter>) -> Self {
        let [a, b] = surfaces.map(Surface::bounds);
        let origin = a.min;
        let mut low = [0, 1].map(|k| a.min[k].max(b.min[k]) - origin[k]);
        let mut high = [0, 1].map(|k| a.max[k].min(b.max[k]) - origin[k]);
        if let Some([first, last]) = crop.map(Cutter::bounds) {
            low = [0, 1].map(|k| low[k].max(first[k]));
            high = [0, 1].map(|k| high[k].min(last[k]));
        }
        let height = (a.max[2] - b.min[2]).abs().max((b.max[2] - a.min[2]).abs());
        let extent = [0, 1].map(|k| a.max[k].max(b.max[k]) - a.min[k].min(b.min[k]));
        Self {
            surfaces,
            origin,
            bounds: [low, high],
            scales: Scales::of(extent, height),
            crop,
        }
    }

    fn pass(&self, step: &'static str, more: u64) -> Pass {
        Pass {
            step,
            name: "volume: triangles",
            origin: Some(self.origin),
            more,
        }
    }

    fn meets(&self, [low, high]: [P2; 2]) -> bool {
        let [first, last] = self.bounds;
        (0..2).all(|k| low[k] < last[k] && high[k] > first[k])
    }
}

/// Measures the volumes between two surfaces.
pub(crate) fn measure(
    surfaces: [&Surface; 2],
    crop: Option<&Cutter>,
    workspace: &Workspace,
) -> Result<Earth> {
    let pair = Pair::of(surfaces, crop);
    let bytes = (2 + workspace.threads as u64) * Counts::BYTES + Tiles::BYTES;
    let _held = workspace.reserve("volume: tiles", bytes)?;
    let tiles = count(&pair, workspace)?.tiles();
    let sent = Shuffle::<TileTriangle>::new("volume.tiles");
    let senders = AtomicUsize::new(0);
    let mut own = [Found::default(); 2];
    for (side, own) in own.iter_mut().enumerate() {
        *own = send(&pair, side, &tiles, (&sent, &senders), workspace)?;
    }
    let inbox = sent.open(workspace, tiles.count())?;
    let all = Mutex::new(Layers::default());
    let observer = &workspace.observer;
    observer.begin("pairs", "tiles", tiles.count() as u64);
    workspace.for_each_unit(
        "volume: tile",
        tiles.count(),
        |tile| inbox.rows(tile) as u64 * MEASURING + (64 << 10),
        |unit| {
            let size = inbox.rows(unit.number()) as u64 * MEASURING;
            let _held = unit.hold(size);
            let rows = inbox.get(unit, unit.number())?;
            let layers = of_tile(&rows, &tiles, unit.number(), &pair.scales);
            lock(&all).join(&layers);
            unit.advance(1);
            unit.check_cancel()
        },
    )?;
    observer.end();
    drop(inbox);
    sent.release(workspace)?;
    let layers = *lock(&all);
    Ok(report(&pair, own, layers))
}

fn report(pair: &Pair<'_>, own: [Found; 2], layers: Layers) -> Earth {
    let scales = &pair.scales;
    let [(mine, is_turned), (theirs, other_turned)] = own.map(|found| found.upward(scales));
    let layers = match is_turned == other_turned {
        true => layers,
        false => layers.turned(),
    };
    let [mine_down, theirs_down] = [mine, theirs].map(|layers| layers.facing[1]);
    let both = layers.cover();
    let value = |sum: i128| scales.area.value(sum);
    let is_closed = own[0].rim == 0;
    Earth {
        covered: (!is_closed).then(|| value(both)),
        only_this: (!is_closed).then(|| value(mine.cover() - both)),
        only_other: (own[1].rim != 0).then(|| value(theirs.cover() - both)),
        is_closed,
        is_turned,
        other_turned,
        facing_up: value(mine.facing[0]),
        facing_down: value(mine_down),
        other_down: value(theirs_down),
        ..Earth::of(&layers, scales)
    }
}

/// Counts the vertices of both surfaces, by corners of triangles.
fn count(pair: &Pair<'_>, workspace: &Workspace) -> Result<Counts> {
    let spare = Mutex::new(Vec::<Counts>::new());
    for surface in pair.surfaces {
        surface.for_each_piece(pair.pass("divide", 0), workspace, |_, piece| {
            let found = lock(&spare).pop();
            let mut counts = found.unwrap_or_else(|| Counts::new(pair.bounds));
            for [[x, y, _], ..] in &piece.triangles {
                if pair.meets([[*x, *y]; 2]) {
                    counts.add([*x, *y]);
                }
            }
            lock(&spare).push(counts);
            Ok(())
        })?;
    }
    let mut all = Counts::new(pair.bounds);
    lock(&spare).iter().for_each(|counts| all.join(counts));
    Ok(all)
}

/// Sends the triangles of a surface to tiles, the first one's cut by the region; returns sums of the surface alone.
fn send(
    pair: &Pair<'_>,
    side: usize,
    tiles: &Tiles,
    (sent, senders): (&Shuffle<TileTriangle>, &AtomicUsize),
    workspace: &Workspace,
) -> Result<Found> {
    let all = Mutex::new(Found::default());
    let pass = pair.pass("sort into tiles", BATCH as u64 * SENDING);
    pair.surfaces[side].for_each_piece(pass, workspace, |unit, piece| {
        let mut found = Found::default();
        found.add(piece, &pair.scales, pair.crop);
        lock(&all).join(&found);
        send_piece(
            pair,
            side,
            tiles,
            piece,
            |rows| {
                let sender = senders.fetch_add(1, Ordering::Relaxed);
                sent.send(unit, sender, rows)
            },
            unit,
        )
    })?;
    let all = *lock(&all);
    Ok(all)
}

fn send_piece(
    pair: &Pair<'_>,
    side: usize,
    tiles: &Tiles,
    piece: &Piece,
    send: impl Fn(Vec<TileTriangle>) -> Result<()>,
    unit: &Unit<'_>,
) -> Result<()> {
    let mut rows = Vec::with_capacity(BATCH);
    let mut parts = Vec::new();
    for triangle in &piece.triangles {
        parts.clear();
        match pair.crop.filter(|_| side == 0) {
            Some(crop) => crop.cut(triangle, |part| parts.extend(part.triangles())),
            None => parts.push(*triangle),
        }
        for &corners in &parts {
            let bounds = Convex::of(&corners).bounds();
            if plan_area(&corners) == 0.0 || !pair.meets(bounds) {
                continue;
            }
            let row = TileTriangle {
                tile: 0,
                side: side as u32,
                corners,
            };
            tiles.for_each(bounds, |tile| rows.push(TileTriangle { tile, ..row }));
            if rows.len() >= BATCH {
                send(std::mem::replace(&mut rows, Vec::with_capacity(BATCH)))?;
                unit.check_cancel()?;
            }
        }
    }
    send(rows)
}

/// A triangle of a tile.
#[derive(Debug, Clone, Copy)]
struct Placed {
    bounds: [P2; 2],
    /// The first and the last cell of the tile's grid.
    cells: [[usize; 2]; 2],
}

/// The volumes of the pairs of a tile.
fn of_tile(rows: &[TileTriangle], tiles: &Tiles, tile: usize, scales: &Scales) -> Layers {
    let mut layers = Layers::default();
    // Rows ascend by tile and side.
    let (first, second) = rows.split_at(rows.partition_point(|row| row.side == 0));
    if first.is_empty() || second.is_empty() {
        return layers;
    }
    let boxes = |rows: &[TileTriangle]| -> Vec<[P2; 2]> {
        let all = rows.iter().map(|row| Convex::of(&row.corners).bounds());
        all.collect()
    };
    let (own, others) = (boxes(first), boxes(second));
    let around = own.iter().fold(
        [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]],
        |b, [low, high]| {
            [
                [0, 1].map(|k| b[0][k].min(low[k])),
                [0, 1].map(|k| b[1][k].max(high[k])),
            ]
        },
    );
    let side = (second.len() / IN_CELL).isqrt().clamp(1, 1 << 10);
    let grid = Grid::new(around, [side, side]);
    let place = |bounds: [P2; 2]| Placed {
        bounds,
        cells: bounds.map(|at| grid.cell(at)),
    };
    let others: Vec<Placed> = others.into_iter().map(place).collect();
    let (starts, list) = by_cell(&others, side);
    for (row, bounds) in first.iter().zip(own) {
        let own = place(bounds);
        for (cell, [x, y]) in cells(own.cells).map(|[x, y]| (y * side + x, [x, y])) {
            for &number in &list[starts[cell] as usize..starts[cell + 1] as usize] {
                let other = &others[number as usize];
                let begin = [0, 1].map(|k| bounds[0][k].max(other.bounds[0][k]));
                let is_first = [0, 1].map(|k| own.cells[0][k].max(other.cells[0][k])) == [x, y];
                let is_near = (0..2).all(|k| begin[k] < bounds[1][k].min(other.bounds[1][k]));
                if is_first && is_near && tiles.has(tile, begin) {
                    let second = &second[number as usize].corners;
                    between(&row.corners, second, scales, &mut layers);
                }
            }
        }
    }
    layers
}

fn cells([low, high]: [[usize; 2]; 2]) -> impl Iterator<Item = [usize; 2]> {
    (low[1]..=high[1]).flat_map(move |y| (low[0]..=high[0]).map(move |x| [x, y]))
}

/// The triangles of each cell of a grid: where those of a cell begin, and their numbers.
fn by_cell(placed: &[Placed], side: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; side * side + 2];
    for [x, y] in placed.iter().flat_map(|one| cells(one.cells)) {
        starts[y * side + x + 2] += 1;
    }
    for cell in 0..side * side + 1 {
        starts[cell + 1] += starts[cell];
    }
    let mut list = vec![0; starts[side * side + 1] as usize];
    for (number, one) in placed.iter().enumerate() {
        for [x, y] in cells(one.cells) {
            let next = &mut starts[y * side + x + 1];
            list[*next as usize] = number as u32;
            *next += 1;
        }
    }
    (starts, list)
}

/// Adds the volume between two triangles where both are.
fn between(a: &[V3; 3], b: &[V3; 3], scales: &Scales, layers: &mut Layers) {
    let area = plan_area(b);
    // Counterclockwise, from the first corner on.
    let [origin, right, left] = if area > 0.0 { *b } else { [b[0], b[2], b[1]] };
    let local = |p: V3| [p[0] - origin[0], p[1] - origin[1], p[2]];
    let (right, left) = (local(right), local(left));
    let cross = |a: V3, b: V3| a[0] * b[1] - a[1] * b[0];
    let sides = [
        |_: V3, right: V3, p: V3| right[0] * p[1] - right[1] * p[0],
        |left: V3, _: V3, p: V3| p[0] * left[1] - p[1] * left[0],
        |left: V3, right: V3, p: V3| {
            let (d, e) = (
                [left[0] - right[0], left[1] - right[1]],
                [p[0] - right[0], p[1] - right[1]],
            );
            d[0] * e[1] - d[1] * e[0]
        },
    ];
    let corners = a.map(local);
    let beyond =
        |side: &fn(V3, V3, V3) -> f64| corners.iter().all(|p| side(left, right, *p) <= 0.0);
    let sides = sides.map(|side| side as fn(V3, V3, V3) -> f64);
    if sides.iter().any(beyond) {
        return;
    }
    let mut part = Convex::of(&corners);
    for side in sides {
        part.keep(|p| side(left, right, p));
        if part.is_empty() {
            return;
        }
    }
    let whole = cross(right, left);
    for corner in part.corners_mut() {
        // Rounding must not lead out of a thin triangle, nor its height out of those of its corners.
        let along = (cross(*corner, left) / whole).clamp(0.0, 1.0);
        let up = (cross(right, *corner) / whole).clamp(0.0, 1.0 - along);
        corner[2] -= origin[2] + along * (right[2] - origin[2]) + up * (left[2] - origin[2]);
    }
    part.add_to(layers, scales, area.signum());
}
