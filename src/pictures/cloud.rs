//! Pictures of a cloud.

use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_draw::histogram::{Histogram, Tally};
use outcrop_draw::picture::{Canvas, Map, OBLIQUE, Picture, SIZE, canvas_bytes, map_bytes};
use outcrop_geom::Point;
use outcrop_geom::lattice::Lattice;
use outcrop_ply::Scalar;
use outcrop_points::{Attributes, Spool, VALUE_BUFFERS};
use outcrop_raster::Vec3;
use outcrop_raster::camera::span;
use outcrop_stages::order::PointStore;

/// Pictures and distributions of a cloud, for its page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Illustration {
    /// A map of the density from above, and an oblique picture coloured by height.
    pub pictures: Vec<Picture>,
    /// Distances of sampled points to their nearest neighbours, in the cloud's unit.
    pub spacings: Option<Histogram>,
    /// Largest number of points for an area of one square unit.
    pub densest: f64,
    /// The heights at the ends of the colour scale.
    pub heights: [f64; 2],
    /// Points of each class, if files give classes.
    pub classes: Vec<(u8, u64)>,
}

/// Pages read at a time.
const RUN: usize = 256;

/// Most pages whose boxes frame the pictures.
const FRAMING: usize = 1 << 15;

/// Part of the heights, in per cent at either end, that have the colour of the end.
const TAILS: f64 = 1.0;

/// Most bars of a distribution.
const BARS: usize = 48;

fn position(p: Point) -> Vec3 {
    p.map(f64::from)
}

impl Illustration {
    /// Draws the points of a store.
    pub fn of(
        store: &PointStore,
        lattice: &Lattice,
        spacings: &Tally,
        workspace: &Workspace,
    ) -> Result<Self> {
        let framing = (FRAMING * 2 * size_of::<Vec3>() * 2) as u64;
        let bytes = canvas_bytes() + map_bytes() + framing;
        let _held = workspace.reserve("draw: pictures", bytes)?;
        let pages = (0..store.pages()).step_by(store.pages().div_ceil(FRAMING).max(1));
        let boxes = pages.map(|page| store.page_box(page));
        let frame: Vec<Vec3> = boxes.flat_map(|b| [b.min, b.max]).map(position).collect();
        let [low, high] = span(&frame, [0.0, 0.0, 1.0], TAILS);
        let share = |z: f64| {
            if high > low {
                (z - low) / (high - low)
            } else {
                0.5
            }
        };
        let points = store.len() as u64;
        let (map, canvas) = (Map::new(&frame, points), Canvas::new(OBLIQUE[0], &frame));
        let pixels = (SIZE[0] * SIZE[1]) as f64;
        let size = (2.0 * pixels / points.max(1) as f64).sqrt().clamp(0.6, 4.0);
        let runs = store.pages().div_ceil(RUN);
        let bytes = (RUN * store.page_size() * 24 + (64 << 10)) as u64;
        workspace.observer.begin("draw", "points", points);
        workspace.for_each_unit(
            "draw: points",
            runs,
            |_| bytes,
            |unit| {
                let first = unit.number() * RUN;
                let mut points = Vec::new();
                store.read_pages(first..(first + RUN).min(store.pages()), &mut points)?;
                for p in &points {
                    let p = position(*p);
                    map.add(p, false);
                    canvas.point(p, size, share(p[2]), 0.0);
                }
                unit.advance(points.len() as u64);
                Ok(())
            },
        )?;
        workspace.observer.end();
        let (density, densest) = map.density("Density from above", lattice.step)?;
        let oblique = canvas.picture("Height, from the south-west", lattice.step, |s| s)?;
        let height = |z: f64| lattice.position([0, 0, z as i32])[2];
        Ok(Self {
            pictures: vec![density, oblique],
            spacings: spacings.histogram(BARS, |square| square.sqrt() * lattice.step),
            densest,
            heights: [height(low), height(high)],
            classes: Vec::new(),
        })
    }
}

/// Name of the column of classes.
const CLASSES: &str = "classification";

/// Points of each class, of a spool with columns; nothing if no file has classes of one byte.
pub fn classes(spool: &Spool, lattice: &Lattice, workspace: &Workspace) -> Result<Vec<(u8, u64)>> {
    let wanted = Attributes::List(vec![CLASSES.to_owned()]);
    let carried = spool.carried(&wanted, false);
    let [column] = &carried.columns[..] else {
        return Ok(Vec::new());
    };
    if column.scalar != Scalar::U8 {
        return Ok(Vec::new());
    }
    let _held = workspace.reserve("info: classes", VALUE_BUFFERS)?;
    let frames: Vec<u32> = spool.frames().into_iter().map(|frame| frame.0).collect();
    let mut counts = [0u64; 256];
    // A byte is its own order.
    spool.for_values(workspace, lattice, &frames, &carried, |_, values| {
        values
            .iter()
            .for_each(|class| counts[usize::from(*class)] += 1);
        Ok(())
    })?;
    let found = (0..=255u8).zip(counts).filter(|(_, count)| *count > 0);
    Ok(found.collect())
}
