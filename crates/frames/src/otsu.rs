//! Two groups of numbers: where they are farthest apart (Otsu), and whether there are two at all (Ashman's D).

/// The least Ashman's D of two groups: an even spread that is cut in two has 3.5.
const CLEAR: f64 = 4.0;

/// Numbers in two groups.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtsuSplit {
    /// How many are in the first group.
    pub count: usize,
    /// The means of the groups.
    pub means: [f64; 2],
    /// Ashman's D: how far the means are apart, in units of the scatter about them.
    pub distance: f64,
}

impl OtsuSplit {
    /// Whether there are two groups, and not one that was cut.
    pub fn is_clear(&self) -> bool {
        self.distance >= CLEAR
    }
}

/// Splits numbers in rising order where the means of the groups are farthest apart, weighted by how many they are. `None` of numbers that are all the same.
pub fn split(numbers: &[f64]) -> Option<OtsuSplit> {
    let (count, total) = (numbers.len(), numbers.iter().sum::<f64>());
    let (mut best, mut at, mut below) = (0.0, 0, 0.0);
    for (place, number) in (1..count).zip(numbers) {
        below += number;
        let (first, second) = (place as f64, (count - place) as f64);
        let apart = (total - below) / second - below / first;
        let between = first * second * apart * apart;
        if between > best {
            (best, at) = (between, place);
        }
    }
    let (first, second) = numbers.split_at_checked(at).filter(|(first, _)| !first.is_empty())?;
    let ((low, low_variance), (high, high_variance)) = (moments(first), moments(second));
    let scatter = (low_variance + high_variance).max(f64::MIN_POSITIVE).sqrt();
    Some(OtsuSplit { count: at, means: [low, high], distance: std::f64::consts::SQRT_2 * (high - low) / scatter })
}

/// The means of two clear groups that each have a twentieth of the values.
pub fn clear_means(mut values: Vec<f64>) -> Option<[f64; 2]> {
    const LEAST: usize = 20;
    values.sort_by(f64::total_cmp);
    let split = split(&values)?;
    let smaller = split.count.min(values.len() - split.count);
    (split.is_clear() && smaller * LEAST >= values.len()).then_some(split.means)
}

/// Mean and variance.
fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count)
}
