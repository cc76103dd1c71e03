//! Orientation by evidence inside a block: the relative orientations of its patches, as far as they can be
//! decided without the rest of the cloud.

use super::contract::{Graph, Limit};
use super::evidence::{Evidence, cosine, facing, weight};
use super::labels::{Connections, OrientedBlock, adjacent, number_labels};
use super::parity::signed;
use super::patches::Patches;
use super::star::{EdgesUp, Triangle};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_paper::method::METHOD;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Id, Ids, PatchNumber, TriangleIndex};

/// Orients a block by evidence.
pub(super) fn weigh_block(
    inner: &[Triangle],
    crossing: &[Triangle],
    evidence: &Evidence,
    blocks: Blocks,
    block: usize,
) -> OrientedBlock {
    let ids = blocks.ids(block);
    let division = evidence.division;
    let mut weigher = Weigher {
        patches: Patches::of(ids, inner, evidence, division.patch),
        graph: Graph::default(),
        inner,
        evidence,
        ids,
        most: 0,
    };
    weigher.add_patches();
    let mut connections = Connections::default();
    weigher.add_connections(crossing, &mut connections);
    let patches = weigher.patches.bytes();
    let most = weigher.most.max(patches + weigher.graph.bytes());
    weigher.contract(division.cluster, &mut connections);
    let dead = weigher.cut();
    let kept: Vec<TriangleIndex> = (0..inner.len())
        .filter(|n| !dead[*n])
        .map(TriangleIndex::at)
        .collect();
    connections.relations.retain(|r| !dead[r.1.index()]);
    let seams = &mut weigher.patches.shared;
    seams.retain(|j| !dead[j.a.index()] && !dead[j.b.index()]);
    connections.seams = std::mem::take(seams);
    let connected = bytes_of(&connections.relations)
        + bytes_of(&connections.pairs)
        + bytes_of(&connections.seams);
    let lists = patches + 9 * inner.len() as u64 + bytes_of(&kept) + connected;
    let removed = (inner.len() - kept.len()) as u64;
    let sets = &mut weigher.patches.sets;
    let mut done = number_labels(inner, &kept, connections, sets, blocks, block, removed);
    done.most = most.max(lists + done.bytes());
    done
}

/// The patches of a block, and the graph that decides their relative orientations.
struct Weigher<'a> {
    patches: Patches,
    graph: Graph<PatchNumber>,
    inner: &'a [Triangle],
    evidence: &'a Evidence,
    ids: Ids,
    /// Most bytes that the patches and the lists for their connections took.
    most: u64,
}

impl Weigher<'_> {
    /// The patch of a triangle, and true if the triangle is turned against it.
    fn patch(&self, triangle: TriangleIndex) -> (PatchNumber, bool) {
        let (_, turned) = self.patches.sets.look(triangle);
        (self.patches.of[triangle.index()], turned)
    }

    /// Adds to the sum of the patches of two triangles; one of the two must be turned if `flip`.
    fn connect(&mut self, a: TriangleIndex, b: TriangleIndex, flip: bool, weight: i64) {
        let ((of_a, up_a), (of_b, up_b)) = (self.patch(a), self.patch(b));
        let weight = signed(flip ^ up_a ^ up_b, weight);
        self.graph.add(of_a, of_b, weight);
    }

    /// Makes the patches nodes, with the evidence that they face up, or to the scanners.
    fn add_patches(&mut self) {
        self.graph = Graph::new(self.patches.roots.len());
        for (node, (_, triangles)) in (0..).map(PatchNumber::new).zip(&self.patches.roots) {
            self.graph.add_triangles(node, u64::from(*triangles));
        }
        let witnesses = &self.evidence.witnesses;
        let mut known = vec![false; self.ids.len()];
        for w in witnesses {
            known[self.ids.place(w.vertex)] = true;
        }
        for (number, t) in (0..).map(TriangleIndex::new).zip(self.inner) {
            let known = t.map(|v| known[self.ids.place(v)]);
            if known.contains(&true) {
                let normal = self.evidence.normal(*t);
                let all = t.iter().zip(known).filter(|(_, known)| *known);
                let evidence = all.map(|(v, _)| {
                    let witness = witnesses.partition_point(|w| w.vertex < *v);
                    facing(normal, witnesses[witness].toward)
                });
                let up = evidence.sum();
                let (of, turned) = self.patch(number);
                self.graph.add_up(of, signed(turned, up));
            }
        }
    }

    /// Adds the connections between patches: edges, candidates, and crossing triangles as far as they are
    /// known in the block.
    fn add_connections(&mut self, crossing: &[Triangle], connections: &mut Connections) {
        for n in 0..self.patches.shared.len() {
            let edge = self.patches.shared[n];
            let weight = METHOD.orientation.edge * i64::from(edge.weight);
            self.connect(edge.a, edge.b, edge.flip, weight);
        }
        let evidence = self.evidence;
        let edges = self.edges_of(crossing.iter().chain(&evidence.candidates));
        for &c in crossing {
            let mut constraints = Vec::new();
            let mut note = |other, flip| constraints.push((other, flip));
            adjacent(c, &edges, self.inner, &self.ids, &mut note);
            for (other, flip) in constraints {
                let weight = self.weight(c, other, flip);
                connections.relations.push((c, other, flip, weight));
                // The most that the other two edges of the crossing triangle can weigh.
                let of = self.patches.of[other.index()];
                let most = 2 * METHOD.orientation.edge * METHOD.orientation.flattest;
                self.graph.add_outside(of, most);
            }
        }
        for &c in &evidence.candidates {
            self.vote(c, &edges);
        }
    }

    /// The triangles at the edges inside the block that `others` may share.
    fn edges_of<'t>(&mut self, others: impl Iterator<Item = &'t Triangle>) -> EdgesUp {
        let inner = self.inner;
        let mut seen = vec![false; self.ids.len()];
        for v in others.flatten().filter(|v| self.ids.contains(v)) {
            seen[self.ids.place(*v)] = true;
        }
        let place = |v: Id| self.ids.place(v);
        // True if an edge of the triangle joins two of their vertices.
        let beside = |t: &Triangle| t.iter().filter(|v| seen[place(**v)]).count() > 1;
        let some = (0..)
            .map(TriangleIndex::new)
            .zip(inner)
            .filter(|(_, t)| beside(t));
        let numbers: Vec<TriangleIndex> = some.map(|(number, _)| number).collect();
        let triangle = |n: &TriangleIndex| &inner[n.index()];
        let mut edges = EdgesUp::with_room_for(self.ids, numbers.iter().map(triangle));
        for number in &numbers {
            edges.add(*triangle(number), *number);
        }
        let lists = bytes_of(&numbers) + bytes_of(&seen);
        self.most = self.patches.bytes() + edges.bytes() + lists;
        edges
    }

    /// The weight of the edge between two triangles.
    fn weight(&self, t: Triangle, other: TriangleIndex, flip: bool) -> i64 {
        let other = self.evidence.normal(self.inner[other.index()]);
        weight(cosine(self.evidence.normal(t), other, flip))
    }

    /// A candidate connects each two of the first three triangles at its edges.
    fn vote(&mut self, c: Triangle, edges: &EdgesUp) {
        let mut constraints = [(TriangleIndex::default(), false); 3];
        let mut count = 0;
        adjacent(c, edges, self.inner, &self.ids, |other, flip| {
            if count < 3 {
                constraints[count] = (other, flip);
                count += 1;
            }
        });
        for x in 1..count {
            for y in 0..x {
                let ((a, flip_a), (b, flip_b)) = (constraints[x], constraints[y]);
                if self.patches.of[a.index()] != self.patches.of[b.index()] {
                    let weight = self.weight(c, a, flip_a).min(self.weight(c, b, flip_b));
                    self.connect(a, b, flip_a ^ flip_b, weight);
                }
            }
        }
    }

    /// Contracts patches to clusters, as far as this cannot be wrong for the rest of the cloud.
    fn contract(&mut self, cluster: u64, connections: &mut Connections) {
        let clusters = self.graph.contract(Limit::Triangles(cluster), |_| ());
        let root = |patch: PatchNumber| self.patches.roots[patch.index()].0;
        for patch in (0..self.patches.roots.len()).map(PatchNumber::at) {
            let (of, flip) = clusters.look(patch);
            let (of, patch) = (root(of), root(patch));
            self.patches.sets.join(of, patch, flip);
        }
        connections.first = self.graph.connected().map(root).collect();
        let pairs = self.graph.pairs();
        connections.pairs = pairs.map(|(a, b, sum)| (root(a), root(b), sum)).collect();
        connections.pairs.sort_unstable();
        let ups = self.graph.ups();
        connections.ups = ups.map(|(node, up)| (root(node), up)).collect();
        self.graph = Graph::default();
    }

    /// Cuts the edges inside clusters whose triangles are not oriented alike: the later triangle is removed,
    /// unless the earlier one has been removed. Edges between clusters stay in `shared`.
    fn cut(&mut self) -> Vec<bool> {
        let mut dead = vec![false; self.inner.len()];
        let Patches { sets, shared, .. } = &mut self.patches;
        shared.retain(|edge| match sets.relation(edge.a, edge.b) {
            None => true,
            Some(flip) if flip == edge.flip => false,
            Some(_) => {
                dead[edge.b.index()] |= !dead[edge.a.index()];
                false
            }
        });
        dead
    }
}

#[cfg(test)]
mod tests;
