//! A progress bar on long work, silent when standard error is not a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar with a label that moves from 0 to 1.
pub struct Progress {
    bar: ProgressBar,
}

const STEPS: u64 = 1000;

impl Progress {
    /// A bar at 0.
    pub fn new(label: &str) -> Self {
        // `indicatif` hides the bar itself when standard error is no terminal.
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg} {bar:40} {percent:>3} %  {elapsed}") {
            bar.set_style(style);
        }
        bar.set_message(label.to_string());
        Self { bar }
    }

    /// Moves the bar to a part of the whole, 0 to 1.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "between 0 and 1000"
    )]
    pub fn set(&self, part: f64) {
        self.bar.set_position((part.clamp(0.0, 1.0) * STEPS as f64) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
