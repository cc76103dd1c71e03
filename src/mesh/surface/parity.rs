//! Union–find in which every member has an orientation relative to its set.

use outcrop_stages::ids::Number;
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// The constraint of an adjacent triangle on the orientation of another one: a label, and true if the other
/// triangle must be turned against this label.
pub type OrientationConstraint<T> = (T, bool);

/// A constraint in a word, `label << 1 | flip`.
#[derive(
    Debug,
    Clone,
    Copy,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    bytemuck::Pod,
    bytemuck::Zeroable,
)]
#[serde(transparent)]
#[repr(transparent)]
pub struct Turned<T> {
    word: u32,
    of: PhantomData<T>,
}

impl<T> Turned<T> {
    /// Stands for no label.
    pub const NONE: Self = Self::from_word(u32::MAX);

    const fn from_word(word: u32) -> Self {
        Self {
            word,
            of: PhantomData,
        }
    }

    /// The other orientation of the same label if `flip`.
    #[must_use]
    #[inline]
    pub fn turn(self, flip: bool) -> Self {
        Self::from_word(self.word ^ u32::from(flip))
    }
}

/// Packs a constraint in a word.
#[must_use]
#[inline]
pub fn word<T: Number>((label, flip): OrientationConstraint<T>) -> Turned<T> {
    Turned::from_word((label.index() as u32) << 1 | u32::from(flip))
}

/// Unpacks a word.
#[must_use]
#[inline]
pub fn constraint<T: Number>(turned: Turned<T>) -> OrientationConstraint<T> {
    (T::at((turned.word >> 1) as usize), turned.word & 1 == 1)
}

/// A weight, negative if `flip`.
#[inline]
pub fn signed(flip: bool, weight: i64) -> i64 {
    if flip { -weight } else { weight }
}

/// Sets of labels with relative orientations.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct ParitySets<T> {
    /// Parent and, in the lowest bit, orientation relative to the parent.
    parent: Vec<Turned<T>>,
}

impl<T: Number> ParitySets<T> {
    /// `count` sets of one label each.
    #[must_use]
    pub fn new(count: usize) -> Self {
        Self {
            parent: (0..count)
                .map(|label| word((T::at(label), false)))
                .collect(),
        }
    }

    /// Adds a set of one new label, and returns the label.
    pub fn push(&mut self) -> T {
        let label = T::at(self.parent.len());
        self.parent.push(word((label, false)));
        label
    }

    /// Number of labels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parent.len()
    }

    /// True if there is no label.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parent.is_empty()
    }

    /// The root of a label's set, and the label's orientation relative to the root.
    pub fn find(&mut self, label: T) -> (T, bool) {
        let mut node = label;
        let mut flip = false;
        loop {
            let (up, turned) = constraint(self.parent[node.index()]);
            if up == node {
                return (node, flip);
            }
            let above = self.parent[up.index()];
            let (top, more) = constraint(above);
            flip ^= turned;
            // Path halving: point at the grandparent.
            if top != up {
                self.parent[node.index()] = above.turn(turned);
                flip ^= more;
                node = top;
            } else {
                node = up;
            }
        }
    }

    /// Joins the sets of two labels, with `b` turned by `flip` against `a`; the root of `a` stays a root. If
    /// they are already in one set with the other relative orientation, nothing changes and the result is
    /// false.
    pub fn join(&mut self, a: T, b: T, flip: bool) -> bool {
        let (root_a, flip_a) = self.find(a);
        let (root_b, flip_b) = self.find(b);
        let turned = flip ^ flip_a ^ flip_b;
        if root_a == root_b {
            return !turned;
        }
        self.parent[root_b.index()] = word((root_a, turned));
        true
    }

    /// As [`ParitySets::join`], but the smaller of the two roots stays a root.
    pub fn join_to_smaller(&mut self, a: T, b: T, flip: bool) -> bool {
        let ((a, flip_a), (b, flip_b)) = (self.find(a), self.find(b));
        self.join(a.min(b), a.max(b), flip ^ flip_a ^ flip_b)
    }

    /// Makes the parent of every label its root.
    pub fn flatten(&mut self) {
        for label in 0..self.parent.len() {
            let (root, flip) = self.find(T::at(label));
            self.parent[label] = word((root, flip));
        }
    }

    /// As [`ParitySets::find`], without shortening paths.
    #[must_use]
    pub fn look(&self, label: T) -> (T, bool) {
        let (mut node, mut flip) = (label, false);
        loop {
            let (up, turned) = constraint(self.parent[node.index()]);
            if up == node {
                return (node, flip);
            }
            flip ^= turned;
            node = up;
        }
    }

    /// The relative orientation of two labels; `None` if they are in different sets.
    pub fn relation(&mut self, a: T, b: T) -> Option<bool> {
        let (root_a, flip_a) = self.find(a);
        let (root_b, flip_b) = self.find(b);
        (root_a == root_b).then_some(flip_a ^ flip_b)
    }

    /// True if `constraints` do not contradict each other, given the joined sets.
    #[must_use]
    pub fn allow(&mut self, constraints: &[OrientationConstraint<T>]) -> bool {
        constraints.iter().enumerate().all(|(x, &(a, flip_a))| {
            constraints[..x].iter().all(|&(b, flip_b)| {
                self.relation(a, b)
                    .is_none_or(|turned| turned == (flip_a ^ flip_b))
            })
        })
    }

    /// Joins the labels of `constraints`. If they contradict each other, nothing changes and the result is
    /// false.
    pub fn merge(&mut self, constraints: &[OrientationConstraint<T>]) -> bool {
        let fits = self.allow(constraints);
        if let (true, Some((&(first, flip), others))) = (fits, constraints.split_first()) {
            for &(other, turned) in others {
                self.join(first, other, flip ^ turned);
            }
        }
        fits
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Compares with a two-colouring by search.
        #[test]
        fn agrees_with_colouring(joins in prop::collection::vec((0u32..12, 0u32..12, any::<bool>()), 0..40)) {
            let mut sets = ParitySets::new(12);
            let mut accepted: Vec<(u32, u32, bool)> = Vec::new();
            let relation = |edges: &[(u32, u32, bool)], a: u32, b: u32| {
                let mut colour = [None; 12];
                colour[a as usize] = Some(false);
                for _ in 0..12 {
                    for &(x, y, f) in edges {
                        match (colour[x as usize], colour[y as usize]) {
                            (Some(c), None) => colour[y as usize] = Some(c ^ f),
                            (None, Some(c)) => colour[x as usize] = Some(c ^ f),
                            _ => {}
                        }
                    }
                }
                colour[b as usize]
            };
            for (a, b, flip) in joins {
                let known = relation(&accepted, a, b);
                prop_assert_eq!(sets.relation(a, b), known);
                let fits = known.is_none_or(|k| k == flip);
                prop_assert_eq!(sets.join(a, b, flip), fits);
                if fits { accepted.push((a, b, flip)); }
            }
        }
    }

    #[test]
    fn a_constraint_in_a_word_comes_back() {
        for (label, flip) in [(0u32, false), (0, true), (5, true), ((1 << 31) - 1, false)] {
            let turned = word((label, flip));
            assert_eq!(constraint(turned), (label, flip));
            assert_eq!(constraint(turned.turn(true)), (label, !flip));
            assert_eq!(turned.turn(false), turned);
            assert_eq!(
                bytemuck::cast::<_, u32>(turned),
                label << 1 | u32::from(flip)
            );
        }
    }
}
