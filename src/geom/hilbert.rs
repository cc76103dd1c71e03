//! The space-filling curve that orders points: a three-dimensional Hilbert curve with 30 bits for each axis.
//!
//! A key has 90 bits in three words, highest first, so comparing records compares keys. The map is a
//! bijection: the position can be computed from the key, so keys are sorted without a payload.
//!
//! The curve is evaluated with a table over 24 states (entry corner, direction). The state update is that of
//! Hamilton & Rau-Chaplin, *Compact Hilbert indices* (2008), section 2.

use super::Point;

/// Bits of each coordinate.
pub const BITS: u32 = 30;

/// A key of the curve, compared lexicographically. Each word holds 30 bits: ten levels of three bits.
pub type Key = [u32; 3];

const STATES: usize = 24;

/// Maps state and octant to digit and next state, and state and digit to octant and next state. Entries are
/// packed as `next state << 3 | result`.
struct Tables {
    digit: [[u8; 8]; STATES],
    octant: [[u8; 8]; STATES],
}

/// The same tables for two levels at a time, packed as `next state << 6 | result`. Digits are six bits of a
/// key; octants are two bits each of x, y and z.
struct Pairs {
    digits: [[u16; 64]; STATES],
    octants: [[u16; 64]; STATES],
}

static PAIRS: Pairs = pairs();

const fn rotate_left(bits: u32, by: u32) -> u32 {
    let by = by % 3;
    ((bits << by) | (bits >> (3 - by))) & 7
}

const fn rotate_right(bits: u32, by: u32) -> u32 {
    rotate_left(bits, 3 - by % 3)
}

const fn gray(i: u32) -> u32 {
    i ^ (i >> 1)
}

const fn entry(digit: u32) -> u32 {
    if digit == 0 {
        0
    } else {
        gray(2 * ((digit - 1) / 2))
    }
}

const fn direction(digit: u32) -> u32 {
    let of = if digit == 0 {
        return 0;
    } else if digit.is_multiple_of(2) {
        digit - 1
    } else {
        digit
    };
    // Number of trailing one bits: the axis along which the Gray code changes next.
    (!of).trailing_zeros() % 3
}

const fn tables() -> Tables {
    let mut t = Tables {
        digit: [[0; 8]; STATES],
        octant: [[0; 8]; STATES],
    };
    let mut state = 0;
    while state < STATES {
        let (e, d) = (state as u32 / 3, state as u32 % 3);
        let mut digit = 0;
        while digit < 8 {
            let octant = rotate_left(gray(digit), d + 1) ^ e;
            let next_e = e ^ rotate_left(entry(digit), d + 1);
            let next_d = (d + direction(digit) + 1) % 3;
            let next = (next_e * 3 + next_d) << 3;
            t.digit[state][octant as usize] = (next | digit) as u8;
            t.octant[state][digit as usize] = (next | octant) as u8;
            digit += 1;
        }
        state += 1;
    }
    // Checks that the two rotations are inverse, as the tables must be bijections.
    assert!(rotate_right(rotate_left(5, 2), 2) == 5);
    t
}

const fn pairs() -> Pairs {
    let single = tables();
    let mut pairs = Pairs {
        digits: [[0; 64]; STATES],
        octants: [[0; 64]; STATES],
    };
    let mut state = 0;
    while state < STATES {
        let mut digits = 0;
        while digits < 64 {
            let upper = single.octant[state][digits >> 3] as usize;
            let lower = single.octant[upper >> 3][digits & 7] as usize;
            // An octant has one bit each of x, y and z; a pair of levels has two.
            let (a, b) = (upper & 7, lower & 7);
            let x = (a >> 2) << 1 | b >> 2;
            let y = (a >> 1 & 1) << 1 | b >> 1 & 1;
            let z = (a & 1) << 1 | b & 1;
            let octants = x << 4 | y << 2 | z;
            let next = (lower >> 3) << 6;
            pairs.octants[state][digits] = (next | octants) as u16;
            pairs.digits[state][octants] = (next | digits) as u16;
            digits += 1;
        }
        state += 1;
    }
    pairs
}

/// The key of a position with coordinates in `0..2^30`.
#[must_use]
pub fn encode(p: Point) -> Key {
    let [x, y, z] = p.map(|c| c as u32);
    let mut key = [0u32; 3];
    let mut state = 0usize;
    for (word, out) in key.iter_mut().enumerate() {
        for pair in 0..5 {
            let shift = BITS - 2 - (word as u32 * 10 + 2 * pair);
            let octants = (x >> shift & 3) << 4 | (y >> shift & 3) << 2 | (z >> shift & 3);
            let step = PAIRS.digits[state][octants as usize];
            *out = *out << 6 | u32::from(step & 63);
            state = usize::from(step >> 6);
        }
    }
    key
}

/// The position of a key; the inverse of [`encode`].
#[must_use]
pub fn decode(key: Key) -> Point {
    let mut p = [0u32; 3];
    let mut state = 0usize;
    for word in key {
        for pair in 0..5 {
            let digits = word >> (24 - 6 * pair) & 63;
            let step = PAIRS.octants[state][digits as usize];
            let octants = u32::from(step);
            p = [
                p[0] << 2 | (octants >> 4 & 3),
                p[1] << 2 | (octants >> 2 & 3),
                p[2] << 2 | (octants & 3),
            ];
            state = usize::from(step >> 6);
        }
    }
    p.map(|c| c as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn decode_inverts_encode(p in prop::array::uniform3(0i32..1 << 30)) {
            let key = encode(p);
            prop_assert!(key.iter().all(|w| *w < 1 << 30));
            prop_assert_eq!(decode(key), p);
        }
    }

    #[test]
    fn neighbours_on_the_curve_are_neighbours_in_space() {
        let mut previous = decode([0, 0, 0]);
        for i in 1..1u32 << 15 {
            let p = decode([0, 0, i]);
            assert_eq!(
                crate::distance2(p, previous),
                1,
                "between {previous:?} and {p:?}"
            );
            previous = p;
        }
    }
}
