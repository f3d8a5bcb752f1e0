//! The analysis as JSON, schema `teachtree.analysis/1`: keys in a fixed order, numbers by one printer, one segment a line.
//!
//! ```json
//! {"schema":"teachtree.analysis/1","log":{"path","frames","rate_hz","duration_s"},"rules":{"files":[],"digest","params":{}},
//!  "tracks":[{"track","segments":[{"primitive","start_s","end_s"}],
//!             "relabelled":[{"primitive","start_s","end_s","was":[],"by"}],
//!             "tasks":[{"task","start_s","end_s","secondary":[],"segments":[{"primitive","start_s","end_s","was":[],"by"}]}]}],
//!  "issues":[{"kind","start_s","end_s","channel","message"}]}
//! ```
//!
//! A track is `left`, `right` or `both`; `segments` is what the trees gave, `relabelled` the same time after relabelling, of which
//! `tasks[].segments` are parts. `was` is empty and `by` is "" where no rule changed anything; several rules are joined by `; `.
//! A task cut by an end of the recording or a gap has `"complete": false` and `"open": ["start"|"end"]`, others have neither.
//! `params` holds the overridden ones; `log.binding` is there when a binding was used.

use super::number::number;
use super::{Analysis, Segment, TaskSpan, Track};
use serde_json::{Map, Value, json};

/// The name and version of the schema.
pub const SCHEMA: &str = "teachtree.analysis/1";

/// What an analysis was made from, as the user named it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Meta {
    /// Path of the log.
    pub log: String,
    /// Path of its binding.
    pub binding: Option<String>,
    /// The rule files in the order of reading.
    pub rules: Vec<String>,
    /// Digest of the rule texts.
    pub digest: String,
    /// Overridden params with their values as they are shown, such as `0.3 N`.
    pub params: Vec<(String, String)>,
}

/// Writes the analysis.
pub fn json(analysis: &Analysis, meta: &Meta) -> String {
    let mut log = Map::new();
    log.insert("path".into(), json!(meta.log));
    if let Some(binding) = &meta.binding {
        log.insert("binding".into(), json!(binding));
    }
    log.insert("frames".into(), json!(analysis.frames));
    log.insert("rate_hz".into(), json!(analysis.rate_hz));
    log.insert("duration_s".into(), json!(analysis.end_s - analysis.start_s));
    let params: Map<String, Value> = meta.params.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    let document = json!({
        "schema": SCHEMA,
        "log": log,
        "rules": { "files": meta.rules, "digest": meta.digest, "params": params },
        "tracks": analysis.tracks.iter().map(track).collect::<Vec<_>>(),
        "issues": analysis.issues.iter().map(|issue| json!({
            "kind": issue.kind,
            "start_s": issue.start_s,
            "end_s": issue.end_s,
            "channel": issue.channel,
            "message": issue.message,
        })).collect::<Vec<_>>(),
    });
    printed(&document)
}

/// A document as text: one line for whatever lists no objects, numbers by the one printer.
pub fn printed(document: &Value) -> String {
    let mut text = String::new();
    print(document, 0, &mut text);
    text.push('\n');
    text
}

/// Which ends of a task were cut off: `start`, `end`.
pub(super) fn open(task: &TaskSpan) -> Vec<&'static str> {
    let ends = [("start", task.open_start), ("end", task.open_end)];
    ends.into_iter().filter(|(_, open)| *open).map(|(end, _)| end).collect()
}

fn track(track: &Track) -> Value {
    let raw =
        |segment: &Segment| json!({"primitive": segment.primitive, "start_s": segment.start_s, "end_s": segment.end_s});
    json!({
        "track": track.who.to_string(),
        "segments": track.segments.iter().map(raw).collect::<Vec<_>>(),
        "relabelled": track.relabelled.iter().map(relabelled).collect::<Vec<_>>(),
        "tasks": track.tasks.iter().map(task).collect::<Vec<_>>(),
    })
}

fn task(task: &TaskSpan) -> Value {
    let mut value = Map::new();
    value.insert("task".into(), json!(task.task));
    value.insert("start_s".into(), json!(task.start_s));
    value.insert("end_s".into(), json!(task.end_s));
    if task.open_start || task.open_end {
        value.insert("complete".into(), json!(false));
        value.insert("open".into(), json!(open(task)));
    }
    value.insert("secondary".into(), json!(task.secondary));
    value.insert("segments".into(), task.segments.iter().map(relabelled).collect());
    Value::Object(value)
}

fn relabelled(segment: &Segment) -> Value {
    json!({
        "primitive": segment.primitive,
        "start_s": segment.start_s,
        "end_s": segment.end_s,
        "was": segment.was,
        "by": segment.by.join("; "),
    })
}

/// Prints the document and what lists objects over several lines, and everything else on one. The depth is that of the schema.
fn print(value: &Value, indent: usize, text: &mut String) {
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
    let long = indent == 0 || lists_objects(value);
    text.push(open);
    for (place, (key, part)) in parts.into_iter().enumerate() {
        if place > 0 {
            text.push_str(if long { "," } else { ", " });
        }
        if long {
            text.push('\n');
            text.push_str(&"  ".repeat(indent + 1));
        }
        if let Some(key) = key {
            text.push_str(&Value::from(key.as_str()).to_string());
            text.push_str(": ");
        }
        print(part, indent + 1, text);
    }
    if long {
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
