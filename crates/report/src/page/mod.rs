//! The page to work in: what its scripts read, as one JSON document, and the scripts themselves.
//!
//! `curves.js` reads curves, `camera.js` chooses the first view of the replay, `replay.js` draws the demonstration in three dimensions, `signals.js` the
//! signals, `why.js` writes explanations, and `work.js` draws the lanes, answers pointer and keys, and keeps all in step; none asks for anything outside the
//! page. Curves are thinned (`thin`), so that the size is bounded however long the log is. `report.js` starts them on the page of one recording; the studio loads one recording
//! after the other into the same scripts.

mod changes;
pub mod decimation;
mod quantities;
pub mod replay;

use super::palette::{self, TASKS};
use super::{parts, remarks};
use changes::ReasonTables;
use decimation::rounded;
use serde_json::{Map, Value, json};
use teachtree_analysis::explain::AnalyzedRecording;
use teachtree_analysis::json::Meta;
use teachtree_analysis::{Analysis, Segment, Track};
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_engine::inspect::Inspector;
use teachtree_language::Rules;

/// The style of the page.
pub const STYLE: &str = include_str!("page.css");
/// The place of the lanes, signals and replay, hidden until a script fills it.
pub const PLACE: &str = include_str!("work.html");
/// What draws and listens, without a start: `load` shows what [`data`] returns, `showTracks` other [`tracks`] of the same recording.
pub const SCRIPTS: [&str; 6] = [
    include_str!("curves.js"),
    include_str!("camera.js"),
    include_str!("replay.js"),
    include_str!("signals.js"),
    include_str!("why.js"),
    include_str!("work.js"),
];

/// The data and the scripts, as elements.
///
/// # Errors
/// When the rate of the log cannot honour a duration of the rules.
pub(super) fn scripts(analyzed: &AnalyzedRecording, recording: &Recording, meta: &Meta) -> Result<String, InputError> {
    Ok(elements(&data(analyzed, recording, meta)?))
}

/// What the scripts show and the scripts themselves, as elements.
pub fn elements(data: &Value) -> String {
    // Within a string of JSON any letter may be written by its number; so nothing in the data ends the element.
    let data = data.to_string();
    let data = data.replace('&', "\\u0026").replace('<', "\\u003c").replace('>', "\\u003e");
    format!(
        "<script type=\"application/json\" id=\"data\">{data}</script>\n<script>\n\"use strict\";\n(() => {{\n{}{}{}}})();\n</script>\n",
        SCRIPTS.concat(),
        include_str!("tables.js"),
        include_str!("report.js")
    )
}

/// What the scripts show of a recording.
///
/// # Errors
/// When the rate of the log cannot honour a duration of the rules.
pub fn data(analyzed: &AnalyzedRecording, recording: &Recording, meta: &Meta) -> Result<Value, InputError> {
    let AnalyzedRecording { rules, frames, leaves, analysis } = *analyzed;
    let mut inspectors: Vec<Inspector> = leaves.iter().map(|leaves| Inspector::new(rules, frames, leaves)).collect();
    let signals = quantities::all(rules, frames, &mut inspectors)?;
    let mut book = ReasonTables::default();
    let mut tracks = Vec::new();
    for track in &analysis.tracks {
        let changes = changes::boundaries(analyzed, &mut inspectors, track, &mut book)?;
        let tried = changes::tasks(analyzed, &inspectors, track);
        tracks.push(self::track(track, changes, tried));
    }
    let (texts, reasons) = book.tables();
    let stretches = frames.stretches.iter().map(|stretch| {
        let start = frames.time.get(stretch.start).copied().unwrap_or_default();
        json!([stretch.start, stretch.end, rounded(start)])
    });
    let issues = analysis
        .issues
        .iter()
        .map(|issue| json!([rounded(issue.start_s), rounded(issue.end_s), issue.kind, issue.channel, issue.message]));
    Ok(json!({
        "log": meta.log,
        "start": rounded(analysis.start_s),
        "end": rounded(analysis.end_s),
        "rate": frames.layout.rate_hz,
        "stretches": stretches.collect::<Vec<_>>(),
        "colors": colors(&analysis.tracks),
        "tracks": tracks,
        "texts": texts,
        "reasons": reasons,
        "groups": quantities::GROUPS,
        "signals": signals,
        "issues": issues.collect::<Vec<_>>(),
        "replay": replay::replay(frames, recording),
    }))
}

/// The lanes of an analysis and their colors, without explanations: `{"tracks","colors"}`.
pub fn tracks(analysis: &Analysis) -> Value {
    let tracks = analysis.tracks.iter().map(|track| {
        let tried = vec![Value::Null; track.tasks.len()];
        self::track(track, Vec::new(), tried)
    });
    json!({ "tracks": tracks.collect::<Vec<_>>(), "colors": colors(&analysis.tracks) })
}

fn track(track: &Track, changes: Vec<Value>, tried: Vec<Value>) -> Value {
    let segment = |segment: &Segment| {
        let (was, by) = match segment.by.is_empty() {
            true => (Value::Null, Value::Null),
            false => (json!(segment.was), json!(segment.by)),
        };
        let subject = segment.subject.suffix();
        // How sure the start is, with `analyze --confidence`.
        let sure =
            segment.confidence.map(|it| json!([rounded(it.share), rounded(it.earliest_s), rounded(it.latest_s)]));
        json!([
            segment.primitive,
            rounded(segment.start_s),
            rounded(segment.end_s),
            was,
            by,
            subject.trim_start(),
            sure
        ])
    };
    let tasks = track.tasks.iter().zip(tried).zip(TASKS.iter().cycle()).map(|((task, tried), color)| {
        json!({
            "task": task.task,
            "subject": task.subject.suffix().trim_start(),
            "start": rounded(task.start_s),
            "end": rounded(task.end_s),
            "open": [task.open_start, task.open_end],
            "remarks": remarks(task),
            "stability": task.stability.map(rounded),
            "color": color.hex(),
            "tried": tried,
        })
    });
    let composites = track.composites.iter().zip(TASKS.iter().cycle().skip(1)).map(|(found, color)| {
        json!({
            "task": found.task,
            "first": found.tasks.start,
            "start": rounded(found.start_s),
            "end": rounded(found.end_s),
            "open": [found.open_start, found.open_end],
            "remarks": parts(found),
            "color": color.hex(),
        })
    });
    json!({
        "who": track.who.to_string(),
        "raw": track.segments.iter().map(segment).collect::<Vec<_>>(),
        "relabeled": track.relabeled.iter().map(segment).collect::<Vec<_>>(),
        "tasks": tasks.collect::<Vec<_>>(),
        "composites": composites.collect::<Vec<_>>(),
        "changes": changes,
    })
}

/// The colors of all labels that rules can give, by name.
pub fn colors_of(rules: &Rules) -> Map<String, Value> {
    let color = |label| {
        let name = rules.label_name(label);
        let color = palette::color(&name, rules.meaning_for(label, None)).hex();
        (name, color.into())
    };
    rules.labels().map(color).collect()
}

/// The colors of the primitives that there are.
fn colors(tracks: &[Track]) -> Map<String, Value> {
    let segments = tracks.iter().flat_map(|track| track.segments.iter().chain(&track.relabeled));
    segments
        .map(|segment| (segment.primitive.clone(), palette::color(&segment.primitive, segment.does).hex().into()))
        .collect()
}
