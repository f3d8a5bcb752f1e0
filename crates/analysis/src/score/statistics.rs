//! Shares with their bounds, and quantiles.

/// The 97.5 % quantile of the normal distribution: two-sided 95 % bounds.
const Z: f64 = 1.959_963_984_540_054;

/// A ratio of counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// The number of correct elements.
    pub right: usize,
    /// The number of elements.
    pub of: usize,
}

impl Share {
    /// Adds one.
    pub fn count(&mut self, right: bool) {
        self.right += usize::from(right);
        self.of += 1;
    }

    /// Adds others.
    pub fn add(&mut self, other: Self) {
        self.right += other.right;
        self.of += other.of;
    }

    /// The share, 0 to 1; `None` of nothing.
    pub fn rate(self) -> Option<f64> {
        ratio(self.right as f64, self.of as f64)
    }

    /// The 95 % bounds of the rate (Wilson 1927); `None` of nothing.
    ///
    ///   (p + z²/2n ± z √(p (1 − p)/n + z²/4n²)) / (1 + z²/n)
    pub fn bounds(self) -> Option<(f64, f64)> {
        let p = self.rate()?;
        let n = self.of as f64;
        let middle = p + Z * Z / (2.0 * n);
        let spread = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
        let scale = 1.0 + Z * Z / n;
        // At 0 and 1 the bound is exact; rounding must not step over it.
        let low = if self.right == 0 { 0.0 } else { (middle - spread) / scale };
        let high = if self.right == self.of { 1.0 } else { (middle + spread) / scale };
        Some((low, high))
    }
}

/// A part of a whole; `None` of nothing.
pub(super) fn ratio(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

/// A quantile of values that are sorted, with straight lines between them: `q` of 0 is the least, 1 the greatest. `None` of nothing.
pub fn quantile(sorted: &[f64], q: f64) -> Option<f64> {
    let place = q.clamp(0.0, 1.0) * sorted.len().checked_sub(1)? as f64;
    // Not negative, and below the length.
    let at = place.floor() as usize;
    let (low, high) = (*sorted.get(at)?, sorted.get(at + 1).or(sorted.get(at))?);
    Some(low + (high - low) * place.fract())
}
