//! The tree of tiles: the cells, and above them every cell of the octree in which several come together.

use super::cells::{Cell, DEEPEST};
use std::collections::BTreeMap;
use std::ops::Range;

/// A tile of the tree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TreeNode {
    /// Depth of its cell in the octree.
    pub depth: u32,
    /// 0 for a leaf; otherwise one more than the highest of its children.
    pub level: u32,
    /// Its children by number, along the curve.
    pub children: Vec<usize>,
}

/// Depth of the smallest cell of the octree that has both of these, which are different.
pub(super) fn common_depth(a: &Cell, b: &Cell) -> u32 {
    ((a.key ^ b.key) << 1).leading_zeros() / 3
}

/// The nodes, children before their parents: first all cells, then by level; the last one is the root.
pub(super) fn build(cells: &[Cell]) -> Vec<TreeNode> {
    let mut by_level: BTreeMap<u32, Vec<(u32, Vec<Child>)>> = BTreeMap::new();
    if cells.len() > 1 {
        above(cells, 0..cells.len(), &mut by_level);
    }
    let mut nodes: Vec<TreeNode> = cells
        .iter()
        .map(|cell| TreeNode {
            depth: cell.depth,
            level: 0,
            children: Vec::new(),
        })
        .collect();
    let mut starts = BTreeMap::from([(0, 0)]);
    for (level, made) in by_level {
        starts.insert(level, nodes.len());
        for (depth, children) in made {
            let children = children.iter();
            let children = children.map(|child| starts[&child.level] + child.number);
            nodes.push(TreeNode {
                depth,
                level,
                children: children.collect(),
            });
        }
    }
    nodes
}

/// A node by its level and its number in that level.
#[derive(Clone, Copy)]
struct Child {
    level: u32,
    number: usize,
}

/// Makes the node above these cells, and all below it. The depth of the recursion is at most [`DEEPEST`].
fn above(
    cells: &[Cell],
    range: Range<usize>,
    made: &mut BTreeMap<u32, Vec<(u32, Vec<Child>)>>,
) -> Child {
    if range.len() == 1 {
        return Child {
            level: 0,
            number: range.start,
        };
    }
    let depth = common_depth(&cells[range.start], &cells[range.end - 1]);
    let shift = 3 * (DEEPEST - depth - 1);
    let mut children = Vec::new();
    let mut start = range.start;
    while start < range.end {
        let child = cells[start].key >> shift;
        let count = cells[start..range.end].partition_point(|cell| cell.key >> shift <= child);
        children.push(above(cells, start..start + count, made));
        start += count;
    }
    let level = 1 + children.iter().map(|child| child.level).max().unwrap_or(0);
    let list = made.entry(level).or_default();
    list.push((depth, children));
    Child {
        level,
        number: list.len() - 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(digits: &[u64]) -> Cell {
        let key = digits.iter().fold(0, |key, digit| key << 3 | digit);
        Cell {
            key: key << (3 * (DEEPEST as usize - digits.len())),
            depth: digits.len() as u32,
            triangles: 1,
        }
    }

    #[test]
    fn nodes_are_where_cells_come_together() {
        let cells = [
            cell(&[0, 3, 1]),
            cell(&[0, 3, 7]),
            cell(&[0, 5]),
            cell(&[6]),
        ];
        assert_eq!(common_depth(&cells[0], &cells[1]), 2);
        assert_eq!(common_depth(&cells[0], &cells[3]), 0);
        let nodes = build(&cells);
        let found: Vec<_> = nodes[4..]
            .iter()
            .map(|n| (n.depth, n.level, n.children.clone()))
            .collect();
        let want = [(2, 1, vec![0, 1]), (1, 2, vec![4, 2]), (0, 3, vec![5, 3])];
        assert_eq!(found, want);
        assert_eq!(build(&cells[..1]).len(), 1);
        assert!(build(&[]).is_empty());
    }
}
