//! Rounding without a function call: base x86-64 has no instruction for it.

/// The nearest integer, halves away from zero, as [`f64::round`]; clamped to the range of the integer.
#[inline]
#[must_use]
pub fn rounded(x: f64) -> i64 {
    let whole = x as i64;
    let rest = x - whole as f64;
    whole.saturating_add(i64::from(rest >= 0.5) - i64::from(rest <= -0.5))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rounding_is_to_the_nearest(x in -(1 << 24)..=1i32 << 24, part in -1.0f64..1.0) {
            for x in [f64::from(x) + part, f64::from(x) + 0.5, 0.499_999_999_999_999_94] {
                prop_assert_eq!(rounded(x), x.round() as i64);
                prop_assert_eq!(rounded(-x), (-x).round() as i64);
            }
        }

        #[test]
        fn large_numbers_are_as_near_as_can_be(bits in any::<u64>()) {
            let x = f64::from_bits(bits);
            prop_assert_eq!(rounded(x), x.round() as i64);
        }
    }
}
