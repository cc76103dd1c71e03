//! Packed pages: each coordinate is a difference to the lowest one of its page, in as few bits as the largest
//! difference takes.
//!
//! A page is cut into blocks of [`BLOCK`] points; the last one is filled with the lowest coordinates. A block
//! has all x, then all y, then all z. Where all differences of a page are multiples of a power of two, as
//! those of a scan on a refined lattice are, their zero bits are left out.

use super::bits::{self, BLOCK};
use outcrop_geom::Point;
use outcrop_geom::aabb::Aabb;

/// The layout of a packed page.
#[derive(Debug, Clone, Copy)]
pub(super) struct Packing {
    min: Point,
    /// Zero bits at the low end of every difference, which are left out.
    shift: u8,
    /// Bits of a difference along each axis.
    bits: [u8; 3],
}

impl Packing {
    /// The layout of a page with these bounds.
    pub fn of(bounds: &Aabb, shift: u8) -> Self {
        let Aabb { min, max } = *bounds;
        let shift = shift.min(31);
        let bits = |axis: usize| {
            let largest = max[axis].wrapping_sub(min[axis]).cast_unsigned() >> shift;
            (u32::BITS - largest.leading_zeros()) as u8
        };
        Self {
            min,
            shift,
            bits: [0, 1, 2].map(bits),
        }
    }

    /// Bytes of a page of `points` points.
    pub fn bytes(&self, points: usize) -> usize {
        let block: usize = self.bits.iter().map(|bits| bits::size(*bits)).sum();
        points.div_ceil(BLOCK) * block
    }

    /// Writes the points of a page in columns, each as long as there are points; `bytes` must have the length
    /// of the page.
    pub fn unpack(&self, mut bytes: &[u8], columns: [&mut [i32]; 3]) {
        let mut values = [0; BLOCK];
        let [x, y, z] = columns;
        let blocks = x
            .chunks_mut(BLOCK)
            .zip(y.chunks_mut(BLOCK))
            .zip(z.chunks_mut(BLOCK));
        for ((x, y), z) in blocks {
            for (axis, column) in [x, y, z].into_iter().enumerate() {
                let (block, rest) = bytes.split_at(bits::size(self.bits[axis]));
                bits::unpack(block, self.bits[axis], &mut values);
                for (to, value) in column.iter_mut().zip(&values) {
                    *to = self.min[axis].wrapping_add((value << self.shift).cast_signed());
                }
                bytes = rest;
            }
        }
    }
}

/// Appends a packed page to `bytes`; returns its bounds and its shift.
pub(super) fn pack(page: &[Point], bytes: &mut Vec<u8>) -> (Aabb, u8) {
    let bounds = Aabb::of(page);
    let difference =
        |point: &Point, axis: usize| (point[axis].wrapping_sub(bounds.min[axis])).cast_unsigned();
    let all = |all, point| (0..3).fold(all, |all, axis| all | difference(point, axis));
    // A single position has differences of zero, and no bits at any shift.
    let shift = page.iter().fold(0, all).trailing_zeros().min(31) as u8;
    let packing = Packing::of(&bounds, shift);
    let start = bytes.len();
    bytes.resize(start + packing.bytes(page.len()), 0);
    let mut left = &mut bytes[start..];
    for block in page.chunks(BLOCK) {
        let mut values = [[0; BLOCK]; 3];
        let [x, y, z] = &mut values;
        for (((x, y), z), point) in x.iter_mut().zip(y).zip(z).zip(block) {
            *x = difference(point, 0) >> shift;
            *y = difference(point, 1) >> shift;
            *z = difference(point, 2) >> shift;
        }
        for (values, bits) in values.iter().zip(packing.bits) {
            let (to, rest) = left.split_at_mut(bits::size(bits));
            bits::pack(values, bits, to);
            left = rest;
        }
    }
    (bounds, shift)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn comes_back(page: &[Point]) -> usize {
        let mut bytes = vec![7];
        let (bounds, shift) = pack(page, &mut bytes);
        assert_eq!(bounds, Aabb::of(page));
        let packing = Packing::of(&bounds, shift);
        assert_eq!(bytes.len(), 1 + packing.bytes(page.len()));
        assert!(bytes.len() <= 1 + page.len().next_multiple_of(BLOCK) * 12);
        let mut columns = [0, 1, 2].map(|_| vec![-1; page.len()]);
        packing.unpack(&bytes[1..], columns.each_mut().map(Vec::as_mut_slice));
        let [x, y, z] = &columns;
        let back: Vec<Point> = (0..page.len()).map(|n| [x[n], y[n], z[n]]).collect();
        assert_eq!(back, page);
        bytes.len() - 1
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn any_page_comes_back(
            page in prop::collection::vec(prop::array::uniform3(0i32..1 << 30), 1..600),
            width in 0u32..31,
            zeros in 0u32..31,
        ) {
            let cut = |c: i32| ((c % (1 << width)) >> zeros) << zeros;
            comes_back(&page);
            comes_back(&page.iter().map(|p| p.map(cut)).collect::<Vec<_>>());
        }
    }

    #[test]
    fn bits_that_are_zero_everywhere_take_no_room() {
        let page: Vec<Point> = (0..256)
            .map(|n| [5 + (n << 10), 7 - ((n % 16) << 10), 3])
            .collect();
        assert_eq!(comes_back(&page), 256 * (8 + 4) / 8);
        assert_eq!(comes_back(&[[9, 9, 9]; 256]), 0);
    }
}
