//! Section 7: insertion of candidates, interior ones by block, then crossing ones.

use super::base::{Base, is_interior};
use super::homes::{Homes, Side};
use super::surface::{Surface, Triangle, alike, edges, fans, opposite};
use super::{Rejected, Settings};
use outcrop_geom::{Point, distance2, sub};
use std::collections::{BTreeMap, BTreeSet};

/// A candidate; the order of the fields is the rank.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Candidate {
    /// 0 flagged T3, 1 T2, 2 T1.
    kind: u8,
    /// Square of the longest edge.
    longest2: u64,
    triangle: Triangle,
}

/// The first failed test; test IV needs more than the mesh and is not here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Failure {
    Edges,
    FullEdge,
    Vertex,
    Angle,
}

/// Triangles so far, each with its component and its orientation in it.
#[derive(Clone)]
struct Mesh<'a> {
    points: &'a [Point],
    cos_max_angle: f64,
    surface: Surface,
    sides: BTreeMap<Triangle, Side>,
}

/// Exact normal of the run i → j → k.
pub fn normal(points: &[Point], t: Triangle) -> [i128; 3] {
    let [p, q, r] = t.map(|v| points[v as usize]);
    let (a, b) = (sub(q, p).map(i128::from), sub(r, p).map(i128::from));
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

impl Mesh<'_> {
    /// Tests I, II, III and G in this order; returns the first that fails.
    fn failure(&self, t: Triangle) -> Option<Failure> {
        let shared: Vec<_> = edges(t)
            .into_iter()
            .filter(|&e| !self.surface.at_edge(e).is_empty())
            .collect();
        let isolated = |v| self.surface.at_vertex(v).is_empty();
        if shared.is_empty() || shared.len() == 1 && !isolated(opposite(t, shared[0])) {
            return Some(Failure::Edges);
        }
        if shared.iter().any(|&e| self.surface.at_edge(e).len() >= 2) {
            return Some(Failure::FullEdge);
        }
        let excess = |v: u32| {
            let mut triangles = self.surface.at_vertex(v);
            triangles.insert(t);
            let fans = fans(v, &triangles);
            fans.len() > 1 && fans.iter().any(|fan| fan.closed)
        };
        if t.into_iter().any(excess) {
            return Some(Failure::Vertex);
        }
        let flat_enough = |&e: &_| {
            let other = self.surface.at_edge(e)[0];
            self.angle_is_small(t, other, alike(t, other, e))
        };
        (!shared.iter().all(flat_enough)).then_some(Failure::Angle)
    }

    /// `n·n' ≥ cos(max-angle) |n| |n'|`: both products of the right side in this order, `n` the
    /// candidate's; every value that enters is an exact integer rounded once to f64.
    fn angle_is_small(&self, t: Triangle, other: Triangle, alike: bool) -> bool {
        let dot = |a: [i128; 3], b: [i128; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (n, m) = (normal(self.points, t), normal(self.points, other));
        let product = if alike { dot(n, m) } else { -dot(n, m) };
        let length = |n| (dot(n, n) as f64).sqrt();
        product as f64 >= self.cos_max_angle * length(n) * length(m)
    }

    /// The orientations that the adjacent triangles imply for `t`, in the order of its edges.
    fn asked(&self, t: Triangle) -> Vec<Side> {
        let mut asked = Vec::new();
        for edge in edges(t) {
            for other in self.surface.at_edge(edge) {
                let side = self.sides[&other];
                asked.push(Side {
                    turned: side.turned == alike(t, other, edge),
                    ..side
                });
            }
        }
        asked
    }

    fn insert(&mut self, t: Triangle, side: Side) {
        self.surface.insert(t);
        self.sides.insert(t, side);
    }

    /// Tries candidates in rank order, in rounds, until a round inserts nothing. `agree` is test IV and notes
    /// an insertion. Returns the inserted ones, in order, and those that fail only test I.
    fn rounds(
        &mut self,
        mut pending: BTreeSet<Candidate>,
        rejected: &mut Rejected,
        agree: &mut dyn FnMut(Triangle, &[Side]) -> bool,
    ) -> (Vec<Triangle>, BTreeSet<Candidate>) {
        let mut inserted = Vec::new();
        loop {
            let before = inserted.len();
            for candidate in pending.clone() {
                let t = candidate.triangle;
                match self.failure(t) {
                    Some(Failure::Edges) => continue,
                    Some(Failure::FullEdge) => rejected.full_edge += 1,
                    Some(Failure::Vertex) => rejected.vertex += 1,
                    Some(Failure::Angle) => rejected.angle += 1,
                    None => {
                        let asked = self.asked(t);
                        if agree(t, &asked) {
                            self.insert(t, asked[0]);
                            inserted.push(t);
                        } else {
                            rejected.orientation += 1;
                        }
                    }
                }
                pending.remove(&candidate);
            }
            if inserted.len() == before {
                return (inserted, pending);
            }
        }
    }
}

/// The candidates, from the triples and the T3 that were flagged.
fn candidates(
    points: &[Point],
    triples: &BTreeMap<Triangle, u32>,
    flagged: &BTreeSet<Triangle>,
) -> BTreeSet<Candidate> {
    let mut all = BTreeSet::new();
    for (&t, &count) in triples {
        let kind = match count {
            3 if flagged.contains(&t) => 0,
            2 => 1,
            1 => 2,
            _ => continue,
        };
        let lengths = edges(t).map(|[a, b]| distance2(points[a as usize], points[b as usize]));
        let longest2 = lengths.into_iter().max().expect("three edges");
        all.insert(Candidate {
            kind,
            longest2,
            triangle: t,
        });
    }
    all
}

/// A tentative merge: a triangle at which two global components meet, and the orientations that its
/// neighbours imply.
struct TentativeMerge {
    triangle: Triangle,
    asked: Vec<Side>,
}

/// The result of a block.
struct Block {
    merges: Vec<TentativeMerge>,
    /// Interior candidates that failed only test I.
    left: BTreeSet<Candidate>,
}

/// Counts of all candidates.
pub struct Inserted {
    pub surface: Surface,
    pub candidates: usize,
    pub interior: usize,
    pub crossing: usize,
    pub merges: usize,
    pub merges_reverted: usize,
    pub rejected: Rejected,
}

pub fn insert(
    points: &[Point],
    triples: &BTreeMap<Triangle, u32>,
    on_a_line: &BTreeSet<Triangle>,
    base: Base,
    settings: &Settings,
) -> Inserted {
    let block = settings.block;
    let mut mesh = Mesh {
        points,
        cos_max_angle: settings.cos_max_angle,
        surface: base.surface,
        sides: base.sides,
    };
    let mut global = base.global;
    let mut homes = Homes::apart(global.len());
    let mut all = candidates(points, triples, &base.flagged);
    all.retain(|c| !on_a_line.contains(&c.triangle));
    let (interior, crossing): (BTreeSet<_>, BTreeSet<_>) = all
        .iter()
        .copied()
        .partition(|c: &Candidate| is_interior(c.triangle, block));
    let mut rejected = Rejected::default();

    let blocks = points.len().div_ceil(block as usize) as u32;
    let mut inserted_inside = Vec::new();
    let mut by_block = Vec::new();
    for g in 0..blocks {
        let own = interior
            .iter()
            .filter(|c| c.triangle[0] / block == g)
            .copied()
            .collect();
        let (inserted, result) = by_itself(&mesh, own, &mut homes, &mut global, &mut rejected);
        inserted_inside.extend(inserted);
        by_block.push(result);
    }
    for &(t, side) in &inserted_inside {
        mesh.insert(t, side);
    }

    let merges = by_block.iter().map(|b| b.merges.len()).sum();
    let crossing_triples = triples.keys().filter(|&&t| !is_interior(t, block));
    let near_border: BTreeSet<u32> = crossing_triples.flatten().copied().collect();
    let (crossing_inserted, merges_reverted) = across(
        &mut mesh,
        by_block,
        crossing,
        &near_border,
        homes,
        block,
        &mut rejected,
    );
    Inserted {
        surface: mesh.surface,
        candidates: all.len(),
        interior: inserted_inside.len(),
        crossing: crossing_inserted,
        merges,
        merges_reverted,
        rejected,
    }
}

/// Tries the interior candidates of one block against the base and each other. Absorbed components are merged
/// in `homes` for good.
fn by_itself(
    base: &Mesh<'_>,
    own: BTreeSet<Candidate>,
    homes: &mut Homes,
    global: &mut [bool],
    rejected: &mut Rejected,
) -> (Vec<(Triangle, Side)>, Block) {
    let mut mesh = base.clone();
    let mut joined = homes.clone();
    let mut merges = Vec::new();
    let mut agree = |triangle: Triangle, asked: &[Side]| {
        if joined.conflict(asked) {
            return false;
        }
        let mut is_joint = false;
        for &further in &asked[1..] {
            let (a, b) = (homes.label(asked[0].home), homes.label(further.home));
            if a == b {
                continue;
            }
            joined.join(asked[0], further);
            if global[a] && global[b] {
                is_joint = true;
                continue;
            }
            // The merged component is global if either was, whichever label remains.
            homes.join(asked[0], further);
            let either = global[a] || global[b];
            (global[a], global[b]) = (either, either);
        }
        if is_joint {
            merges.push(TentativeMerge {
                triangle,
                asked: asked.to_vec(),
            });
        }
        true
    };
    let (inserted, left) = mesh.rounds(own, rejected, &mut agree);
    let inserted = inserted.into_iter().map(|t| (t, mesh.sides[&t])).collect();
    (inserted, Block { merges, left })
}

/// Tentative merges and crossing candidates, block by block, in the whole mesh. Returns the numbers of
/// triangles inserted and of tentative merges removed.
fn across(
    mesh: &mut Mesh<'_>,
    blocks: Vec<Block>,
    mut crossing: BTreeSet<Candidate>,
    near_border: &BTreeSet<u32>,
    mut homes: Homes,
    block: u32,
    rejected: &mut Rejected,
) -> (usize, usize) {
    let (mut inserted, mut removed) = (0, 0);
    for (g, own) in blocks.into_iter().enumerate() {
        for merge in own.merges {
            if homes.conflict(&merge.asked) {
                mesh.surface.remove(merge.triangle);
                mesh.sides.remove(&merge.triangle);
                removed += 1;
            } else {
                homes.join_all(&merge.asked);
            }
        }
        // A vertex in block g implies that the smallest vertex is in block g or before.
        let touches = |c: &Candidate| c.triangle.iter().any(|v| v / block == g as u32);
        let (now, later): (BTreeSet<_>, BTreeSet<_>) = crossing.into_iter().partition(touches);
        let again = |c: &&Candidate| c.triangle.iter().any(|v| near_border.contains(v));
        let (retried, hopeless): (BTreeSet<_>, BTreeSet<_>) = own.left.iter().partition(again);
        let mut agree = |_: Triangle, asked: &[Side]| {
            let fine = !homes.conflict(asked);
            if fine {
                homes.join_all(asked);
            }
            fine
        };
        let tried = now.union(&retried).copied().collect();
        let (done, left) = mesh.rounds(tried, rejected, &mut agree);
        inserted += done.len();
        // Crossing candidates are tried again in each later block that has one of their vertices.
        let (wait, over): (BTreeSet<_>, BTreeSet<_>) = left
            .into_iter()
            .partition(|c: &Candidate| c.triangle[2] / block > g as u32);
        crossing = &later | &wait;
        rejected.edges += over.len() + hopeless.len();
    }
    (inserted, removed)
}
