//! Colours of vertices in linear light, as glTF has them, from those of the scan (sRGB in 8 or 16 bits).

use std::sync::LazyLock;

/// sRGB, 0 to 1, as linear light.
fn linear(x: f64) -> f64 {
    match x <= 0.040_45 {
        true => x / 12.92,
        false => libm::pow((x + 0.055) / 1.055, 2.4),
    }
}

/// The inverse of [`linear`].
fn encoded(x: f64) -> f64 {
    match x <= 0.003_130_8 {
        true => x * 12.92,
        false => 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055,
    }
}

/// The component of 8 bits in sRGB of linear light from 0 to 1.
#[must_use]
pub fn byte_of(x: f64) -> u8 {
    (encoded(x) * 255.0).round() as u8
}

/// Largest error of a component, in steps of sRGB: rounded it is what it was.
const ERROR: f64 = 0.3;

/// Linear light of components of 8 bits.
static OF_BYTES: LazyLock<[u16; 256]> = LazyLock::new(table);

/// Linear light of components of 16 bits.
static OF_WORDS: LazyLock<Vec<u16>> = LazyLock::new(|| {
    let exact = |x: u16| linear(f64::from(x) / 65535.0) * 65535.0;
    (0..=u16::MAX).map(|x| exact(x).round() as u16).collect()
});

/// A component of 8 bits in 16 bits of linear light: 8 bits of that cannot tell dark components apart.
#[inline]
pub fn of_byte(component: u8) -> u16 {
    OF_BYTES[usize::from(component)]
}

/// A component of 16 bits in as many of linear light. The darkest differ by less than a step of it.
#[inline]
pub fn of_word(component: u16) -> u16 {
    OF_WORDS[usize::from(component)]
}

/// The components in 16 bits of linear light by those in 8 bits of sRGB. Of the numbers that are near enough those
/// with the most low bits of zero, which compress best: the brightest (from 194) need one byte.
fn table() -> [u16; 256] {
    std::array::from_fn(|component| {
        let exact = linear(component as f64 / 255.0) * 65535.0;
        let near = |bits: &i32| {
            let number = (exact / 2f64.powi(*bits)).round() * 2f64.powi(*bits);
            let back = encoded(number / 65535.0) * 255.0;
            let is_near = number < 65536.0 && (back - component as f64).abs() <= ERROR;
            is_near.then_some(number as u16)
        };
        // White is 65535, all bits.
        match component {
            255 => u16::MAX,
            _ => (0..=8)
                .rev()
                .find_map(|bits| near(&bits))
                .unwrap_or(exact.round() as u16),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_come_back_and_bright_ones_have_one_byte() {
        let table = table();
        assert_eq!((table[0], table[255]), (0, 65535));
        for (component, number) in table.iter().enumerate() {
            let back = encoded(f64::from(*number) / 65535.0) * 255.0;
            assert!(
                (back - component as f64).abs() <= ERROR,
                "{component}: {back}"
            );
            assert!(component == 0 || *number > table[component - 1]);
            assert!(
                component < 194 || component == 255 || number % 256 == 0,
                "{component}: {number}"
            );
        }
        // Middle grey of sRGB has a fifth of the light of white.
        assert!((f64::from(table[128]) / 65535.0 - 0.2158).abs() < 0.004);
    }

    #[test]
    fn wide_components_are_those_of_bytes_where_they_meet() {
        assert_eq!((of_word(0), of_word(u16::MAX)), (0, u16::MAX));
        for component in 0..=255u8 {
            let (wide, narrow) = (of_word(u16::from(component) * 257), of_byte(component));
            let back = encoded(f64::from(wide) / 65535.0) * 255.0;
            assert!(
                (back - f64::from(component)).abs() < 0.05,
                "{component}: {back}"
            );
            assert!(wide.abs_diff(narrow) <= 256, "{component}: {wide} {narrow}");
        }
        assert!((1..=u16::MAX).all(|x| of_word(x) >= of_word(x - 1)));
    }
}
