//! What a search looks at besides being near enough.

use crate::geom::aabb::Aabb;

/// Says which points matter to one query. Some that do not may pass.
pub trait Wanted {
    /// False if no point in a box matters.
    fn may_be_in(&self, bounds: &Aabb) -> bool;

    /// Puts down the places of the points that matter, in order, of those with these coordinates.
    fn pick(&self, columns: [&[i32]; 3], places: &mut Vec<u32>);
}

/// All of them.
#[derive(Debug, Clone, Copy)]
pub struct All;

impl Wanted for All {
    fn may_be_in(&self, _: &Aabb) -> bool {
        true
    }

    fn pick(&self, [x, ..]: [&[i32]; 3], places: &mut Vec<u32>) {
        places.extend(0..x.len() as u32);
    }
}
