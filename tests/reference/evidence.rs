//! Orientation by evidence (section 6.3): the surface is cut where its connections weigh least.

use super::base::is_interior;
use super::contract::Graph;
use super::homes::{Homes, Side};
use super::outside::{Known as Out, extreme};
use super::patches::{Block, cosine, unit_normal, weight};
use super::surface::{Edge, Surface, Triangle, alike, edges};
use super::{Settings, Weighing};
use outcrop_geom::Point;
use std::collections::{BTreeMap, BTreeSet};

/// Input: the T3 before they are oriented.
pub struct Known<'a> {
    /// The shape.
    pub points: &'a [Point],
    pub settings: &'a Settings,
    /// What is known of each point.
    pub out: &'a [Option<Out>],
    /// The T3 that no vertex flags.
    pub kept: &'a BTreeSet<Triangle>,
    /// By block, the crossing T3 that touch it and are not flagged by its own vertices.
    pub seen: BTreeMap<u32, BTreeSet<Triangle>>,
    /// Interior candidates.
    pub candidates: BTreeSet<Triangle>,
}

/// The oriented base.
pub struct Weighed {
    pub surface: Surface,
    pub one_sided: BTreeSet<Triangle>,
    /// The component of each triangle, and its orientation in it.
    pub sides: BTreeMap<Triangle, Side>,
    /// For each component: it has a crossing triangle.
    pub global: Vec<bool>,
    pub met: Weighing,
}

/// The state. A triangle's number is its place among those that no vertex flags; each begins as a component
/// of its own.
struct Weigher<'a> {
    known: Known<'a>,
    number: BTreeMap<Triangle, usize>,
    /// Orientations decided so far.
    sets: Homes,
    /// Triangles so far: first the interior ones, later crossing ones too.
    surface: Surface,
    removed: BTreeSet<Triangle>,
    /// The nodes between blocks.
    graph: Graph,
    /// The nodes of the triangles of global labels; true if they are turned there.
    nodes: BTreeMap<Triangle, Side>,
    /// The edges that remain after step 5.
    seams: Vec<(Triangle, Triangle, Edge)>,
    met: Weighing,
}

pub fn orient(known: Known<'_>) -> Weighed {
    let block = known.settings.block;
    let inside = |t: &&Triangle| is_interior(**t, block);
    let interior: BTreeSet<Triangle> = known.kept.iter().filter(inside).copied().collect();
    let blocks: BTreeSet<u32> = interior.iter().map(|t| t[0] / block).collect();
    let mut weigher = Weigher {
        number: known.kept.iter().copied().zip(0..).collect(),
        sets: Homes::apart(known.kept.len()),
        surface: Surface::of(interior),
        removed: BTreeSet::new(),
        graph: Graph::default(),
        nodes: BTreeMap::new(),
        seams: Vec::new(),
        met: Weighing::default(),
        known,
    };
    let highest = extreme(weigher.known.points, 2, 1);
    for g in blocks {
        weigher.orient_block(g, &highest);
    }
    weigher.settle();
    weigher.add_crossing();
    weigher.cut_seams();
    weigher.finish()
}

impl Weigher<'_> {
    /// The orientation of `t` itself.
    fn own(&self, t: Triangle) -> Side {
        Side {
            home: self.number[&t],
            turned: false,
        }
    }

    /// The orientation that `other` implies for `t`.
    fn asks(&self, other: Triangle, t: Triangle, edge: Edge) -> Side {
        Side {
            turned: !alike(t, other, edge),
            ..self.own(other)
        }
    }

    fn interior(&self, t: &Triangle) -> bool {
        is_interior(*t, self.known.settings.block)
    }

    /// The crossing triangles that no vertex flags, ascending.
    fn crossing(&self) -> Vec<Triangle> {
        let all = self.known.kept.iter().copied();
        all.filter(|t| !self.interior(t)).collect()
    }

    fn remove(&mut self, t: Triangle) {
        self.surface.remove(t);
        self.removed.insert(t);
    }

    /// Steps 1 to 5 in a block.
    fn orient_block(&mut self, g: u32, highest: &BTreeSet<u32>) {
        let settings = self.known.settings;
        let here = |t: &&Triangle| t[0] / settings.block == g && self.interior(t);
        let block = Block {
            points: self.known.points,
            surface: Surface::of(self.known.kept.iter().filter(here).copied()),
            crossing: self.known.seen[&g].clone(),
            candidates: self.known.candidates.iter().filter(here).copied().collect(),
            highest,
            known: self.known.out,
            run: settings.patch,
        };
        for t in block.crossing.difference(self.known.kept) {
            let asks = |edge: Edge| !block.surface.at_edge(edge).is_empty();
            self.met.flagged_elsewhere += usize::from(edges(*t).into_iter().any(asks));
        }
        let mut patches = block.patches(&mut self.met);
        let clusters = patches
            .graph
            .contract(Some(settings.cluster), &mut self.met);
        let of: BTreeMap<Triangle, Side> = patches
            .of
            .iter()
            .map(|(&t, &side)| (t, clusters.seen_from_label(side)))
            .collect();
        self.cut_clusters(&block, &of);
        self.add_labels(&patches.graph, &of);
    }

    /// Step 5: cuts.
    fn cut_clusters(&mut self, block: &Block<'_>, of: &BTreeMap<Triangle, Side>) {
        for (t, other, edge) in block.shared_edges() {
            let (a, b) = (of[&t], of[&other]);
            if a.home != b.home {
                self.seams.push((t, other, edge));
                continue;
            }
            let alike = (a.turned == b.turned) == alike(t, other, edge);
            let gone = |t| self.removed.contains(t);
            if !alike && !gone(&t) && !gone(&other) {
                self.remove(other);
                self.met.cut_inside += 1;
            }
        }
    }

    /// Step 5: the labels of a block; and for step 6 the nodes of the global ones. `graph` has the clusters,
    /// `of` the cluster of each triangle.
    fn add_labels(&mut self, graph: &Graph, of: &BTreeMap<Triangle, Side>) {
        let clusters: BTreeSet<usize> = of.values().map(|side| side.home).collect();
        let mut nodes: BTreeMap<usize, usize> = BTreeMap::new();
        for cluster in clusters {
            let left = |t: &&Triangle| of[*t].home == cluster && !self.removed.contains(*t);
            let triangles: Vec<Triangle> = of.keys().filter(left).copied().collect();
            for &t in &triangles[1..] {
                let turned = of[&t].turned != of[&triangles[0]].turned;
                let other = self.own(t);
                self.sets
                    .join(self.own(triangles[0]), Side { turned, ..other });
            }
            if !graph.connected(cluster) {
                continue;
            }
            let home = self.graph.push();
            self.graph.nodes[home].up = graph.nodes[cluster].up;
            nodes.insert(cluster, home);
            for t in triangles {
                let turned = of[&t].turned;
                self.nodes.insert(t, Side { home, turned });
            }
        }
        for ([a, b], sum) in &graph.sums {
            self.graph.sums.insert([nodes[a], nodes[b]], *sum);
        }
    }

    /// Step 6: the relative orientations of labels.
    fn settle(&mut self) {
        let labels = self.nodes.clone();
        self.add_crossing_nodes();
        self.graph.push_sky();
        let settled = self.graph.settle(self.known.settings.gain, &mut self.met);
        // All triangles of a label are joined at this point.
        let mut first: BTreeMap<usize, (Triangle, bool)> = BTreeMap::new();
        for (t, side) in labels {
            let side = settled.seen_from_label(side);
            let (with, turned) = *first.entry(side.home).or_insert((t, side.turned));
            let turned = turned != side.turned;
            let other = self.own(t);
            self.sets.join(self.own(with), Side { turned, ..other });
        }
    }

    /// Step 6: the nodes of the crossing triangles, and the sums at their edges.
    fn add_crossing_nodes(&mut self) {
        let exact = |t| unit_normal(self.known.points, t);
        let rounded = |t| exact(t).map(|x| f64::from(x as f32));
        let mut before: BTreeSet<Triangle> = BTreeSet::new();
        for t in self.crossing() {
            // The sides that others imply for it, with the weights of the edges; interior ones first.
            let mut asked: Vec<(Side, i64)> = Vec::new();
            let mut ask = |other: Triangle, edge: Edge, cosine: f64| {
                let side = self.nodes[&other];
                let turned = side.turned == alike(t, other, edge);
                asked.push((Side { turned, ..side }, weight(cosine)));
            };
            for edge in edges(t) {
                for other in self.surface.at_edge(edge) {
                    ask(other, edge, cosine(exact, t, other, edge));
                }
            }
            for edge in edges(t) {
                let at = |other: &&Triangle| edge.iter().all(|v| other.contains(v));
                for &other in before.iter().filter(at) {
                    ask(other, edge, cosine(rounded, t, other, edge));
                }
            }
            let own = match asked.first() {
                Some((side, _)) => *side,
                None => {
                    self.met.own_nodes += 1;
                    Side {
                        home: self.graph.push(),
                        turned: false,
                    }
                }
            };
            for (side, weight) in asked {
                self.graph.add(own, side, 8 * weight);
            }
            self.nodes.insert(t, own);
            before.insert(t);
        }
    }

    /// Step 7: the crossing triangles.
    fn add_crossing(&mut self) {
        for t in self.crossing() {
            let mut asked = Vec::new();
            for edge in edges(t) {
                let others = self.surface.at_edge(edge).into_iter();
                asked.extend(others.map(|other| self.asks(other, t, edge)));
            }
            if self.sets.conflict(&asked) {
                self.removed.insert(t);
                self.met.cut_crossing += 1;
                continue;
            }
            for side in asked {
                self.sets.join(self.own(t), side);
            }
            self.surface.insert(t);
        }
    }

    /// Step 7: the edges between labels.
    fn cut_seams(&mut self) {
        for (t, other, edge) in std::mem::take(&mut self.seams) {
            let gone = |t| self.removed.contains(t);
            if gone(&t) || gone(&other) {
                continue;
            }
            let asked = [self.own(t), self.asks(other, t, edge)];
            let [a, b] = asked.map(|side| self.sets.label(side.home));
            assert_eq!(a, b, "an edge between labels that were not contracted");
            if self.sets.conflict(&asked) {
                self.remove(other);
                self.met.cut_between += 1;
            }
        }
    }

    /// Components are the joined sets; one without a crossing triangle is divided into its parts in each
    /// block.
    fn finish(self) -> Weighed {
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
            let part = (!crosses).then(|| t[0] / self.known.settings.block);
            let home = *homes.entry((side.home, part)).or_insert_with(|| {
                global.push(crosses);
                global.len() - 1
            });
            sides.insert(t, Side { home, ..side });
        }
        Weighed {
            surface: self.surface,
            one_sided: self.removed,
            sides,
            global,
            met: self.met,
        }
    }
}
