//! Times of the stages that remain when the tree is known, for the progress.

use super::cells::Cell;
use super::make::target;
use super::outlook::{LEAVES, LEVEL, WRITE, planned};
use super::tree::TreeNode;
use outcrop_disk::workspace::outlook::Planned;

/// The stages that follow when the tree is known: the leaves, each level, and the files.
pub(super) fn of_tree(
    cells: &[Cell],
    nodes: &[TreeNode],
    most: u32,
    threads: usize,
) -> Vec<Planned> {
    let last = nodes.last().map_or(0, |root| root.level);
    let mut joined = vec![0usize; last as usize + 1];
    let mut triangles: Vec<usize> = Vec::with_capacity(nodes.len());
    for (number, node) in nodes.iter().enumerate() {
        let children = node.children.iter().map(|child| triangles[*child]);
        let count = children.sum();
        joined[node.level as usize] += count;
        let own = cells.get(number).map(|cell| cell.triangles as usize);
        triangles.push(own.unwrap_or_else(|| target(count, most)));
    }
    joined[0] = cells.iter().map(|cell| cell.triangles as usize).sum();
    let write = planned(WRITE, joined[0] as f64, threads);
    let levels = joined.into_iter().enumerate();
    let levels = levels.map(|(level, count)| {
        let stage = if level == 0 { LEAVES } else { LEVEL };
        planned(stage, count as f64, threads)
    });
    levels.chain([write]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_level_is_planned_by_the_triangles_of_its_children() {
        let cells = [40_000, 60_000, 50_000].map(|triangles| Cell {
            key: 0,
            depth: 1,
            triangles,
        });
        let node = |level, children: &[usize]| TreeNode {
            depth: 0,
            level,
            children: children.to_vec(),
        };
        let nodes = [
            node(0, &[]),
            node(0, &[]),
            node(0, &[]),
            node(1, &[0, 1]),
            node(2, &[3, 2]),
        ];
        let stages = of_tree(&cells, &nodes, 65_536, 2);
        let names: Vec<_> = stages.iter().map(|stage| stage.name).collect();
        assert_eq!(names, ["leaves", "level", "level", "write"]);
        let joined = [150_000.0, 100_000.0, 50_000.0 + 16_666.0, 150_000.0];
        for (stage, (joined, each)) in stages
            .iter()
            .zip(joined.into_iter().zip([0.4, 0.55, 0.55, 0.02]))
        {
            assert!((stage.seconds - joined * each * 1e-6 / 2.0).abs() < 1e-6);
        }
    }
}
