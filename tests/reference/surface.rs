//! A set of triangles with the triangles at each edge and vertex, found by a search.

use std::collections::{BTreeMap, BTreeSet};

/// Three ids, ascending.
pub type Triangle = [u32; 3];
/// Two ids, ascending.
pub type Edge = [u32; 2];

/// The edges of a triangle in the order of the method's conventions: (i,j), (i,k), (j,k).
pub fn edges([i, j, k]: Triangle) -> [Edge; 3] {
    [[i, j], [i, k], [j, k]]
}

/// The id of `t` that is not on `edge`.
pub fn opposite(t: Triangle, edge: Edge) -> u32 {
    t.into_iter()
        .find(|v| !edge.contains(v))
        .expect("a triangle has a corner beside its edge")
}

/// True if the run i → j → k → i has `edge` from its lower to its higher id.
pub fn runs_up(t: Triangle, edge: Edge) -> bool {
    edge != [t[0], t[2]]
}

/// True if two triangles with a common edge, both run i → j → k, run along it in opposite directions, as
/// neighbours on an oriented surface do.
pub fn alike(a: Triangle, b: Triangle, edge: Edge) -> bool {
    runs_up(a, edge) != runs_up(b, edge)
}

/// A component of a vertex's link, as its triangles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fan {
    pub triangles: BTreeSet<Triangle>,
    /// True for a closed cycle, false for a path.
    pub closed: bool,
}

/// The components of the link of `v` in `triangles` (all at `v`), in order of their smallest triangles.
pub fn fans(v: u32, triangles: &BTreeSet<Triangle>) -> Vec<Fan> {
    let others = |t: &Triangle| t.iter().copied().filter(|&x| x != v).collect::<Vec<u32>>();
    let mut left = triangles.clone();
    let mut found = Vec::new();
    while let Some(first) = left.pop_first() {
        let mut fan = BTreeSet::from([first]);
        loop {
            let nodes: BTreeSet<u32> = fan.iter().flat_map(others).collect();
            let next = left
                .iter()
                .find(|t| others(t).iter().any(|x| nodes.contains(x)))
                .copied();
            let Some(next) = next else { break };
            left.remove(&next);
            fan.insert(next);
        }
        let nodes: Vec<u32> = fan.iter().flat_map(others).collect();
        let closed = nodes
            .iter()
            .all(|x| nodes.iter().filter(|y| *y == x).count() == 2);
        found.push(Fan {
            triangles: fan,
            closed,
        });
    }
    found
}

/// Triangles connected through edges; true for those that must be turned (i → k → j) to be oriented like the
/// smallest one.
pub type Component = BTreeMap<Triangle, bool>;

#[derive(Debug, Clone, Default)]
pub struct Surface {
    triangles: BTreeSet<Triangle>,
    at_edge: BTreeMap<Edge, BTreeSet<Triangle>>,
    at_vertex: BTreeMap<u32, BTreeSet<Triangle>>,
}

impl Surface {
    pub fn of(triangles: impl IntoIterator<Item = Triangle>) -> Self {
        let mut surface = Self::default();
        triangles.into_iter().for_each(|t| surface.insert(t));
        surface
    }

    pub fn insert(&mut self, t: Triangle) {
        assert!(t[0] < t[1] && t[1] < t[2], "{t:?} is no triangle");
        assert!(self.triangles.insert(t), "{t:?} is there already");
        for edge in edges(t) {
            self.at_edge.entry(edge).or_default().insert(t);
        }
        for v in t {
            self.at_vertex.entry(v).or_default().insert(t);
        }
    }

    pub fn remove(&mut self, t: Triangle) {
        assert!(self.triangles.remove(&t), "{t:?} is not there");
        for edge in edges(t) {
            self.at_edge.get_mut(&edge).expect("indexed").remove(&t);
        }
        for v in t {
            self.at_vertex.get_mut(&v).expect("indexed").remove(&t);
        }
    }

    pub fn triangles(&self) -> &BTreeSet<Triangle> {
        &self.triangles
    }

    pub fn at_edge(&self, edge: Edge) -> Vec<Triangle> {
        self.at_edge
            .get(&edge)
            .into_iter()
            .flatten()
            .copied()
            .collect()
    }

    pub fn at_vertex(&self, v: u32) -> BTreeSet<Triangle> {
        self.at_vertex.get(&v).cloned().unwrap_or_default()
    }

    /// Ids of the vertices that have triangles, ascending.
    pub fn vertices(&self) -> Vec<u32> {
        self.at_vertex
            .iter()
            .filter(|(_, at)| !at.is_empty())
            .map(|(v, _)| *v)
            .collect()
    }

    /// The fans of all triangles at `v`.
    pub fn fans(&self, v: u32) -> Vec<Fan> {
        fans(v, &self.at_vertex(v))
    }

    /// True if exactly one triangle has the edge.
    pub fn is_boundary(&self, edge: Edge) -> bool {
        self.at_edge(edge).len() == 1
    }

    /// The triangles connected to `start` through edges, with turns relative to `start`; `None` if they
    /// cannot all be oriented alike.
    pub fn component(&self, start: Triangle) -> Option<Component> {
        let mut turned = Component::from([(start, false)]);
        let mut queue = vec![start];
        while let Some(t) = queue.pop() {
            for edge in edges(t) {
                for other in self.at_edge(edge) {
                    if other == t {
                        continue;
                    }
                    let turn = turned[&t] == alike(t, other, edge);
                    match turned.insert(other, turn) {
                        None => queue.push(other),
                        Some(before) if before != turn => return None,
                        Some(_) => {}
                    }
                }
            }
        }
        Some(turned)
    }

    /// All components in order of their smallest triangles; `None` if one cannot be oriented.
    pub fn components(&self) -> Option<Vec<Component>> {
        let mut left = self.triangles.clone();
        let mut found = Vec::new();
        while let Some(first) = left.first().copied() {
            let component = self.component(first)?;
            component.keys().for_each(|t| {
                left.remove(t);
            });
            found.push(component);
        }
        Some(found)
    }
}
