//! Samples: positions on one side, in curve order.

use super::Options;
use super::pages::Pages;
use super::shape::{Items, Shape};
use super::triangles::{area, sorter};
use oorandom::Rand64;
use outcrop_disk::error::Result;
use outcrop_disk::spill::row;
use outcrop_disk::workspace::Workspace;
use outcrop_geom::vector::{V3, add, scale, sub};

/// Added to the seed, so that points on faces and vertices are chosen by independent numbers.
const FACES: u128 = 1 << 64;
const POINTS: u128 = 2 << 64;

/// A position at which a distance is taken.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) position: V3,
    /// True if it counts in all figures; false if only in the maximum.
    pub(super) counts: bool,
}

row! {
    /// A sample with the key of its position; rows sort by key.
    struct KeyedSample {
        /// The key on the curve.
        key: [u32; 3],
        /// The bits of three `f64`.
        position: [u32; 6],
        /// 1 if it counts in all figures, 0 if only in the maximum.
        counts: u32,
    }
    unpacked
}

/// Numbers of samples of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Numbers {
    /// Vertices of a mesh.
    pub(super) vertices: u64,
    /// Points of a cloud, or points on the faces of a mesh.
    pub(super) points: u64,
}

impl Numbers {
    /// The numbers for at most `most` samples in all.
    pub(super) fn of(shape: &Shape, most: u64) -> Self {
        match &shape.items {
            Items::Cloud(_) => Self {
                vertices: 0,
                points: shape.side.points.min(most),
            },
            Items::Mesh { vertices, .. } => {
                let vertices = vertices.total();
                let points = if shape.side.area > 0.0 {
                    most - vertices.min(most)
                } else {
                    0
                };
                Self { vertices, points }
            }
        }
    }

    pub(super) fn all(self) -> u64 {
        self.vertices + self.points
    }
}

/// Calls `each` with every sample of a shape, in an order that depends only on the shape, the seed and their
/// number. On return the progress stage of the distances has begun.
pub(super) fn for_each(
    shape: &Shape,
    options: &Options,
    workspace: &Workspace,
    mut each: impl FnMut(Sample) -> Result<()>,
) -> Result<()> {
    let (observer, seed) = (&workspace.observer, options.seed);
    let numbers = Numbers::of(shape, options.samples);
    let (triangles, vertices) = match &shape.items {
        Items::Cloud(points) => {
            observer.begin("distances", "samples", numbers.all());
            let mut rng = Rand64::new(u128::from(seed) + POINTS);
            let (mut left, mut wanted) = (shape.side.points, numbers.points);
            return points.for_each_page(|page| {
                for &position in page {
                    // Knuth's algorithm S: chooses exactly the wanted number.
                    let all = wanted == left;
                    if wanted > 0 && (all || rng.rand_range(0..left) < wanted) {
                        wanted -= 1;
                        let counts = true;
                        each(Sample { position, counts })?;
                    }
                    left -= 1;
                }
                Ok(())
            });
        }
        Items::Mesh {
            triangles,
            vertices,
        } => (triangles, vertices),
    };
    let bounds = triangles.bounds();
    let bytes = numbers.all() * size_of::<KeyedSample>() as u64;
    let buffer = bytes.min(workspace.memory.available() / 4) + (1 << 20);
    let (sorter, _held) = sorter(workspace, &format!("{}.samples", shape.name), buffer)?;
    observer.begin("sample", "samples", numbers.all());
    let push = |position, counts| {
        workspace.check_cancel()?;
        observer.advance(1);
        sorter.push(&[KeyedSample {
            key: bounds.key(position),
            position: bytemuck::cast(position),
            counts: u32::from(counts),
        }])
    };
    for section in 0..vertices.count() {
        let mut positions = vertices.get(section)?.into_iter();
        positions.try_for_each(|position| push(position, numbers.points == 0))?;
    }
    let on_face = |position| push(position, true);
    take_faces(triangles, shape.side.area, numbers.points, seed, on_face)?;
    observer.end();
    observer.begin("distances", "samples", numbers.all());
    sorter.finish(workspace)?.for_each(|sample: KeyedSample| {
        each(Sample {
            position: bytemuck::cast(sample.position),
            counts: sample.counts == 1,
        })
    })
}

/// Divides the area into equal parts, one for each sample, and chooses a random point in each.
fn take_faces(
    triangles: &Pages<[V3; 3]>,
    all: f64,
    wanted: u64,
    seed: u64,
    each: impl Fn(V3) -> Result<()>,
) -> Result<()> {
    let mut rng = Rand64::new(u128::from(seed) + FACES);
    let mut taken = 0;
    let mut place = |rng: &mut Rand64| {
        let at = (taken as f64 + rng.rand_float()) / wanted as f64 * all;
        taken += 1;
        (taken <= wanted).then_some(at)
    };
    let mut next = place(&mut rng);
    let (mut passed, mut last) = (0.0, None);
    triangles.for_each_page(|page| {
        for triangle in page {
            let area = area(triangle);
            if area > 0.0 {
                last = Some(*triangle);
            }
            passed += area;
            while next.is_some_and(|at| at < passed) {
                each(within(triangle, &mut rng))?;
                next = place(&mut rng);
            }
        }
        Ok(())
    })?;
    // Rounding may leave the last sample at the very end.
    while let (Some(_), Some(triangle)) = (next, &last) {
        each(within(triangle, &mut rng))?;
        next = place(&mut rng);
    }
    Ok(())
}

/// A random point of a triangle.
fn within([a, b, c]: &[V3; 3], rng: &mut Rand64) -> V3 {
    let (mut u, mut v) = (rng.rand_float(), rng.rand_float());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    add(*a, add(scale(sub(*b, *a), u), scale(sub(*c, *a), v)))
}
