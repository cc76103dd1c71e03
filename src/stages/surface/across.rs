//! Orientation by evidence between blocks: the labels that the blocks could not settle by themselves, and
//! the crossing triangles between them.

use super::border::Border;
use super::contract::{Graph, Limit};
use super::evidence::{cosine, weight};
use super::orient::{Oriented, Weighed};
use super::star::Triangle;
use crate::error::Result;
use crate::method::METHOD;
use crate::spill::Sections;
use crate::stages::blocks::Blocks;
use crate::workspace::Workspace;

/// Settles how global labels run against each other. `border` gives the crossing triangles of a block
/// with their normals.
pub(super) fn settle(
    surface: &mut Oriented,
    border: impl Fn(usize) -> Result<Vec<(Triangle, [f64; 3])>>,
    relations: &Sections<7>,
    weighed: &Weighed,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<()> {
    let mut graph = Graph::new(surface.sets.len());
    let mut reserved = workspace.promise("labels: graph", 0)?;
    for block in 0..blocks.count() {
        let first = surface.globals[block].0;
        for [a, b, low, high] in weighed.pairs.get(block)? {
            let sum = i64::from(high as i32) << 32 | i64::from(low);
            graph.add(first + a, first + b, sum);
        }
        for [label, low, high] in weighed.ups.get(block)? {
            let up = i64::from(high as i32) << 32 | i64::from(low);
            graph.add_up(first + label, up);
        }
        reserved.at_least(graph.bytes())?;
    }
    let mut edges = Border::new(workspace)?;
    for group in 0..blocks.count() {
        workspace.check_cancel()?;
        let relations = relations.get(group)?;
        let triangles = border(group)?;
        edges.make_room(triangles.len())?;
        for (t, normal) in triangles {
            let key = [group as u32, t[0], t[1], t[2]];
            let start = relations.partition_point(|r| r[..4] < key[..]);
            // Label, turned or not, and weight of each neighbour; an interior one comes first.
            let mut asks: Vec<(u32, bool, i64)> = relations[start..]
                .iter()
                .take_while(|r| r[..4] == key[..])
                .map(|r| {
                    let label = surface.globals[r[4] as usize].0 + (r[5] >> 1);
                    (label, r[5] & 1 == 1, i64::from(r[6]))
                })
                .collect();
            let before = edges.asks_with_normals(t);
            asks.extend(before.map(|(label, flip, opposed, other)| {
                (label, flip, weight(cosine(normal, other, opposed)))
            }));
            let (label, flip) = match asks.first() {
                Some(&(label, flip, _)) => (label, flip),
                None => (graph.push(), false),
            };
            for &(other, turned, weight) in &asks {
                let sum = if flip ^ turned { -weight } else { weight };
                graph.add(label, other, METHOD.orientation.edge * sum);
            }
            edges.put(t, label << 1 | u32::from(flip), normal);
        }
        edges.end(group, blocks);
        reserved.at_least(graph.bytes())?;
    }
    drop(edges);
    graph.push_sky();
    reserved.set_held(graph.bytes());
    let clusters = graph.contract(Limit::None);
    // A label of the surface that stands for each cluster.
    let mut standing = vec![None; graph.len()];
    for label in 0..surface.sets.len() as u32 {
        let (root, flip) = clusters.look(label);
        match standing[root as usize] {
            None => standing[root as usize] = Some((label, flip)),
            Some((first, turned)) => _ = surface.sets.join(first, label, flip ^ turned),
        }
    }
    Ok(())
}
