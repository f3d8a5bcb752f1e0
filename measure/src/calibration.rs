//! Calibration: a rising map from a stability to the share of right results, by isotonic regression. Neighbors that are out of order are pooled.

use crate::confidence::ConfidenceSample;

/// The map, in steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// The least stability and the share of right results of each step, both rising.
    steps: Vec<(f64, f64)>,
}

/// Results of neighboring stabilities.
struct Pool {
    least: f64,
    /// The weight of the right ones, and of all.
    right: f64,
    all: f64,
}

impl Pool {
    fn rate(&self) -> f64 {
        self.right / self.all
    }

    fn add(&mut self, other: &Self) {
        self.right += other.right;
        self.all += other.all;
    }
}

impl Calibration {
    /// Learns the map from kinds of recordings. Each kind has the same weight, whatever its number of results.
    pub fn of_kinds<'a>(kinds: impl IntoIterator<Item = &'a [ConfidenceSample]>) -> Self {
        let mut samples: Vec<(ConfidenceSample, f64)> = Vec::new();
        for kind in kinds {
            samples.extend(kind.iter().map(|sample| (*sample, 1.0 / kind.len() as f64)));
        }
        samples.sort_by(|(one, _), (other, _)| one.share.total_cmp(&other.share));
        let mut pools: Vec<Pool> = Vec::new();
        for same in samples.chunk_by(|(one, _), (next, _)| one.share.total_cmp(&next.share).is_eq()) {
            let mut pool = Pool { least: f64::NEG_INFINITY, right: 0.0, all: 0.0 };
            for (sample, weight) in same {
                pool.least = sample.share;
                pool.add(&Pool { least: sample.share, right: if sample.right { *weight } else { 0.0 }, all: *weight });
            }
            while let Some(mut before) = pools.pop_if(|before| before.rate() >= pool.rate()) {
                before.add(&pool);
                pool = before;
            }
            pools.push(pool);
        }
        Self { steps: pools.iter().map(|pool| (pool.least, pool.rate())).collect() }
    }

    /// The least stability and the share of right results of each step.
    pub fn steps(&self) -> &[(f64, f64)] {
        &self.steps
    }

    /// The share of right results at a stability; that of the first step below all steps, and 0 of an empty map.
    pub fn share(&self, stability: f64) -> f64 {
        let reached = self.steps.iter().take_while(|(least, _)| *least <= stability).last();
        reached.or(self.steps.first()).map_or(0.0, |(_, share)| *share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(of: &[(f64, bool)]) -> Vec<ConfidenceSample> {
        of.iter().map(|&(share, right)| ConfidenceSample { share, right }).collect()
    }

    #[test]
    fn shares_that_fall_are_pooled() {
        let kind = samples(&[(0.2, false), (0.5, true), (0.5, true), (0.8, true), (0.8, false), (1.0, true)]);
        let map = Calibration::of_kinds([&kind[..]]);
        for (at, share) in [(0.1, 0.0), (0.2, 0.0), (0.6, 0.75), (0.8, 0.75), (1.0, 1.0)] {
            assert!((map.share(at) - share).abs() < 1e-9, "{at}: {}", map.share(at));
        }
    }

    #[test]
    fn kinds_count_alike() {
        let (few, many) = (samples(&[(1.0, true)]), samples(&[(1.0, false); 99]));
        assert!((Calibration::of_kinds([&few[..], &many[..]]).share(1.0) - 0.5).abs() < 1e-9);
        assert!(Calibration::of_kinds([]).share(1.0).abs() < 1e-9);
    }
}
