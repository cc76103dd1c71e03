//! Orientation by evidence (section 1.4, robust): the surface is cut where it is least sure.

use super::base::is_interior;
use super::homes::{Homes, Side};
use super::insert::normal;
use super::surface::{Edge, Surface, Triangle, alike, edges};
use outcrop::geom::Point;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// What is known of the T3 before they are oriented.
pub struct Known<'a> {
    /// The shape.
    pub points: &'a [Point],
    /// `B`.
    pub block: u32,
    /// The T3 that no vertex flags.
    pub kept: &'a BTreeSet<Triangle>,
    /// By block, the crossing T3 that touch it and that none of its own vertices flags.
    pub seen: BTreeMap<u32, BTreeSet<Triangle>>,
    /// Interior candidates.
    pub candidates: Vec<Triangle>,
}

/// The oriented base.
pub struct Weighed {
    pub surface: Surface,
    pub one_sided: BTreeSet<Triangle>,
    /// The home of each triangle, and how it runs in it.
    pub sides: BTreeMap<Triangle, Side>,
    /// Whether a home has a crossing triangle.
    pub global: Vec<bool>,
    /// Pairs of labels joined by votes, and how many sums contradicted those before.
    pub voted: usize,
    pub outvoted: usize,
}

/// The normal of the run i → j → k, of length one.
fn unit_normal(points: &[Point], t: Triangle) -> [f64; 3] {
    let n = normal(points, t).map(|x| x as f64);
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    n.map(|x| if length > 0.0 { x / length } else { x })
}

/// The cosine of the angle between two triangles at an edge, run alike.
fn cosine(points: &[Point], a: Triangle, b: Triangle, edge: Edge) -> f64 {
    let (n, m) = (unit_normal(points, a), unit_normal(points, b));
    let dot = n[0] * m[0] + n[1] * m[1] + n[2] * m[2];
    if alike(a, b, edge) { dot } else { -dot }
}

fn weight(cosine: f64) -> i64 {
    1 + (15.0 * cosine.max(0.0)).floor() as i64
}

/// Everything while it is worked on. A triangle's number is its place among those that no vertex
/// flags; each begins as a set of its own.
struct Weigher<'a> {
    known: Known<'a>,
    number: BTreeMap<Triangle, usize>,
    sets: Homes,
    /// What is there so far: first the interior triangles, then crossing ones, too.
    surface: Surface,
    one_sided: BTreeSet<Triangle>,
}

pub fn orient(known: Known<'_>) -> Weighed {
    let inside = |t: &&Triangle| is_interior(**t, known.block);
    let interior: BTreeSet<Triangle> = known.kept.iter().filter(inside).copied().collect();
    let mut weigher = Weigher {
        number: known.kept.iter().copied().zip(0..).collect(),
        sets: Homes::apart(known.kept.len()),
        surface: Surface::of(interior),
        one_sided: BTreeSet::new(),
        known,
    };
    weigher.join_by_flatness();
    let (voted, outvoted) = weigher.join_by_votes();
    weigher.add_crossing();
    weigher.finish(voted, outvoted)
}

impl Weigher<'_> {
    /// The orientation of `t` itself.
    fn own(&self, t: Triangle) -> Side {
        Side {
            home: self.number[&t],
            turned: false,
        }
    }

    /// The orientation that `other` asks of `t`.
    fn asks(&self, other: Triangle, t: Triangle, edge: Edge) -> Side {
        Side {
            turned: !alike(t, other, edge),
            ..self.own(other)
        }
    }

    /// All that the surface so far asks of `t`, with the triangles that ask, in order of its edges.
    fn asked(&self, t: Triangle) -> Vec<(Triangle, Edge, Side)> {
        let mut all = Vec::new();
        for edge in edges(t) {
            for other in self.surface.at_edge(edge).into_iter().filter(|o| *o != t) {
                all.push((other, edge, self.asks(other, t, edge)));
            }
        }
        all
    }

    /// Step 1. No edge of two interior triangles is in two blocks, so all blocks are one here.
    fn join_by_flatness(&mut self) {
        let mut joints = Vec::new();
        for &t in self.surface.triangles() {
            for (other, edge, _) in self.asked(t) {
                let cosine = cosine(self.known.points, t, other, edge);
                let step = match cosine {
                    c if c > 0.9 => 0,
                    c => 1 + (((0.9 - c) / 1.9 * 63.0) as usize).min(63),
                };
                if t < other {
                    joints.push((step, t, other, edge));
                }
            }
        }
        // Those of a step in the order in which they were found.
        joints.sort_by_key(|joint| joint.0);
        for (_, t, other, edge) in joints {
            if self.one_sided.contains(&t) || self.one_sided.contains(&other) {
                continue;
            }
            let (a, b) = (self.own(t), self.asks(other, t, edge));
            if self.sets.conflict(&[a, b]) {
                self.one_sided.insert(other);
            } else {
                self.sets.join(a, b);
            }
        }
        for &t in &self.one_sided {
            self.surface.remove(t);
        }
    }

    /// Labels that are voted on, by their sets, numbered from block to block and in each in the order
    /// in which its crossing triangles meet them.
    fn labels(&self) -> BTreeMap<usize, usize> {
        let mut numbers = BTreeMap::new();
        for (&g, seen) in &self.known.seen {
            for &t in seen {
                let inside = |other: &Triangle| other[0] / self.known.block == g;
                for (_, _, side) in self.asked(t).into_iter().filter(|ask| inside(&ask.0)) {
                    let next = numbers.len();
                    numbers.entry(self.sets.label(side.home)).or_insert(next);
                }
            }
        }
        numbers
    }

    /// Step 2: how many pairs of labels were joined, and how many contradicted.
    fn join_by_votes(&mut self) -> (usize, usize) {
        let numbers = self.labels();
        let mut votes: BTreeMap<[usize; 2], i64> = BTreeMap::new();
        let mut vote = |a: Side, b: Side, weight: i64| {
            if let (Some(&x), Some(&y)) = (numbers.get(&a.home), numbers.get(&b.home))
                && x != y
            {
                let sign = if a.turned == b.turned { 1 } else { -1 };
                *votes.entry([x.min(y), x.max(y)]).or_default() += sign * weight;
            }
        };
        for &t in &self.known.candidates {
            let mut asked = self.asked(t);
            asked.truncate(3);
            for (n, &(other, edge, a)) in asked.iter().enumerate() {
                for &(another, far, b) in &asked[..n] {
                    let flat = |other, edge| cosine(self.known.points, t, other, edge);
                    let least = flat(other, edge).min(flat(another, far));
                    let [a, b] = [a, b].map(|side| self.sets.seen_from_label(side));
                    vote(a, b, weight(least));
                }
            }
        }
        self.crossing_votes(&mut vote);
        let sets_of: BTreeMap<usize, usize> = numbers.iter().map(|(&set, &n)| (n, set)).collect();
        let mut pairs: Vec<_> = votes.into_iter().filter(|(_, sum)| *sum != 0).collect();
        pairs.sort_by_key(|&(pair, sum)| (Reverse(sum.abs()), pair));
        let mut outvoted = 0;
        for ([x, y], sum) in &pairs {
            let [a, b] = [(x, false), (y, *sum < 0)].map(|(label, turned)| Side {
                home: sets_of[label],
                turned,
            });
            if self.sets.conflict(&[a, b]) {
                outvoted += 1;
            } else {
                self.sets.join(a, b);
            }
        }
        (pairs.len() - outvoted, outvoted)
    }

    /// The votes of the crossing triangles, ascending.
    fn crossing_votes(&self, vote: &mut impl FnMut(Side, Side, i64)) {
        let mut runs: BTreeMap<Triangle, Side> = BTreeMap::new();
        for &t in self.known.kept.iter().filter(|t| !self.interior(t)) {
            let mut asked = Vec::new();
            for (other, edge, side) in self.asked(t) {
                let weight = weight(cosine(self.known.points, t, other, edge));
                asked.push((self.sets.seen_from_label(side), weight));
            }
            for edge in edges(t) {
                for (&other, &side) in &runs {
                    if edge.iter().all(|v| other.contains(v)) {
                        let turned = side.turned == alike(t, other, edge);
                        asked.push((Side { turned, ..side }, 1));
                    }
                }
            }
            let greatest = asked.iter().map(|ask| ask.1).max();
            let first = asked.iter().find(|ask| Some(ask.1) == greatest);
            if let Some(&(side, _)) = first {
                runs.insert(t, side);
                for &(other, weight) in &asked {
                    vote(side, other, 8 * weight);
                }
            }
        }
    }

    fn interior(&self, t: &Triangle) -> bool {
        is_interior(*t, self.known.block)
    }

    /// Step 3.
    fn add_crossing(&mut self) {
        for &t in self.known.kept {
            if self.interior(&t) {
                continue;
            }
            let asked: Vec<Side> = self.asked(t).iter().map(|ask| ask.2).collect();
            if self.sets.conflict(&asked) {
                self.one_sided.insert(t);
                continue;
            }
            for side in asked {
                self.sets.join(self.own(t), side);
            }
            self.surface.insert(t);
        }
    }

    /// Homes are the sets; one without a crossing triangle is cut up into its parts in each block.
    fn finish(self, voted: usize, outvoted: usize) -> Weighed {
        let seen: BTreeMap<Triangle, Side> = self
            .surface
            .triangles()
            .iter()
            .map(|&t| (t, self.sets.seen_from_label(self.own(t))))
            .collect();
        let crossing = seen.iter().filter(|(t, _)| !self.interior(t));
        let crossed: BTreeSet<usize> = crossing.map(|(_, side)| side.home).collect();
        let mut homes: BTreeMap<(usize, Option<u32>), usize> = BTreeMap::new();
        let mut global = Vec::new();
        let mut sides = BTreeMap::new();
        for (t, side) in seen {
            let crosses = crossed.contains(&side.home);
            let part = (!crosses).then(|| t[0] / self.known.block);
            let home = *homes.entry((side.home, part)).or_insert_with(|| {
                global.push(crosses);
                global.len() - 1
            });
            sides.insert(t, Side { home, ..side });
        }
        Weighed {
            surface: self.surface,
            one_sided: self.one_sided,
            sides,
            global,
            voted,
            outvoted,
        }
    }
}
