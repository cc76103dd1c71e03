//! Lines of the table.

/// Largest angle, in degrees, that does not count as wild.
const WILD: f64 = 30.0;

/// The head.
pub(crate) fn head() -> String {
    "| world | normals | positions | mean | 50 % | 90 % | 99 % | > 30° |\n\
     |---|---|---|--:|--:|--:|--:|--:|"
        .to_owned()
}

/// A row of errors in degrees.
pub(crate) fn row(world: &str, method: &str, shape: &str, mut errors: Vec<f64>) -> String {
    errors.sort_unstable_by(f64::total_cmp);
    let count = errors.len();
    let at = |hundredths: usize| {
        let rank = (count * hundredths).div_ceil(100).max(1);
        errors.get(rank - 1).copied().unwrap_or(0.0)
    };
    let mean = errors.iter().sum::<f64>() / count.max(1) as f64;
    let wild = errors.iter().filter(|e| **e > WILD).count() as f64 / count.max(1) as f64;
    format!(
        "| {world} | {method} | {shape} | {mean:.2} | {:.2} | {:.2} | {:.2} | {:.2} % |",
        at(50),
        at(90),
        at(99),
        100.0 * wild
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_ranks() {
        let errors = (1..=100).map(f64::from).collect();
        assert_eq!(
            row("w", "m", "s", errors),
            "| w | m | s | 50.50 | 50.00 | 90.00 | 99.00 | 70.00 % |"
        );
    }
}
