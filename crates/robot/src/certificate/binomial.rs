//! The bound of C. J. Clopper and E. S. Pearson, *The Use of Confidence or Fiducial Limits Illustrated in the Case of the Binomial*, 1934.

use statrs::distribution::{Beta, ContinuousCDF};

/// The success rate that a certificate states.
pub const RATE: f64 = 0.95;
/// The confidence of a certificate.
pub const CONFIDENCE: f64 = 0.95;

/// Returns the one-sided lower Clopper–Pearson bound of a success rate: with a smaller rate, `successes` or more of `runs` independent runs succeed with a
/// probability of less than 1 − `confidence`. It is the quantile 1 − `confidence` of the distribution Beta(successes, runs − successes + 1).
pub fn lower_bound(successes: usize, runs: usize, confidence: f64) -> f64 {
    if successes == 0 || successes > runs {
        return 0.0;
    }
    let beta = Beta::new(successes as f64, (runs - successes + 1) as f64);
    beta.map_or(0.0, |beta| beta.inverse_cdf(1.0 - confidence))
}

/// Returns the smallest number of runs that certify [`RATE`] if all of them succeed: ⌈ln(1 − confidence) / ln [`RATE`]⌉.
pub fn runs_without_failure(confidence: f64) -> usize {
    ((1.0 - confidence).ln() / RATE.ln()).ceil() as usize
}

/// Returns the confidence of a round of verification, from 0. The error probability is divided among all rounds (1/2, 1/4, …): a certificate has [`CONFIDENCE`]
/// whatever the number of rounds that failed before it.
pub fn round_confidence(round: u32) -> f64 {
    1.0 - (1.0 - CONFIDENCE) / 2.0_f64.powf(f64::from(round) + 1.0)
}
