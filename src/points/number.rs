//! Numbers in text.

/// Stands for the number of decimals of a number with an exponent.
pub const NOT_FIXED: u32 = u32::MAX;

/// Parses a number; raises `decimals` to its number of decimals, or to [`NOT_FIXED`] if it has an exponent.
/// Words for infinity and NaN are accepted.
pub fn parse(token: &[u8], decimal_comma: bool, decimals: &mut u32) -> Option<f64> {
    let mut copy = [0u8; 64];
    let token = if decimal_comma {
        // Longer tokens are not numbers.
        let copy = copy.get_mut(..token.len())?;
        for (to, from) in copy.iter_mut().zip(token) {
            *to = if *from == b',' { b'.' } else { *from };
        }
        &*copy
    } else {
        token
    };
    let text = std::str::from_utf8(token).ok()?;
    let value = match text.parse::<f64>() {
        Ok(value) => value,
        Err(_) if is_windows_nan(token) => f64::NAN,
        Err(_) => return None,
    };
    if value.is_finite() {
        let is_other = |b: &u8| !matches!(b, b'0'..=b'9' | b'+' | b'-');
        let found = match token.iter().position(is_other) {
            None => 0,
            Some(dot) if token[dot + 1..].iter().all(u8::is_ascii_digit) && token[dot] == b'.' => {
                (token.len() - dot - 1) as u32
            }
            Some(_) => NOT_FIXED,
        };
        *decimals = (*decimals).max(found);
    }
    Some(value)
}

/// `1.#QNAN`, `-1.#IND`, `-nan(ind)` and the like, as the Microsoft runtime writes them.
fn is_windows_nan(token: &[u8]) -> bool {
    let token = token.strip_prefix(b"-").unwrap_or(token);
    let lower = token.to_ascii_lowercase();
    lower.starts_with(b"1.#") || lower.starts_with(b"nan(")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_decimals() {
        let mut decimals = 0;
        assert_eq!(parse(b"-12.250", false, &mut decimals), Some(-12.25));
        assert_eq!(decimals, 3);
        assert_eq!(parse(b"7", false, &mut decimals), Some(7.0));
        assert_eq!(parse(b"1,5", true, &mut decimals), Some(1.5));
        assert_eq!(parse(b"1,5", false, &mut decimals), None);
        assert!(parse(b"nan", false, &mut decimals).unwrap().is_nan());
        assert!(parse(b"-1.#IND", false, &mut decimals).unwrap().is_nan());
        assert_eq!(decimals, 3);
        assert_eq!(parse(b"1e-3", false, &mut decimals), Some(1e-3));
        assert_eq!(decimals, NOT_FIXED);
    }
}
