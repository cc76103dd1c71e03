//! Moves noisy points to the surface around them, as far as they are noisy (docs/method.md, section 4.3).

use super::foot::{Feet, Foot, Settle};
use super::{Relaxing, moved};
use crate::spacing::spacing2;
use crate::tiles::near::{Around, Nearer};
use outcrop_geom::Point;
use outcrop_paper::method::METHOD;

/// The squared distance, in steps, up to which a point with neighbours that reach this far, squared, has a foot, and
/// the next point may follow it.
pub(super) fn farthest2(reach2: u64) -> f64 {
    METHOD.smoothing.farthest * METHOD.smoothing.farthest * reach2 as f64
}

/// A noisy point.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Noisy {
    pub id: usize,
    pub point: Point,
    /// Number of rounds in which it moves; a follower may move in the last of them only.
    pub rounds: u8,
    /// True if this is the last of them.
    pub last: bool,
    /// True if the next point follows it, unless the points around scatter.
    pub leads: bool,
    /// The number of its neighbours.
    pub count: usize,
    /// Squared distance of the last of them.
    pub reach2: u64,
}

impl Noisy {
    /// The position to which it moves. An outlier, which is too far from the surface, stays.
    fn moved(&self, Foot { offset }: Foot) -> Point {
        let length2 = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        if length2 > farthest2(self.reach2) {
            self.point
        } else {
            moved(self.point, offset)
        }
    }

    /// True if the mean squared height of the neighbours over their surface, which reach as far as `count` of all points,
    /// is more than that of `limit` local spacings.
    fn is_over(&self, limit: f64, mean2: f64, count: usize) -> bool {
        mean2 > limit * limit * spacing2(self.reach2, count)
    }
}

/// Moves noisy points to their feet, those whose neighbours lie in layers by fewer neighbours.
pub(super) struct Mover<P> {
    relaxing: Relaxing,
    layered: Feet<Noisy>,
    nearer: Nearer,
    /// The ids of leaders that no point may follow, because the points around scatter.
    pub scattered: Vec<usize>,
    /// Receives the noisy points and the positions to which they move.
    put: P,
}

impl<P: FnMut(Noisy, Point)> Mover<P> {
    /// `put` receives the points and the positions to which they move.
    pub fn new(relaxing: Relaxing, put: P) -> Self {
        Self {
            relaxing,
            layered: Feet::default(),
            nearer: Nearer::default(),
            scattered: Vec::new(),
            put,
        }
    }

    /// Moves the collected points, and those in layers that are left.
    pub fn finish(&mut self, feet: &mut Feet<Noisy>) {
        feet.finish(self);
        let put = &mut self.put;
        self.layered
            .finish(&mut |noisy: Noisy, foot: Foot| put(noisy, noisy.moved(foot)));
    }
}

impl<P: FnMut(Noisy, Point)> Settle<Noisy> for Mover<P> {
    /// Neighbours lie in layers, such as the two sides of a thin plate, or show details, if they are farther from their
    /// surface than noise explains.
    fn look(&mut self, noisy: &Noisy, mean2: f64) -> bool {
        let most = self.relaxing.most();
        if noisy.leads && noisy.is_over(METHOD.noise.follow, mean2, most) {
            self.scattered.push(noisy.id);
        }
        let layers = METHOD.noise.layers * f64::from(noisy.rounds);
        self.relaxing.fewer() < noisy.count && noisy.is_over(layers, mean2, most)
    }

    fn settle_layered(&mut self, noisy: Noisy, around: &mut Around) {
        around.keep_nearest(self.relaxing.fewer(), &mut self.nearer);
        let reach2 = around.last2();
        let put = &mut self.put;
        self.layered.add(
            Noisy { reach2, ..noisy },
            around,
            &mut |noisy: Noisy, foot: Foot| {
                put(noisy, noisy.moved(foot));
            },
        );
    }

    fn settle(&mut self, noisy: Noisy, foot: Foot) {
        (self.put)(noisy, noisy.moved(foot));
    }
}
