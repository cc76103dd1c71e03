//! Colours of vertices in linear light, as glTF has them, from those of the scan (sRGB in 8 bits).

/// sRGB, 0 to 1, as linear light.
fn linear(x: f64) -> f64 {
    match x <= 0.040_45 {
        true => x / 12.92,
        false => ((x + 0.055) / 1.055).powf(2.4),
    }
}

/// The inverse of [`linear`].
fn encoded(x: f64) -> f64 {
    match x <= 0.003_130_8 {
        true => x * 12.92,
        false => 1.055 * x.powf(1.0 / 2.4) - 0.055,
    }
}

/// Largest error of a component, in steps of sRGB: rounded it is what it was.
const ERROR: f64 = 0.3;

/// The components in 16 bits of linear light by those in 8 bits of sRGB: 8 bits of linear light cannot tell dark
/// components apart. Of the numbers that are near enough those with the most low bits of zero, which compress best:
/// the brightest (from 194) need one byte.
pub(super) fn table() -> [u16; 256] {
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
}
