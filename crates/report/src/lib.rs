//! Reports: of an analysis, a timeline for terminals and a page for browsers; of a score, tables and a picture; of rules, diagrams. Writers return text; they
//! open no file and print nothing.

pub mod agreement;
pub mod audit;
pub mod diagram;
mod explain;
mod figure;
mod fit;
pub mod html;
pub mod page;
pub mod palette;
mod scale;
pub mod score;
mod signals;
pub mod svg;
pub mod text;
pub mod words;

pub use explain::{Detail, explanation};
pub use fit::{fit, patch as fit_patch};
pub use html::html;
pub use signals::{CHANNELS, channels};
pub use text::{Style, text};

use teachtree_analysis::{CompositeSpan, TaskSpan};

/// A step of 1, 2 or 5 times a power of ten, at least as long as asked; 1 when asked for what is not a positive number.
fn round_step(at_least: f64) -> f64 {
    if !(at_least > 0.0 && at_least.is_finite()) {
        return 1.0;
    }
    let power = 10.0_f64.powf(at_least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|factor| factor * power).find(|step| *step >= at_least).unwrap_or(10.0 * power)
}

/// Returns the details of a composite task besides its name and time.
pub fn parts(composite: &CompositeSpan) -> String {
    let cut = match (composite.open_start, composite.open_end) {
        (true, true) => "; cut off at both ends",
        (true, false) => "; cut off at the start",
        (false, true) => "; cut off at the end",
        (false, false) => "",
    };
    let failure = if composite.failure { "; a failure" } else { "" };
    format!("made of {}{failure}{cut}", composite.parts.join(", "))
}

/// Returns the details of a task besides its name and time.
pub fn remarks(task: &TaskSpan) -> String {
    let mut remarks = Vec::new();
    if task.failure {
        remarks.push("a failure".to_string());
    }
    if task.attempt > 1 {
        remarks.push(format!("attempt {}", task.attempt));
    }
    match (task.open_start, task.open_end) {
        (true, true) => remarks.push("cut off at both ends".to_string()),
        (true, false) => remarks.push("cut off at the start".to_string()),
        (false, true) => remarks.push("cut off at the end".to_string()),
        (false, false) => {}
    }
    if !task.secondary.is_empty() {
        remarks.push(format!("also {}", task.secondary.join(", ")));
    }
    remarks.join("; ")
}
