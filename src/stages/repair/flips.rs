//! Edge flips that reduce the bending of the surface.
//!
//! Of the two triangulations of a quadrilateral, the one with smaller angles between the normals of adjacent
//! triangles is usually closer to the surface (Dyn, Levin and Rippa, *Data dependent triangulations for
//! piecewise linear interpolation*, 1990). The cells do not take this into account, and relaxed positions
//! show less of it than those in the file.
//!
//! Only triangles inside the block are changed, in ascending order, so that the result depends on the block
//! alone. Boundary edges, components and fans are preserved.

use super::around::merge;
use crate::ids::{Id, Ids, Side, TriangleIndex};
use crate::surface::sides::{across, parts, side};
use crate::surface::star::Triangle;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_geom::method::METHOD;
use outcrop_geom::triangle::small_normal;
use outcrop_geom::{Point, sub};

/// A triangle that may be changed, and its neighbours.
#[derive(Debug, Clone, Copy)]
struct Slot {
    /// Corners by index in the block, in the triangle's orientation.
    corners: [u32; 3],
    /// For the edge opposite each corner: the adjacent triangle, and its corner opposite this edge.
    across: [Side; 3],
    /// Unit normal.
    normal: [f32; 3],
    /// For the edge opposite each corner: the bend there, i.e. the distance of the two unit normals.
    bends: [f32; 3],
}

/// The triangles of a block that may be changed.
pub struct Sheet<'a> {
    /// The ids of the block.
    ids: Ids,
    points: &'a [Point],
    /// Their numbers among all triangles of the block.
    numbers: Vec<TriangleIndex>,
    slots: Vec<Slot>,
    /// Fixed vertices, which take part in no flip: some of their triangles are outside the sheet, or they are
    /// on the boundary.
    fixed: Vec<bool>,
    /// Edges to examine, with four bits for each triangle and 16 triangles in a word: bit `k` is the edge
    /// opposite corner `k`.
    due: Vec<u64>,
    flipped: Vec<bool>,
}

/// A flip that lowers the sum of bends.
struct Flip {
    normals: [[f32; 3]; 2],
    /// Bends at the new edge, and at the sides `cu`, `ud`, `dv`, `vc`.
    bends: [f32; 5],
}

impl<'a> Sheet<'a> {
    /// From the ascending `triangles` that touch the vertices `ids`. `points` are the positions in the file,
    /// `shape` those that decide the connectivity. Triangles none of whose points were moved are kept.
    pub fn of(ids: Ids, triangles: &[Triangle], points: &'a [Point], shape: &[Point]) -> Self {
        let moved: Vec<bool> = points.iter().zip(shape).map(|(p, s)| p != s).collect();
        let inside = |t: &Triangle| ids.contains(&t[0]) && ids.contains(&t[2]);
        let moved = |t: &Triangle| t.iter().any(|v| moved[ids.place(*v)]);
        let mut fixed = vec![false; ids.len()];
        let mut numbers = Vec::new();
        // With corners by index in the block, as if the block were the cloud.
        let mut these: Vec<Triangle> = Vec::new();
        for (number, t) in triangles.iter().enumerate() {
            if inside(t) && moved(t) {
                numbers.push(TriangleIndex::at(number));
                these.push(t.map(|v| Id::at(ids.place(v))));
            } else {
                for v in t.iter().filter(|v| ids.contains(v)) {
                    fixed[ids.place(*v)] = true;
                }
            }
        }
        let across = across(Ids::at(&(0..points.len())), &these);
        let slot = |(t, across): (&Triangle, &[Side; 3])| {
            let corners = t.map(|v| v.index() as u32);
            Slot {
                corners,
                across: *across,
                normal: unit(normal(points, corners)),
                bends: [0.0; 3],
            }
        };
        let mut sheet = Self {
            ids,
            points,
            numbers,
            slots: these.iter().zip(&across).map(slot).collect(),
            fixed,
            due: vec![0; these.len().div_ceil(16)],
            flipped: vec![false; these.len()],
        };
        sheet.fixed();
        sheet.bend();
        sheet
    }

    /// Allocated bytes.
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.numbers)
            + bytes_of(&self.slots)
            + bytes_of(&self.fixed)
            + bytes_of(&self.due)
            + bytes_of(&self.flipped)
    }

    /// Flips edges in the `triangles` of the block, and returns the number of flips.
    pub fn flip(mut self, triangles: &mut Vec<Triangle>) -> u64 {
        let mut flips = 0;
        for _ in 0..METHOD.flips.sweeps {
            let more = self.sweep();
            flips += more;
            if more == 0 {
                break;
            }
        }
        if flips > 0 {
            self.write(triangles);
        }
        flips
    }

    /// Fixes the vertices of boundary edges.
    fn fixed(&mut self) {
        for slot in &self.slots {
            for k in (0..3).filter(|&k| slot.across[k] == Side::NONE) {
                for v in [slot.corners[next(k)], slot.corners[last(k)]] {
                    self.fixed[v as usize] = true;
                }
            }
        }
    }

    /// Computes all bends, and marks the edges where a flip may lower the sum.
    fn bend(&mut self) {
        for number in 0..self.slots.len() {
            for k in 0..3 {
                let behind = self.slots[number].across[k];
                let (other, corner) = parts(behind);
                if behind != Side::NONE && number < other {
                    let seen = self.seen_from(number, k, behind);
                    let bend = distance(self.slots[number].normal, seen);
                    self.slots[number].bends[k] = bend;
                    self.slots[other].bends[corner] = bend;
                }
            }
        }
        for (number, slot) in self.slots.iter().enumerate() {
            let mut bits = 0;
            for (k, &behind) in slot.across.iter().enumerate() {
                let own = behind != Side::NONE && number < parts(behind).0;
                bits |= u64::from(own && self.around(number, k, behind) >= METHOD.flips.bent) << k;
            }
            self.due[number / 16] |= bits << (number % 16 * 4);
        }
    }

    /// The sum of bends at the five edges of the quadrilateral of an edge.
    #[inline]
    fn around(&self, number: usize, k: usize, behind: Side) -> f32 {
        let (other, corner) = parts(behind);
        let (mine, theirs) = (&self.slots[number].bends, &self.slots[other].bends);
        mine[k] + (mine[next(k)] + mine[last(k)]) + (theirs[next(corner)] + theirs[last(corner)])
    }

    /// The normal of triangle `behind` the edge opposite corner `k` of triangle `number`, negated if the two
    /// are not oriented alike.
    #[inline]
    fn seen_from(&self, number: usize, k: usize, behind: Side) -> [f32; 3] {
        self.facing(behind, self.slots[number].corners[next(k)])
    }

    /// The normal of triangle `behind` an edge that starts at `from` in the neighbour; negated unless the
    /// triangle runs along the edge in the opposite direction.
    #[inline]
    fn facing(&self, behind: Side, from: u32) -> [f32; 3] {
        let (other, corner) = parts(behind);
        let slot = &self.slots[other];
        // A sign instead of a branch, since both cases are equally frequent.
        let sign = u32::from(slot.corners[next(corner)] == from) << 31;
        slot.normal.map(|x| f32::from_bits(x.to_bits() ^ sign))
    }

    /// Examines the edges that are due, in order, and flips them if the sum of bends is lowered. Returns the
    /// number of flips.
    fn sweep(&mut self) -> u64 {
        let mut flips = 0;
        for word in 0..self.due.len() {
            let mut ahead = u64::MAX;
            loop {
                // Edges that become due further on are examined in this sweep, those already passed in the
                // next one.
                let bits = self.due[word] & ahead;
                if bits == 0 {
                    break;
                }
                let bit = bits.trailing_zeros();
                self.due[word] &= !(1 << bit);
                ahead = u64::MAX.checked_shl(bit + 1).unwrap_or(0);
                let (number, k) = (word * 16 + bit as usize / 4, bit as usize % 4);
                // An edge is examined from the triangle with the smaller number; there is none beyond the
                // last.
                let Some(slot) = self.slots.get(number) else {
                    break;
                };
                let behind = slot.across[k];
                if behind != Side::NONE
                    && number < parts(behind).0
                    && let Some(flip) = self.gain(number, k, behind)
                {
                    self.turn(number, k, behind, flip);
                    flips += 1;
                }
            }
        }
        flips
    }

    /// The outcome of flipping the edge opposite corner `k` of `number`, if it lowers the sum of bends.
    #[inline]
    fn gain(&self, number: usize, k: usize, behind: Side) -> Option<Flip> {
        let was = self.around(number, k, behind);
        if was < METHOD.flips.bent {
            return None;
        }
        let (other, corner) = parts(behind);
        let (c, u, v) = self.named(number, k);
        let d = self.slots[other].corners[corner];
        if [c, u, d, v].into_iter().any(|v| self.fixed[v as usize]) {
            return None;
        }
        let (one, two) = (
            normal(self.points, [u, d, c]),
            normal(self.points, [d, v, c]),
        );
        let (mine, theirs) = (self.slots[number].normal, self.seen_from(number, k, behind));
        let both: [f32; 3] = std::array::from_fn(|i| mine[i] + theirs[i]);
        if !(dot(one, both) > 0.0 && dot(two, both) > 0.0) {
            return None;
        }
        let (one, two) = (unit(one), unit(two));
        let inner = distance(one, two);
        // In most cases the new edge alone decides.
        if was - inner <= METHOD.flips.gain {
            return None;
        }
        let sides = self.sides(number, k, behind);
        let bend = |normal, side: Option<[f32; 3]>| side.map_or(0.0, |s| distance(normal, s));
        let bends = [
            inner,
            bend(one, sides[0]),
            bend(one, sides[1]),
            bend(two, sides[2]),
            bend(two, sides[3]),
        ];
        let is = bends[0] + (bends[1] + bends[2]) + (bends[3] + bends[4]);
        let pays = was - is > METHOD.flips.gain
            && !self.too_slender([c, u, d, v])
            && !self.meets(number, k, d);
        pays.then_some(Flip {
            normals: [one, two],
            bends,
        })
    }

    /// Corner `k` of a triangle, and the two after it in its orientation.
    #[inline]
    fn named(&self, number: usize, k: usize) -> (u32, u32, u32) {
        let t = self.slots[number].corners;
        (t[k], t[next(k)], t[last(k)])
    }

    /// The triangles adjacent to the sides `cu`, `ud`, `dv`, `vc` of the quadrilateral of an edge.
    #[inline]
    fn behind(&self, number: usize, k: usize, behind: Side) -> [Side; 4] {
        let (other, corner) = parts(behind);
        let (mine, theirs) = (&self.slots[number].across, &self.slots[other].across);
        let u = self.slots[number].corners[next(k)];
        // The side opposite `u` is `dv`.
        let (ud, dv) = if self.slots[other].corners[next(corner)] == u {
            (last(corner), next(corner))
        } else {
            (next(corner), last(corner))
        };
        [mine[last(k)], theirs[ud], theirs[dv], mine[next(k)]]
    }

    /// The normals of the triangles adjacent to these sides, oriented like `number`.
    #[inline]
    fn sides(&self, number: usize, k: usize, behind: Side) -> [Option<[f32; 3]>; 4] {
        let (c, u, v) = self.named(number, k);
        let (other, corner) = parts(behind);
        let d = self.slots[other].corners[corner];
        let all = self.behind(number, k, behind);
        let from = [c, u, d, v];
        // The quadrilateral runs c, u, d, v.
        std::array::from_fn(|i| (all[i] != Side::NONE).then(|| self.facing(all[i], from[i])))
    }

    /// True if one of the two new triangles is degenerate, or is slender and less regular than both old ones.
    fn too_slender(&self, [c, u, d, v]: [u32; 4]) -> bool {
        let shape = |t: [u32; 3]| slenderness(t.map(|v| self.points[v as usize]));
        let made = shape([u, d, c]).min(shape([d, v, c]));
        let least = METHOD.flips.slender * METHOD.flips.slender;
        made == 0.0 || made < least && made < shape([c, u, v]).min(shape([d, v, u]))
    }

    /// True if there is already an edge from corner `k` of a triangle to `d`.
    fn meets(&self, number: usize, k: usize, d: u32) -> bool {
        let c = self.slots[number].corners[k];
        let all_around = |begin: usize| {
            let (mut at, mut through) = (number, begin);
            loop {
                let behind = self.slots[at].across[through];
                if behind == Side::NONE {
                    return (false, false);
                }
                let (other, corner) = parts(behind);
                if other == number {
                    return (false, true);
                }
                if self.slots[other].corners[corner] == d {
                    return (true, true);
                }
                // Leave the triangle through its other edge at c.
                at = other;
                through = if self.slots[other].corners[next(corner)] == c {
                    last(corner)
                } else {
                    next(corner)
                };
            }
        };
        let (found, whole) = all_around(next(k));
        found || (!whole && all_around(last(k)).0)
    }

    /// Carries out a flip.
    fn turn(&mut self, number: usize, k: usize, behind: Side, flip: Flip) {
        let (other, corner) = parts(behind);
        let (c, u, v) = self.named(number, k);
        let d = self.slots[other].corners[corner];
        let [cu, ud, dv, vc] = self.behind(number, k, behind);
        let [one, two] = [number, other].map(TriangleIndex::at);
        self.slots[number].corners = [u, d, c];
        self.slots[other].corners = [d, v, c];
        self.slots[number].across = [side(two, 1), cu, ud];
        self.slots[other].across = [vc, side(one, 0), dv];
        [self.slots[number].normal, self.slots[other].normal] = flip.normals;
        let [inner, at_cu, at_ud, at_dv, at_vc] = flip.bends;
        self.slots[number].bends = [inner, at_cu, at_ud];
        self.slots[other].bends = [at_vc, inner, at_dv];
        let sides = [
            (cu, side(one, 1), at_cu),
            (ud, side(one, 2), at_ud),
            (dv, side(two, 2), at_dv),
            (vc, side(two, 0), at_vc),
        ];
        for (side, mine, bend) in sides {
            if side != Side::NONE {
                let (triangle, corner) = parts(side);
                self.slots[triangle].across[corner] = mine;
                self.slots[triangle].bends[corner] = bend;
            }
        }
        for triangle in [number, other] {
            self.flipped[triangle] = true;
            for k in 0..3 {
                let behind = self.slots[triangle].across[k];
                let owner = side(TriangleIndex::at(triangle), k as u32);
                let owner = owner.min(behind).index();
                self.due[owner / 64] |= 1 << (owner % 64);
            }
        }
    }

    /// Writes the flipped triangles back to their places.
    fn write(&self, triangles: &mut Vec<Triangle>) {
        let mut new: Vec<Triangle> = Vec::new();
        let mut gone = Vec::new();
        for (number, _) in self.flipped.iter().enumerate().filter(|(_, f)| **f) {
            let mut t = self.slots[number].corners.map(|v| self.ids.id(v as usize));
            t.sort_unstable();
            new.push(t);
            gone.push(self.numbers[number]);
        }
        new.sort_unstable();
        let (mut numbers, mut gone) = (0.., gone.into_iter().peekable());
        triangles.retain(|_| {
            let number = numbers.next().map(TriangleIndex::new);
            gone.next_if(|gone| number == Some(*gone)).is_none()
        });
        merge(triangles, new.into_iter());
    }
}

/// The index of the corner after corner `k`; two bits for each.
#[inline]
fn next(k: usize) -> usize {
    0b00_10_01 >> (2 * k) & 3
}

/// The index of the corner before corner `k`.
#[inline]
fn last(k: usize) -> usize {
    0b01_00_10 >> (2 * k) & 3
}

#[inline]
fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    (x * x + y * y + z * z).sqrt()
}

/// The unit normal of a triangle.
#[inline]
fn normal(points: &[Point], [a, b, c]: [u32; 3]) -> [f32; 3] {
    let at = |v: u32| points[v as usize];
    let (u, v) = (difference(at(a), at(b)), difference(at(a), at(c)));
    [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]
}

/// Scales a vector to unit length; NaN if it is zero.
#[inline]
fn unit([x, y, z]: [f32; 3]) -> [f32; 3] {
    let inverse = 1.0 / (x * x + y * y + z * z).sqrt();
    [x * inverse, y * inverse, z * inverse]
}

#[inline]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector from `a` to `b`.
#[inline]
fn difference(a: Point, b: Point) -> [f32; 3] {
    // Differences of coordinates in 0..2^30 fit 32 bits.
    std::array::from_fn(|k| b[k].wrapping_sub(a[k]) as f32)
}

/// The square of twice a triangle's area divided by its two longest sides; zero only if it is degenerate.
fn slenderness([a, b, c]: [Point; 3]) -> f64 {
    let square = |v: [i64; 3]| {
        let [x, y, z] = v.map(|x| x as f64);
        x * x + y * y + z * z
    };
    let (ab, bc, ca) = (square(sub(b, a)), square(sub(c, b)), square(sub(a, c)));
    square(small_normal(a, b, c)) * ab.min(bc).min(ca) / (ab * bc * ca)
}
