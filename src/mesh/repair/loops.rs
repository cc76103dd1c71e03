//! Boundary loops: the succession of boundary edges at the vertices of a block.

use super::{OrientedTriangle, ascending};
use crate::surface::star::{Link, Star, others};
use outcrop_geom::triangle::{add, normal};
use outcrop_geom::{Point, sub};
use outcrop_stages::ids::Id;

/// A triangle and its component.
pub type InComponent = (OrientedTriangle, u32);

/// One step of a boundary loop: the edge from `from` to `at` is followed by the edge from `at` to `to`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Step {
    /// The previous vertex.
    pub from: Id,
    /// The vertex, which is in the block.
    pub at: Id,
    /// The next vertex.
    pub to: Id,
    /// The third vertex of the triangle at the edge `from`, `at`.
    pub apex: Id,
    /// True if `at` has several fans.
    pub pinched: bool,
}

/// An open fan around a vertex.
#[derive(Debug, Clone, Copy)]
struct Fan {
    start: Id,
    end: Id,
    apex: Id,
    component: u32,
    normal: [i128; 3],
}

/// The steps at those of `vertices` that have a boundary edge, ascending by (`from`, `at`). Calls `pinch`
/// with every vertex that has several fans.
pub fn steps(
    vertices: impl Iterator<Item = Id>,
    star: &Star,
    triangles: &[InComponent],
    position: impl Fn(Id) -> Point,
    mut pinch: impl FnMut(Id),
) -> Vec<Step> {
    let mut link = Link::default();
    let mut all = Vec::new();
    let mut fans: Vec<Fan> = Vec::new();
    for v in vertices {
        let at = star.at(v);
        let edges = at.iter().map(|&n| after(ids(&triangles[n.index()]), v));
        match ends(edges) {
            Ends::None => continue,
            Ends::One { start, apex, end } => {
                all.push(Step {
                    from: start,
                    at: v,
                    to: end,
                    apex,
                    pinched: false,
                });
                continue;
            }
            Ends::More => pinch(v),
        }
        link.set(v, at.iter().map(|&n| ids(&triangles[n.index()])));
        fans.clear();
        for group in 0..link.groups() {
            let members = (0..at.len()).filter(|&i| link.group(i) == group);
            let members = members.map(|i| &triangles[at[i].index()]);
            fans.extend(fan(v, members, &position));
        }
        pair_up(v, &fans, &position, &mut |incoming, outgoing| {
            all.push(Step {
                from: incoming.start,
                at: v,
                to: outgoing.end,
                apex: incoming.apex,
                pinched: true,
            });
        });
    }
    all.sort_unstable();
    all
}

/// The open fans around a vertex.
enum Ends {
    /// None: the vertex has no triangle, or a closed fan.
    None,
    /// One fan.
    One { start: Id, apex: Id, end: Id },
    /// Several fans.
    More,
}

/// From the oriented edges opposite to the vertex.
fn ends(edges: impl Iterator<Item = [Id; 2]> + Clone) -> Ends {
    let mut starts = edges
        .clone()
        .filter(|[a, _]| edges.clone().all(|[_, b]| b != *a));
    let Some([start, apex]) = starts.next() else {
        return Ends::None;
    };
    if starts.next().is_some() {
        return Ends::More;
    }
    let last = |&[_, b]: &[Id; 2]| edges.clone().all(|[a, _]| a != b);
    // A fan with a start has an end.
    let end = edges.clone().find(last).map_or(start, |[_, b]| b);
    Ends::One { start, apex, end }
}

fn ids(t: &InComponent) -> OrientedTriangle {
    t.0
}

/// The other two vertices of an oriented triangle, in their order after `v`.
fn after(t: OrientedTriangle, v: Id) -> [Id; 2] {
    match t {
        [at, a, b] | [b, at, a] if at == v => [a, b],
        [a, b, _] => [a, b],
    }
}

fn fan<'a>(
    v: Id,
    members: impl Iterator<Item = &'a InComponent> + Clone,
    position: &impl Fn(Id) -> Point,
) -> Option<Fan> {
    let edges = members.clone().map(|t| after(ids(t), v));
    let Ends::One { start, apex, end } = ends(edges.clone()) else {
        return None;
    };
    let mut sum = [0i128; 3];
    for [a, b] in edges {
        let n = normal(position(v), position(a), position(b));
        add(&mut sum, n);
    }
    Some(Fan {
        start,
        end,
        apex,
        component: members.clone().next()?.1,
        normal: sum,
    })
}

/// Matches incoming and outgoing boundary edges of the fans of each component across the gaps between them.
fn pair_up(v: Id, fans: &[Fan], position: &impl Fn(Id) -> Point, put: &mut impl FnMut(&Fan, &Fan)) {
    let own = position(v);
    let away = |x: Id| sub(position(x), own).map(|c| c as f64);
    let mut pairs = Vec::new();
    for (x, a) in fans.iter().enumerate() {
        let mut axis = [0i128; 3];
        for b in fans.iter().filter(|b| b.component == a.component) {
            add(&mut axis, b.normal);
        }
        let axis = axis.map(|c| c as f64);
        for (y, b) in fans.iter().enumerate() {
            if a.component == b.component {
                let angle = clockwise(axis, away(a.start), away(b.end));
                pairs.push((angle, a.start, b.end, x, y));
            }
        }
    }
    pairs.sort_unstable();
    let mut used_in = vec![false; fans.len()];
    let mut used_out = vec![false; fans.len()];
    for (.., x, y) in pairs {
        if !used_in[x] && !used_out[y] {
            used_in[x] = true;
            used_out[y] = true;
            put(&fans[x], &fans[y]);
        }
    }
}

/// A full turn in the unit of [`clockwise`].
const FULL_TURN: u64 = 4 << ANGLE_BITS;

/// Binary digits of a quarter turn to which angles are rounded. Directions that are exactly alike or opposite
/// then have equal angles in spite of rounding errors.
const ANGLE_BITS: u32 = 36;

/// A monotone measure of the angle turned clockwise about `axis` from `s` to `e`, more than 0 and up to
/// [`FULL_TURN`].
fn clockwise(axis: [f64; 3], s: [f64; 3], e: [f64; 3]) -> u64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let length = dot(axis, axis).sqrt();
    if length == 0.0 {
        return FULL_TURN;
    }
    let n = axis.map(|x| x / length);
    // The projection on the plane across the axis, scaled to unit length.
    let flat = |v: [f64; 3]| {
        let along = dot(v, n);
        let f: [f64; 3] = std::array::from_fn(|k| v[k] - along * n[k]);
        let size = dot(f, f).sqrt();
        (size > 1e-9 * dot(v, v).sqrt()).then(|| f.map(|x| x / size))
    };
    let (Some(s), Some(e)) = (flat(s), flat(e)) else {
        return FULL_TURN;
    };
    let cross = [
        s[1] * e[2] - s[2] * e[1],
        s[2] * e[0] - s[0] * e[2],
        s[0] * e[1] - s[1] * e[0],
    ];
    let (cosine, sine) = (dot(s, e), -dot(n, cross));
    let quarter = |a: f64, b: f64| b / (a + b);
    let turned = match (cosine >= 0.0, sine >= 0.0) {
        (true, true) => quarter(cosine, sine),
        (false, true) => 1.0 + quarter(sine, -cosine),
        (false, false) => 2.0 + quarter(-cosine, -sine),
        (true, false) => 3.0 + quarter(-sine, cosine),
    };
    match (turned * f64::from(1u32 << 18) * f64::from(1u32 << (ANGLE_BITS - 18))).round() as u64 {
        0 => FULL_TURN,
        angle => angle,
    }
}

/// The one-ring of a vertex: all vertices connected to it by an edge.
pub fn neighbors(star: &Star, triangles: &[InComponent], v: Id) -> Vec<Id> {
    let around = star.at(v).iter();
    ascending(around.flat_map(|&n| others(ids(&triangles[n.index()]), v)))
}
