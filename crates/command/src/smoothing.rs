//! Smoothing with minimum jerk: minimizes the distance from the data plus a penalty on the jerk.
//!
//! ```text
//! minimise  Σ (x_i - y_i)²  +  λ Σ (x_{i+3} - 3 x_{i+2} + 3 x_{i+1} - x_i)²      with both ends held
//! ```
//!
//! It has no delay. A sine of frequency f is passed by `1 / (1 + λ (2 sin(π f / rate))^6)`, so λ follows from the frequency that is
//! halved. The matrix has seven diagonals: one pass down and one up.

/// The factor by which a cut-off frequency is raised until the deviation is within its limit.
const RAISED: f64 = 1.4;
/// The weight of the first and the last sample.
const HELD: f64 = 1e6;

/// Smooths samples at `rate_hz`; a sine of `cutoff_hz` is halved. Fewer than five samples are returned as they are.
pub fn smooth(samples: &[f64], rate_hz: f64, cutoff_hz: f64) -> Vec<f64> {
    let n = samples.len();
    if n < 5 || cutoff_hz >= rate_hz / 2.0 {
        return samples.to_vec();
    }
    let lambda = (2.0 * (std::f64::consts::PI * cutoff_hz / rate_hz).sin()).powi(-6);
    // Diagonal and three above it.
    let mut band = vec![[0.0; 4]; n];
    let mut right = samples.to_vec();
    for (row, entry) in band.iter_mut().enumerate() {
        entry[0] = if row == 0 || row + 1 == n { HELD } else { 1.0 };
    }
    let third = [-1.0, 3.0, -3.0, 1.0];
    for start in 0..n - 3 {
        for (i, a) in third.iter().enumerate() {
            for (j, b) in third.iter().enumerate().skip(i) {
                band[start + i][j - i] += lambda * a * b;
            }
        }
    }
    right[0] *= HELD;
    right[n - 1] *= HELD;
    // L D Lᵀ in place: band[k][0] becomes D, band[k][j] the multiple of row k in row k + j.
    for k in 0..n {
        let pivot = band[k][0];
        let row = band[k];
        for j in 1..4.min(n - k) {
            let factor = row[j] / pivot;
            for i in j..4.min(n - k) {
                band[k + j][i - j] -= factor * row[i];
            }
            right[k + j] -= factor * right[k];
            band[k][j] = factor;
        }
    }
    for k in (0..n).rev() {
        let mut value = right[k] / band[k][0];
        for j in 1..4.min(n - k) {
            value -= band[k][j] * right[k + j];
        }
        right[k] = value;
    }
    right
}

/// Smooths the components of a vector, as [`smooth`] does.
pub fn smooth_parts<const N: usize>(samples: &[[f64; N]], rate_hz: f64, cutoff_hz: f64) -> Vec<[f64; N]> {
    let part = |part: usize| samples.iter().map(|sample| sample[part]).collect::<Vec<f64>>();
    let parts: [Vec<f64>; N] = std::array::from_fn(|index| smooth(&part(index), rate_hz, cutoff_hz));
    (0..samples.len()).map(|at| std::array::from_fn(|part| parts[part][at])).collect()
}

/// Smooths the components of a vector; the cut-off is raised until no sample is moved by more than `allowed`.
pub fn smooth_within<const N: usize>(
    samples: &[[f64; N]],
    rate_hz: f64,
    cutoff_hz: f64,
    allowed: f64,
) -> Vec<[f64; N]> {
    let mut cutoff = cutoff_hz;
    loop {
        let smoothed = smooth_parts(samples, rate_hz, cutoff);
        if cutoff >= rate_hz / 2.0 || deviation(samples, &smoothed) <= allowed {
            return smoothed;
        }
        cutoff *= RAISED;
    }
}

/// Returns the maximum distance of two series.
pub fn deviation<const N: usize>(one: &[[f64; N]], other: &[[f64; N]]) -> f64 {
    let apart = |(a, b): (&[f64; N], &[f64; N])| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    one.iter().zip(other).map(apart).fold(0.0, f64::max)
}

/// Returns the largest jerk of a series, per s^3 of its unit.
pub fn jerk<const N: usize>(samples: &[[f64; N]], rate_hz: f64) -> f64 {
    let third = |at: &[[f64; N]]| {
        let part = |part: usize| at[3][part] - 3.0 * at[2][part] + 3.0 * at[1][part] - at[0][part];
        (0..N).map(|index| part(index).powi(2)).sum::<f64>().sqrt() * rate_hz.powi(3)
    };
    samples.windows(4).map(third).fold(0.0, f64::max)
}
