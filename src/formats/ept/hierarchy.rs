//! The hierarchy: which nodes there are, and how many points each has.
//!
//! It is in files of JSON, each with a map from keys `depth-x-y-z` to numbers of points. The number -1 says that the
//! nodes from there on are in a file of their own.

use super::super::input::Input;
use super::super::reads::Means;
use super::info::{Info, damaged};
use super::pins::Pinned;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_points::crop::Nearby;
use std::collections::{BTreeMap, BTreeSet};

/// Deepest level of an octree: the numbers of its nodes are 32-bit integers.
const DEEPEST: u32 = 30;

/// Most bytes of a file; they have about 10 000 nodes.
const LONGEST: u64 = 64 << 20;

/// Most points of a node: its rows must fit into memory.
const MOST_POINTS: i64 = 1 << 25;

/// A node: its level, and its place in the grid of that level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    depth: u32,
    place: [u32; 3],
}

impl Key {
    const ROOT: Self = Self {
        depth: 0,
        place: [0; 3],
    };

    fn parse(text: &str) -> Option<Self> {
        let mut numbers = text.split('-').map(|part| part.parse::<u32>().ok());
        let mut next = || numbers.next().flatten();
        let key = Self {
            depth: next()?,
            place: [next()?, next()?, next()?],
        };
        let fits = key.depth <= DEEPEST && key.place.iter().all(|p| *p < 1 << key.depth);
        (fits && numbers.next().is_none() && key.name() == text).then_some(key)
    }

    /// The name of its files.
    pub(super) fn name(self) -> String {
        let [x, y, z] = self.place;
        format!("{}-{x}-{y}-{z}", self.depth)
    }

    /// Its cube in that of the root.
    fn cube(self, [low, high]: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
        let cells = f64::from(1u32 << self.depth);
        let at = |steps: u32, axis: usize| {
            low[axis] + (high[axis] - low[axis]) / cells * f64::from(steps)
        };
        let corner = |more: u32| [0, 1, 2].map(|axis| at(self.place[axis] + more, axis));
        [corner(0), corner(1)]
    }
}

/// A node with points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub(super) key: Key,
    pub(super) points: u64,
}

/// The nodes to read, sorted by key.
pub(super) struct Nodes {
    pub(super) all: Vec<Node>,
    /// The files that were read, if they are on a server.
    pub(super) files: Vec<Pinned>,
    _memory: Reservation,
}

/// Reads the hierarchy as far as its nodes meet the wanted region.
///
/// # Errors
/// [`outcrop_disk::error::Error::Input`] where it is damaged; errors of memory and files.
pub(super) fn read(
    input: &Input,
    info: &Info,
    region: Option<&Nearby<'_>>,
    means: Means<'_>,
) -> Result<Nodes> {
    let mut memory = means.reserve("EPT hierarchy", 0)?;
    let (mut all, mut seen, mut pages) = (Vec::new(), BTreeSet::new(), vec![Key::ROOT]);
    let mut files = Vec::new();
    while let Some(page) = pages.pop() {
        means.cancel.check()?;
        let name = format!("ept-hierarchy/{}.json", page.name());
        let (text, version) = input.beside(&name, LONGEST)?;
        files.extend(version.map(|version| (name.clone(), version)));
        let held = means.reserve("EPT hierarchy file", 8 * text.len() as u64)?;
        let map: BTreeMap<String, i64> = serde_json::from_slice(&text).map_err(|e| {
            damaged(
                input,
                &name,
                e.to_string().escape_debug().to_string(),
                "numbers of points of nodes",
            )
        })?;
        let more = (map.len() * 3 * size_of::<Node>()) as u64;
        let old = memory.bytes();
        memory.at_least(old + more)?;
        memory.set_held(old + more);
        for (text, points) in map {
            let key = Key::parse(&text)
                .ok_or_else(|| damaged(input, &name, format!("the key {text:?}"), "depth-x-y-z"))?;
            let wanted = region.is_none_or(|r| r.may_meet(key.cube(info.cube)));
            match points {
                0 => {}
                1..=MOST_POINTS if wanted => all.push(Node {
                    key,
                    points: points as u64,
                }),
                1..=MOST_POINTS => {}
                -1 if !wanted || key == page => {}
                -1 if seen.insert(key) => pages.push(key),
                _ => {
                    let found = format!("{points} points in the node {text}");
                    return Err(damaged(input, &name, found, "a number, and each file once"));
                }
            }
        }
        drop(held);
    }
    all.sort_unstable_by_key(|node| node.key);
    let before = all.len();
    all.dedup_by_key(|node| node.key);
    if all.len() < before {
        return Err(damaged(
            input,
            "ept-hierarchy",
            "a node twice",
            "each node once",
        ));
    }
    Ok(Nodes {
        all,
        files,
        _memory: memory,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_read_strictly() {
        assert_eq!(Key::parse("0-0-0-0"), Some(Key::ROOT));
        let key = Key::parse("3-7-0-2").unwrap();
        assert_eq!((key.depth, key.place), (3, [7, 0, 2]));
        for wrong in [
            "",
            "1-0-0",
            "1-0-0-0-0",
            "1-2-0-0",
            "31-0-0-0",
            "1--1-0-0",
            "01-0-0-0",
            "1-0-0-+1",
        ] {
            assert_eq!(Key::parse(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn children_divide_the_cube() {
        let cube = [[0.0, 10.0, -8.0], [8.0, 18.0, 0.0]];
        let key = Key::parse("2-3-0-1").unwrap();
        assert_eq!(key.cube(cube), [[6.0, 10.0, -6.0], [8.0, 12.0, -4.0]]);
    }
}
