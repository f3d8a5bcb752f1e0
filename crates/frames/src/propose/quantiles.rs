//! Quantiles of unsorted values.

/// The value below which a share of the values is; `None` of no values.
pub fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get((values.len() as f64 * share) as usize).copied()
}

/// The median; `None` of no values.
pub fn median(values: Vec<f64>) -> Option<f64> {
    quantile(values, 0.5)
}
