//! Nearest neighbours among points, and spacings.

use std::f64::consts::PI;

use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Points that can be asked for those nearest to a place.
#[derive(Debug)]
pub struct Spots(RTree<GeomWithData<[f64; 3], u32>>);

impl Spots {
    /// Of these points, numbered in their order.
    pub fn new(points: &[[f64; 3]]) -> Self {
        let numbered = points.iter().zip(0..);
        let numbered = numbered.map(|(point, number)| GeomWithData::new(*point, number));
        Spots(RTree::bulk_load(numbered.collect()))
    }

    /// Distances and numbers of the nearest points, the nearest first, as many as are asked for.
    pub fn nearest(&self, place: [f64; 3]) -> impl Iterator<Item = (f64, usize)> + '_ {
        self.0
            .nearest_neighbor_iter_with_distance_2(place)
            .map(|(spot, square)| (square.sqrt(), spot.data as usize))
    }

    /// Spacing at one of the points: the root of the area for each, by the disc that ends at its `k`-th
    /// neighbour. Zero if there are fewer points.
    pub fn spacing(&self, place: [f64; 3], k: usize) -> f64 {
        let neighbor = self.nearest(place).nth(k);
        neighbor.map_or(0.0, |(reach, _)| reach * (PI / k.max(1) as f64).sqrt())
    }
}

/// The median of numbers; 0 if there are none.
pub fn median(mut values: Vec<f64>) -> f64 {
    let half = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(half, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_its_spacing() {
        let points: Vec<_> = (0..900)
            .map(|i| [2.0 * f64::from(i % 30), 2.0 * f64::from(i / 30), 0.0])
            .collect();
        let spots = Spots::new(&points);
        assert_eq!(
            spots.nearest([10.1, 10.1, 0.0]).next().map(|n| n.1),
            Some(155)
        );
        // The 12th neighbour of a node is 4 away.
        let expected = 4.0 * (PI / 12.0).sqrt();
        assert!((spots.spacing([30.0, 30.0, 0.0], 12) - expected).abs() < 1e-12);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(spots.spacing([0.0; 3], 1000), 0.0);
    }
}
