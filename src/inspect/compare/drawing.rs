//! Pictures of shapes: meshes as surfaces, samples in the colours of their distances.

use super::Witness;
use super::pages::{Item, Pages};
use super::shape::{Items, Shape};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_draw::histogram::{Histogram, Tally};
use outcrop_draw::picture::{Canvas, OBLIQUE, Picture, TOP, Tone, canvas_bytes};
use outcrop_geom::vector::{Box3, V3, sub};
use outcrop_raster::View;
use rayon::prelude::*;

/// The views of a shape.
const VIEWS: [(&str, View); 2] = [("from above", TOP), ("from the south-west", OBLIQUE[0])];

/// Most pages of which an item frames the pictures.
const FRAMING: usize = 4096;

/// Side of a sample or a point in pixels.
const POINT: f64 = 1.6;

/// Largest side of a place of a map in pixels.
const WIDEST: f64 = 24.0;

/// Pixels by which samples are in front of the surface on which they lie.
const LIFT: f64 = 1.5;

/// Decades of the scale on which distances are kept, below the diagonal.
const DECADES: f64 = 8.0;

/// Distances in the histogram are multiples of the diagonal divided by this.
const PARTS: f64 = (1u64 << 40) as f64;

/// Pictures of a shape while they are drawn.
pub(crate) struct Sketch {
    canvases: Vec<Canvas>,
    /// Subtracted from positions, so that they are small.
    middle: V3,
    _held: Reservation,
}

impl Sketch {
    /// Draws the surface of a shape, if it has one.
    pub(crate) fn of(shape: &Shape, workspace: &Workspace) -> Result<Self> {
        let bytes = VIEWS.len() as u64 * canvas_bytes();
        let held = workspace.reserve("draw: pictures", bytes + (FRAMING * 100) as u64)?;
        let (min, max) = (shape.side.min, shape.side.max);
        let middle: V3 = std::array::from_fn(|k| min[k] / 2.0 + max[k] / 2.0);
        let frame: Vec<V3> = match &shape.items {
            Items::Mesh { triangles, .. } => framing(triangles, |t| t[0])?,
            Items::Cloud(points) => framing(points, |p| *p)?,
        };
        let frame: Vec<V3> = frame.iter().map(|p| sub(*p, middle)).collect();
        let canvases = VIEWS.map(|(_, view)| Canvas::new(view, &frame));
        let sketch = Self {
            canvases: canvases.into(),
            middle,
            _held: held,
        };
        if let Items::Mesh { triangles, .. } = &shape.items {
            triangles.visit(workspace, |triangles| {
                for triangle in triangles {
                    let corners = triangle.map(|p| sub(p, middle));
                    sketch.canvases.iter().for_each(|c| c.triangle(corners));
                }
            })?;
        }
        Ok(sketch)
    }

    /// Draws a sample, whose distance is compared with the `diagonal` of the shape.
    pub(super) fn sample(&self, p: V3, distance: f64, diagonal: f64) {
        let p = sub(p, self.middle);
        let share = share(distance, diagonal);
        for canvas in &self.canvases {
            canvas.point(p, POINT, share, LIFT);
        }
    }

    /// Draws a place on a map of change, where this much changed; `spacing` is the distance of such places.
    pub(crate) fn change(&self, p: V3, tone: Tone, [change, diagonal]: [f64; 2], spacing: f64) {
        let p = sub(p, self.middle);
        let share = share(change, diagonal);
        for canvas in &self.canvases {
            // Places next to each other touch.
            let size = (1.25 * spacing * canvas.pixels()).clamp(POINT, WIDEST);
            canvas.change(p, size, (tone, share), LIFT);
        }
    }

    /// Marks a place.
    pub(super) fn mark(&self, p: V3) {
        let p = sub(p, self.middle);
        self.canvases.iter().for_each(|canvas| canvas.mark(p, 7.0));
    }

    /// The pictures, with the name of the shape; samples as far as `top` have the last colour of the scale.
    pub(crate) fn pictures(
        &self,
        name: &str,
        (diagonal, top): (f64, f64),
        workspace: &Workspace,
    ) -> Result<Vec<Picture>> {
        let scale = |share: f64| {
            let distance = diagonal * libm::exp10((share - 1.0) * DECADES);
            if top > 0.0 { distance / top } else { 0.0 }
        };
        workspace.install(|| {
            let views = self.canvases.par_iter().zip(&VIEWS);
            let picture = |(canvas, (view, _)): (&Canvas, &(&str, View))| {
                canvas.picture(&format!("{name} {view}"), 1.0, scale)
            };
            views.map(picture).collect()
        })
    }
}

/// A distance on the scale on which distances are kept.
fn share(distance: f64, diagonal: f64) -> f64 {
    let share = 1.0 + libm::log10(distance / diagonal) / DECADES;
    if share.is_finite() { share } else { 0.0 }
}

/// A position of an item of some pages.
fn framing<T: Item>(pages: &Pages<T>, position: impl Fn(&T) -> V3) -> Result<Vec<V3>> {
    let Box3 { min, max } = pages.bounds();
    let mut all = Vec::with_capacity(FRAMING + 2);
    pages.some(FRAMING, |item| all.push(position(item)))?;
    if all.len() < 16 {
        // Too few to tell usual positions from others.
        all.extend((0..8).map(|corner| [0, 1, 2].map(|k| [min[k], max[k]][corner >> k & 1])));
    }
    Ok(all)
}

/// Pictures and distributions of a comparison, for its page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Illustration {
    /// Pictures of both sides, coloured by distance.
    pub pictures: Vec<Picture>,
    /// Distances from the first side to the second, and back; none if the first side has no extent.
    pub distances: [Option<Histogram>; 2],
    /// The distance at the end of the colour scale: the 99th percentile of both directions.
    pub top: f64,
}

/// A comparison while it is drawn.
pub(super) struct Drawing {
    sketches: [Sketch; 2],
    tallies: [Tally; 2],
    diagonal: f64,
}

impl Witness for Drawing {
    fn take(&mut self, way: usize, p: V3, distance: f64) {
        self.sketches[way].sample(p, distance, self.diagonal);
        if self.diagonal > 0.0 {
            self.tallies[way].add((distance / self.diagonal * PARTS) as u64);
        }
    }
}

impl Drawing {
    pub(super) fn of(a: &Shape, b: &Shape, diagonal: f64, workspace: &Workspace) -> Result<Self> {
        Ok(Self {
            sketches: [Sketch::of(a, workspace)?, Sketch::of(b, workspace)?],
            tallies: Default::default(),
            diagonal,
        })
    }

    pub(super) fn finish(self, top: f64, workspace: &Workspace) -> Result<Illustration> {
        let scale = (self.diagonal, top);
        let mut pictures = Vec::new();
        for (sketch, name) in self.sketches.iter().zip(["A", "B"]) {
            pictures.extend(sketch.pictures(name, scale, workspace)?);
        }
        let length = |parts: f64| parts / PARTS * self.diagonal;
        Ok(Illustration {
            pictures,
            distances: self.tallies.map(|tally| tally.histogram(48, length)),
            top,
        })
    }
}
