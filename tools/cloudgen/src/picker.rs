//! Choice of an item in proportion to its weight, monotone in the random number.

/// Cumulative weights with a guide table, for choices in constant time on average.
///
/// Unlike an alias table it keeps the order: larger numbers give later items, as sorted and stratified
/// sampling need.
#[derive(Clone, Debug)]
pub(crate) struct Picker {
    /// `bounds[k]..bounds[k + 1]` of the unit interval belongs to item `k`.
    bounds: Vec<f64>,
    /// First item that can contain a number of the `j`-th of `guide.len()` equal parts.
    guide: Vec<u32>,
    total: f64,
}

impl Picker {
    /// From weights that are finite, not negative and not all zero.
    pub(crate) fn new(weights: impl Iterator<Item = f64>) -> Self {
        let mut bounds = vec![0.0];
        let mut total = 0.0;
        for weight in weights {
            total += weight;
            bounds.push(total);
        }
        for bound in &mut bounds {
            *bound /= total;
        }
        let items = bounds.len() - 1;
        let mut guide = Vec::with_capacity(items);
        let mut item = 0;
        for j in 0..items {
            let start = j as f64 / items as f64;
            while item + 1 < items && bounds[item + 1] <= start {
                item += 1;
            }
            guide.push(item as u32);
        }
        Picker {
            bounds,
            guide,
            total,
        }
    }

    /// Sum of the weights.
    pub(crate) fn total(&self) -> f64 {
        self.total
    }

    /// The item that contains `u` in `[0, 1)`, and the place of `u` inside it, again in `[0, 1)`.
    pub(crate) fn pick(&self, u: f64) -> (usize, f64) {
        let items = self.guide.len();
        let part = ((u * items as f64) as usize).min(items - 1);
        let mut item = self.guide[part] as usize;
        // The product above is rounded: it may give a part that begins slightly after `u`.
        while item > 0 && self.bounds[item] > u {
            item -= 1;
        }
        while item + 1 < items && self.bounds[item + 1] <= u {
            item += 1;
        }
        let (low, high) = (self.bounds[item], self.bounds[item + 1]);
        let inside = if high > low {
            (u - low) / (high - low)
        } else {
            0.5
        };
        (item, inside.clamp(0.0, 1.0 - f64::EPSILON))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picks_in_proportion_and_in_order() {
        let picker = Picker::new([1.0, 0.0, 3.0].into_iter());
        assert_eq!(picker.pick(0.0).0, 0);
        assert_eq!(picker.pick(0.2499).0, 0);
        assert_eq!(picker.pick(0.25), (2, 0.0));
        let (item, inside) = picker.pick(0.625);
        assert_eq!(item, 2);
        assert!((inside - 0.5).abs() < 1e-12);
        assert_eq!(picker.pick(1.0).0, 2);
        assert!((picker.total() - 4.0).abs() < 1e-12);
    }
}
