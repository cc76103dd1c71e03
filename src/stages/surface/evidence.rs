//! What speaks for an orientation: how flat a surface runs from one triangle to the next.
//!
//! Where not everything can be oriented alike, the surface should be cut where that costs least: a few
//! connections at the foot of a wall, and not a kilometre of meadow.

use super::star::Triangle;
use crate::geom::triangle::small_normal;
use crate::stages::located::Located;
use crate::workspace::memory::Holding;

/// How a base is divided while it is oriented.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Division {
    /// The smallest ids of the triangles of a patch share a run of so many ids.
    pub patch: u32,
    /// Most triangles that are joined inside a block where another part of the cloud could still gain by
    /// turning them against each other.
    pub cluster: u64,
}

impl Default for Division {
    /// Patches of a page of points. With clusters of up to 4096 triangles open ground is cut nowhere, with
    /// 16 384 it is; smaller ones need more memory where blocks are put together.
    fn default() -> Self {
        Self {
            patch: 256,
            cluster: 1024,
        }
    }
}

/// Where triangles lie, and what may be inserted between them later.
#[derive(Debug, Default)]
pub struct Evidence {
    /// The vertices of the triangles around a block.
    pub places: Located,
    /// Candidates inside the block.
    pub candidates: Vec<Triangle>,
    /// How it is divided.
    pub division: Division,
    /// Vertices of the block that are the highest in their columns, ascending.
    pub highest: Vec<u32>,
    /// What they hold.
    pub held: Holding,
}

impl Evidence {
    /// The unit normal of a triangle by its ascending ids; zero if it has none.
    #[must_use]
    pub fn normal(&self, t: Triangle) -> [f64; 3] {
        let [a, b, c] = t.map(|v| self.places.at(v));
        let n = small_normal(a, b, c).map(|x| x as f64);
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        if length > 0.0 {
            n.map(|x| x / length)
        } else {
            n
        }
    }
}

/// The cosine of the angle between two triangles when they run alike, `flip` if one must be turned
/// for that.
#[must_use]
pub fn cosine(a: [f64; 3], b: [f64; 3], flip: bool) -> f64 {
    let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if flip { -dot } else { dot }
}

/// Weight of a connection through an edge: 1 for a fold, 16 where it is flat.
#[must_use]
pub fn weight(cosine: f64) -> i64 {
    1 + (cosine.max(0.0) * 15.0) as i64
}

/// The weight of the flattest connection.
pub const FLATTEST: i64 = 16;

/// Flatter than this, a connection is no place to cut.
pub const FLAT: f64 = 0.9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_grow_with_flatness() {
        assert_eq!([-1.0, 0.0, 0.5, 1.0].map(weight), [1, 1, 8, FLATTEST]);
    }
}
