//! The tables of the program, in Markdown.

use crate::sensors::SensorSet;
use crate::trial::{FoundFailure, PRIMITIVES, SensorResult, Trial};
use std::fmt::Write as _;

/// How many recordings contain their failure in the ground truth, by operator.
pub fn injected(trials: &[Trial]) -> String {
    let mut text = String::from(
        "| operator | failure | recordings | with the failure in the ground truth | without it: no failures in the ground truth |\n|---|---|---|---|---|\n",
    );
    for trials in trials.chunk_by(|one, next| one.operator == next.operator) {
        let Some(Trial { operator, .. }) = trials.first() else { continue };
        let primitives: Vec<&str> =
            PRIMITIVES.into_iter().filter(|name| trials.iter().any(|trial| trial.primitive == *name)).collect();
        let primitive = primitives.join(", ");
        let occurred = trials.iter().filter(|trial| trial.occurred).count();
        let succeed = trials.iter().filter(|trial| trial.succeeds).count();
        let _ = writeln!(text, "| `{operator}` | {primitive} | {} | {occurred} | {succeed} |", trials.len());
    }
    text
}

/// The share of failures that are found, and the share of successes with a false failure of the same kind, by failure and sensor set. The last rows
/// count false failures of any kind.
pub fn found(trials: &[Trial], sets: &[&SensorSet]) -> String {
    let mut text = head("failure", sets);
    for primitive in PRIMITIVES {
        for (two_hands, mended) in [(false, false), (false, true), (true, false), (true, true)] {
            let is_of =
                |trial: &&Trial| (trial.primitive, trial.two_hands, trial.mended) == (primitive, two_hands, mended);
            let of: Vec<&Trial> = trials.iter().filter(is_of).collect();
            if of.is_empty() {
                continue;
            }
            let rest = if mended { ", then inserted in the same attempt" } else { "" };
            let _ = write!(text, "| {primitive}{rest}, {} |", hands(two_hands));
            for set in 0..sets.len() {
                let results: Vec<&SensorResult> = of.iter().filter_map(|trial| trial.results.get(set)).collect();
                let _ = write!(text, " {} |", cell(&results, primitive));
            }
            text.push('\n');
        }
    }
    for two_hands in [false, true] {
        let of: Vec<&Trial> = trials.iter().filter(|trial| trial.two_hands == two_hands).collect();
        if of.is_empty() {
            continue;
        }
        let _ = write!(text, "| false failures of any kind, {} |", hands(two_hands));
        for set in 0..sets.len() {
            let sound: Vec<_> = of.iter().filter_map(|trial| trial.results.get(set)?.false_ones.as_ref()).collect();
            let _ = write!(text, " {} |", share(sound.iter().filter(|found| !found.is_empty()).count(), sound.len()));
        }
        text.push('\n');
    }
    text
}

/// A line for each failure and sensor set for which the rules cannot detect the failure, with the reason.
pub fn undetectable(trials: &[Trial], sets: &[&SensorSet]) -> String {
    let mut lines: Vec<String> = Vec::new();
    for (number, set) in sets.iter().enumerate() {
        for trial in trials {
            let reason = trial.results.get(number).and_then(|result| result.undetectable.as_ref());
            let line = reason.map(|reason| format!("- {}, {}: {reason}", trial.primitive, set.name));
            lines.extend(line.filter(|line| !lines.contains(line)));
        }
    }
    lines.join("\n")
}

fn head(first: &str, sets: &[&SensorSet]) -> String {
    let names: Vec<&str> = sets.iter().map(|set| set.name).collect();
    format!("| {first} | {} |\n|---|{}\n", names.join(" | "), "---|".repeat(sets.len()))
}

fn cell(results: &[&SensorResult], primitive: &str) -> String {
    let detectable: Vec<&&SensorResult> = results.iter().filter(|result| result.undetectable.is_none()).collect();
    if detectable.iter().all(|result| result.found.is_none()) && detectable.len() < results.len() {
        return "undetectable".into();
    }
    let occurred: Vec<bool> = detectable.iter().filter_map(|result| result.found).collect();
    let found = occurred.iter().filter(|found| **found).count();
    let sound: Vec<&Vec<FoundFailure>> = results.iter().filter_map(|result| result.false_ones.as_ref()).collect();
    let wrong = sound.iter().filter(|found| found.iter().any(|failure| failure.primitive == primitive)).count();
    let undetectable = results.len() - detectable.len();
    let rest = if undetectable > 0 { format!("; undetectable in {undetectable}") } else { String::new() };
    format!("{}; false {}{rest}", share(found, occurred.len()), share(wrong, sound.len()))
}

fn share(count: usize, of: usize) -> String {
    if of == 0 {
        return "–".into();
    }
    format!("{count} of {of}, {:.0} %", 100.0 * count as f64 / of as f64)
}

const fn hands(two: bool) -> &'static str {
    if two { "two hands" } else { "one hand" }
}
