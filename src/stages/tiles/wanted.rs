//! An additional condition on the points that a search returns.

use outcrop_geom::aabb::Aabb;

/// Selects the points that matter to a query. It may let others pass.
pub trait Wanted {
    /// False if no point in a box can matter.
    fn may_be_in(&self, bounds: &Aabb) -> bool;

    /// Appends the places, ascending, of the points with these coordinates that matter.
    fn pick(&self, columns: [&[i32]; 3], places: &mut Vec<u32>);
}

/// All points matter.
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
