//! A hierarchy of boxes over triangles: what a ray meets first, and what is nearest to a place.
//!
//! Written for this crate, since what there is either computes with 32 bits or brings a library of linear
//! algebra with it, and results must be the same to the bit on every machine.

use crate::surface::distance2;
use crate::vec3::{Vec3, cross, dot, normalize, sub};

/// Triangles of a leaf, at most.
const LEAF: usize = 4;

/// A ray that meets a triangle this far outside, in units of its sides, still meets it: none slips through
/// between two.
const RIM: f64 = 1e-12;

/// A part of the triangles in a box.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// First triangle of a leaf, or the second child of another node; its first child is the next node.
    first: u32,
    /// Triangles of a leaf; 0 for other nodes.
    count: u32,
}

/// Triangles that can be asked for the first on a ray and for the nearest to a place.
#[derive(Clone, Debug)]
pub struct Triangles {
    nodes: Vec<Node>,
    /// Corners, in the order of the leaves.
    corners: Vec<[Vec3; 3]>,
    /// Number of each triangle as they were given.
    numbers: Vec<u32>,
}

/// A triangle found, and how far away it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Distance from the place, or along the ray in units of its direction.
    pub distance: f64,
    /// Number of the triangle.
    pub triangle: usize,
    /// Its unit normal, by the order of its corners; zero if it has no area.
    pub normal: [f64; 3],
}

impl Triangles {
    /// Of a mesh. Triangles without an area are left out, as are those of vertices that do not exist.
    pub fn new(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Self {
        let place = |v: u32| vertices.get(v as usize).copied();
        let mut items = Vec::with_capacity(triangles.len());
        for (number, &[a, b, c]) in triangles.iter().enumerate() {
            if let (Some(a), Some(b), Some(c)) = (place(a), place(b), place(c)) {
                let normal = cross(sub(b, a), sub(c, a));
                if dot(normal, normal) > 0.0 {
                    items.push((number as u32, [a, b, c]));
                }
            }
        }
        let mut built = Triangles {
            nodes: Vec::with_capacity(items.len()),
            corners: Vec::with_capacity(items.len()),
            numbers: Vec::with_capacity(items.len()),
        };
        if !items.is_empty() {
            built.build(&mut items);
        }
        built
    }

    /// Adds the node of some triangles, and those below it.
    fn build(&mut self, items: &mut [(u32, [Vec3; 3])]) {
        let [low, high] = bounds(items.iter().flat_map(|item| item.1));
        let at = self.nodes.len();
        let leaf = items.len() <= LEAF;
        self.nodes.push(Node {
            low,
            high,
            first: self.corners.len() as u32,
            count: if leaf { items.len() as u32 } else { 0 },
        });
        if leaf {
            self.numbers.extend(items.iter().map(|item| item.0));
            self.corners.extend(items.iter().map(|item| item.1));
            return;
        }
        let [low, high] = bounds(items.iter().map(|item| middle(&item.1)));
        let extent = sub(high, low);
        let axis = (1..3).fold(0, |most, k| if extent[k] > extent[most] { k } else { most });
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |a, b| {
            let [p, q] = [a, b].map(|item| middle(&item.1)[axis]);
            p.total_cmp(&q).then(a.0.cmp(&b.0))
        });
        let (one, other) = items.split_at_mut(half);
        self.build(one);
        self.nodes[at].first = self.nodes.len() as u32;
        self.build(other);
    }

    /// The first triangle that a ray meets, from either side; of several the first by number.
    pub fn first_on_ray(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<Found> {
        let inverse = direction.map(|c| 1.0 / c);
        let mut best: Option<(f64, usize)> = None;
        let mut stack = vec![0];
        while let Some(at) = stack.pop() {
            let Some(node) = self.nodes.get(at) else {
                break;
            };
            let most = best.map_or(f64::INFINITY, |b| b.0);
            if !on_ray(node, origin, inverse, most) {
                continue;
            }
            if node.count == 0 {
                let (near, far) = (at + 1, node.first as usize);
                let reach = |child: usize| dot(middle_of(&self.nodes[child]), direction);
                // The nearer one is examined first: it is pushed last.
                stack.extend(if reach(near) <= reach(far) {
                    [far, near]
                } else {
                    [near, far]
                });
                continue;
            }
            for item in node.first as usize..(node.first + node.count) as usize {
                if let Some(t) = meets(&self.corners[item], origin, direction)
                    && self.better(best, t, item)
                {
                    best = Some((t, item));
                }
            }
        }
        best.map(|(t, item)| self.found(t, item))
    }

    /// The nearest triangle; of several the first by number. None if there is no triangle.
    pub fn nearest(&self, place: [f64; 3]) -> Option<Found> {
        let mut best: Option<(f64, usize)> = None;
        let mut stack = vec![(0.0, 0)];
        while let Some((distance, at)) = stack.pop() {
            let Some(node) = self.nodes.get(at) else {
                break;
            };
            if best.is_some_and(|b| distance > b.0) {
                continue;
            }
            if node.count == 0 {
                let mut children = [at + 1, node.first as usize]
                    .map(|child| (to_box(&self.nodes[child], place), child));
                // The nearer one last.
                children.sort_by(|a, b| b.0.total_cmp(&a.0));
                stack.extend(children);
                continue;
            }
            for item in node.first as usize..(node.first + node.count) as usize {
                let square = distance2(self.corners[item], place);
                if self.better(best, square, item) {
                    best = Some((square, item));
                }
            }
        }
        best.map(|(square, item)| self.found(square.sqrt(), item))
    }

    fn better(&self, best: Option<(f64, usize)>, distance: f64, item: usize) -> bool {
        best.is_none_or(|(least, other)| {
            distance < least || (distance == least && self.numbers[item] < self.numbers[other])
        })
    }

    fn found(&self, distance: f64, item: usize) -> Found {
        let [a, b, c] = self.corners[item];
        Found {
            distance,
            triangle: self.numbers[item] as usize,
            normal: normalize(cross(sub(b, a), sub(c, a))),
        }
    }
}

fn bounds(points: impl Iterator<Item = Vec3>) -> [Vec3; 2] {
    let start = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    points.fold(start, |[low, high], p| {
        [
            std::array::from_fn(|k| low[k].min(p[k])),
            std::array::from_fn(|k| high[k].max(p[k])),
        ]
    })
}

fn middle([a, b, c]: &[Vec3; 3]) -> Vec3 {
    std::array::from_fn(|k| a[k] + b[k] + c[k])
}

fn middle_of(node: &Node) -> Vec3 {
    std::array::from_fn(|k| node.low[k] + node.high[k])
}

/// Squared distance of a place to a node's box.
fn to_box(node: &Node, place: Vec3) -> f64 {
    let off: Vec3 = std::array::from_fn(|k| {
        (node.low[k] - place[k])
            .max(place[k] - node.high[k])
            .max(0.0)
    });
    dot(off, off)
}

/// True if a ray may meet something in the box before `most`.
fn on_ray(node: &Node, origin: Vec3, inverse: Vec3, most: f64) -> bool {
    let (mut enter, mut leave) = (0.0_f64, most);
    for k in 0..3 {
        let (below, above) = (node.low[k] - origin[k], node.high[k] - origin[k]);
        if inverse[k].is_infinite() {
            if below > 0.0 || above < 0.0 {
                return false;
            }
            continue;
        }
        let (one, other) = (below * inverse[k], above * inverse[k]);
        enter = enter.max(one.min(other));
        leave = leave.min(one.max(other));
    }
    // Rounding must not cut off what is on the rim.
    enter <= leave * (1.0 + 1e-9) + 1e-12
}

/// Way along a ray to a triangle (Möller and Trumbore).
fn meets([a, b, c]: &[Vec3; 3], origin: Vec3, direction: Vec3) -> Option<f64> {
    let (u, v) = (sub(*b, *a), sub(*c, *a));
    let p = cross(direction, v);
    let det = dot(u, p);
    if det == 0.0 {
        return None;
    }
    let off = sub(origin, *a);
    let s = dot(off, p) / det;
    let q = cross(off, u);
    let t = dot(direction, q) / det;
    let inside = s >= -RIM && t >= -RIM && s + t <= 1.0 + RIM;
    let way = dot(v, q) / det;
    (inside && way > 0.0).then_some(way)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{Purpose, Rng};
    use crate::vec3::{add, scale};

    #[test]
    fn finds_what_a_search_through_all_finds() {
        let mut rng = Rng::at(5, Purpose::Object, 0);
        let mut place = |size: f64| -> Vec3 { [(); 3].map(|()| size * (rng.uniform() - 0.5)) };
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for n in 0..300u32 {
            let centre = place(10.0);
            vertices.extend([(); 3].map(|()| add(centre, place(2.0))));
            triangles.push([3 * n, 3 * n + 1, 3 * n + 2]);
        }
        let tree = Triangles::new(&vertices, &triangles);
        let all = || {
            let corners = triangles.iter().map(|t| t.map(|v| vertices[v as usize]));
            corners.enumerate()
        };
        let mut hits = 0;
        for _ in 0..500 {
            let (origin, direction) = (place(12.0), normalize(place(1.0)));
            let first = all()
                .filter_map(|(n, c)| Some((meets(&c, origin, direction)?, n)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let found = tree.first_on_ray(origin, direction);
            assert_eq!(found.map(|f| (f.distance, f.triangle)), first);
            if let Some(found) = found {
                hits += 1;
                let end = add(origin, scale(direction, found.distance));
                assert!(tree.nearest(end).is_some_and(|f| f.distance < 1e-9));
            }
            let near = all().map(|(n, c)| (distance2(c, origin).sqrt(), n));
            let near = near.min_by(|a, b| a.0.total_cmp(&b.0));
            let found = tree.nearest(origin).map(|f| (f.distance, f.triangle));
            assert_eq!(found, near);
        }
        assert!(hits > 50, "{hits}");
        assert!(Triangles::new(&[], &[]).nearest([0.0; 3]).is_none());
    }
}
