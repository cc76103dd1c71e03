//! Sections 8.2 to 8.4: bridges, small components, and the orientation of components.

use super::big::{Big, Big3, cross, determinant, dot, plus, vector};
use super::insert::normal;
use super::outside::{Known, facing};
use super::surface::{Component, Edge, Surface, Triangle, edges};
use outcrop_geom::Point;
use std::collections::BTreeSet;

/// Wide enough for every product below: the largest has about 300 bits.
type Wide = Big<8>;

/// Removes bridges, all at once; returns their number.
pub fn remove_bridges(surface: &mut Surface) -> usize {
    let is_bridge = |&t: &Triangle| {
        let border: Vec<Edge> = edges(t)
            .into_iter()
            .filter(|&e| surface.is_boundary(e))
            .collect();
        t.into_iter().any(|v| {
            let both = border.iter().filter(|edge| edge.contains(&v)).count() == 2;
            let fans = surface.fans(v);
            // If all fans are single triangles, the smallest stays.
            let smallest = fans.iter().flat_map(|fan| &fan.triangles).min();
            let stays = fans.iter().all(|fan| fan.triangles.len() == 1) && smallest == Some(&t);
            both && fans.len() > 1 && !stays
        })
    };
    let bridges: Vec<Triangle> = surface
        .triangles()
        .iter()
        .copied()
        .filter(is_bridge)
        .collect();
    bridges.iter().for_each(|&t| surface.remove(t));
    bridges.len()
}

/// Removes components of fewer than `least` triangles; returns the numbers of components and triangles.
pub fn remove_small_components(surface: &mut Surface, least: usize) -> (usize, usize) {
    let mut removed = (0, 0);
    for component in surface.components().expect("the mesh is orientable") {
        if component.len() < least {
            component.keys().for_each(|&t| surface.remove(t));
            removed = (removed.0 + 1, removed.1 + component.len());
        }
    }
    removed
}

/// The corners of `t` as it runs, the smallest first.
pub fn run([i, j, k]: Triangle, turned: bool) -> [u32; 3] {
    if turned { [i, k, j] } else { [i, j, k] }
}

/// All triangles as they run after every component is oriented: by what is known of its points, else by its volume
/// or area.
pub fn oriented(points: &[Point], known: &[Option<Known>], surface: &Surface) -> Vec<Component> {
    let mut components = surface.components().expect("the mesh is orientable");
    for component in &mut components {
        let open = component
            .keys()
            .any(|&t| edges(t).iter().any(|&e| surface.is_boundary(e)));
        let seen: i64 = component
            .iter()
            .map(|(&t, &turned)| {
                let seen = facing(points, known, t, t[0]);
                if turned { -seen } else { seen }
            })
            .sum();
        if seen < 0 || seen == 0 && faces_wrongly(points, component, open) {
            component.values_mut().for_each(|turned| *turned = !*turned);
        }
    }
    components
}

/// True if a component, in which the smallest triangle runs i → j → k, has to be turned over.
///
/// Sums over its triangles (p, q, r), as they run, all exact:
/// * `volume6` = Σ det(p, q, r) with positions from the lattice's origin, six times the volume;
/// * `area2` = Σ (q − p) × (r − p), twice the vector area;
/// * `size2` = Σ floor(sqrt(|(q − p) × (r − p)|²)), about twice the area;
/// * `corners` = Σ p + q + r, with `count` = 3 · (number of triangles): the centroid is their
///   quotient, a mean over triangle corners and not over vertices.
///
/// Closed (no edge with one triangle): turned over if `volume6 < 0`. Open with
/// `16 |area2|² ≥ size2²`: turned over if the first component of `area2` that is not zero, in the
/// order z, y, x, is negative. Otherwise, turned over if the volume about the centroid is negative:
/// order z, y, x, is negative. Otherwise, turned over if the volume about the centroid is negative: `count ·
/// volume6 − corners · area2 < 0` (six times the volume, times `count`). With a sum of zero the component
/// stays: its smallest triangle runs i → j → k.
fn faces_wrongly(points: &[Point], component: &Component, open: bool) -> bool {
    let mut volume6 = Wide::ZERO;
    let mut area2: Big3<8> = [Wide::ZERO; 3];
    let mut size2 = 0u128;
    let mut corners: Big3<8> = [Wide::ZERO; 3];
    for (&t, &turned) in component {
        let at = run(t, turned).map(|v| vector::<8, i64>(points[v as usize].map(i64::from)));
        volume6 = volume6 + determinant(at);
        let n = normal(points, t).map(|x| if turned { -x } else { x });
        area2 = plus(area2, vector(n));
        let square: i128 = n.iter().map(|x| x * x).sum();
        size2 += square.unsigned_abs().isqrt();
        corners = at.into_iter().fold(corners, plus);
    }
    if !open {
        return volume6.sign() < 0;
    }
    let size2 = Wide::from(size2 as i128);
    if dot(area2, area2) * Wide::from(16i64) >= size2 * size2 {
        let up = [2, 1, 0].map(|axis: usize| area2[axis].sign());
        return up.into_iter().find(|&sign| sign != 0).unwrap_or(0) < 0;
    }
    let count = Wide::from(3 * component.len() as i64);
    (count * volume6 - dot(corners, area2)).sign() < 0
}

/// The angle from one edge to another, clockwise about `axis`, for the order of holes at a vertex. Angles are
/// compared exactly; zero counts as a full turn.
#[derive(Debug, Clone, Copy)]
pub struct ClockwiseAngle {
    /// 0 for less than half a turn, 1 for half a turn, 2 for more, 3 for a full turn.
    quarter: u8,
    /// Cosine and sine, each times a positive factor that depends only on the lengths of the edges.
    cosine: Wide,
    sine: Wide,
}

impl ClockwiseAngle {
    pub fn new(axis: [i128; 3], from: [i64; 3], to: [i64; 3]) -> Self {
        let (n, a, b) = (
            vector::<8, _>(axis),
            vector::<8, _>(from),
            vector::<8, _>(to),
        );
        let cosine = dot(n, n) * dot(a, b) - dot(a, n) * dot(b, n);
        let sine = -dot(n, cross(a, b));
        let quarter = match (sine.sign(), cosine.sign()) {
            (1, _) => 0,
            (0, -1) => 1,
            (-1, _) => 2,
            _ => 3,
        };
        Self {
            quarter,
            cosine,
            sine,
        }
    }

    pub fn compare(&self, other: &Self) -> std::cmp::Ordering {
        // Within half a turn the order of angles is the sign of the cross product.
        let turn = self.cosine * other.sine - self.sine * other.cosine;
        let within = if self.quarter.is_multiple_of(2) {
            0.cmp(&turn.sign())
        } else {
            0.cmp(&0)
        };
        self.quarter.cmp(&other.quarter).then(within)
    }
}

/// Vertices with more than one fan.
pub fn pinched(surface: &Surface) -> BTreeSet<u32> {
    surface
        .vertices()
        .into_iter()
        .filter(|&v| surface.fans(v).len() > 1)
        .collect()
}
