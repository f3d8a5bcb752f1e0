//! The result of `learn` as `teachtree.learning/1` (docs/formats.md).

use serde_json::{Value, json};
use std::path::Path;
use teachtree_analysis::json::VERSION;
use teachtree_learn::{Candidate, FoundInterval, LearningResult, LineChange, Recognition, RelearnedRules};
use teachtree_new_primitive::NewPrimitive;

/// The result that `learn` prints, with and without `--new`.
pub struct RuleOutput<'a> {
    /// The rule file that was chosen.
    pub rules: &'a str,
    /// Whether it is better than the rules that it replaces, or only adds to those that it extends.
    pub is_better: bool,
    /// Where it was written.
    pub file: Option<&'a Path>,
}

fn document(written: &RuleOutput, recordings: usize, conditions: usize) -> Value {
    json!({
        "schema": "teachtree.learning/1",
        "version": VERSION,
        "recordings": recordings,
        "conditions": conditions,
        "rules": written.rules,
        "better": written.is_better,
        "file": written.file.map(|file| file.display().to_string()),
    })
}

/// Rules for all labels, of groups of recordings.
pub fn of_file(written: &RuleOutput, learned: &LearningResult, recordings: usize, groups: &[String]) -> Value {
    let mut document = document(written, recordings, learned.conditions);
    document["groups"] = json!(groups);
    document["boundaries"] = json!(learned.boundaries.0);
    document["candidates"] = candidates(&learned.candidates, learned.chosen);
    document["versions"] = json!(learned.extent.versions);
    document["complete"] = json!(!learned.extent.is_cut);
    document
}

fn candidates(all: &[Candidate], chosen: usize) -> Value {
    let candidate = |(at, it): (usize, &Candidate)| json!({"name": it.name, "f1": it.f1, "accuracy": it.accuracy, "lines": it.lines, "chosen": at == chosen});
    all.iter().enumerate().map(candidate).collect()
}

/// Changes of a written file.
pub fn of_changes(
    written: &RuleOutput,
    learned: &RelearnedRules,
    recordings: usize,
    groups: &[String],
    patch: &str,
) -> Value {
    let change = |it: &LineChange| {
        let [[f1, accuracy], [f1_after, accuracy_after]] = it.held_out;
        json!({
            "line": it.line,
            "before": it.texts[0],
            "after": it.texts[1],
            "f1": [f1, f1_after],
            "accuracy": [accuracy, accuracy_after],
        })
    };
    let mut document = document(written, recordings, learned.conditions);
    document["groups"] = json!(groups);
    document["candidates"] = candidates(&learned.candidates, usize::from(written.is_better));
    document["versions"] = json!(learned.runs);
    document["complete"] = json!(!learned.is_cut);
    document["changes"] = learned.changes.iter().map(change).collect();
    document["patch"] = json!(patch);
    document
}

/// A new primitive.
pub fn of_primitive(written: &RuleOutput, learned: &NewPrimitive) -> Value {
    let extension = &learned.extension;
    let recognition = |it: Recognition| json!({"labeled": it.marked, "found": it.found, "matched": it.matched, "overlap": it.overlap()});
    let interval = |it: &FoundInterval| {
        json!({
            "log": learned.log(it.recording).name(),
            "track": it.who,
            "start_s": it.time_s[0],
            "end_s": it.time_s[1],
            "found": it.is_found,
            "labeled": it.is_marked,
            "agreement": it.agreement,
        })
    };
    let findings = extension.proof.findings.iter().map(|it| json!({"what": it.what, "place": it.place}));
    let mut document = document(written, learned.recordings.len(), extension.tried[0]);
    document["primitive"] = json!({
        "name": learned.name,
        "places": extension.tried[1],
        "learned": recognition(extension.learned),
        "held_out": recognition(extension.held_out),
        "demonstrations": learned.demonstrations.len(),
        "proved": extension.proof.is_proved(),
        "findings": findings.collect::<Vec<_>>(),
        "intervals": extension.intervals.iter().map(interval).collect::<Vec<_>>(),
    });
    document
}
