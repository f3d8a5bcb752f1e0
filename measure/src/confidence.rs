//! Results with a confidence, and the share of them that is right.

use std::fmt::Write as _;

/// The lower ends of the classes.
const CLASSES: [f64; 4] = [0.9, 0.7, 0.5, 0.0];

/// A boundary or a label that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConfidenceSample {
    /// Its confidence or its agreement, 0 to 1.
    pub share: f64,
    /// Whether it is right.
    pub right: bool,
}

/// The share of right results `what`, in classes of `by`.
pub fn table(by: &str, what: &str, sets: &[(&str, &[ConfidenceSample])]) -> String {
    let mut text =
        format!("| {what} right, by {by} | 90 % and more | 70 to 90 % | 50 to 70 % | less |\n|---|---|---|---|---|\n");
    for (name, samples) in sets {
        let _ = write!(text, "| {name} |");
        let mut below = f64::INFINITY;
        for least in CLASSES {
            let class = samples.iter().filter(|it| it.share >= least && it.share < below);
            let _ = write!(text, " {} |", right_of(class));
            below = least;
        }
        text.push('\n');
    }
    text
}

/// The number of right samples and their share: `38 of 41, 92.7 %`.
pub fn right_of<'a>(samples: impl Iterator<Item = &'a ConfidenceSample>) -> String {
    let (mut right, mut all) = (0_usize, 0_usize);
    for sample in samples {
        right += usize::from(sample.right);
        all += 1;
    }
    if all == 0 {
        return "–".into();
    }
    format!("{right} of {all}, {:.1} %", 100.0 * right as f64 / all as f64)
}
