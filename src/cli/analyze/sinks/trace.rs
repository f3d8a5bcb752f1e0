//! `analyze --trace`: an analysis as a trace of events, which Perfetto and Chrome's `about:tracing` show: a thread a track, the segments of a task below
//! it, signals as counters.

use super::Sink;
use crate::cli::output;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use teachtree_analysis::Segment;
use teachtree_analysis::json::VERSION;
use teachtree_base::error::InputError;
use teachtree_base::hands::TrackId;
use teachtree_session::AnalysisInternals;
use teachtree_session::{Analysis, Error, FrameValues};

/// The schema of the file.
const SCHEMA: &str = "teachtree.trace/1";
/// The number of the one process of a trace.
const PROCESS: u32 = 1;

pub(super) const SINK: Sink = Sink {
    check: |_, path, _| match path.extension() {
        Some(ending) if !ending.eq_ignore_ascii_case("json") => {
            let message = "expected a name that ends in .json, which a trace is";
            Err(InputError::new(path.display().to_string(), message))
        }
        _ => Ok(()),
    },
    needs_log: |args| !args.signals.is_empty(),
    ..Sink::new(["--trace", "a trace"], |args, path, _, analysis| {
        let trace = trace(analysis, &args.signals())?;
        Ok(Box::new(move |files, inputs| output::add(files, path, &trace, inputs)))
    })
};

/// The trace of an analysis with the values of signals, as JSON with an event a line. Times are whole µs, so that what ends where the next begins does so
/// for readers too.
///
/// # Errors
/// When there is no such signal.
fn trace(analysis: &Analysis, signals: &[&str]) -> Result<String, Error> {
    let (found, meta) = (analysis.found(), analysis.meta());
    let microseconds = |time_s: f64| ((time_s + meta.zero_stamp_s) * 1e6).round() as i64;
    let named = |kind: &str, thread: u32, args: Value| json!({ "ph": "M", "name": kind, "pid": PROCESS, "tid": thread, "args": args });
    let mut events = vec![named("process_name", 0, json!({ "name": meta.name }))];
    for track in &found.tracks {
        let thread = thread(track.who);
        events.push(named("thread_name", thread, json!({ "name": track.who.to_string() })));
        events.push(named("thread_sort_index", thread, json!({ "sort_index": thread })));
        let mut spans: Vec<(i64, i64, Value)> = Vec::new();
        let mut add = |name: &str, kind: &str, (start_s, end_s): (f64, f64), args: Map<String, Value>| {
            let (start, end) = (microseconds(start_s), microseconds(end_s));
            let event = json!({ "ph": "X", "name": name, "cat": kind, "pid": PROCESS, "tid": thread, "ts": start,
                "dur": end - start, "args": args });
            spans.push((start, end, event));
        };
        for task in &track.tasks {
            let rows = (task.rows.start, task.rows.end);
            let mut args = about(task.subject.object.as_ref(), task.subject.partner.as_ref(), rows);
            if !task.secondary.is_empty() {
                args.insert("also".into(), json!(task.secondary));
            }
            add(&task.task, "task", (task.start_s, task.end_s), args);
        }
        for Segment { primitive, subject, rows, start_s, end_s, was, by, .. } in &track.relabeled {
            let mut args = about(subject.object.as_ref(), subject.partner.as_ref(), (rows.start, rows.end));
            if !was.is_empty() {
                args.insert("was".into(), json!(was));
                args.insert("by".into(), json!(by));
            }
            add(primitive, "primitive", (*start_s, *end_s), args);
        }
        // What is around others stands before them: of two that begin at once the longer one, and the task before its only segment.
        spans.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.cmp(&a.1)));
        events.extend(spans.into_iter().map(|(.., event)| event));
    }
    events.extend(counters(analysis, signals, &microseconds)?);
    let params: Map<String, Value> = meta.params.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    let other = json!({ "version": VERSION, "log": meta.log, "rules": meta.rules.join(" "), "digest": meta.digest,
        "params": params });
    let mut text =
        format!("{{\"schema\":\"{SCHEMA}\",\"displayTimeUnit\":\"ms\",\"otherData\":{other},\"traceEvents\":[");
    for (at, event) in events.iter().enumerate() {
        let _ = write!(text, "{}\n{event}", if at == 0 { "" } else { "," });
    }
    text.push_str("\n]}\n");
    Ok(text)
}

/// The thread of a track.
fn thread(who: TrackId) -> u32 {
    match who.side() {
        Some(side) => 1 + side as u32,
        None => 3,
    }
}

/// What an event is about.
fn about(object: Option<&String>, partner: Option<&String>, (first, end): (usize, usize)) -> Map<String, Value> {
    let mut args = Map::new();
    let subject = [("object", object), ("partner", partner)];
    args.extend(subject.into_iter().filter_map(|(name, body)| Some((name.into(), json!(body?)))));
    args.insert("start_row".into(), json!(first));
    args.insert("end_row".into(), json!(end));
    args
}

/// The values of signals, each where it changes: a counter holds until its next value.
fn counters(analysis: &Analysis, signals: &[&str], microseconds: &dyn Fn(f64) -> i64) -> Result<Vec<Value>, Error> {
    if signals.is_empty() {
        return Ok(Vec::new());
    }
    let table = analysis.frames(signals)?;
    let Some(FrameValues::Numbers(time)) = table.column("time") else { return Ok(Vec::new()) };
    let mut events = Vec::new();
    for (name, _, values) in table.columns() {
        let FrameValues::Numbers(values) = values else { continue };
        if matches!(name, "time" | "row") {
            continue;
        }
        let mut last = f64::NAN;
        for (time_s, value) in time.iter().zip(values) {
            // What is not known has no event, since JSON has no number for it.
            if value.is_finite() && *value != last {
                events.push(json!({ "ph": "C", "name": name, "pid": PROCESS, "ts": microseconds(*time_s),
                    "args": { "value": value } }));
                last = *value;
            }
        }
    }
    Ok(events)
}
