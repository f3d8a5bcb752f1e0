//! The report of a score: tables for terminals, and a picture. Writers return text.

mod picture;
mod text;

pub use picture::picture;
pub use text::text;

use teachtree_analysis::score::{NONE, Score};
use teachtree_analysis::{UNKNOWN, number::fixed};

/// The text of an undefined number, such as a rate of nothing.
const NOTHING: &str = "–";

/// A rate in percent.
fn percent(rate: Option<f64>) -> String {
    rate.map_or_else(|| NOTHING.into(), |rate| format!("{} %", fixed(rate * 100.0, 1)))
}

/// A time in milliseconds.
fn ms(time_s: Option<f64>) -> String {
    time_s.map_or_else(|| NOTHING.into(), |time| fixed(time * 1e3, 1))
}

/// The names of tasks in a confusion: those of the paper's kind by name, then `unknown`, then `none`.
fn task_names(score: &Score) -> Vec<&str> {
    let mut names: Vec<&str> =
        score.all.task_confusion().into_keys().flat_map(|(truth, result)| [truth, result]).collect();
    names.sort_by_key(|name| (*name == NONE, *name == UNKNOWN, *name));
    names.dedup();
    names
}

/// The last part of a name, so that it is not longer than `most`.
fn shortened(name: &str, most: usize) -> String {
    let count = name.chars().count();
    if count <= most {
        return name.into();
    }
    let end: String = name.chars().skip(count + 1 - most).collect();
    format!("…{end}")
}
