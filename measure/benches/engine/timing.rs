//! Measures and prints times: all candidates run in turns, round by round, so that other work on the machine affects all of them.

use std::time::Instant;

/// A candidate: its name and its function.
pub struct Contestant<'a> {
    pub name: String,
    run: Box<dyn FnMut() + 'a>,
}

impl<'a> Contestant<'a> {
    pub fn new(name: impl Into<String>, run: impl FnMut() + 'a) -> Self {
        Self { name: name.into(), run: Box::new(run) }
    }
}

/// Returns the fastest time of each candidate, s, since other work on the machine only slows rounds down. The first round is not counted.
pub fn race(rounds: usize, contestants: &mut [Contestant<'_>]) -> Vec<f64> {
    let mut times = vec![f64::INFINITY; contestants.len()];
    for round in 0..=rounds {
        for (contestant, times) in contestants.iter_mut().zip(&mut times) {
            let start = Instant::now();
            (contestant.run)();
            if round > 0 {
                *times = times.min(start.elapsed().as_secs_f64());
            }
        }
    }
    times
}

/// Returns the median.
pub fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

/// The target of a figure.
#[derive(Clone, Copy)]
pub enum TargetFigure {
    AtLeast(f64),
    AtMost(f64),
    /// No target; for comparison only.
    Nothing,
}

use TargetFigure::{AtLeast, AtMost, Nothing};

/// Prints the heading of a table.
pub fn heading(text: &str) {
    println!("\n{text}");
}

/// Prints a row of a table: the figure and its target.
pub fn figure(name: &str, found: f64, unit: &str, wanted: TargetFigure) {
    let digits = if found.abs() < 10.0 { 2 } else { 1 };
    let (printed, met) = match wanted {
        AtLeast(bound) => (format!("at least {bound}"), found >= bound),
        AtMost(bound) => (format!("at most {bound}"), found <= bound),
        Nothing => (String::new(), true),
    };
    let missed = if met { "" } else { "  MISSED" };
    println!("  {name:<62} {found:>9.digits$} {unit:<11} {printed}{missed}");
}
