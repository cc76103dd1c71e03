//! What speaks for an orientation: how flat a surface runs from one triangle to the next.
//!
//! Where not everything can be oriented alike, the surface should be cut where that costs least: a few
//! connections at the foot of a wall, and not a kilometre of meadow.

use super::star::Triangle;
use crate::geom::triangle::small_normal;
use crate::method::METHOD;
use crate::stages::located::Located;
use crate::workspace::memory::Holding;

/// How a base is divided while it is oriented.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Division {
    /// The smallest ids of the triangles of a patch share a run of this number of ids.
    pub patch: u32,
    /// Most triangles that are joined inside a block where another part of the cloud could still gain by
    /// turning them against each other.
    pub cluster: u64,
}

impl Default for Division {
    fn default() -> Self {
        Self {
            patch: METHOD.curve.patch as u32,
            cluster: METHOD.orientation.cluster,
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
    /// The normal of a triangle by its ascending ids, rounded to `f64`, and its squared length.
    #[must_use]
    #[inline(always)]
    pub fn long_normal(&self, t: Triangle) -> LongNormal {
        let [a, b, c] = self.places.corners(t);
        let [x, y, z] = small_normal(a, b, c);
        let n = [x as f64, y as f64, z as f64];
        LongNormal {
            n,
            length2: dot(n, n),
        }
    }

    /// The unit normal of a triangle by its ascending ids; zero if it has none.
    #[must_use]
    pub fn normal(&self, t: Triangle) -> [f64; 3] {
        self.long_normal(t).unit()
    }
}

/// A normal and its squared length.
#[derive(Debug, Clone, Copy)]
pub struct LongNormal {
    n: [f64; 3],
    length2: f64,
}

impl LongNormal {
    /// The unit normal; zero if there is none.
    #[must_use]
    pub fn unit(self) -> [f64; 3] {
        let length = self.length2.sqrt();
        if length > 0.0 {
            self.n.map(|x| x / length)
        } else {
            self.n
        }
    }

    /// True if the [`cosine`] of the unit normals is so large that this is no place to cut.
    #[must_use]
    #[inline]
    pub fn is_flat(self, other: Self, flip: bool) -> bool {
        let flat = METHOD.orientation.flat;
        self.surely_between(other, flip, flat, f64::INFINITY)
            || cosine(self.unit(), other.unit(), flip) > flat
    }

    /// The [`weight`] of the [`cosine`] of the unit normals.
    #[must_use]
    #[inline]
    pub fn weight(self, other: Self, flip: bool) -> i64 {
        let most = METHOD.orientation.flattest - 1;
        let next = (most - 1) as f64 / most as f64;
        if self.surely_between(other, flip, next, 1.0) {
            most
        } else {
            weight(cosine(self.unit(), other.unit(), flip))
        }
    }

    /// True if the cosine is plainly between two positive ones: without unit normals, and by far more than
    /// all that is rounded.
    #[inline]
    fn surely_between(self, other: Self, flip: bool, least: f64, most: f64) -> bool {
        let dot = cosine(self.n, other.n, flip);
        let (square, lengths) = (dot * dot, self.length2 * other.length2);
        let (least, most) = (least * least * (1.0 + 1e-9), most * most * (1.0 - 1e-9));
        dot > 0.0 && square > least * lengths && square < most * lengths
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The cosine of the angle between two triangles when they run alike, `flip` if one must be turned
/// for that.
#[must_use]
pub fn cosine(a: [f64; 3], b: [f64; 3], flip: bool) -> f64 {
    let dot = dot(a, b);
    if flip { -dot } else { dot }
}

/// Weight of a connection through an edge: 1 for a fold, 16 where it is flat.
#[must_use]
pub fn weight(cosine: f64) -> i64 {
    1 + (cosine.max(0.0) * (METHOD.orientation.flattest - 1) as f64) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::located::Located;
    use proptest::prelude::*;

    proptest! {
        /// On fine and coarse lattices: with the latter, cosines lie at limits exactly.
        #[test]
        fn long_normals_tell_what_unit_normals_do(
            points in prop::array::uniform4(prop::array::uniform3(0i32..1 << 30)),
            shift in 0u32..31,
            flip in any::<bool>(),
        ) {
            let points = points.map(|p| p.map(|x| x >> shift));
            let evidence = Evidence { places: Located::of(&points), ..Evidence::default() };
            for [t, other] in [[[0, 1, 2], [1, 2, 3]], [[0, 1, 2], [0, 1, 3]], [[0, 1, 3], [0, 1, 3]]] {
                let cosine = cosine(evidence.normal(t), evidence.normal(other), flip);
                let [t, other] = [t, other].map(|t| evidence.long_normal(t));
                prop_assert_eq!(t.is_flat(other, flip), cosine > METHOD.orientation.flat);
                prop_assert_eq!(t.weight(other, flip), weight(cosine));
            }
        }
    }

    #[test]
    fn weights_grow_with_flatness() {
        assert_eq!(
            [-1.0, 0.0, 0.5, 1.0].map(weight),
            [1, 1, 8, METHOD.orientation.flattest]
        );
    }
}
