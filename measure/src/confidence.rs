//! Results with a confidence, and the share of them that is right.

use std::fmt::Write as _;

/// The classes of boundaries from the largest: the lower end of each, and its heading.
pub const CLASSES: [(f64, &str); 4] = [(0.9, "90 % and more"), (0.7, "70 to 90 %"), (0.5, "50 to 70 %"), (0.0, "less")];
/// The classes of live labels: each has one confidence.
pub const LIVE_CLASSES: [(f64, &str); 3] = [(0.88, "88 %"), (0.74, "74 %"), (0.59, "59 %")];

/// A boundary or a label that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConfidenceSample {
    /// Its confidence or its stability, 0 to 1.
    pub share: f64,
    /// Whether it is right.
    pub right: bool,
}

/// The share of right results `what`, in `classes` of `by`.
pub fn table(by: &str, what: &str, classes: &[(f64, &str)], sets: &[(&str, &[ConfidenceSample])]) -> String {
    let headings: Vec<&str> = classes.iter().map(|(_, heading)| *heading).collect();
    let mut text =
        format!("| {what} right, by {by} | {} |\n|---|{}\n", headings.join(" | "), "---|".repeat(classes.len()));
    for (name, samples) in sets {
        let _ = write!(text, "| {name} |");
        let mut below = f64::INFINITY;
        for (least, _) in classes {
            let class = samples.iter().filter(|it| it.share >= *least && it.share < below);
            let _ = write!(text, " {} |", right_of(class));
            below = *least;
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
