//! Relative orientations of homes, for test IV of section 7.

/// A triangle's orientation as seen from a home: turned (i → k → j) or not (i → j → k).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Side {
    pub home: usize,
    pub turned: bool,
}

/// Which homes are joined with which, and how they lie to each other.
///
/// Every home has a label; homes with the same label are joined. `turned` relates a home to the
/// frame of its label.
#[derive(Debug, Clone)]
pub struct Homes {
    label: Vec<Side>,
}

impl Homes {
    /// `count` homes, each by itself.
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

    /// The same orientation seen from the label of its home.
    pub fn seen_from_label(&self, side: Side) -> Side {
        let label = self.label[side.home];
        Side {
            home: label.home,
            turned: label.turned != side.turned,
        }
    }

    /// The label of a home.
    pub fn label(&self, home: usize) -> usize {
        self.label[home].home
    }

    /// True if two of the asked-for orientations of one triangle contradict each other: their
    /// homes are joined (or the same) and they see it turned differently.
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

    /// Joins two homes so that both sides are one orientation of one triangle.
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

    /// Joins all homes that ask for an orientation of one triangle.
    pub fn join_all(&mut self, asked: &[Side]) {
        for pair in asked.windows(2) {
            self.join(pair[0], pair[1]);
        }
    }
}
