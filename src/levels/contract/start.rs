//! What is found in a mesh before its edges are contracted: components, the boundary, and where it is no surface.

use super::{COMPONENT, Edge, Mesh, NONE, step};
use crate::quadric::{Quadric, V3, cross, dot, minus, normal};
use rustc_hash::FxHashMap;
use std::array::from_fn;

/// The corners after and before this one.
fn beside([a, b, c]: [u32; 3], vertex: u32) -> [u32; 2] {
    match vertex {
        v if v == a => [b, c],
        v if v == b => [c, a],
        _ => [a, b],
    }
}

impl Mesh<'_> {
    /// Finds the boundary, and locks vertices whose triangles are not one fan of an oriented surface.
    pub(super) fn look_at_vertices(&mut self, locked: &[bool]) {
        const OUT: u8 = 1;
        const IN: u8 = 2;
        const TWICE: u8 = 4;
        let mut ways = vec![0u8; locked.len()];
        let mut after = vec![NONE; locked.len()];
        for v in 0..locked.len() as u32 {
            let fan = self.fans.at(v);
            let sides = |t: &u32| beside(self.triangles[*t as usize], v);
            for [next, last] in fan.iter().map(sides) {
                for (w, way) in [(next, OUT), (last, IN)] {
                    let is_new = ways[w as usize] & way == 0;
                    ways[w as usize] |= if is_new { way } else { TWICE };
                }
                after[next as usize] = last;
            }
            let mut first = fan.first().map_or(NONE, |t| sides(t)[0]);
            let mut is_surface = true;
            for t in fan {
                for w in sides(t) {
                    let way = ways[w as usize];
                    is_surface &= way & TWICE == 0;
                    // Between two locked vertices the edge may have triangles in other cells.
                    let is_free = !(locked[v as usize] && locked[w as usize]);
                    if way == OUT {
                        first = w;
                    }
                    if is_free && (way == OUT || way == IN) {
                        self.boundary[v as usize] = true;
                        if way == OUT {
                            let corners = self.triangles[*t as usize];
                            let normal = normal(corners.map(|v| self.points[v as usize]));
                            hold(self.points, &mut self.quadrics, [v, w], normal);
                        }
                    }
                }
            }
            let (mut at, mut reached) = (first, 0);
            while is_surface && reached < fan.len() && ways[at as usize] & OUT != 0 {
                at = after[at as usize];
                reached += 1;
                if at == first {
                    break;
                }
            }
            self.locked[v as usize] |= !is_surface || reached < fan.len();
            for w in fan.iter().flat_map(sides) {
                ways[w as usize] = 0;
            }
        }
    }

    /// Finds all components, and what those without a locked vertex cost.
    pub(super) fn find_components(&mut self, locked: &[bool]) {
        let into = &mut self.component;
        for t in &self.triangles {
            let firsts = t.map(|v| first(into, v));
            let least = firsts[0].min(firsts[1]).min(firsts[2]);
            firsts.iter().for_each(|v| into[*v as usize] = least);
        }
        let mut held = vec![false; locked.len()];
        for v in 0..locked.len() {
            let first = first(into, v as u32);
            into[v] = first;
            held[first as usize] |= locked[v];
        }
        let mut boxes: FxHashMap<u32, [V3; 2]> = FxHashMap::default();
        for t in &self.triangles {
            let first = into[t[0] as usize];
            self.members[first as usize] += 1;
            if held[first as usize] {
                continue;
            }
            let [low, high] = boxes.entry(first).or_insert([[f64::MAX; 3], [f64::MIN; 3]]);
            for p in t.map(|v| self.points[v as usize]) {
                *low = from_fn(|k| low[k].min(p[k]));
                *high = from_fn(|k| high[k].max(p[k]));
            }
        }
        let free = boxes.into_iter().map(|(v, [low, high])| {
            let diagonal = minus(high, low);
            Edge {
                stays: v,
                goes: v,
                step: step(COMPONENT * dot(diagonal, diagonal)),
            }
        });
        self.free = free.collect();
        self.free.sort_unstable_by_key(|edge| edge.stays);
    }
}

/// The first vertex of the component of this one, as far as it is known.
fn first(into: &mut [u32], mut vertex: u32) -> u32 {
    while into[vertex as usize] != vertex {
        into[vertex as usize] = into[into[vertex as usize] as usize];
        vertex = into[vertex as usize];
    }
    vertex
}

/// Adds the plane through an edge of the boundary that is upright on its triangle.
fn hold(points: &[V3], quadrics: &mut [Quadric], ends: [u32; 2], normal: V3) {
    let [p, q] = ends.map(|v| points[v as usize]);
    let along = minus(q, p);
    let upright = cross(along, normal);
    let length = dot(upright, upright).sqrt();
    if length > 0.0 {
        for v in ends {
            quadrics[v as usize].add_plane(upright.map(|x| x / length), dot(along, along));
        }
    }
}
