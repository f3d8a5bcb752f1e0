//! Noise of positions: how far the samples of a tracker scatter about where a body is, each by itself.
//!
//! Neighboring second differences of such noise have the covariance `-4 s²`, with its standard deviation `s`. Motion bends the same way for several
//! samples, so its covariance is not negative; the median over short blocks leaves out jerks. A velocity that is differentiated from noisy
//! positions is not zero at rest: up to [`PositionNoise::limit`] it is not motion. The difference of two positions is not zero either: rules compare it
//! with `target.noise`.
//!
//! Where the log repeats poses, only the measured samples count: repeated or interpolated ones hide the noise.

use super::motion;
use crate::clean::preprocess::{CleanLog, PositionNoise};
use teachtree_base::scene::Role;

/// Samples of a block.
const BLOCK: usize = 32;
/// The fewest blocks that show a noise.
const FEWEST: usize = 4;
/// A speed below this many standard deviations of its noise is not motion.
const ABOVE_NOISE: f64 = 4.0;
/// Noise that makes less than this speed in all, m/s, moves nothing: the rules' slowest motion is twice as fast.
const NEGLIGIBLE: f64 = 2.5e-3;
/// Noise of this standard deviation, m, makes ways that the rules must compare with it, however high the rate is: eight times as far are 1.6 mm.
const LEAST_M: f64 = 2e-4;

/// Estimates the noise of a column, value by value.
#[derive(Clone, Debug, Default)]
pub struct NoiseEstimator {
    before: [f64; 2],
    difference: f64,
    seen: usize,
    /// The products of neighboring differences in this block.
    products: usize,
    sum: f64,
    blocks: Vec<f64>,
}

impl NoiseEstimator {
    /// Takes the next values.
    pub fn take(&mut self, values: &[f64]) {
        for &value in values {
            let [first, second] = self.before;
            let difference = value - 2.0 * second + first;
            if self.seen >= 3 {
                self.sum += difference * self.difference;
                self.products += 1;
            }
            if self.products == BLOCK {
                self.blocks.push(-self.sum / (4.0 * BLOCK as f64));
                (self.sum, self.products) = (0.0, 0);
            }
            (self.before, self.difference) = ([second, value], difference);
            self.seen += 1;
        }
    }

    /// The variance of the noise; 0 of few values.
    fn variance(mut self) -> f64 {
        if self.blocks.len() < FEWEST {
            return 0.0;
        }
        let middle = self.blocks.len() / 2;
        let (_, median, _) = self.blocks.select_nth_unstable_by(middle, f64::total_cmp);
        // Lost samples make it NaN.
        median.max(0.0)
    }
}

/// The noise of three columns with a measured value every `rows` rows, where it counts. It makes no speed of a body whose velocity the log has.
pub fn of_columns(
    estimates: [NoiseEstimator; 3],
    rate_hz: f64,
    rows: usize,
    has_velocity: bool,
) -> Option<PositionNoise> {
    let deviation = (estimates.map(NoiseEstimator::variance).iter().sum::<f64>() / 3.0).sqrt();
    let speed = if has_velocity { 0.0 } else { ABOVE_NOISE * deviation * motion::slope_gain(rate_hz, rows) };
    let limit = if speed > NEGLIGIBLE { speed } else { 0.0 };
    (limit > 0.0 || deviation > LEAST_M).then_some(PositionNoise { deviation, limit })
}

/// The noise of the objects of a whole log, by name.
pub fn of_objects<'a>(measured: &'a CleanLog) -> impl Iterator<Item = (String, PositionNoise)> + 'a {
    let objects = measured.scene.bodies.iter().filter(|(_, body)| body.role == Role::Object);
    objects.filter_map(|(name, _)| {
        let has_velocity = measured.vec3(&format!("{name}.velocity")).is_some();
        let channel = format!("{name}.position");
        let columns = measured.vec3(&channel)?;
        let held = measured.held.get(&channel);
        let estimates = columns.map(|column| {
            let mut estimate = NoiseEstimator::default();
            if let Some(held) = held {
                let values = held.measured.iter().filter_map(|row| column.get(*row).copied());
                estimate.take(&values.collect::<Vec<f64>>());
                return estimate;
            }
            for stretch in &measured.stretches {
                estimate.take(column.get(stretch.clone()).unwrap_or_default());
            }
            estimate
        });
        let rows = held.map_or(1, |held| held.rows);
        Some((name.clone(), of_columns(estimates, measured.rate_hz, rows, has_velocity)?))
    })
}
