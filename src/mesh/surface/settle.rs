//! Orientation by evidence between blocks: of the labels that the blocks on their own could not orient, and
//! of the crossing triangles between them.

use super::contract::{Graph, Limit};
use super::crossing_edges::CrossingEdges;
use super::evidence::{cosine, weight};
use super::history::History;
use super::orient::{OrientedSurface, Weighed};
use super::parity::{OrientationConstraint, signed, word};
use super::rows::{Relation, interior_constraints, sum};
use super::star::Triangle;
use outcrop_disk::error::Result;
use outcrop_disk::spill::Inbox;
use outcrop_disk::workspace::Unit;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_paper::method::METHOD;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::GlobalLabel;

/// Decides the relative orientations of global labels. `crossing` returns the crossing triangles of a block
/// with their normals.
pub(super) fn settle(
    surface: &mut OrientedSurface,
    crossing: impl Fn(usize) -> Result<Vec<(Triangle, [f64; 3])>>,
    relations: &Inbox<Relation>,
    weighed: &Weighed,
    blocks: Blocks,
    unit: &Unit<'_>,
) -> Result<()> {
    let mut graph = Graph::new(surface.sets.len());
    let mut reserved = unit.promise("labels: graph", 0)?;
    for block in 0..blocks.count() {
        let first = surface.globals[block].0;
        for pair in weighed.pairs.get(unit, block)? {
            graph.add(first.of(pair.a), first.of(pair.b), sum(pair.sum));
        }
        for up in weighed.ups.get(unit, block)? {
            graph.add_up(first.of(up.label), sum(up.evidence));
        }
        reserved.at_least(graph.bytes())?;
    }
    let mut edges = CrossingEdges::new(unit)?;
    for group in 0..blocks.count() {
        unit.check_cancel()?;
        let relations = relations.get(unit, group)?;
        let triangles = crossing(group)?;
        edges.make_room(triangles.len())?;
        for (t, normal) in triangles {
            // Label, flip and weight of each neighbour; interior neighbours come first.
            let mut neighbors: Vec<(OrientationConstraint<GlobalLabel>, i64)> =
                interior_constraints(&surface.globals, &relations, group, t).collect();
            let before = edges.adjacent(t);
            neighbors.extend(before.map(|(constraint, opposed, other)| {
                (constraint, weight(cosine(normal, other, opposed)))
            }));
            let (label, flip) = match neighbors.first() {
                Some(&(first, _)) => first,
                None => (graph.push(), false),
            };
            for &((other, turned), weight) in &neighbors {
                let sum = signed(flip ^ turned, weight);
                graph.add(label, other, METHOD.orientation.edge * sum);
            }
            edges.put(t, word((label, flip)), normal);
        }
        edges.end(group, blocks);
        reserved.at_least(graph.bytes())?;
    }
    drop(edges);
    join_clusters(surface, graph, weighed.gain, &mut reserved)
}

/// Contracts the graph of the labels, looks at the contractions again, and joins the labels of each cluster.
fn join_clusters(
    surface: &mut OrientedSurface,
    mut graph: Graph<GlobalLabel>,
    gain: i64,
    reserved: &mut Reservation,
) -> Result<()> {
    let sky = graph.push_sky();
    let most = History::most(&graph);
    reserved.at_least(most)?;
    reserved.set_held(most);
    let mut history = History::of(&graph);
    let clusters = graph.contract(Limit::None, |contraction| history.push(contraction));
    let nodes = graph.len();
    drop(graph);
    let turned = history.look_back(&clusters, sky, gain);
    // One label of the surface that represents each cluster.
    let mut representative = vec![None; nodes];
    for label in (0..surface.sets.len()).map(GlobalLabel::at) {
        let (root, flip) = clusters.look(label);
        let flip = flip ^ turned[label.index()];
        match representative[root.index()] {
            None => representative[root.index()] = Some((label, flip)),
            Some((first, turned)) => _ = surface.sets.join(first, label, flip ^ turned),
        }
    }
    Ok(())
}
