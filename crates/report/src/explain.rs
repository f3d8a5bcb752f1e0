//! Explanations for terminals.

use std::collections::BTreeSet;
use std::fmt::Write;
use teachtree_analysis::Subject;
use teachtree_analysis::explain::{
    CompositePart, Explanation, LabelChange, LatchState, NearestPath, Obstacle, Reason, Step, TaskCandidate, TaskReason,
};

/// Names that were opened before, with the slot that they were about.
type PrintedNames = BTreeSet<(String, String)>;

/// How much of a reason is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// What decides: the choice that is taken in full, of each refused one the condition that fails.
    Short,
    /// All reasons, latches and tasks.
    Full,
}

impl Detail {
    /// The levels of reasons below a choice.
    fn levels(self, is_taken: bool) -> usize {
        if self == Self::Full || is_taken { usize::MAX } else { 1 }
    }
}

/// Writes explanations one below the other.
pub fn explanation(explained: &[Explanation], detail: Detail) -> String {
    let mut text = String::new();
    for one in explained {
        if !text.is_empty() {
            text.push('\n');
        }
        write_one(&mut text, one, detail);
    }
    text
}

fn write_one(text: &mut String, one: &Explanation, detail: Detail) {
    let _ = writeln!(
        text,
        "{} at {:.3} s, frame {}: {}{} (from {:.3} s), by the tree {}",
        one.track.name(),
        one.time_s,
        one.frame,
        one.leaf,
        suffix(&one.object, &one.partner),
        one.since_s,
        one.tree
    );
    let mut printed = PrintedNames::new();
    for step in &one.path {
        write_step(text, step, &mut printed, detail);
    }
    let has_changed = |latch: &&LatchState| detail == Detail::Full || latch.since_s.is_some();
    let latches: Vec<&LatchState> = one.latches.iter().filter(has_changed).collect();
    if !latches.is_empty() {
        text.push_str("  latches\n");
        for latch in latches {
            let when = match (latch.on, latch.since_s) {
                (true, Some(since)) => format!("set at {since:.3} s"),
                (true, None) => "set from the beginning".into(),
                (false, Some(since)) => format!("cleared at {since:.3} s"),
                (false, None) => "not set so far".into(),
            };
            let _ = writeln!(text, "    {} {when}", latch.latch);
        }
    }
    if let Some(settled) = &one.settled {
        write_label_change(text, "settled", settled);
    }
    if let Some(relabeled) = &one.relabeled {
        write_label_change(text, "relabeled", relabeled);
    }
    if let Some(task) = &one.task {
        write_task(text, task, detail);
    }
    if let Some(why_not) = &one.why_not {
        // On another frame names mean something else.
        if why_not.time_s.to_bits() != one.time_s.to_bits() {
            printed.clear();
        }
        write_why_not(text, why_not, &mut printed);
    }
}

fn suffix(object: &Option<String>, partner: &Option<String>) -> String {
    Subject { object: object.clone(), partner: partner.clone() }.suffix()
}

fn write_step(text: &mut String, step: &Step, printed: &mut PrintedNames, detail: Detail) {
    let indent = "  ".repeat(step.depth + 1);
    let taken = if step.taken { "yes" } else { "no " };
    let fact = match &step.reason {
        Some(reason) => words(reason),
        None => String::new(),
    };
    let _ = writeln!(text, "{indent}{taken} {}{fact}   {}", step.choice, step.place);
    if let Some(learned) = &step.learned {
        let _ = writeln!(text, "{indent}      learned: {learned}");
    }
    for reason in step.reason.iter().flat_map(|reason| &reason.because) {
        write_reason(text, reason, step.depth + 3, printed, detail.levels(step.taken));
    }
}

/// The measured values, after the condition.
fn words(reason: &Reason) -> String {
    let fact = reason.fact.as_ref().map_or(String::new(), |fact| format!(": {}", fact.words(reason.holds)));
    if reason.defaults.is_empty() {
        return fact;
    }
    let are = if reason.defaults.len() == 1 { "has its default" } else { "have their defaults" };
    format!("{fact}; `{}` {are} in the whole log, as if not logged", reason.defaults.join("`, `"))
}

/// Writes a reason and as many levels, this one included, of those below it.
fn write_reason(text: &mut String, reason: &Reason, depth: usize, printed: &mut PrintedNames, levels: usize) {
    let Some(below) = levels.checked_sub(1) else { return };
    let indent = "  ".repeat(depth);
    let holds = if reason.holds { "yes" } else { "no " };
    let slot = reason.slot.as_ref().map_or(String::new(), |slot| format!("{slot}: "));
    // At another time, names have other values than above.
    let (at, mut others) = (reason.at_s.map_or(String::new(), |at| format!(" at {at:.3} s")), PrintedNames::default());
    let printed = if reason.at_s.is_some() { &mut others } else { printed };
    if below > 0
        && is_name(&reason.condition)
        && !reason.because.is_empty()
        && !printed.insert((slot.clone(), reason.condition.clone()))
    {
        let _ = writeln!(text, "{indent}{holds} {slot}{}{}, as above", reason.condition, words(reason));
        return;
    }
    // A name whose meaning is one measured condition is printed on one line with it.
    match reason.because.as_slice() {
        [only]
            if reason.fact.is_none()
                && only.slot.is_none()
                && only.holds == reason.holds
                && is_name(&reason.condition) =>
        {
            let _ =
                writeln!(text, "{indent}{holds} {slot}{}{at} = {}{}", reason.condition, only.condition, words(only));
            for reason in &only.because {
                write_reason(text, reason, depth + 2, printed, below);
            }
        }
        because => {
            let _ = writeln!(text, "{indent}{holds} {slot}{}{at}{}", reason.condition, words(reason));
            for reason in because {
                write_reason(text, reason, depth + 2, printed, below);
            }
        }
    }
}

fn is_name(condition: &str) -> bool {
    condition.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '[' | ']'))
}

fn write_label_change(text: &mut String, word: &str, became: &LabelChange) {
    let _ = writeln!(text, "  {word}: {} {:.3} – {:.3} s", became.primitive, became.start_s, became.end_s);
    if !became.was.is_empty() {
        let _ = writeln!(text, "    was {}", became.was.join(" "));
    }
    for by in &became.by {
        match &by.place {
            Some(place) => {
                let _ = writeln!(text, "    by {}   {place}", by.what);
            }
            None => {
                let _ = writeln!(text, "    since {}", by.what);
            }
        }
    }
}

fn write_task(text: &mut String, task: &TaskReason, detail: Detail) {
    let subject = suffix(&task.object, &task.partner);
    let failure = if task.failure { ", a failure" } else { "" };
    let _ = writeln!(text, "  task: {}{subject} {:.3} – {:.3} s{failure}", task.task, task.start_s, task.end_s);
    if let Some(CompositePart { task, part, parts, start_s, end_s }) = &task.part_of {
        let (of, parts) = (parts.len(), parts.join(", "));
        let _ = writeln!(text, "    part {part} of {of} of {task} {start_s:.3} – {end_s:.3} s: {parts}");
    }
    // A task that does not match and is tried after the one that names the span decides nothing.
    let named = task.tried.iter().position(|tried| tried.matches).unwrap_or(task.tried.len());
    let decides = |(at, tried): &(usize, &TaskCandidate)| detail == Detail::Full || *at <= named || tried.matches;
    for (_, tried) in task.tried.iter().enumerate().filter(decides) {
        let taken = if tried.matches { "yes" } else { "no " };
        let asked = tried.asked.iter().map(|asked| format!("{} ({})", asked.what, asked.found));
        let _ =
            writeln!(text, "    {taken} {}: {}   {}", tried.task, asked.collect::<Vec<_>>().join(", "), tried.place);
    }
}

fn write_why_not(text: &mut String, why_not: &NearestPath, printed: &mut PrintedNames) {
    let NearestPath { primitive, time_s, choice, place, missing } = why_not;
    if missing.is_empty() {
        let _ = writeln!(text, "  {primitive} was given at {time_s:.3} s by {choice}   {place}");
        return;
    }
    let _ = writeln!(text, "  not {primitive}; nearest at {time_s:.3} s to {choice}   {place}");
    for Obstacle { choice, place, wanted, reason } in missing {
        let why = if *wanted { "is not so" } else { "takes it" };
        let _ = writeln!(text, "    {choice} {why}{}   {place}", words(reason));
        for below in &reason.because {
            write_reason(text, below, 3, printed, usize::MAX);
        }
    }
}
