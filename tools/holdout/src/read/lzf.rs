//! LZF, the compression of PCD files. The one crate in use is no longer maintained.

/// Unpacks exactly `length` bytes; None if `packed` does not hold them.
pub(super) fn unpack(packed: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(length.min(packed.len().saturating_mul(264)));
    let mut rest = packed;
    while out.len() < length {
        let (&control, after) = rest.split_first()?;
        rest = after;
        let control = usize::from(control);
        if control < 32 {
            let (literal, after) = rest.split_at_checked(control + 1)?;
            out.extend_from_slice(literal);
            rest = after;
            continue;
        }
        let mut count = control >> 5;
        if count == 7 {
            let (&more, after) = rest.split_first()?;
            count += usize::from(more);
            rest = after;
        }
        let (&low, after) = rest.split_first()?;
        rest = after;
        let back = ((control & 31) << 8 | usize::from(low)) + 1;
        let from = out.len().checked_sub(back)?;
        // Source and target may overlap, so bytes are copied one by one.
        for at in from..from + count + 2 {
            out.push(out[at]);
        }
    }
    (out.len() == length && rest.is_empty()).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::unpack;
    use proptest::prelude::*;

    #[test]
    fn literals_and_copies() {
        assert_eq!(unpack(&[2, b'a', b'b', b'c'], 3), Some(b"abc".to_vec()));
        // "ab", then 5 bytes from 2 back, then 9 + 3 from 1 back.
        let packed = [1, b'a', b'b', 3 << 5, 1, 7 << 5, 3, 0];
        assert_eq!(unpack(&packed, 19), Some(b"abababaaaaaaaaaaaaa".to_vec()));
        assert_eq!(unpack(&packed, 18), None);
        assert_eq!(unpack(&packed[..6], 19), None);
        // A reference to before the start.
        assert_eq!(unpack(&[0, b'a', 1 << 5, 1], 4), None);
    }

    proptest! {
        #[test]
        fn any_bytes_are_survived(packed in prop::collection::vec(any::<u8>(), 0..300), length in 0usize..5000) {
            if let Some(out) = unpack(&packed, length) {
                prop_assert_eq!(out.len(), length);
            }
        }
    }
}
