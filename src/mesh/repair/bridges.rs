//! Bridges: triangles connected by one edge only, whose opposite vertex touches another part of the surface.

use super::ascending;
use super::patch::Patch;
use crate::surface::star::{Link, Star, Triangle};
use outcrop_stages::ids::{Id, Ids, TriangleIndex};

/// Numbers, ascending, of the triangles that are bridges at a vertex of the block.
///
/// A bridge has two boundary edges, so it is adjacent to at most one triangle. Removing it leaves the rest
/// connected as before, and the component of that triangle was open before.
#[must_use]
pub fn find(ids: Ids, triangles: &[Triangle], patch: &Patch) -> Vec<TriangleIndex> {
    // Every open fan has two boundary edges, and a closed fan is the only fan of its vertex.
    let several = |v: Id| ids.contains(&v) && patch.rims[ids.place(v)] >= 4;
    let near: Vec<TriangleIndex> = (0..triangles.len())
        .filter(|&n| triangles[n].into_iter().any(several))
        .map(TriangleIndex::at)
        .collect();
    if near.is_empty() {
        return Vec::new();
    }
    let these: Vec<Triangle> = near.iter().map(|&n| triangles[n.index()]).collect();
    let star = Star::of(ids, &these);
    let mut link = Link::default();
    let mut found = Vec::new();
    for v in ids.iter().filter(|v| several(*v)) {
        let at = star.at(v);
        link.set(v, at.iter().map(|&n| these[n.index()]));
        // A fan of one triangle has both its edges at v on the boundary. If there is no larger fan, the first
        // triangle is kept, so that v stays in the mesh.
        let size = |group| (0..at.len()).filter(|&i| link.group(i) == group).count();
        let larger = (0..link.groups()).any(|group| size(group) > 1);
        for (index, &n) in at.iter().enumerate() {
            let group = link.group(index);
            if size(group) == 1 && (larger || group > 0) {
                found.push(near[n.index()]);
            }
        }
    }
    ascending(found)
}
