//! The volume that a closed mesh encloses: a sum over its triangles that is exact, so that their order does not
//! matter. Only the volume of the tetrahedron of each triangle is rounded.

/// Binary digits of a bin.
const DIGITS: i32 = 32;

/// Bins for all finite numbers: exponents of the last digit from -1074 to 971.
const BINS: usize = (2046 / DIGITS + 1) as usize;

/// Sums of tetrahedra between triangles and an origin.
#[derive(Debug, Clone)]
pub(super) struct Volume {
    /// A corner of all tetrahedra, near the mesh.
    pub origin: [f64; 3],
    /// Integers of 85 digits at most, each times a power of 2; they have room for 2^42 of them.
    bins: Box<[i128; BINS]>,
    /// True if a number was too large.
    is_lost: bool,
}

impl Default for Volume {
    fn default() -> Self {
        Self::from([0.0; 3])
    }
}

impl Volume {
    /// Without triangles; `origin` must not depend on their order.
    pub fn from(origin: [f64; 3]) -> Self {
        Self {
            origin: match origin.iter().all(|c| c.is_finite()) {
                true => origin,
                false => [0.0; 3],
            },
            bins: Box::new([0; BINS]),
            is_lost: false,
        }
    }

    /// Adds a triangle, given from any of its corners on.
    pub fn add(&mut self, corners: [[f64; 3]; 3]) {
        let least = (0..3).min_by(|a, b| order(&corners[*a], &corners[*b]));
        let first = least.unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|k| {
            let p = corners[(first + k) % 3];
            [0, 1, 2].map(|axis| p[axis] - self.origin[axis])
        });
        let six = a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        if !six.is_finite() {
            self.is_lost = true;
            return;
        }
        let bits = six.to_bits();
        let exponent = (bits >> 52 & 0x7ff) as i32;
        let mantissa = bits & ((1 << 52) - 1);
        let (mantissa, place) = match exponent {
            0 => (mantissa, 0),
            _ => (mantissa | 1 << 52, exponent - 1),
        };
        let part = i128::from(mantissa) << (place % DIGITS);
        let bin = &mut self.bins[(place / DIGITS) as usize];
        *bin += if six < 0.0 { -part } else { part };
    }

    /// Adds what another one has.
    pub fn join(&mut self, other: &Self) {
        self.is_lost |= other.is_lost;
        for (bin, more) in self.bins.iter_mut().zip(&*other.bins) {
            *bin += more;
        }
    }

    /// The volume; none if it is beyond all numbers.
    pub fn value(&self) -> Option<f64> {
        let (carry, parts) = self.parts(1);
        // Below zero the highest digits would cancel.
        let (carry, parts, sign) = match carry < 0 {
            true => {
                let (carry, parts) = self.parts(-1);
                (carry, parts, -1.0)
            }
            false => (carry, parts, 1.0),
        };
        let part = |digits: i128, bin: usize| match digits {
            0 => 0.0,
            _ => {
                let exponent = bin as i32 * DIGITS - 1074;
                let half = exponent / 2;
                digits as f64 * 2f64.powi(half) * 2f64.powi(exponent - half)
            }
        };
        let mut sum = part(carry, BINS);
        for (bin, digits) in parts.iter().enumerate().rev() {
            sum += part(*digits, bin);
        }
        let volume = sign * sum / 6.0;
        (volume.is_finite() && !self.is_lost).then_some(volume)
    }

    /// The sum times a sign: digits for each bin, none negative, and what is above all bins.
    fn parts(&self, sign: i128) -> (i128, Vec<i128>) {
        let mut carry = 0i128;
        let parts = self.bins.iter().map(|bin| {
            let all = sign * bin + carry;
            carry = all >> DIGITS;
            all - (carry << DIGITS)
        });
        let parts = parts.collect();
        (carry, parts)
    }
}

fn order(a: &[f64; 3], b: &[f64; 3]) -> std::cmp::Ordering {
    let axes = (0..3).map(|k| a[k].total_cmp(&b[k]));
    axes.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron of volume 1/6 from `at`, of this size.
    fn corner(at: [f64; 3], size: f64) -> [[[f64; 3]; 3]; 4] {
        let p = |k: usize| {
            let mut p = at;
            if k > 0 {
                p[k - 1] += size;
            }
            p
        };
        [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|t| t.map(p))
    }

    #[test]
    fn volumes_add_up_in_any_order() {
        for (at, size) in [
            ([0.0; 3], 1.0),
            ([635_000.0, 4_848_000.0, 120.0], 0.5),
            ([1e-200; 3], 1e-90),
            ([-3.0, 2.0, 1.0], 1e60),
        ] {
            let triangles = corner(at, size);
            let mut volume = Volume::from(at);
            triangles.iter().for_each(|t| volume.add(*t));
            let expected = size * size * size / 6.0;
            let found = volume.value().unwrap();
            assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
            let mut other = Volume::from(at);
            let mut rest = Volume::from(at);
            for (n, [a, b, c]) in triangles.iter().rev().enumerate() {
                let one = if n % 2 == 0 { &mut other } else { &mut rest };
                one.add([*b, *c, *a]);
            }
            other.join(&rest);
            assert_eq!(other.value(), volume.value());
        }
        // Inside out.
        let mut volume = Volume::default();
        corner([0.0; 3], 1.0)
            .iter()
            .for_each(|[a, b, c]| volume.add([*a, *c, *b]));
        assert_eq!(volume.value(), Some(-1.0 / 6.0));
    }

    #[test]
    fn what_is_too_large_has_no_volume() {
        let mut volume = Volume::default();
        volume.add([[1e200, 0.0, 0.0], [0.0, 1e200, 0.0], [0.0, 0.0, 1e200]]);
        assert_eq!(volume.value(), None);
    }
}
