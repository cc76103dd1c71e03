//! Pictures and distributions of the finished surface, for a report that is a page (if asked for).
//!
//! Blocks are drawn by all threads into one depth buffer for each view, so the memory is that of the pictures.
//! Nothing depends on the order of blocks: pixels keep the largest value, counts are integers, and edges are sorted.

mod border;
mod source;
#[cfg(test)]
mod tests;

pub use source::Finished;

use border::{BorderEdge, Boundary};
use outcrop_disk::error::Result;
use outcrop_disk::spill::Sorter;
use outcrop_disk::workspace::memory::{bytes_of, table_bytes};
use outcrop_disk::workspace::{Unit, Workspace, lock};
use outcrop_draw::histogram::{Histogram, Tally};
use outcrop_draw::picture::{Canvas, Map, OBLIQUE, Picture, TOP, canvas_bytes, map_bytes};
use outcrop_geom::{Point, distance2};
use outcrop_paper::method::METHOD;
use outcrop_raster::{Vec3, View};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::Id;
use outcrop_stages::order::PointStore;
use outcrop_stages::spacing::{Spacings, spacing2};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use source::{Part, Source};
use std::sync::Mutex;

/// The surface that is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// The positions of the mesh.
    pub store: &'a PointStore,
    /// The triangles.
    pub finished: Finished<'a>,
    /// Division into blocks.
    pub blocks: Blocks,
    /// Length of a step of the lattice, in the input's unit.
    pub step: f64,
    /// The local spacings and the number of neighbours by which they were measured, if they were.
    pub spacings: Option<(&'a Spacings, usize)>,
}

/// Pictures and distributions.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Drawn {
    /// The pictures.
    pub pictures: Vec<Picture>,
    /// Lengths of all edges, in the input's unit.
    pub edges: Option<Histogram>,
    /// Numbers of edges of the boundary loops; none if there are too many edges.
    pub loops: Option<Histogram>,
    /// True if there are too many boundary edges for their loops to be counted.
    pub many_loops: bool,
    /// Numbers of triangles of the components, without those that fill holes; none of a cut mesh.
    pub components: Option<Histogram>,
    /// Local spacings of the points, by patch, in the input's unit.
    pub spacings: Option<Histogram>,
}

/// Most bars of a distribution of lengths.
const BARS: usize = 48;

/// Most pages whose boxes frame the pictures; more do not change them visibly.
const FRAMING: usize = 1 << 15;

/// Bytes of the buffer in which edges are sorted.
const BUFFER: u64 = 4 << 20;

const VIEWS: [(&str, View); 3] = [
    ("From above", TOP),
    ("From the south-west", OBLIQUE[0]),
    ("From the north-east", OBLIQUE[1]),
];

fn position(p: Point) -> Vec3 {
    p.map(f64::from)
}

/// Draws the surface.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn draw(subject: Subject<'_>, workspace: &Workspace) -> Result<Drawn> {
    let source = Source::open(subject.finished, subject.blocks, workspace)?;
    let frame = frame(&subject, &source, workspace)?;
    let most = (0..source.count(subject.blocks))
        .map(|part| source.memory(workspace, subject.blocks, part));
    let rest = most.max().unwrap_or(0) + 4 * BUFFER + map_bytes();
    // All views at once if there is room, since all triangles are read for each round.
    let room = workspace.memory.available().saturating_sub(rest) / canvas_bytes();
    let at_once = (room as usize).clamp(1, VIEWS.len());
    let mut drawing = Drawing {
        subject: &subject,
        source: &source,
        frame: &frame,
        workspace,
        counts: Counts::default(),
        pictures: Vec::new(),
    };
    let mut drawn = Drawn::default();
    let mut boundary = None;
    for views in VIEWS.chunks(at_once) {
        let pictures = drawing.round(views, &mut boundary)?;
        drawn.pictures.extend(pictures);
    }
    drawing.finish(boundary, &mut drawn)?;
    Ok(drawn)
}

/// Some positions that frame the pictures: corners of boxes around pages with a vertex, or around squares.
fn frame(subject: &Subject<'_>, source: &Source<'_>, workspace: &Workspace) -> Result<Vec<Vec3>> {
    let store = subject.store;
    let bytes = 2 * FRAMING * 4 * size_of::<Vec3>();
    let _held = workspace.reserve("draw: frame", bytes as u64)?;
    Ok(match source {
        Source::Whole { used, .. } => {
            let is_used = |page: &usize| {
                let word = |id: usize| used.used[id / 64] >> (id % 64) & 1 == 1;
                store.page_ids(*page).any(word)
            };
            let pages = store.pages();
            let some = (0..pages).step_by(pages.div_ceil(FRAMING).max(1));
            let boxes = some.filter(is_used).map(|page| store.page_box(page));
            boxes.flat_map(|b| [b.min, b.max]).map(position).collect()
        }
        Source::Cut(pieces) => {
            let tiles = pieces.tiles();
            let some = tiles.iter().step_by(tiles.len().div_ceil(FRAMING).max(1));
            some.flat_map(|tile| tile.bounds).map(position).collect()
        }
    })
}

/// The counts of a part, or of several.
#[derive(Debug, Default)]
struct Counts {
    /// Squared lengths of sides; of each edge once for each of its triangles.
    sides: Tally,
    /// Triangles of components inside the part.
    inside: Tally,
    /// Triangles of components that extend further, by their numbers.
    across: FxHashMap<u32, u64>,
}

/// A drawing in several rounds, of which the first counts.
struct Drawing<'a> {
    subject: &'a Subject<'a>,
    source: &'a Source<'a>,
    frame: &'a [Vec3],
    workspace: &'a Workspace,
    counts: Counts,
    pictures: Vec<Picture>,
}

impl Drawing<'_> {
    /// Draws some views; the first round finds the boundary as well.
    fn round(
        &mut self,
        views: &[(&str, View)],
        boundary: &mut Option<Boundary>,
    ) -> Result<Vec<Picture>> {
        let workspace = self.workspace;
        let bytes = views.len() as u64 * canvas_bytes();
        let _held = workspace.reserve("draw: pictures", bytes)?;
        let canvases: Vec<Canvas> = views
            .iter()
            .map(|(_, view)| Canvas::new(*view, self.frame))
            .collect();
        match boundary {
            None => *boundary = Some(self.first_round(&canvases)?),
            Some(_) => self.each_part(|unit, part| {
                paint(unit, part, &canvases);
                Ok(())
            })?,
        }
        if let Some(boundary) = boundary {
            let many = boundary.edges.total();
            boundary.for_each(|edge| {
                let ends = edge.at.map(position);
                canvases.iter().for_each(|canvas| canvas.edge(ends, many));
            })?;
        }
        let step = self.subject.step;
        workspace.install(|| {
            let named = views.par_iter().zip(&canvases);
            named
                .map(|((name, _), canvas)| canvas.picture(name, step, |share| share))
                .collect()
        })
    }

    fn each_part(&self, work: impl Fn(&Unit<'_>, &Part) -> Result<()> + Sync) -> Result<()> {
        let (workspace, blocks) = (self.workspace, self.subject.blocks);
        let count = self.source.count(blocks);
        let memory = |part| self.source.memory(workspace, blocks, part);
        workspace.for_each_unit("draw: block", count, memory, |unit| {
            let part = self.source.load(unit, blocks, self.subject.store)?;
            if let Some(part) = &part {
                let _held = unit.hold(part.bytes());
                work(unit, part)?;
            }
            Ok(())
        })
    }

    /// Draws all parts, counts, and finds the boundary.
    fn first_round(&mut self, canvases: &[Canvas]) -> Result<Boundary> {
        let workspace = self.workspace;
        let mut held = workspace.promise("draw: edges", 2 * BUFFER)?;
        held.set_held(BUFFER);
        let sorter: Sorter<BorderEdge> = Sorter::new(workspace, "draw.edges", BUFFER);
        let map_held = workspace.reserve("draw: map", map_bytes())?;
        let map = matches!(self.source, Source::Whole { .. })
            .then(|| Map::new(self.frame, self.subject.store.len() as u64));
        let counts: Mutex<Counts> = Mutex::default();
        let components = Mutex::new(workspace.promise("draw: components", 0)?);
        self.each_part(|unit, part| {
            paint(unit, part, canvases);
            if let (Some(map), Source::Whole { used, .. }) = (&map, self.source) {
                for (id, p) in part.ids.indices().zip(part.at.own()) {
                    let is_used = used.used[id / 64] >> (id % 64) & 1 == 1;
                    map.add(position(*p), !is_used);
                }
            }
            let edges = border::of_part(part);
            let _held = unit.hold(bytes_of(&edges) + 8 * part.ids.len() as u64);
            sorter.push(&edges)?;
            let own = Counts::of(part);
            let mut all = lock(&counts);
            all.merge(own);
            unit.advance(1);
            lock(&components).at_least(2 * table_bytes(&all.across))
        })?;
        if let Some(map) = &map {
            let name = "Points that are not in the mesh";
            self.pictures.push(map.shares(name, self.subject.step)?);
        }
        drop((map, map_held));
        self.counts = std::mem::take(&mut *lock(&counts));
        let sorted = sorter.finish(workspace)?;
        Boundary::of(sorted, workspace)
    }

    /// Adds the distributions.
    fn finish(mut self, boundary: Option<Boundary>, drawn: &mut Drawn) -> Result<()> {
        let step = self.subject.step;
        let length = |square: f64| square.sqrt() * step;
        drawn.pictures.append(&mut self.pictures);
        let Counts {
            mut sides,
            mut inside,
            across,
        } = self.counts;
        if let Some(boundary) = boundary {
            // Now every edge is counted twice.
            sides.merge(&boundary.lengths);
            sides.halve();
            drawn.many_loops = boundary.loops.is_none();
            drawn.loops = boundary.loops.and_then(|loops| loops.by_octave());
        }
        drawn.edges = sides.histogram(BARS, length);
        across.values().for_each(|size| inside.add(*size));
        drawn.components = inside.by_octave();
        drawn.spacings = self.subject.spacings.and_then(|(spacings, neighbors)| {
            let mut tally = Tally::default();
            for first in (0..self.subject.store.len()).step_by(METHOD.curve.patch) {
                tally.add(spacing2(spacings.usual2(Id::at(first)), neighbors) as u64);
            }
            tally.histogram(BARS, length)
        });
        Ok(())
    }
}

/// Draws the triangles of a part. Most triangles of a large mesh lie between the centres of pixels, which the cells
/// of their corners tell.
fn paint(unit: &Unit<'_>, part: &Part, canvases: &[Canvas]) {
    let mut own: Vec<u32> = Vec::with_capacity(part.at.own().len());
    let _held = unit.hold(4 * part.at.own().len() as u64);
    for canvas in canvases {
        let cell = |p: &Point| canvas.cell(position(*p));
        own.clear();
        own.extend(part.at.own().iter().map(cell));
        for t in &part.triangles {
            let cells = t.map(|v| match own.get(part.ids.find(v)) {
                Some(cell) => *cell,
                None => cell(&part.at.at(v)),
            });
            if !Canvas::misses(cells) {
                canvas.triangle(part.at.corners(*t).map(position));
            }
        }
    }
}

impl Counts {
    fn of(part: &Part) -> Self {
        let mut counts = Self::default();
        for t in &part.triangles {
            let [a, b, c] = part.at.corners(*t);
            counts.sides.add(distance2(a, b));
            counts.sides.add(distance2(b, c));
            counts.sides.add(distance2(c, a));
        }
        // A component inside a block may consist of several runs.
        let mut own: FxHashMap<u32, u64> = FxHashMap::default();
        for run in part.runs.iter().filter(|run| run.count > 0) {
            let count = run.count as u64;
            match run.component & 1 {
                1 => *counts.across.entry(run.component >> 1).or_default() += count,
                _ => *own.entry(run.component).or_default() += count,
            }
        }
        own.values().for_each(|size| counts.inside.add(*size));
        counts
    }

    fn merge(&mut self, more: Self) {
        self.sides.merge(&more.sides);
        self.inside.merge(&more.inside);
        for (component, count) in more.across {
            *self.across.entry(component).or_default() += count;
        }
    }
}
