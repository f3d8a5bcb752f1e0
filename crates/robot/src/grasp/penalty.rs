//! The costs of a measure, a missing distance and an overlap.

use crate::kinematics::joint_positions::REACHED_M;

/// The smallest measure.
const SMALLEST: f64 = 1e-3;
/// The cost of a missing distance, 1/m.
const PER_METRE: f64 = 400.0;
/// Clearance of shapes in the search, m; an overlap of the same length costs 1.
pub(super) const MARGIN_M: f64 = 0.0008;
const OVERLAP_M: f64 = 0.002;

/// Returns the cost of a finger's measure that misses its contact by `miss`, m.
pub(super) fn measure_cost(measure: f64, miss: f64) -> f64 {
    let measure = if miss < REACHED_M { measure } else { 0.0 };
    PER_METRE * miss - measure.max(SMALLEST).ln()
}

/// Returns the cost of an overlap, m: its square, and linear for large overlaps.
pub(super) fn price(over: f64) -> f64 {
    let over = over / OVERLAP_M;
    if over < 1.0 { over * over } else { 2.0 * over - 1.0 }
}

/// Returns the derivative of [`price`], 1/m.
pub(super) fn price_slope(over: f64) -> f64 {
    2.0 * (over / OVERLAP_M).min(1.0) / OVERLAP_M
}
