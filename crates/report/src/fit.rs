//! The report of a fit for terminals: the objective before and after, the params, each held-out recording, and the verdict.

use std::fmt::{Display, Write};
use teachtree_analysis::fit::{CrossValidation, Fit, MIN_GAIN, MIN_LOGS, Objective, Verdict};
use teachtree_analysis::number::fixed;

/// The longest name of a recording that is shown whole.
const LOG: usize = 40;

/// Writes it; `rules` are the files.
pub fn fit(fit: &Fit, rules: &[String]) -> String {
    let mut text = String::new();
    let plural = if fit.logs.len() == 1 { "" } else { "s" };
    let _ = writeln!(text, "{} recording{plural}, rules {}", fit.logs.len(), rules.join(", "));
    let names = |at: &[usize]| -> String {
        at.iter().filter_map(|at| Some(fit.space.params.get(*at)?.name.as_str())).collect::<Vec<_>>().join(", ")
    };
    let changed = fit.changed();
    // A threshold that moves along with the other one of its hysteresis has an effect.
    let idle: Vec<usize> = fit.idle.iter().copied().filter(|at| changed.iter().all(|(moved, _)| moved != at)).collect();
    if !idle.is_empty() {
        let _ = writeln!(text, "no effect on these recordings: {}", names(&idle));
    }
    if !changed.is_empty() {
        objectives(&mut text, fit);
        params(&mut text, fit, &changed);
    }
    if let Some(held) = &fit.held_out {
        recordings(&mut text, fit, held);
    }
    text.push('\n');
    let _ = writeln!(text, "{}", verdict(fit));
    text
}

fn percent(part: f64) -> String {
    format!("{} %", fixed(part * 100.0, 1))
}

fn objectives(text: &mut String, fit: &Fit) {
    let held = fit.held_out.as_ref();
    let head = if held.is_some() { "  held out: in the files    fitted" } else { "" };
    let _ = writeln!(text, "\n                    in the files    fitted{head}");
    let boundaries = format!("  boundaries ±{} s", fixed(fit.tolerance_s, 2));
    for (number, name) in
        ["objective", "  frame accuracy", "  segmental F1", boundaries.as_str()].into_iter().enumerate()
    {
        let part = |objective: &Objective| {
            let parts = [objective.objective, objective.accuracy, objective.f1, objective.boundaries];
            parts.get(number).map_or(String::new(), |part| percent(*part))
        };
        let mut line = format!("{name:20}{:>12}{:>10}", part(&fit.before), part(&fit.after));
        if let Some(held) = held {
            let _ = write!(line, "{:>24}{:>10}", part(&held.before), part(&held.after));
        }
        let _ = writeln!(text, "{line}");
    }
}

fn params(text: &mut String, fit: &Fit, changed: &[(usize, f64)]) {
    let mut rows = vec![["param", "in the file", "fitted", "range", "while others were held out"].map(String::from)];
    for (at, value) in changed {
        let Some(param) = fit.space.params.get(*at) else { continue };
        let values = fit.held_out.iter().flat_map(|held| &held.folds).filter_map(|fold| fold.point.get(*at).copied());
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        let folds = match (values.first(), values.last()) {
            (Some(low), Some(high)) if low < high => format!("{} to {}", param.show(*low), param.show(*high)),
            (Some(one), _) => format!("{} always", param.show(*one)),
            _ => String::new(),
        };
        let range = format!("{} .. {}", param.show(param.range.0), param.show(param.range.1));
        rows.push([param.name.clone(), param.show(param.value), param.show(*value), range, folds]);
    }
    table(text, &rows);
}

fn recordings(text: &mut String, fit: &Fit, held: &CrossValidation) {
    let mut rows = vec![["group", "held out", "in the files", "fitted", "gain"].map(String::from)];
    for (number, fold) in held.folds.iter().enumerate() {
        for (log, (before, after)) in fold.logs.iter().zip(fold.before.iter().zip(&fold.after)) {
            let name = fit.logs.get(*log).map_or("", String::as_str);
            let count = name.chars().count();
            let short: String = name.chars().skip(count.saturating_sub(LOG)).collect();
            let gain = after.objective - before.objective;
            let (before, after) = (percent(before.objective), percent(after.objective));
            rows.push([(number + 1).to_string(), short, before, after, percent(gain)]);
        }
    }
    table(text, &rows);
}

/// A table with a blank line above.
fn table(text: &mut String, rows: &[[String; 5]]) {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or_default();
    let widths: [usize; 5] = std::array::from_fn(width);
    text.push('\n');
    for row in rows {
        let cells = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}"));
        let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join("   ").trim_end());
    }
}

fn verdict(fit: &Fit) -> String {
    let spread = fit.held_out.as_ref().map_or(String::new(), |held| {
        let (gain, at_least) = (percent(held.gain), percent(held.at_least));
        let of = if held.groups == fit.logs.len() { "recordings" } else { "groups" };
        let p_value = if held.p_value < 0.001 { "< 0.001".into() } else { format!("= {:.3}", held.p_value) };
        format!(
            "the gain on held-out {of} is {gain}, at least {at_least} with 95 % confidence (t test over {} {of}, p {p_value})",
            held.groups
        )
    });
    match fit.verdict {
        Verdict::Gain => format!("better: {spread}"),
        Verdict::NotBorneOut => format!(
            "not confirmed: {spread}.\nThese values may fit the recordings by chance; add recordings, or print the patch with `--anyway`."
        ),
        Verdict::NothingToGain => {
            format!(
                "nothing to gain: no values within the ranges are better on these recordings by {} or more",
                percent(MIN_GAIN)
            )
        }
        Verdict::TooFew => format!(
            "too few recordings: {}, expected at least {MIN_LOGS}, so that some can be held out for validation. `--anyway` fits them without.",
            fit.logs.len()
        ),
    }
}

/// What is said above a patch; `lacking` are files in it that are not on disk, `place` where it was written.
pub fn patch(fit: &Fit, lacking: &[String], place: Option<impl Display>) -> String {
    let mut text = String::new();
    let set: Vec<String> = fit
        .changed()
        .into_iter()
        .filter_map(|(at, value)| {
            let param = fit.space.params.get(at)?;
            Some(format!("--set '{}={}'", param.name, param.show(value)))
        })
        .collect();
    let place = place.map_or("the patch below".to_string(), |place| place.to_string());
    let _ = writeln!(
        text,
        "{place} changes the rule files (`patch -p0`, `git apply -p0`); to try it without: {}",
        set.join(" ")
    );
    if !lacking.is_empty() {
        let _ = writeln!(
            text,
            "changed since it was read, or not a file in this folder: {}. To change a file that comes with the program, copy it beside your rules, or set `params` in a binding.",
            lacking.join(", ")
        );
    }
    text
}
