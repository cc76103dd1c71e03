//! Evidence for the orientation: the flatness of the surface at edges between triangles.
//!
//! Where not everything can be oriented consistently, the surface should be cut where the connections have
//! the least weight: a few edges at the foot of a wall rather than a kilometre of meadow.

use super::contract::upward;
use super::star::Triangle;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::triangle::small_normal;
use outcrop_paper::method::METHOD;
use outcrop_stages::ids::Id;
use outcrop_stages::located::Located;

/// The division of a base into patches and clusters for its orientation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Division {
    /// The smallest ids of the triangles of a patch are in the same run of this number of ids.
    pub patch: u32,
    /// Most triangles that are joined inside a block where turning one part could still reduce the cut weight
    /// in the rest of the cloud.
    pub cluster: u64,
    /// A part that was contracted is turned again if this lowers the weight that is cut by more than this.
    pub gain: i64,
}

impl Default for Division {
    fn default() -> Self {
        Self {
            patch: METHOD.curve.patch as u32,
            cluster: METHOD.orientation.cluster,
            gain: upward(METHOD.orientation.held),
        }
    }
}

/// The positions of triangles, and the candidates that may connect them.
#[derive(Debug, Default)]
pub struct Evidence {
    /// Positions of the vertices of the triangles around a block.
    pub places: Located,
    /// Interior candidates of the block.
    pub candidates: Vec<Triangle>,
    /// Its division into patches and clusters.
    pub division: Division,
    /// Vertices of the block at which it is known to which side the surface faces, ascending.
    pub witnesses: Vec<Witness>,
}

/// A vertex at which it is known to which side the surface faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Witness {
    /// Its id.
    pub vertex: Id,
    /// A unit vector to that side: up, or to the scanner that saw the point.
    pub toward: [f64; 3],
}

/// Up.
pub const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// The evidence that a triangle with this unit normal faces to a side.
#[must_use]
pub fn facing(unit_normal: [f64; 3], toward: [f64; 3]) -> i64 {
    (dot(unit_normal, toward) * METHOD.orientation.flattest as f64) as i64
}

impl Evidence {
    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.places.bytes() + bytes_of(&self.candidates) + bytes_of(&self.witnesses)
    }

    /// The normal of a triangle with ascending ids, rounded to `f64`, and its squared length.
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

    /// The unit normal of a triangle with ascending ids; zero if it is degenerate.
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
    /// The unit normal; zero if the triangle is degenerate.
    #[must_use]
    pub fn unit(self) -> [f64; 3] {
        let length = self.length2.sqrt();
        if length > 0.0 {
            self.n.map(|x| x / length)
        } else {
            self.n
        }
    }

    /// True if the [`cosine`] of the unit normals is above the limit, so that the surface is not to be cut
    /// here.
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

    /// True if the cosine is certainly between two positive values: without unit normals, and with a margin
    /// far larger than all rounding errors.
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

/// The cosine of the angle between two triangles when they are oriented alike; `flip` if one must be turned
/// for that.
#[must_use]
pub fn cosine(a: [f64; 3], b: [f64; 3], flip: bool) -> f64 {
    let dot = dot(a, b);
    if flip { -dot } else { dot }
}

/// Weight of an edge: 1 for a fold, 16 where the surface is flat.
#[must_use]
pub fn weight(cosine: f64) -> i64 {
    1 + (cosine.max(0.0) * (METHOD.orientation.flattest - 1) as f64) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use outcrop_stages::ids::triangle;
    use proptest::prelude::*;

    proptest! {
        /// On fine and coarse lattices; on coarse ones, cosines can be exactly at the limits.
        #[test]
        fn long_normals_tell_what_unit_normals_do(
            points in prop::array::uniform4(prop::array::uniform3(0i32..1 << 30)),
            shift in 0u32..31,
            flip in any::<bool>(),
        ) {
            let points = points.map(|p| p.map(|x| x >> shift));
            let evidence = Evidence { places: Located::of(&points), ..Evidence::default() };
            for [t, other] in [[[0, 1, 2], [1, 2, 3]], [[0, 1, 2], [0, 1, 3]], [[0, 1, 3], [0, 1, 3]]] {
                let [t, other] = [t, other].map(triangle);
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
