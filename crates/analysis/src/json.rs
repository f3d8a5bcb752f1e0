//! The analysis as JSON, schema `teachtree.analysis/2` (docs/formats.md): keys in a fixed order, numbers by one printer, one segment a line.
//!
//! ```json
//! {"schema":"teachtree.analysis/2","version",
//!  "log":{"name","path","frames","rows","rate_hz","start_s","duration_s","zero_stamp_s"},"rules":{"files":[],"digest","params":{}},
//!  "tracks":[{"track","segments":[{"primitive",SPAN}],
//!             "relabeled":[{"primitive",SPAN,"was":[],"by"}],
//!             "tasks":[{"task",SPAN,"attempt","secondary":[],"segments":[{"primitive",SPAN,"was":[],"by"}]}],
//!             "composites":[{"task","tasks":[],"parts":[],"start_s","end_s","start_row","end_row"}]}],
//!  "outcome":{"result","attempts","reasons":[{"kind","track","task","start_s","end_s","message"}]},
//!  "issues":[{"kind","start_s","end_s","channel","message"}]}
//! ```
//!
//! SPAN is `"object","partner","start_s","end_s","start_row","end_row"`; object and partner may be null.
//! A track is `left`, `right` or `both`; `segments` is what the trees gave, `relabeled` the same time after relabeling, of which
//! `tasks[].segments` are parts. `was` is empty and `by` is "" where no rule changed anything; several rules are joined by `; `.
//! `composites` are the tasks that are made of tasks, where there are any: `parts` are the names of these, `tasks` their numbers in the track, from 1.
//! A task that the rules declare as a failure has `"failure": true`, also one that is made of tasks.
//! A task cut by an end of the recording or a gap has `"complete": false` and `"open": ["start"|"end"]`, others have neither.
//! With `analyze --confidence`, segments after relabeling have `"confidence","stability","earliest_s","latest_s","margin"` too, and tasks `"stability"`.
//! `outcome` has `"expected","as_expected"` too where tasks are expected; `track`, `task` and the times of a reason are null where it is about the recording.
//! `params` holds the overridden ones; `log.binding` is there when a binding was used.

use super::number::number;
use super::outcome::{Outcome, OutcomeReason};
use super::{Analysis, CompositeSpan, Confidence, Segment, Subject, TaskSpan, Track, TrackId};
use serde_json::{Map, Value, json};
use std::ops::Range;
use teachtree_logs::issue::Issue;
use teachtree_logs::read::date_time;
use teachtree_logs::read::first_stamp::SINCE_1970_S;

/// The name and version of the schema.
pub const SCHEMA: &str = "teachtree.analysis/2";

/// The version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The inputs of an analysis, as the user named them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Meta {
    /// Path of the log.
    pub log: String,
    /// Name of the recording: that of its file, without folders and ending.
    pub name: String,
    /// The clock of the log at t = 0, s.
    pub zero_stamp_s: f64,
    /// Path of its binding.
    pub binding: Option<String>,
    /// The rule files in the order of reading.
    pub rules: Vec<String>,
    /// The hand model among them and why it was loaded, where rules needed one for the log.
    pub hand_model: Option<String>,
    /// Digest of the rule texts.
    pub digest: String,
    /// Overridden params with their values as they are shown, such as `0.3 N`.
    pub params: Vec<(String, String)>,
}

impl Meta {
    /// The date and the time of day at t = 0, if the stamps of the log count from 1970.
    pub fn date(&self) -> Option<String> {
        (self.zero_stamp_s >= SINCE_1970_S).then(|| date_time::written(self.zero_stamp_s))
    }
}

/// Writes the analysis as a document of several lines.
pub fn json(analysis: &Analysis, meta: &Meta) -> String {
    printed(&document(analysis, meta))
}

/// Writes the analysis as one line, for files of several.
pub fn line(analysis: &Analysis, meta: &Meta) -> String {
    let mut text = String::new();
    print(&document(analysis, meta), None, &mut text);
    text.push('\n');
    text
}

/// The rules that were run.
pub(super) fn rules(meta: &Meta) -> Value {
    let params: Map<String, Value> = meta.params.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    let mut rules = json!({ "files": meta.rules, "digest": meta.digest, "params": params });
    if let (Some(hand_model), Some(rules)) = (&meta.hand_model, rules.as_object_mut()) {
        rules.insert("hand_model".into(), json!(hand_model));
    }
    rules
}

fn document(analysis: &Analysis, meta: &Meta) -> Value {
    let mut log = Map::new();
    log.insert("name".into(), json!(meta.name));
    log.insert("path".into(), json!(meta.log));
    if let Some(binding) = &meta.binding {
        log.insert("binding".into(), json!(binding));
    }
    log.insert("frames".into(), json!(analysis.frames));
    log.insert("rows".into(), json!(analysis.rows));
    log.insert("rate_hz".into(), json!(analysis.rate_hz));
    log.insert("start_s".into(), json!(analysis.start_s));
    log.insert("duration_s".into(), json!(analysis.end_s - analysis.start_s));
    log.insert("zero_stamp_s".into(), json!(meta.zero_stamp_s));
    json!({
        "schema": SCHEMA,
        "version": VERSION,
        "log": log,
        "rules": rules(meta),
        "outcome": outcome(&analysis.outcome()),
        "tracks": analysis.tracks.iter().map(track).collect::<Vec<_>>(),
        "issues": analysis.issues.iter().map(issue).collect::<Vec<_>>(),
    })
}

/// An issue of the log.
pub fn issue(issue: &Issue) -> Value {
    json!({
        "kind": issue.kind,
        "start_s": issue.start_s,
        "end_s": issue.end_s,
        "channel": issue.channel,
        "message": issue.message,
    })
}

/// The outcome of a recording.
pub fn outcome(outcome: &Outcome) -> Value {
    let reason = |reason: &OutcomeReason| {
        json!({
            "kind": reason.kind,
            "track": reason.track.map(|track| track.to_string()),
            "task": reason.task,
            "start_s": reason.span_s.map(|[start, _]| start),
            "end_s": reason.span_s.map(|[_, end]| end),
            "message": reason.message,
        })
    };
    let mut value = Map::new();
    value.insert("result".into(), json!(outcome.result));
    value.insert("attempts".into(), json!(outcome.attempts));
    value.extend(outcome.expected.as_ref().map(|expected| ("expected".into(), json!(expected))));
    value.extend(outcome.is_as_expected.map(|is| ("as_expected".into(), json!(is))));
    value.insert("reasons".into(), outcome.reasons.iter().map(reason).collect());
    Value::Object(value)
}

/// Returns a document as text: values without objects are on one line; numbers by the one printer.
pub fn printed(document: &Value) -> String {
    let mut text = String::new();
    print(document, Some(0), &mut text);
    text.push('\n');
    text
}

/// Which ends of a task were cut off: `start`, `end`.
pub(super) fn open(task: &TaskSpan) -> Vec<&'static str> {
    cut_ends(task.open_start, task.open_end)
}

pub(super) fn cut_ends(start: bool, end: bool) -> Vec<&'static str> {
    [("start", start), ("end", end)].into_iter().filter(|(_, open)| *open).map(|(end, _)| end).collect()
}

fn track(track: &Track) -> Value {
    let mut value = json!({
        "track": track.who.to_string(),
        "segments": track.segments.iter().map(|segment| Value::Object(raw(segment))).collect::<Vec<_>>(),
        "relabeled": track.relabeled.iter().map(relabeled).collect::<Vec<_>>(),
        "tasks": track.tasks.iter().map(task).collect::<Vec<_>>(),
    });
    if !track.composites.is_empty() {
        value["composites"] = track.composites.iter().map(composite).collect();
    }
    value
}

/// The field of a failure.
fn failure(is_failure: bool) -> Option<(String, Value)> {
    is_failure.then(|| ("failure".into(), json!(true)))
}

fn composite(found: &CompositeSpan) -> Value {
    let mut value = Map::new();
    value.insert("task".into(), json!(found.task));
    value.extend(failure(found.failure));
    value.insert("tasks".into(), json!(found.tasks.clone().map(|at| at + 1).collect::<Vec<_>>()));
    value.insert("parts".into(), json!(found.parts));
    value.insert("start_s".into(), json!(found.start_s));
    value.insert("end_s".into(), json!(found.end_s));
    value.insert("start_row".into(), json!(found.rows.start));
    value.insert("end_row".into(), json!(found.rows.end));
    if found.open_start || found.open_end {
        value.insert("complete".into(), json!(false));
        value.insert("open".into(), json!(cut_ends(found.open_start, found.open_end)));
    }
    Value::Object(value)
}

/// The common fields of segments and tasks, after the key of the name.
fn span(key: &str, name: &str, subject: &Subject, time_s: (f64, f64), rows: &Range<usize>) -> Map<String, Value> {
    let mut value = Map::new();
    value.insert(key.into(), json!(name));
    value.insert("object".into(), json!(subject.object));
    value.insert("partner".into(), json!(subject.partner));
    value.insert("start_s".into(), json!(time_s.0));
    value.insert("end_s".into(), json!(time_s.1));
    value.insert("start_row".into(), json!(rows.start));
    value.insert("end_row".into(), json!(rows.end));
    value
}

fn raw(segment: &Segment) -> Map<String, Value> {
    let time_s = (segment.start_s, segment.end_s);
    span("primitive", &segment.primitive, &segment.subject, time_s, &segment.rows)
}

fn task(task: &TaskSpan) -> Value {
    let mut value = span("task", &task.task, &task.subject, (task.start_s, task.end_s), &task.rows);
    value.extend(failure(task.failure));
    if task.open_start || task.open_end {
        value.insert("complete".into(), json!(false));
        value.insert("open".into(), json!(open(task)));
    }
    value.insert("attempt".into(), json!(task.attempt));
    value.insert("secondary".into(), json!(task.secondary));
    value.extend(task.stability.map(|share| ("stability".into(), json!(share))));
    value.insert("segments".into(), task.segments.iter().map(relabeled).collect());
    Value::Object(value)
}

fn relabeled(segment: &Segment) -> Value {
    let mut value = raw(segment);
    value.insert("was".into(), json!(segment.was));
    value.insert("by".into(), json!(segment.by.join("; ")));
    if let Some(Confidence { share, stability, earliest_s, latest_s, margin }) = segment.confidence {
        value.insert("confidence".into(), json!(share));
        value.insert("stability".into(), json!(stability));
        value.insert("earliest_s".into(), json!(earliest_s));
        value.insert("latest_s".into(), json!(latest_s));
        value.insert("margin".into(), json!(margin));
    }
    Value::Object(value)
}

/// The schema of a line of a live log.
const LIVE: &str = "teachtree.live/1";

/// The primitive of a track at the newest frame, on one line.
pub fn live_label(
    sequence: u64,
    who: TrackId,
    primitive: Option<&str>,
    time_s: f64,
    confidence: Option<f64>,
) -> String {
    let mut label = json!({ "primitive": primitive, "time_s": time_s });
    if let (Value::Object(label), Some(confidence)) = (&mut label, confidence) {
        label.insert("confidence".into(), json!(confidence));
    }
    live("label", sequence, Some(who), false, label)
}

/// A segment of a live log, on one line.
pub fn live_segment(sequence: u64, who: TrackId, segment: &Segment, is_final: bool) -> String {
    live("segment", sequence, Some(who), is_final, relabeled(segment))
}

/// A task of a live log, on one line.
pub fn live_task(sequence: u64, who: TrackId, span: &TaskSpan, is_final: bool) -> String {
    let mut value = task(span);
    if let Value::Object(fields) = &mut value {
        // The attempts before those that the history keeps are unknown.
        fields.shift_remove("attempt");
    }
    live("task", sequence, Some(who), is_final, value)
}

/// A task that is made of tasks, of a live log, on one line. Its tasks are not numbered.
pub fn live_composite(sequence: u64, who: TrackId, found: &CompositeSpan) -> String {
    let mut value = composite(found);
    if let Value::Object(fields) = &mut value {
        fields.shift_remove("tasks");
    }
    live("composite", sequence, Some(who), true, value)
}

/// An issue of a live log, on one line.
pub fn live_issue(sequence: u64, issue: &Issue) -> String {
    live("issue", sequence, None, true, json!(issue))
}

/// Returns the time of 0 s of a live log, on one line.
pub fn live_clock(sequence: u64, origin_ns: i64) -> String {
    live("clock", sequence, None, true, json!({ "origin_ns": origin_ns }))
}

fn live(event: &str, sequence: u64, who: Option<TrackId>, is_final: bool, what: Value) -> String {
    let mut line = Map::new();
    line.insert("schema".into(), json!(LIVE));
    line.insert("sequence".into(), json!(sequence));
    line.insert("event".into(), json!(event));
    line.insert("final".into(), json!(is_final));
    line.extend(who.map(|who| ("track".into(), json!(who.to_string()))));
    if let Value::Object(what) = without_rows(what) {
        line.extend(what);
    }
    let mut text = String::new();
    print(&Value::Object(line), None, &mut text);
    text
}

/// Rows of a live log are not counted.
fn without_rows(mut value: Value) -> Value {
    if let Value::Object(fields) = &mut value {
        fields.shift_remove("start_row");
        fields.shift_remove("end_row");
        if let Some(Value::Array(segments)) = fields.get_mut("segments") {
            segments.iter_mut().for_each(|segment| *segment = without_rows(segment.take()));
        }
    }
    value
}

/// Prints the document and what lists objects over several lines, and everything else on one; without an indent all of it on one.
/// The depth is that of the schema.
fn print(value: &Value, indent: Option<usize>, text: &mut String) {
    let (open, close, parts): (char, char, Vec<(Option<&String>, &Value)>) = match value {
        Value::Array(items) => ('[', ']', items.iter().map(|item| (None, item)).collect()),
        Value::Object(fields) => ('{', '}', fields.iter().map(|(key, field)| (Some(key), field)).collect()),
        Value::Number(number_value) => {
            match number_value.as_f64() {
                Some(float) if number_value.is_f64() => text.push_str(&number(float)),
                _ => text.push_str(&number_value.to_string()),
            }
            return;
        }
        scalar => {
            text.push_str(&scalar.to_string());
            return;
        }
    };
    // The indentation of parts that have their own lines.
    let indent = indent.filter(|indent| *indent == 0 || lists_objects(value));
    text.push(open);
    for (place, (key, part)) in parts.into_iter().enumerate() {
        if place > 0 {
            text.push_str(if indent.is_some() { "," } else { ", " });
        }
        if let Some(indent) = indent {
            text.push('\n');
            text.push_str(&"  ".repeat(indent + 1));
        }
        if let Some(key) = key {
            text.push_str(&Value::from(key.as_str()).to_string());
            text.push_str(": ");
        }
        print(part, indent.map(|indent| indent + 1), text);
    }
    if let Some(indent) = indent {
        text.push('\n');
        text.push_str(&"  ".repeat(indent));
    }
    text.push(close);
}

fn lists_objects(value: &Value) -> bool {
    match value {
        Value::Array(items) => items.iter().any(Value::is_object),
        Value::Object(fields) => fields.values().any(lists_objects),
        _ => false,
    }
}
