//! Contraction of edges in passes: in each, edges are put in order by cost, and those of the cheapest are contracted
//! that have no end in common with one before.

mod start;

use crate::fans::Fans;
use crate::quadric::{QUALITY, Quadric, TURN, V3, dot, minus, normal, of_triangles};
use crate::simplify::Surface;
use std::array::from_fn;

/// No vertex, and the first corner of a triangle that is gone.
const NONE: u32 = u32::MAX;

/// Bits of a cost that do not count: with the others, costs have eight steps in an octave.
const SHIFT: u32 = 20;

/// Steps of a cost that is a float.
const STEPS: usize = (f32::INFINITY.to_bits() >> SHIFT) as usize + 1;

/// The cheapest part of all edges, one of so many, that may be contracted in a pass.
const SHARE: usize = 4;

/// Edges that may be contracted in a pass, for each contraction that is still wanted.
const CHOICE: usize = 4;

/// The part of the squared length of an edge that is added to its cost, so that short edges go first where the surface
/// is flat.
const LENGTH: f64 = 1e-9;

/// The squared diagonal of a component times this is the cost at which it goes as a whole.
const COMPONENT: f64 = 16.0;

/// An end of an edge that goes into the other, or a component, which has a vertex twice.
#[derive(Debug, Clone, Copy, Default)]
struct Edge {
    stays: u32,
    goes: u32,
    /// The step of its cost.
    step: u32,
}

/// A mesh while its edges are contracted.
pub(super) struct Mesh<'a> {
    points: &'a [V3],
    quadrics: Vec<Quadric>,
    locked: Vec<bool>,
    boundary: Vec<bool>,
    pub triangles: Vec<[u32; 3]>,
    /// The triangles at each vertex when the pass began.
    fans: Fans,
    /// True for ends of an edge that was contracted in the pass.
    touched: Vec<bool>,
    /// For each vertex the first one of its component.
    component: Vec<u32>,
    /// Triangles of each component, by its first vertex.
    members: Vec<u32>,
    /// Components without locked vertices, and the steps of what they cost.
    free: Vec<Edge>,
    /// For each vertex the last search that saw it.
    seen: Vec<u32>,
    search: u32,
    count: usize,
}

/// The triangles at the end that goes, without and with the one that stays.
#[derive(Debug, Default)]
struct Around {
    moved: Vec<u32>,
    both: Vec<u32>,
}

/// The step of a cost.
fn step(cost: f64) -> u32 {
    ((cost as f32).to_bits() >> SHIFT).min(STEPS as u32 - 1)
}

fn is_gone(triangle: &[u32; 3]) -> bool {
    triangle[0] == NONE
}

/// The square of the quality of a triangle with this normal.
fn quality2([a, b, c]: [V3; 3], normal2: f64) -> f64 {
    let sides = [minus(b, a), minus(c, b), minus(a, c)];
    let sum: f64 = sides.iter().map(|side| dot(*side, *side)).sum();
    match sum > 0.0 {
        true => 12.0 * normal2 / (sum * sum),
        false => 0.0,
    }
}

impl<'a> Mesh<'a> {
    /// Triangles with two equal corners are left out. Vertices at which it is no surface are locked.
    pub fn new(surface: Surface<'a>) -> Self {
        let mut triangles = surface.triangles.to_vec();
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        let count = surface.points.len();
        let mut mesh = Self {
            points: surface.points,
            quadrics: of_triangles(surface.points, &triangles),
            locked: surface.locked.to_vec(),
            boundary: vec![false; count],
            fans: Fans::of(count, &triangles),
            touched: vec![false; count],
            component: (0..count as u32).collect(),
            members: vec![0; count],
            free: Vec::new(),
            seen: vec![0; count],
            search: 0,
            count: triangles.len(),
            triangles,
        };
        mesh.find_components(surface.locked);
        mesh.look_at_vertices(surface.locked);
        mesh
    }

    /// Contracts cheap edges, down to this number of triangles or until no more can be contracted.
    pub fn contract(&mut self, target: usize) {
        let (mut edges, mut cheap) = (Vec::new(), Vec::new());
        let mut around = Around::default();
        let mut share = SHARE;
        while self.count > target {
            self.edges(&mut edges);
            let wanted = CHOICE * (self.count - target).div_ceil(2);
            let limit = match share {
                1 => edges.len(),
                _ => (edges.len() / share).min(wanted),
            };
            cheapest(&edges, limit, &mut cheap);
            let before = self.count;
            for edge in &cheap {
                if self.count <= target {
                    break;
                }
                self.turn(*edge, &mut around);
            }
            self.end_pass();
            // What could not be contracted may be possible when all else is done.
            match (self.count < before - before / 64, share) {
                (true, _) => {}
                (false, 1) => break,
                (false, _) => share = 1,
            }
        }
    }

    /// All edges that may be contracted, and all components that may go.
    fn edges(&self, all: &mut Vec<Edge>) {
        all.clear();
        all.extend(
            self.free
                .iter()
                .filter(|e| self.members[e.stays as usize] > 0),
        );
        for [a, b, c] in &self.triangles {
            for (a, b) in [(*a, *b), (*b, *c), (*c, *a)] {
                // Both sides of an edge name it, and one of them in this order. On a boundary it has one side.
                if a < b || self.boundary[a as usize] && self.boundary[b as usize] {
                    all.extend(self.look([a, b]));
                }
            }
        }
    }

    /// The edge, by what it costs: the mean squared distance of the end that stays from the planes of all triangles for
    /// which it will stand. None if both ends are locked.
    fn look(&self, [a, b]: [u32; 2]) -> Option<Edge> {
        let stays = |v: u32| (self.locked[v as usize], self.boundary[v as usize]);
        let [p, q] = [a, b].map(|v| self.points[v as usize]);
        let [of_a, of_b] = [a, b].map(|v| &self.quadrics[v as usize]);
        let at_a = || of_a.here() + of_b.at(minus(p, q));
        let at_b = || of_b.here() + of_a.at(minus(q, p));
        let ([stays, goes], sum) = match (stays(a), stays(b)) {
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
        let step = step(sum / area + LENGTH * dot(along, along));
        Some(Edge { stays, goes, step })
    }

    /// Contracts an edge, if it can be.
    fn turn(&mut self, edge: Edge, around: &mut Around) {
        let [a, b] = [edge.stays, edge.goes].map(|v| v as usize);
        if a == b {
            let members = self.members[a] as usize;
            // Something is left to show.
            if members < self.count {
                self.count -= members;
                self.members[a] = 0;
            }
            return;
        }
        let members = self.component[a] as usize;
        if self.touched[a]
            || self.touched[b]
            || self.members[members] == 0
            || !self.can_contract(edge, around)
            || !self.keeps_triangles(edge, around)
        {
            return;
        }
        let away = minus(self.points[a], self.points[b]);
        self.quadrics[a] = self.quadrics[a].plus(&self.quadrics[b].moved(away));
        self.boundary[a] |= self.boundary[b];
        for triangle in &around.both {
            self.triangles[*triangle as usize][0] = NONE;
        }
        self.count -= around.both.len();
        self.members[members] -= around.both.len() as u32;
        for triangle in &around.moved {
            let corners = &mut self.triangles[*triangle as usize];
            *corners = corners.map(|v| if v == edge.goes { edge.stays } else { v });
        }
        self.touched[a] = true;
        self.touched[b] = true;
    }

    /// Finds the triangles around an edge and the corners opposite to it, if it is one of a surface or of the boundary as
    /// its ends are.
    fn tips(&self, edge: Edge, around: &mut Around) -> Option<[u32; 2]> {
        let (a, b) = (edge.stays, edge.goes);
        let Around { moved, both } = around;
        moved.clear();
        both.clear();
        for t in self.fans.at(b) {
            let corners = &self.triangles[*t as usize];
            match corners.contains(&a) {
                _ if is_gone(corners) => {}
                true => both.push(*t),
                false => moved.push(*t),
            }
        }
        let is_held = self.boundary[a as usize] || self.locked[a as usize];
        let is_rim = is_held && self.boundary[b as usize];
        if both.len() != if is_rim { 1 } else { 2 } {
            return None;
        }
        let opposite = |t: &u32| {
            let corners = self.triangles[*t as usize];
            corners.into_iter().find(|v| *v != a && *v != b)
        };
        let mut tips = both.iter().filter_map(opposite);
        let tips = [tips.next().unwrap_or(NONE), tips.next().unwrap_or(NONE)];
        (tips[0] != tips[1]).then_some(tips)
    }

    /// Looks around an edge: true if the surface stays one, and has the same shape in the sense of topology, when it is
    /// contracted, and no boundary moves to the inside.
    fn can_contract(&mut self, edge: Edge, around: &mut Around) -> bool {
        let (a, b) = (edge.stays, edge.goes);
        let Some(tips) = self.tips(edge, around) else {
            return false;
        };
        let Around { moved, both } = around;
        let locked = self.locked[a as usize];
        let has_tips = |t: &[u32; 3]| t.contains(&tips[0]) && t.contains(&tips[1]);
        self.search += 1;
        let (mut only_a, mut closes) = (0, false);
        for t in self.fans.at(a) {
            let corners = &self.triangles[*t as usize];
            if !is_gone(corners) && !corners.contains(&b) {
                only_a += 1;
                closes |= has_tips(corners);
                for v in corners {
                    self.seen[*v as usize] = self.search;
                }
            }
        }
        if only_a + moved.len() == 0 {
            return false;
        }
        let mut is_closed = false;
        for t in moved.iter() {
            let corners = &self.triangles[*t as usize];
            is_closed |= has_tips(corners);
            for v in corners.iter().filter(|v| **v != b && !tips.contains(v)) {
                // Neighbours of both ends must be the tips. A new edge between locked vertices might be one of another
                // cell.
                let near = self.seen[*v as usize] == self.search;
                if near || locked && self.locked[*v as usize] {
                    return false;
                }
            }
        }
        // Where both ends have a triangle with both tips, one would lie on the other.
        let is_flat = closes && is_closed;
        let mut tips = tips.iter().filter(|tip| **tip != NONE);
        !is_flat && tips.all(|tip| self.has_others(*tip, both))
    }

    /// True if a vertex has triangles besides these.
    fn has_others(&self, vertex: u32, these: &[u32]) -> bool {
        let mut fan = self.fans.at(vertex).iter();
        fan.any(|t| !is_gone(&self.triangles[*t as usize]) && !these.contains(t))
    }

    /// True if no triangle around turns over or becomes a sliver.
    fn keeps_triangles(&self, edge: Edge, around: &Around) -> bool {
        let place = self.points[edge.stays as usize];
        let mut made = f64::INFINITY;
        for triangle in &around.moved {
            let corners = self.triangles[*triangle as usize];
            let old = corners.map(|v| self.points[v as usize]);
            let new = from_fn(|k| match corners[k] == edge.goes {
                true => place,
                false => old[k],
            });
            let [was, is] = [old, new].map(normal);
            let [was2, along, is2] = [dot(was, was), dot(was, is), dot(is, is)];
            let is_turned = along < 0.0 || along * along < TURN * TURN * was2 * is2;
            if is_turned || is2 <= 0.0 && was2 > 0.0 {
                return false;
            }
            made = made.min(quality2(new, is2));
        }
        made >= QUALITY * QUALITY
            || around.moved.iter().any(|triangle| {
                let corners = self.triangles[*triangle as usize];
                let old = corners.map(|v| self.points[v as usize]);
                let was = normal(old);
                quality2(old, dot(was, was)) <= made
            })
    }

    /// Forgets what is gone.
    fn end_pass(&mut self) {
        let (component, members) = (&self.component, &self.members);
        let is_left = |t: &[u32; 3]| !is_gone(t) && members[component[t[0] as usize] as usize] > 0;
        self.triangles.retain(is_left);
        self.touched.fill(false);
        self.fans.renew(self.points.len(), &self.triangles);
    }
}

/// About so many of the cheapest edges, in order.
fn cheapest(edges: &[Edge], limit: usize, cheap: &mut Vec<Edge>) {
    let mut starts = vec![0; STEPS + 1];
    edges
        .iter()
        .for_each(|edge| starts[edge.step as usize + 1] += 1);
    let mut last = STEPS as u32;
    for step in 0..STEPS {
        if starts[step] >= limit.max(1) {
            last = step as u32;
            break;
        }
        starts[step + 1] += starts[step];
    }
    cheap.clear();
    cheap.resize(starts[last as usize], Edge::default());
    for edge in edges.iter().filter(|edge| edge.step < last) {
        let place = &mut starts[edge.step as usize];
        cheap[*place] = *edge;
        *place += 1;
    }
}
