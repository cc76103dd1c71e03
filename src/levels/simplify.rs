//! Simplification of tiles. The result has vertices of the given ones only, and is the same on every machine.

use super::patch::{Around, Patch, Vertices};
use super::quadric::{Quadric, V3, dot, minus, of_triangles};
use rustc_hash::{FxHashMap, FxHashSet};

/// A mesh to simplify.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface<'a> {
    /// Positions of the vertices.
    pub points: &'a [V3],
    /// Corners of the triangles.
    pub triangles: &'a [[u32; 3]],
    /// For each vertex whether it must stay.
    pub locked: &'a [bool],
}

/// A way to simplify to about this number of triangles, or as few as can be.
pub(super) type Manner = fn(Surface<'_>, usize) -> Vec<[u32; 3]>;

/// Bits of a cost that do not count: with the others, costs have two steps in an octave.
const SHIFT: u32 = 22;

/// Lists of the queue: one for each step of a cost that is a finite float.
const LISTS: usize = (f32::INFINITY.to_bits() >> SHIFT) as usize + 1;

/// Steps by which an edge that cannot be contracted is put off.
const LATER: usize = 4;

/// The part of the squared length of an edge that is added to its cost, so that short edges go first where the surface
/// is flat.
const LENGTH: f64 = 1e-9;

/// The squared diagonal of a component times this is the cost at which it goes as a whole.
const COMPONENT: f64 = 16.0;

/// An edge in the queue, or a component, which has a vertex twice.
#[derive(Debug, Clone, Copy)]
struct Queued {
    ends: [u32; 2],
    /// The contractions at both ends when its cost was found.
    contractions: u32,
    /// True if it could not be contracted then.
    failed: bool,
}

/// Edges by cost. That of an edge is found again when its turn comes, if it has changed meanwhile.
struct Queue {
    lists: Vec<Vec<Queued>>,
    /// For each vertex the one into which it was put, or itself.
    into: Vec<u32>,
    /// For each vertex, how many contractions led to it.
    contractions: Vec<u32>,
}

/// The step of what an edge costs: the mean squared distance of the end that stays from the planes of all triangles for
/// which it will stand. The end that stays is the first. None if both ends are locked.
fn look(patch: &Patch, [a, b]: [u32; 2]) -> Option<([u32; 2], usize)> {
    let stays = |v: u32| (patch.locked[v as usize], patch.boundary[v as usize]);
    let [p, q] = [a, b].map(|v| patch.points[v as usize]);
    let [of_a, of_b] = [a, b].map(|v| &patch.quadrics[v as usize]);
    let at_a = || of_a.here() + of_b.at(minus(p, q));
    let at_b = || of_b.here() + of_a.at(minus(q, p));
    let (ends, sum) = match (stays(a), stays(b)) {
        ((true, _), (true, _)) => return None,
        ((true, _), _) => ([a, b], at_a()),
        (_, (true, _)) => ([b, a], at_b()),
        ((_, true), (_, false)) => ([a, b], at_a()),
        ((_, false), (_, true)) => ([b, a], at_b()),
        _ => match (at_a(), at_b()) {
            (one, other) if other < one => ([b, a], other),
            (one, _) => ([a, b], one),
        },
    };
    let area = (of_a.area + of_b.area).max(f64::MIN_POSITIVE);
    let along = minus(q, p);
    Some((ends, step(sum / area + LENGTH * dot(along, along))))
}

/// The step of a cost.
fn step(cost: f64) -> usize {
    let step = ((cost as f32).to_bits() >> SHIFT) as usize;
    step.min(LISTS - 1)
}

impl Queue {
    fn of(patch: &Patch) -> Self {
        let count = patch.points.len();
        let mut queue = Self {
            lists: vec![Vec::new(); LISTS],
            into: (0..count as u32).collect(),
            contractions: vec![0; count],
        };
        queue.add_components(patch);
        for [a, b, c] in patch.left() {
            for (a, b) in [(*a, *b), (*b, *c), (*c, *a)] {
                // Both sides of an edge name it, and one of them in this order. On a boundary it has one side.
                let is_rim = patch.boundary[a as usize] && patch.boundary[b as usize];
                if (a < b || is_rim)
                    && let Some((ends, step)) = look(patch, [a, b])
                {
                    queue.lists[step].push(Queued {
                        ends,
                        contractions: 0,
                        failed: false,
                    });
                }
            }
        }
        queue
    }

    /// Queues all components without a locked vertex.
    fn add_components(&mut self, patch: &Patch) {
        for [a, b, c] in patch.left() {
            let [a, b, c] = [*a, *b, *c].map(|v| self.now(v));
            let least = a.min(b).min(c);
            for v in [a, b, c] {
                self.into[v as usize] = least;
            }
        }
        let mut locked = vec![false; patch.points.len()];
        for v in (0..patch.points.len() as u32).filter(|v| patch.locked[*v as usize]) {
            locked[self.now(v) as usize] = true;
        }
        let mut free: FxHashMap<u32, [V3; 2]> = FxHashMap::default();
        for t in patch.left() {
            let first = self.now(t[0]);
            if locked[first as usize] {
                continue;
            }
            let [low, high] = free.entry(first).or_insert([[f64::MAX; 3], [f64::MIN; 3]]);
            for p in t.map(|v| patch.points[v as usize]) {
                for k in 0..3 {
                    low[k] = low[k].min(p[k]);
                    high[k] = high[k].max(p[k]);
                }
            }
        }
        self.into = (0..patch.points.len() as u32).collect();
        let mut free: Vec<_> = free.into_iter().collect();
        free.sort_unstable_by_key(|(v, _)| *v);
        let mut costs: Vec<_> = free
            .into_iter()
            .map(|(v, [low, high])| {
                let diagonal = minus(high, low);
                (v, step(COMPONENT * dot(diagonal, diagonal)))
            })
            .collect();
        if !patch.locked.contains(&true)
            && let Some(largest) = (0..costs.len()).max_by_key(|n| costs[*n].1)
        {
            // Something is left to show.
            costs.remove(largest);
        }
        for (v, step) in costs {
            self.lists[step].push(Queued {
                ends: [v, v],
                contractions: 0,
                failed: false,
            });
        }
    }

    /// The vertex into which this one was contracted, or itself.
    fn now(&mut self, mut vertex: u32) -> u32 {
        while self.into[vertex as usize] != vertex {
            let next = self.into[self.into[vertex as usize] as usize];
            self.into[vertex as usize] = next;
            vertex = next;
        }
        vertex
    }

    /// The edge as it is now. None if it is none any more, or if it is as it was when it could not be contracted.
    fn renewed(&mut self, edge: Queued) -> Option<Queued> {
        let ends = edge.ends.map(|v| self.now(v));
        let [m, n] = ends.map(|v| self.contractions[v as usize]);
        let contractions = m + n;
        let is_same = contractions == edge.contractions;
        (ends[0] != ends[1] && !(is_same && edge.failed)).then_some(Queued {
            ends,
            contractions,
            failed: false,
        })
    }

    /// Contracts edges, cheap ones first, down to this number of triangles or to the end of the queue.
    fn contract(&mut self, patch: &mut Patch, target: usize) {
        let mut around = Around::default();
        for step in 0..LISTS {
            while !self.lists[step].is_empty() {
                for edge in std::mem::take(&mut self.lists[step]) {
                    if patch.count <= target {
                        return;
                    }
                    self.turn(patch, edge, step, &mut around);
                }
            }
        }
    }

    /// Contracts an edge of this step, if it still costs that and can be contracted.
    fn turn(&mut self, patch: &mut Patch, edge: Queued, step: usize, around: &mut Around) {
        if edge.ends[0] == edge.ends[1] {
            let vertex = self.now(edge.ends[0]);
            patch.remove(vertex);
            return;
        }
        let Some(mut now) = self.renewed(edge) else {
            return;
        };
        if now.contractions != edge.contractions {
            let Some((ends, new)) = look(patch, now.ends) else {
                return;
            };
            now.ends = ends;
            if new > step {
                self.lists[new].push(now);
                return;
            }
        }
        let [a, b] = now.ends;
        let place = patch.points[a as usize];
        if patch.can_contract(a, b, around) && patch.keeps_triangles(a, b, place, around) {
            patch.contract(a, b, place, around);
            self.into[b as usize] = a;
            self.contractions[a as usize] = now.contractions + 1;
        } else if let Some(later) = self.lists.get_mut(step + LATER) {
            now.failed = true;
            later.push(now);
        }
    }
}

/// Contracts edges: the surface stays connected as it is, but small components may go.
pub(super) fn careful(surface: Surface<'_>, target: usize) -> Vec<[u32; 3]> {
    let vertices = Vertices {
        points: surface.points.to_vec(),
        quadrics: Vec::new(),
        values: Vec::new(),
        blended: Vec::new(),
        locked: surface.locked.to_vec(),
    };
    let mut patch = Patch::new(vertices, surface.triangles.to_vec(), false);
    let mut before = usize::MAX;
    // What could not be contracted may be possible when all else is done.
    while patch.count > target && patch.count < before - before / 64 {
        before = patch.count;
        Queue::of(&patch).contract(&mut patch, target);
    }
    patch.left().copied().collect()
}

/// Most cells of a grid along a side.
const CELLS: u32 = 1 << 20;

/// The cells of a grid: one for each locked vertex, and cubes for all others, `count` of them along the longest side.
fn cells(surface: Surface<'_>, count: u32) -> Vec<u64> {
    let fold = |start: f64, least: fn(f64, f64) -> f64| {
        let points = surface.points.iter();
        points.fold([start; 3], |ends, p| {
            [0, 1, 2].map(|k| least(ends[k], p[k]))
        })
    };
    let (low, high) = (fold(f64::MAX, f64::min), fold(f64::MIN, f64::max));
    let longest = minus(high, low).into_iter().fold(0.0, f64::max);
    let scale = f64::from(count) / longest.max(f64::MIN_POSITIVE);
    let cell = |(number, p): (usize, &V3)| match surface.locked[number] {
        true => 1 << 63 | number as u64,
        false => minus(*p, low).into_iter().fold(0, |cell, x| {
            cell << 21 | ((x * scale) as u64).min(u64::from(count - 1))
        }),
    };
    surface.points.iter().enumerate().map(cell).collect()
}

fn is_whole<T: PartialEq>([a, b, c]: [T; 3]) -> bool {
    a != b && b != c && c != a
}

/// Joins the vertices in each cell of a grid, the finest by which there are few enough triangles: parts may grow
/// together, and small ones go.
pub(super) fn coarse(surface: Surface<'_>, target: usize) -> Vec<[u32; 3]> {
    let (mut few, mut many) = (1, CELLS);
    while many - few > 1 {
        let middle = few + (many - few) / 2;
        let cells = cells(surface, middle);
        let whole = surface
            .triangles
            .iter()
            .map(|t| t.map(|v| cells[v as usize]));
        match whole.filter(|t| is_whole(*t)).count() <= target {
            true => few = middle,
            false => many = middle,
        }
    }
    let joined = joined(surface, &cells(surface, few));
    match joined.is_empty() {
        // Something is left to show.
        true => self::joined(surface, &cells(surface, many)),
        false => joined,
    }
}

/// The triangles that are left if the vertices in each cell are joined.
fn joined(surface: Surface<'_>, cells: &[u64]) -> Vec<[u32; 3]> {
    let chosen = chosen(surface, cells);
    let mut known = FxHashSet::default();
    let joined = surface
        .triangles
        .iter()
        .map(|t| t.map(|v| chosen[v as usize]));
    joined
        .filter(|t| {
            let mut turned = *t;
            let first = (0..3).min_by_key(|n| t[*n]).unwrap_or(0);
            turned.rotate_left(first);
            is_whole(*t) && known.insert(turned)
        })
        .collect()
}

/// For each vertex that of its cell which is nearest to the planes of all triangles there.
fn chosen(surface: Surface<'_>, cells: &[u64]) -> Vec<u32> {
    let quadrics = of_triangles(surface.points, surface.triangles);
    let mut order: Vec<u32> = (0..surface.points.len() as u32).collect();
    order.sort_unstable_by_key(|v| (cells[*v as usize], *v));
    let mut chosen = vec![0; order.len()];
    for same in order.chunk_by(|v, w| cells[*v as usize] == cells[*w as usize]) {
        let about = surface.points[same[0] as usize];
        let away = |v: u32| minus(surface.points[v as usize], about);
        let sum = same.iter().fold(Quadric::default(), |sum, v| {
            let back = away(*v).map(|x| -x);
            sum.plus(&quadrics[*v as usize].moved(back))
        });
        let mut best = (f64::INFINITY, same[0]);
        for v in same.iter().filter(|v| quadrics[**v as usize].area > 0.0) {
            let value = sum.at(away(*v));
            if value < best.0 {
                best = (value, *v);
            }
        }
        same.iter().for_each(|v| chosen[*v as usize] = best.1);
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A wavy grid of `side` squares along each side, with its rim locked.
    fn grid(side: u32) -> (Vec<V3>, Vec<[u32; 3]>, Vec<bool>) {
        let row = side + 1;
        let places = (0..row * row).map(|n| (n % row, n / row));
        let point = |(x, y): (u32, u32)| [x.into(), y.into(), f64::from(x * y % 5) / 50.0];
        let is_rim = |(x, y): (u32, u32)| x % side == 0 || y % side == 0;
        let squares = (0..side * side).map(|n| n / side * row + n % side);
        let halves = squares.flat_map(|a| [[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]);
        (
            places.clone().map(point).collect(),
            halves.collect(),
            places.map(is_rim).collect(),
        )
    }

    #[test]
    fn few_triangles_are_left_and_the_rim_stays() {
        let (points, triangles, locked) = grid(40);
        let surface = Surface {
            points: &points,
            triangles: &triangles,
            locked: &locked,
        };
        let rim = locked.iter().filter(|locked| **locked).count();
        for (manner, target) in [(careful as Manner, 600), (coarse as Manner, 600)] {
            let left = manner(surface, target);
            assert!(
                left.len() <= target && left.len() > target / 3,
                "{}",
                left.len()
            );
            let corners: FxHashSet<u32> = left.iter().flatten().copied().collect();
            assert!(corners.len() > rim / 2);
            assert_eq!(left, manner(surface, target));
        }
        let left = careful(surface, 600);
        let corners: FxHashSet<u32> = left.iter().flatten().copied().collect();
        assert!((0..points.len()).all(|v| !locked[v] || corners.contains(&(v as u32))));
        // No triangle is upside down, and all together cover the square.
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            let (p, q) = (minus(b, a), minus(c, a));
            (p[0] * q[1] - p[1] * q[0]) / 2.0
        };
        assert!(left.iter().all(|t| area(t) > 0.0));
        assert_eq!(left.iter().map(area).sum::<f64>(), 1600.0);
    }

    #[test]
    fn triangles_without_neighbours_go_the_small_ones_first() {
        let triangles: Vec<[u32; 3]> = (0..50).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        let point = |n: u32| {
            let size = f64::from(n / 3 + 1);
            [
                f64::from(n / 3) * 200.0 + if n % 3 == 1 { size } else { 0.0 },
                if n % 3 == 2 { size } else { 0.0 },
                0.0,
            ]
        };
        let points: Vec<V3> = (0..150).map(point).collect();
        let surface = Surface {
            points: &points,
            triangles: &triangles,
            locked: &[false; 150],
        };
        let left = careful(surface, 10);
        assert!(
            left.len() <= 10 && left.contains(&triangles[49]),
            "{left:?}"
        );
    }

    proptest! {
        /// Whatever the triangles are, those that are left have corners of them, and locked corners stay.
        #[test]
        fn any_triangles_can_be_simplified(
            places in prop::collection::vec(([-5i8..5, -5i8..5, -5i8..5], any::<bool>()), 3..40),
            corners in prop::collection::vec([0u32..1000, 0u32..1000, 0u32..1000], 0..120),
            target in 0usize..60,
        ) {
            let count = places.len() as u32;
            let points: Vec<V3> = places.iter().map(|(p, _)| p.map(f64::from)).collect();
            let locked: Vec<bool> = places.iter().map(|(_, locked)| *locked).collect();
            let triangles: Vec<[u32; 3]> = corners.iter().map(|t| t.map(|v| v % count)).collect();
            let surface = Surface { points: &points, triangles: &triangles, locked: &locked };
            let whole: Vec<_> = triangles.iter().filter(|t| is_whole(**t)).collect();
            let used: FxHashSet<u32> = whole.iter().copied().flatten().copied().collect();
            let left = careful(surface, target);
            let kept: FxHashSet<u32> = left.iter().flatten().copied().collect();
            prop_assert!(left.len() <= whole.len() && kept.is_subset(&used));
            prop_assert!(used.iter().all(|v| !locked[*v as usize] || kept.contains(v)));
            let left = coarse(surface, target);
            let kept: FxHashSet<u32> = left.iter().flatten().copied().collect();
            prop_assert!(left.len() <= whole.len() && kept.is_subset(&used));
            let mut ordered = crate::order::of(points.len(), &triangles);
            let mut sorted = triangles.clone();
            ordered.sort_unstable();
            sorted.sort_unstable();
            prop_assert_eq!(ordered, sorted);
        }
    }
}
