//! Distances of points from the true surface, before and after smoothing.

use crate::Arguments;
use crate::error::Result;
use crate::world::World;
use outcrop::params::Smoothing;
use outcrop_cloudgen::Kind;
use outcrop_stages::smooth::smooth;

/// Cosine of the angle between the normals of neighbours at an edge: 30°.
const EDGE: f64 = 0.866;

/// The head of the table.
pub(crate) fn head() -> String {
    "| world | smoothing | rounds | away from edges | 99 % | 99.9 % | near edges | 99 % | 99.9 % | mean radius |\n\
     |---|---|--:|--:|--:|--:|--:|--:|--:|--:|"
        .to_owned()
}

/// Rows of a world: before, and after one and two rounds of each kind of smoothing. Distances in mean
/// spacings.
pub(crate) fn rows(kind: Kind, world: &World, name: &str, args: &Arguments) -> Result<Vec<String>> {
    let store = &world.store;
    let near_edge = world.near_edges(EDGE)?;
    let row = |what: &str, round: u32, points: &[[f64; 3]]| {
        let distance = |p: &[f64; 3]| world.generator.distance(*p) / world.spacing;
        let off: Vec<f64> = points.iter().map(distance).collect();
        let part = |near: bool| {
            let part = off.iter().zip(&near_edge).filter(|(_, n)| **n == near);
            figures(part.map(|(d, _)| *d).collect())
        };
        let radius = match kind {
            Kind::Sphere => {
                let length = |p: &[f64; 3]| (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
                let sum: f64 = points.iter().map(length).sum();
                format!("{:.4}", sum / points.len().max(1) as f64)
            }
            _ => String::new(),
        };
        format!(
            "| {name} | {what} | {round} | {} | {} | {radius} |",
            part(false),
            part(true)
        )
    };
    let mut rows = vec![row("none", 0, &world.positions(store)?)];
    for (what, smoothing) in [("plain", Smoothing::Plain), ("edges", Smoothing::Edges)] {
        let mut smoothed = None;
        for round in 1..=2 {
            let before = smoothed.as_ref().unwrap_or(store);
            let tiles = world.tiles();
            let k = args.neighbors;
            let next = smooth(before, tiles, k, smoothing, round, &world.workspace)?;
            let next = next.open(&world.workspace)?;
            rows.push(row(what, round, &world.positions(&next)?));
            smoothed = Some(next);
        }
    }
    Ok(rows)
}

/// Root mean square, and the values below which 99 % and 99.9 % are.
fn figures(mut values: Vec<f64>) -> String {
    if values.is_empty() {
        return " | | ".to_owned();
    }
    values.sort_unstable_by(f64::total_cmp);
    let squares: f64 = values.iter().map(|d| d * d).sum();
    let root = (squares / values.len() as f64).sqrt();
    let part = |thousandths: usize| values[(values.len() * thousandths).div_ceil(1000) - 1];
    format!("{root:.4} | {:.4} | {:.4}", part(990), part(999))
}
