//! The base of terrain: walls from its outer rims down to a plane, and a floor.

use super::Kind;
use super::ears::clip;
use super::lid::{Loop, Patch};
use super::near::{Near, Placed};
use crate::source::{PAGE, RANGE, READER, Source};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::vector::V3;
use serde::{Deserialize, Serialize};

/// Outer rims with less than this part of the largest area, seen from above, get a lid and no walls.
const SMALLEST: f64 = 1e-3;

/// Most outer rims with walls.
const MOST: usize = 1000;

/// Thickness of the base below the lowest point, as part of the larger side of the mesh: 4 mm of a print of 20 cm.
const THICKNESS: f64 = 0.02;

/// Loops with walls, and their floor.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Base {
    /// Numbers of the loops, ascending.
    pub loops: Vec<u32>,
    /// The floor, in the coordinates of the file.
    pub z: f64,
}

/// A loop seen from above.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Outline {
    number: u32,
    batch: u32,
    /// The area that it encloses counter-clockwise, as the mesh runs.
    area: f64,
    first: [f64; 2],
}

/// Decides which loops get walls, and where the floor is.
pub(super) fn plan(
    source: &Source,
    near: &Near<'_>,
    kind: Kind,
    workspace: &Workspace,
) -> Result<Base> {
    let Kind::Base(wanted) = kind else {
        return Ok(Base::default());
    };
    let [low, high] = bounds(source, workspace)?;
    let z = match wanted {
        Some(z) if z < low[2] => z,
        Some(z) => {
            let expected = format!("a height below the lowest vertex, {}", low[2]);
            let found = z.to_string();
            return Err(Error::Parameter {
                name: "close",
                found: format!("base={found}"),
                expected,
            });
        }
        None => {
            let side = (high[0] - low[0])
                .max(high[1] - low[1])
                .max(high[2] - low[2]);
            // A round number with three digits of the thickness.
            let thickness = (THICKNESS * side).max(f64::MIN_POSITIVE);
            let step = libm::exp10(libm::log10(thickness).floor() - 2.0);
            ((low[2] - thickness) / step).floor() * step
        }
    };
    let mut outlines = Vec::new();
    workspace.units(
        ("outlines", "close: outlines"),
        near.batches(),
        |batch| near.bytes(batch),
        |unit| {
            let first = near.batch(unit.number()).first;
            let loops = near.load(unit, unit.number())?;
            let outline = |(number, placed): (u32, &Placed)| Outline {
                number,
                batch: unit.number() as u32,
                area: -placed.around.vector_area()[2] / 2.0,
                first: [0, 1].map(|k| placed.origin[k] + placed.around.points[0][k]),
            };
            let all: Vec<Outline> = (first..).zip(&loops).map(outline).collect();
            Ok(all)
        },
        |_, found: Vec<Outline>| {
            outlines.extend(found.into_iter().filter(|o| o.area > 0.0));
            Ok(())
        },
    )?;
    outlines.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.number.cmp(&b.number)));
    let largest = outlines.first().map_or(0.0, |o| o.area);
    outlines.retain(|o| o.area >= SMALLEST * largest);
    outlines.truncate(MOST);
    let mut loops = Vec::new();
    let mut fields: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut held = workspace.reserve("close: outlines", 0)?;
    for outline in &outlines {
        // What floats above a field, such as a roof, has none.
        if fields.iter().any(|field| is_inside(field, outline.first)) {
            continue;
        }
        let batch = outline.batch as usize;
        let _more = workspace.reserve("close: outline", near.bytes(batch))?;
        let placed = &near.load(&workspace.unit(), batch)?;
        let number = (outline.number - near.batch(batch).first) as usize;
        let placed = &placed[number];
        let flat = |p: &V3| [0, 1].map(|k| placed.origin[k] + p[k]);
        fields.push(placed.around.points.iter().map(flat).collect());
        let all: usize = fields.iter().map(Vec::len).sum();
        held.at_least(16 * all as u64)?;
        loops.push(outline.number);
    }
    loops.sort_unstable();
    Ok(Base { loops, z })
}

/// The box of all vertices.
fn bounds(source: &Source, workspace: &Workspace) -> Result<[V3; 2]> {
    let mut all = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let count = source.vertices.div_ceil(RANGE) as usize;
    workspace.units(
        ("bounds", "close: bounds"),
        count,
        |_| READER,
        |unit| {
            let fixed = source.fixed()?;
            let (mut bytes, mut positions) = (Vec::new(), Vec::new());
            let first = unit.number() as u64 * RANGE;
            let end = (first + RANGE).min(source.vertices);
            let mut found = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
            for from in (first..end).step_by(PAGE) {
                positions.clear();
                let count = (end - from).min(PAGE as u64) as usize;
                fixed.positions((from, count), &mut bytes, &mut positions)?;
                for p in &positions {
                    for k in 0..3 {
                        found[0][k] = found[0][k].min(p[k]);
                        found[1][k] = found[1][k].max(p[k]);
                    }
                }
            }
            Ok(found)
        },
        |_, found: [V3; 2]| {
            for k in 0..3 {
                all[0][k] = all[0][k].min(found[0][k]);
                all[1][k] = all[1][k].max(found[1][k]);
            }
            Ok(())
        },
    )?;
    Ok(all)
}

/// True if a point lies inside of a polygon.
fn is_inside(field: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let next = field.iter().cycle().skip(1);
    let crossed = field.iter().zip(next).filter(|([ax, ay], [bx, by])| {
        (*ay > y) != (*by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax)
    });
    crossed.count() % 2 == 1
}

/// Walls from a loop down to the height `z`, and the floor; and how many of its triangles overlap others, as the rim
/// crosses itself seen from above.
pub(super) fn block(around: &Loop, z: f64) -> (Patch, u64) {
    let n = around.len() as u32;
    let down: Vec<V3> = around.points.iter().map(|p| [p[0], p[1], z]).collect();
    // From below, counter-clockwise.
    let flat: Vec<[f64; 2]> = down.iter().map(|p| [p[1], p[0]]).collect();
    let clipped = clip(&flat, &down, |_, _| true);
    let mut patch = Patch {
        parents: (0..n).map(|v| [v; 3]).collect(),
        new: down,
        triangles: Vec::with_capacity(4 * n as usize),
    };
    for v in 0..n {
        let next = (v + 1) % n;
        patch.triangles.push([v, next, n + next]);
        patch.triangles.push([v, n + next, n + v]);
    }
    let lower = clipped.triangles.iter().map(|t| t.map(|v| n + v));
    patch.triangles.extend(lower);
    if clipped.left.len() >= 3 {
        let middle = n + patch.new.len() as u32;
        let count = clipped.left.len() as f64;
        let mean = [0, 1].map(|k| {
            let sum: f64 = clipped.left.iter().map(|v| patch.new[*v as usize][k]).sum();
            sum / count
        });
        patch.new.push([mean[0], mean[1], z]);
        patch.parents.push([clipped.left[0]; 3]);
        let next = clipped.left.iter().cycle().skip(1);
        let fan = clipped.left.iter().zip(next);
        patch
            .triangles
            .extend(fan.map(|(a, b)| [n + a, n + b, middle]));
    }
    (patch, clipped.forced)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_inside_or_not() {
        let field = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        assert!(is_inside(&field, [1.0, 1.0]) && is_inside(&field, [3.5, 3.0]));
        assert!(!is_inside(&field, [2.0, 3.0]) && !is_inside(&field, [5.0, 1.0]));
    }
}
