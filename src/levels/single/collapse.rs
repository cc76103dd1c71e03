//! Contraction of edges, cheapest first.

use super::patch::{Around, Patch, is_gone};
use super::quadric::{V3, minus};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Steps of the cost in an octave, for [`Curve`].
const STEPS: u32 = 7;

/// How many triangles are removed at which cost: pairs of a step of the cost and a number.
pub(super) type Curve = Vec<(u32, u32)>;

/// The step of a cost.
fn step(cost: f32) -> u32 {
    cost.to_bits() >> (23 - STEPS)
}

/// The largest cost of a step.
pub(super) fn cost_of(step: u32) -> f32 {
    f32::from_bits(((step + 1) << (23 - STEPS)) - 1)
}

/// When contraction ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct End {
    /// The largest cost: a mean squared distance from planes.
    pub cost: f32,
    /// The smallest number of triangles.
    pub triangles: usize,
}

/// An edge in the queue, as one number, by which it sorts: its cost as bits, its ends, and the sum of their versions.
type Queued = Reverse<u128>;

fn queued(words: [u32; 4]) -> Queued {
    let number = words
        .into_iter()
        .fold(0, |all, word| all << 32 | u128::from(word));
    Reverse(number)
}

fn words(Reverse(number): Queued) -> [u32; 4] {
    [96, 64, 32, 0].map(|shift| (number >> shift) as u32)
}

struct Queue {
    edges: BinaryHeap<Queued>,
    /// For each vertex, how often it was moved.
    versions: Vec<u32>,
}

/// The cost of an edge, and the place of its vertex; `a` stays if it is locked. None if both are.
fn look(patch: &Patch, a: u32, b: u32) -> Option<(f32, u32, u32, V3)> {
    let [locked_a, locked_b] = [a, b].map(|v| patch.locked[v as usize]);
    let [rim_a, rim_b] = [a, b].map(|v| patch.boundary[v as usize]);
    let (a, b, fixed) = match (locked_a, locked_b) {
        (true, true) => return None,
        (true, false) => (a, b, true),
        (false, true) => (b, a, true),
        _ if rim_a && !rim_b => (a, b, true),
        _ if rim_b && !rim_a => (b, a, true),
        _ => (a, b, false),
    };
    let [p, q] = [a, b].map(|v| patch.points[v as usize]);
    let away = minus(q, p);
    let of_b = patch.quadrics[b as usize].moved(minus(p, q));
    let sum = patch.quadrics[a as usize].plus(&of_b);
    let length2: f64 = away.iter().map(|x| x * x).sum();
    let middle = away.map(|x| x / 2.0);
    let free = || {
        let near = |d: &V3| {
            let out = minus(*d, middle);
            out.iter().map(|x| x * x).sum::<f64>() <= 4.0 * length2
        };
        sum.least(middle).filter(near).unwrap_or(middle)
    };
    let d = if fixed { [0.0; 3] } else { free() };
    let area = sum.area.max(f64::MIN_POSITIVE);
    let cost = sum.at(d) / area + LENGTH * length2;
    let place = if fixed {
        p
    } else {
        std::array::from_fn(|k| p[k] + d[k])
    };
    Some((cost as f32, a, b, place))
}

/// The part of the squared length of an edge that is added to its cost, so that short edges go first where the surface
/// is flat.
const LENGTH: f64 = 1e-9;

impl Queue {
    /// An edge as it is queued; none if it is not contracted at this cost.
    fn edge(&self, patch: &Patch, (a, b): (u32, u32), most: f32) -> Option<Queued> {
        let (cost, ..) = look(patch, a, b)?;
        let [v, w] = [a, b].map(|v| self.versions[v as usize]);
        // Costs are not negative.
        let bits = cost.max(0.0).to_bits();
        (cost <= most).then(|| queued([bits, a.min(b), a.max(b), v.wrapping_add(w)]))
    }

    fn of(patch: &Patch, most: f32) -> Self {
        let mut queue = Self {
            edges: BinaryHeap::new(),
            versions: vec![0; patch.points.len()],
        };
        let mut all = Vec::with_capacity(2 * patch.triangles.len());
        for [a, b, c] in &patch.triangles {
            for (a, b) in [(*a, *b), (*b, *c), (*c, *a)] {
                // Both sides of an edge name it, and one of them in this order. On a boundary it has one side.
                if a < b || patch.boundary[a as usize] && patch.boundary[b as usize] {
                    all.extend(queue.edge(patch, (a, b), most));
                }
            }
        }
        queue.edges = BinaryHeap::from(all);
        queue
    }
}

/// Contracts edges up to an end, and notes what each cost removes.
pub(super) fn contract(patch: &mut Patch, end: End) -> Curve {
    let mut queue = Queue::of(patch, end.cost);
    let (mut curve, mut highest) = (Curve::new(), 0f32);
    let mut around = Around::default();
    let (mut fan, mut near) = (Vec::new(), Vec::new());
    while patch.count > end.triangles
        && let Some(edge) = queue.edges.pop()
    {
        let [bits, a, b, versions] = words(edge);
        let known = queue.versions[a as usize].wrapping_add(queue.versions[b as usize]);
        if known != versions {
            continue;
        }
        let cost = f32::from_bits(bits);
        let Some((_, a, b, place)) = look(patch, a, b) else {
            continue;
        };
        if !patch.can_contract(a, b, &mut around) || !patch.keeps_triangles(a, b, place, &around) {
            continue;
        }
        let before = patch.count;
        patch.contract(a, b, place, &around);
        highest = highest.max(cost);
        let (step, removed) = (step(highest), (before - patch.count) as u32);
        match curve.last_mut() {
            Some(last) if last.0 == step => last.1 += removed,
            _ => curve.push((step, removed)),
        }
        // The other end never comes back: no edge of the queue is one of this version.
        queue.versions[a as usize] += 1;
        queue.versions[b as usize] += 1;
        fan.clear();
        near.clear();
        patch.fan(a, &mut fan);
        patch.neighbours(a, &fan, &mut near);
        for other in &near {
            let edge = queue.edge(patch, (a, *other), end.cost);
            queue.edges.extend(edge);
        }
    }
    curve
}

/// The triangles that are left.
pub(super) fn left(patch: &Patch) -> impl Iterator<Item = &[u32; 3]> {
    patch.triangles.iter().filter(|t| !is_gone(t))
}
