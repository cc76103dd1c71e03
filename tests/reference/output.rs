//! Pinched vertices and the order of the file (section 9).

use super::repair::run;
use super::surface::{Component, Fan, Surface, Triangle};
use std::collections::BTreeMap;

/// The id of each vertex in the file, and the triangles as indices of these.
pub fn in_file_order(
    surface: &Surface,
    turned: &Component,
    split_pinched: bool,
) -> (Vec<u32>, Vec<[u32; 3]>) {
    let mut ids = surface.vertices();
    let mut index_of: BTreeMap<(u32, Triangle), u32> = BTreeMap::new();
    for (index, &v) in ids.iter().enumerate() {
        for t in surface.at_vertex(v) {
            index_of.insert((v, t), index as u32);
        }
    }
    if split_pinched {
        for v in surface.vertices() {
            for Fan { triangles, .. } in surface.fans(v).into_iter().skip(1) {
                let copy = ids.len() as u32;
                ids.push(v);
                index_of.extend(triangles.into_iter().map(|t| ((v, t), copy)));
            }
        }
    }
    let indices = |&t: &Triangle| run(t, turned[&t]).map(|v| index_of[&(v, t)]);
    let triangles = surface.triangles().iter().map(indices).collect();
    (ids, triangles)
}
