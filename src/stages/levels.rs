//! A number from 0 to 3, such as the level of noise, for each point of a range, four in a byte.

use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;
use std::ops::Range;

/// The highest level of noise, and the largest number of rounds of smoothing that it asks for.
pub const HIGHEST: u8 = 3;

/// Numbers in a byte.
const EACH: usize = 4;

/// Numbers from 0 to 3 by place.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Levels(Vec<u8>);

/// Numbers with a reservation of their memory.
#[derive(Debug)]
pub struct HeldLevels {
    levels: Levels,
    _held: Reservation,
}

impl HeldLevels {
    /// Reserves the memory under a name.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Memory`].
    pub fn open(levels: Levels, name: &'static str, workspace: &Workspace) -> Result<Self> {
        let held = workspace.reserve(name, levels.bytes())?;
        Ok(Self {
            levels,
            _held: held,
        })
    }
}

impl std::ops::Deref for HeldLevels {
    type Target = Levels;

    fn deref(&self) -> &Levels {
        &self.levels
    }
}

impl Levels {
    /// Zeros.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self(vec![0; count.div_ceil(EACH)])
    }

    /// Bytes for a number of places.
    #[must_use]
    pub fn size(count: usize) -> u64 {
        count.div_ceil(EACH) as u64
    }

    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.0.len() as u64
    }

    /// True if there is no place.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// True if a number in this range of places, which begins with a whole byte, is not 0.
    #[must_use]
    pub fn any(&self, places: &Range<usize>) -> bool {
        let bytes = places.start / EACH..places.end.div_ceil(EACH);
        self.0[bytes].iter().any(|byte| *byte != 0)
    }

    /// The number at a place.
    #[must_use]
    #[inline(always)]
    pub fn get(&self, place: usize) -> u8 {
        self.0[place / EACH] >> (2 * (place % EACH)) & 3
    }

    /// Sets the number at a place where it is 0.
    pub fn set(&mut self, place: usize, level: u8) {
        self.0[place / EACH] |= level << (2 * (place % EACH));
    }

    /// Sets the number at a place to 0.
    pub fn clear(&mut self, place: usize) {
        self.0[place / EACH] &= !(3 << (2 * (place % EACH)));
    }

    /// Copies numbers to the places from `first` on, a multiple of four.
    pub fn put(&mut self, first: usize, levels: &Self) {
        self.0[first / EACH..][..levels.0.len()].copy_from_slice(&levels.0);
    }

    /// Copies the numbers of a range of places, which are 0 here, from the first numbers of others.
    pub fn put_range(&mut self, places: Range<usize>, levels: &Self) {
        let first = places.start;
        for place in places {
            self.set(place, levels.get(place - first));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_come_back(levels in prop::collection::vec(0u8..4, 0..40), first in 0usize..5) {
            let mut part = Levels::new(levels.len());
            for (place, level) in levels.iter().enumerate() {
                part.set(place, *level);
            }
            let mut all = Levels::new(4 * first + levels.len());
            all.put(4 * first, &part);
            prop_assert!(levels.iter().enumerate().all(|(i, l)| all.get(4 * first + i) == *l));
            prop_assert!(!all.any(&(0..4 * first)));
            let places = 4 * first..4 * first + levels.len();
            prop_assert_eq!(all.any(&places), levels.iter().any(|l| *l > 0));
        }
    }
}
