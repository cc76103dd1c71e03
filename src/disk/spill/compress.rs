//! Compression of packed rows with Zstandard.
//!
//! Packed rows end with zeros, compressed ones with [`MARK`], so each section says itself what it is, and a
//! run that is resumed may go on with another setting.

use std::borrow::Cow;

/// The last byte of compressed rows.
const MARK: u8 = 1;

/// Least number of bytes that are compressed: below it a frame's head and tables take what it saves.
const LEAST: usize = 512;

/// Largest ratio of compression; what would become smaller stays packed. So a few bytes of a damaged file
/// cannot claim much memory.
const MOST_RATIO: usize = 64;

/// Compresses packed rows at a level, if that makes them smaller.
pub(super) fn compress(packed: Vec<u8>, level: Option<i32>) -> Vec<u8> {
    let Some(level) = level.filter(|_| packed.len() >= LEAST) else {
        return packed;
    };
    match zstd::bulk::compress(&packed, level) {
        Ok(mut frame) if frame.len() + 1 < packed.len() => {
            if packed.len() > MOST_RATIO * frame.len() {
                return packed;
            }
            frame.push(MARK);
            frame
        }
        _ => packed,
    }
}

/// The packed rows of a section; `None` if they do not decompress.
pub(super) fn expand(bytes: &[u8]) -> Option<Cow<'_, [u8]>> {
    let Some((&MARK, frame)) = bytes.split_last() else {
        return Some(Cow::Borrowed(bytes));
    };
    let claimed = zstd::zstd_safe::get_frame_content_size(frame).ok()??;
    let room = usize::try_from(claimed).ok()?;
    let fits = room <= MOST_RATIO.saturating_mul(frame.len());
    let packed = fits.then(|| zstd::bulk::decompress(frame, room).ok());
    packed.flatten().map(Cow::Owned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]
        #[test]
        fn packed_rows_come_back(
            bytes in prop::collection::vec(0u8..9, 0..9000),
            level in prop::option::of(1i32..6),
        ) {
            let packed = [&bytes[..], &[0; 4]].concat();
            let stored = compress(packed.clone(), level);
            prop_assert!(stored.len() <= packed.len());
            prop_assert_eq!(stored == packed, level.is_none() || packed.len() < LEAST);
            prop_assert_eq!(&*expand(&stored).unwrap(), &packed[..]);
        }

        /// Any bytes give some or `None`.
        #[test]
        fn no_bytes_are_too_bad(
            mut bytes in prop::collection::vec(any::<u8>(), 0..2000),
            place in any::<prop::sample::Index>(),
        ) {
            let mut stored = compress([vec![3; 700], bytes.clone(), vec![0; 4]].concat(), Some(1));
            let place = place.index(stored.len() - 1);
            stored[place] ^= 64;
            let _ = expand(&stored);
            bytes.push(MARK);
            let _ = expand(&bytes);
        }
    }

    #[test]
    fn few_bytes_cannot_claim_much_memory() {
        let zeros = vec![0; 1 << 20];
        assert_eq!(compress(zeros.clone(), Some(1)), zeros);
        let mut frame = zstd::bulk::compress(&zeros, 1).unwrap();
        frame.push(MARK);
        assert!(expand(&frame).is_none());
    }
}
