//! Relative orientations of components, for test IV of section 7.

/// A triangle's orientation relative to a component: turned (i → k → j) or not (i → j → k).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Side {
    pub home: usize,
    pub turned: bool,
}

/// Merged components and their relative orientations.
///
/// Every component has a label; components with the same label are merged. `turned` is the orientation of a
/// component relative to its label.
#[derive(Debug, Clone)]
pub struct Homes {
    label: Vec<Side>,
}

impl Homes {
    /// `count` components, none merged.
    pub fn apart(count: usize) -> Self {
        Self {
            label: (0..count)
                .map(|home| Side {
                    home,
                    turned: false,
                })
                .collect(),
        }
    }

    /// The same orientation relative to the label of its component.
    pub fn seen_from_label(&self, side: Side) -> Side {
        let label = self.label[side.home];
        Side {
            home: label.home,
            turned: label.turned != side.turned,
        }
    }

    /// The label of a component.
    pub fn label(&self, home: usize) -> usize {
        self.label[home].home
    }

    /// True if two of the implied orientations of one triangle contradict each other: their components are
    /// merged (or the same) and the orientations differ.
    pub fn conflict(&self, asked: &[Side]) -> bool {
        let seen: Vec<Side> = asked
            .iter()
            .map(|&side| self.seen_from_label(side))
            .collect();
        seen.iter().any(|a| {
            seen.iter()
                .any(|b| a.home == b.home && a.turned != b.turned)
        })
    }

    /// Merges two components so that both sides are one orientation of one triangle.
    pub fn join(&mut self, a: Side, b: Side) {
        let (a, b) = (self.seen_from_label(a), self.seen_from_label(b));
        assert!(
            a.home != b.home || a.turned == b.turned,
            "joined against an earlier join"
        );
        if a.home == b.home {
            return;
        }
        for label in &mut self.label {
            if label.home == b.home {
                label.home = a.home;
                label.turned ^= a.turned != b.turned;
            }
        }
    }

    /// Merges all components that imply an orientation of one triangle.
    pub fn join_all(&mut self, asked: &[Side]) {
        for pair in asked.windows(2) {
            self.join(pair[0], pair[1]);
        }
    }
}
