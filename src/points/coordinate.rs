//! Coordinates as files store them.

/// A coordinate as a file stores it.
pub trait Coordinate: bytemuck::Pod + PartialEq + Into<f64> {
    /// True for floating-point numbers.
    const FLOATING: bool = true;
    /// False for infinity and NaN.
    fn is_finite(self) -> bool {
        let value: f64 = self.into();
        value.is_finite()
    }
    /// The highest power of two of which the value is a multiple; `i32::MAX` for zero.
    fn exponent(self) -> i32 {
        let value: f64 = self.into();
        let bits = value.to_bits();
        let power = (bits >> 52 & 0x7ff) as i32;
        let fraction = bits & ((1 << 52) - 1);
        match (power, fraction) {
            (0, 0) => i32::MAX,
            (0, _) => -1074 + fraction.trailing_zeros() as i32,
            _ => power - 1075 + (fraction | 1 << 52).trailing_zeros() as i32,
        }
    }
}

impl Coordinate for f32 {}

impl Coordinate for f64 {}

impl Coordinate for i32 {
    const FLOATING: bool = false;

    fn is_finite(self) -> bool {
        true
    }
    fn exponent(self) -> i32 {
        0
    }
}
