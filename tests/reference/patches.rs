//! Patches of a block and their connections (section 6.3, steps 1 to 3).

use super::Weighing;
use super::contract::Graph;
use super::homes::{Homes, Side};
use super::insert::normal;
use super::outside::{Known, facing};
use super::surface::{Edge, Surface, Triangle, alike, edges};
use outcrop_geom::Point;
use std::collections::{BTreeMap, BTreeSet};

/// The unit normal of the run i → j → k.
pub fn unit_normal(points: &[Point], t: Triangle) -> [f64; 3] {
    let n = normal(points, t).map(|x| x as f64);
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    n.map(|x| if length > 0.0 { x / length } else { x })
}

/// The cosine between two triangles at an edge, oriented alike, by the normals of `unit`.
pub fn cosine(unit: impl Fn(Triangle) -> [f64; 3], a: Triangle, b: Triangle, edge: Edge) -> f64 {
    let (n, m) = (unit(a), unit(b));
    let dot = n[0] * m[0] + n[1] * m[1] + n[2] * m[2];
    if alike(a, b, edge) { dot } else { -dot }
}

/// The weight of an edge.
pub fn weight(cosine: f64) -> i64 {
    1 + (15.0 * cosine.max(0.0)).floor() as i64
}

/// Input: a block.
pub struct Block<'a> {
    /// The shape.
    pub points: &'a [Point],
    /// Its interior triangles.
    pub surface: Surface,
    /// The crossing T3 that no vertex of the block flags.
    pub crossing: BTreeSet<Triangle>,
    /// Its interior candidates.
    pub candidates: BTreeSet<Triangle>,
    /// The highest points of columns.
    pub highest: &'a BTreeSet<u32>,
    /// What is known of each point.
    pub known: &'a [Option<Known>],
    /// `P`.
    pub run: u32,
}

/// The patches of a block.
pub struct Patches {
    /// The patch of each triangle; true if it is turned in it.
    pub of: BTreeMap<Triangle, Side>,
    pub graph: Graph,
}

impl Block<'_> {
    /// The edges between its triangles, by the smaller triangle, then in the order of its edges: smaller and
    /// larger triangle, and the edge.
    pub fn shared_edges(&self) -> Vec<(Triangle, Triangle, Edge)> {
        let mut shared_edges = Vec::new();
        for &t in self.surface.triangles() {
            for edge in edges(t) {
                let others = self.surface.at_edge(edge).into_iter();
                shared_edges.extend(others.filter(|o| t < *o).map(|other| (t, other, edge)));
            }
        }
        shared_edges
    }

    fn cosine(&self, a: Triangle, b: Triangle, edge: Edge) -> f64 {
        cosine(|t| unit_normal(self.points, t), a, b, edge)
    }

    /// Steps 1 to 3.
    pub fn patches(&self, met: &mut Weighing) -> Patches {
        let mut patches = Patches {
            of: self.joined(met),
            graph: Graph::default(),
        };
        let count = patches.of.values().map(|side| side.home + 1).max();
        (0..count.unwrap_or(0)).for_each(|_| _ = patches.graph.push());
        self.add_evidence(&mut patches, met);
        self.add_edges(&mut patches);
        self.add_outside(&mut patches);
        for &c in &self.candidates {
            self.add_votes(c, &mut patches, met);
        }
        patches
    }

    /// Step 1. A patch has the orientation of its smallest triangle.
    fn joined(&self, met: &mut Weighing) -> BTreeMap<Triangle, Side> {
        let all: Vec<Triangle> = self.surface.triangles().iter().copied().collect();
        let number = |t| Side {
            home: all.iter().position(|u| *u == t).expect("a triangle"),
            turned: false,
        };
        let mut sets = Homes::apart(all.len());
        for (t, other, edge) in self.shared_edges() {
            let near = t[0] / self.run == other[0] / self.run;
            if near && self.cosine(t, other, edge) > 0.9 {
                let turned = !alike(t, other, edge);
                let asks = [
                    number(t),
                    Side {
                        turned,
                        ..number(other)
                    },
                ];
                if sets.conflict(&asks) {
                    met.folded += 1;
                } else {
                    sets.join(asks[0], asks[1]);
                }
            }
        }
        // Patches so far, each with the side of its smallest triangle.
        let mut patches: Vec<Side> = Vec::new();
        let mut of = BTreeMap::new();
        for &t in &all {
            let side = sets.seen_from_label(number(t));
            let known = patches.iter().position(|first| first.home == side.home);
            let home = known.unwrap_or_else(|| {
                patches.push(side);
                patches.len() - 1
            });
            let turned = side.turned != patches[home].turned;
            of.insert(t, Side { home, turned });
        }
        of
    }

    /// Step 2: evidence, and the numbers of triangles.
    fn add_evidence(&self, patches: &mut Patches, met: &mut Weighing) {
        for (&t, side) in &patches.of {
            let node = &mut patches.graph.nodes[side.home];
            node.triangles += 1;
            for v in t {
                let known = self.known[v as usize];
                let up = match known {
                    Some(Known::Place(_) | Known::Normal(..)) if v % 64 != 0 => 0,
                    Some(Known::Normal(_, false)) => 0,
                    Some(_) => facing(self.points, self.known, t, v),
                    None if self.highest.contains(&v) => {
                        (16.0 * unit_normal(self.points, t)[2]).trunc() as i64
                    }
                    None => 0,
                };
                met.faced += usize::from(known.is_some() && up != 0);
                node.up += if side.turned { -up } else { up };
            }
        }
    }

    /// Step 3: edges.
    fn add_edges(&self, patches: &mut Patches) {
        for (t, other, edge) in self.shared_edges() {
            let weight = 8 * weight(self.cosine(t, other, edge));
            let (a, b) = (patches.of[&t], self.asks(patches, other, t, edge));
            patches.graph.add(a, b, weight);
        }
    }

    /// The orientation that `other` implies for `t`.
    fn asks(&self, patches: &Patches, other: Triangle, t: Triangle, edge: Edge) -> Side {
        let side = patches.of[&other];
        Side {
            turned: side.turned == alike(t, other, edge),
            ..side
        }
    }

    /// Step 3: edges to crossing triangles.
    fn add_outside(&self, patches: &mut Patches) {
        for &c in &self.crossing {
            for edge in edges(c) {
                for t in self.surface.at_edge(edge) {
                    patches.graph.nodes[patches.of[&t].home].outside += 256;
                }
            }
        }
    }

    /// Step 3: the votes of a candidate.
    fn add_votes(&self, c: Triangle, patches: &mut Patches, met: &mut Weighing) {
        let mut asked = Vec::new();
        for edge in edges(c) {
            for t in self.surface.at_edge(edge) {
                let weight = weight(self.cosine(c, t, edge));
                asked.push((self.asks(patches, t, c, edge), weight));
            }
        }
        met.crowded += usize::from(asked.len() > 3);
        asked.truncate(3);
        for (n, &(a, of_a)) in asked.iter().enumerate() {
            for &(b, of_b) in &asked[..n] {
                met.votes += usize::from(a.home != b.home);
                patches.graph.add(a, b, of_a.min(of_b));
            }
        }
    }
}
