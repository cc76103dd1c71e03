//! Which points follow the point before them (docs/method.md, section 4.3): two bits for two ids.

use crate::levels::Levels;

/// Ids from a multiple of this number on can be copied.
const WHOLE: usize = 8;

/// The points of a range that follow their leaders. Only points with odd ids can.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Followers(Levels);

/// The id of the point that a point can follow; `None` if it is a leader.
pub(super) fn leader(id: usize) -> Option<usize> {
    id.checked_sub(1).filter(|_| !id.is_multiple_of(2))
}

impl Followers {
    /// No followers among `count` points.
    pub fn new(count: usize) -> Self {
        Self(Levels::new(count.div_ceil(2)))
    }

    /// Bytes for `count` points.
    pub fn size(count: usize) -> u64 {
        Levels::size(count.div_ceil(2))
    }

    /// True if the point follows its leader.
    pub fn contains(&self, id: usize) -> bool {
        leader(id).is_some() && self.0.get(id / 2) > 0
    }

    /// Adds a point with an odd id.
    pub fn add(&mut self, id: usize) {
        debug_assert!(leader(id).is_some());
        self.0.set(id / 2, 1);
    }

    /// Removes a point; false if it was not one of them.
    pub fn remove(&mut self, id: usize) -> bool {
        let contains = self.contains(id);
        if contains {
            self.0.clear(id / 2);
        }
        contains
    }

    /// Copies those of others to the ids from `first` on, a multiple of eight.
    pub fn put(&mut self, first: usize, others: &Self) {
        debug_assert!(first.is_multiple_of(WHOLE));
        self.0.put(first / 2, &others.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn followers_are_those_that_were_added(
            follows in prop::collection::vec(any::<bool>(), 1..40),
            first in 0usize..4,
        ) {
            let mut part = Followers::new(follows.len());
            let odd = |id: &usize| id % 2 == 1 && follows[*id];
            for id in (0..follows.len()).filter(odd) {
                part.add(id);
            }
            let first = WHOLE * first;
            let mut all = Followers::new(first + follows.len());
            all.put(first, &part);
            for id in 0..follows.len() {
                prop_assert_eq!(all.contains(first + id), odd(&id));
                prop_assert_eq!(all.remove(first + id), odd(&id));
                prop_assert!(!all.contains(first + id));
            }
        }
    }
}
