//! The tables of an analysis, in the names of docs/formats.md.

use crate::arrow::Table;
use arrow_array::builder::{ListBuilder, StringBuilder};
use arrow_array::{ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow_schema::ArrowError;
use std::ops::Range;
use std::sync::Arc;
use teachtree::{Analysis, FrameTable, FrameValues, Segment, Task};

type Columns = Vec<(&'static str, ArrayRef, bool)>;

fn table(columns: Columns) -> Result<Table, ArrowError> {
    RecordBatch::try_from_iter_with_nullable(columns).map(Table)
}

fn texts<'a>(texts: impl Iterator<Item = &'a str>) -> ArrayRef {
    Arc::new(texts.map(Some).collect::<StringArray>())
}

fn optional<'a>(texts: impl Iterator<Item = Option<&'a str>>) -> ArrayRef {
    Arc::new(texts.collect::<StringArray>())
}

fn lists<'a>(lists: impl Iterator<Item = &'a [String]>) -> ArrayRef {
    let mut builder = ListBuilder::new(StringBuilder::new());
    for list in lists {
        builder.append_value(list.iter().map(Some));
    }
    Arc::new(builder.finish())
}

fn numbers(numbers: impl Iterator<Item = f64>) -> ArrayRef {
    Arc::new(numbers.collect::<Float64Array>())
}

fn maybe(numbers: impl Iterator<Item = Option<f64>>) -> ArrayRef {
    Arc::new(numbers.collect::<Float64Array>())
}

fn counts(counts: impl Iterator<Item = usize>) -> ArrayRef {
    Arc::new(counts.map(|count| i64::try_from(count).unwrap_or(i64::MAX)).collect::<Int64Array>())
}

/// Times, rows and frames, which segments and tasks have alike.
fn spans(times: impl Iterator<Item = (f64, f64)>, rows: &[Range<usize>], frames: &[Range<usize>]) -> Columns {
    let (starts, ends): (Vec<f64>, Vec<f64>) = times.unzip();
    vec![
        ("start_s", numbers(starts.into_iter()), false),
        ("end_s", numbers(ends.into_iter()), false),
        ("start_row", counts(rows.iter().map(|rows| rows.start)), false),
        ("end_row", counts(rows.iter().map(|rows| rows.end)), false),
        ("start_frame", counts(frames.iter().map(|frames| frames.start)), false),
        ("end_frame", counts(frames.iter().map(|frames| frames.end)), false),
    ]
}

/// The segments of all tracks, by track and time.
pub fn segments(analysis: &Analysis, raw: bool) -> Result<Table, ArrowError> {
    let mut all: Vec<(Segment<'_>, Option<i64>)> = Vec::new();
    for track in analysis.tracks() {
        if raw {
            all.extend(track.raw_segments().map(|segment| (segment, None)));
            continue;
        }
        let tasks: Vec<Range<usize>> = track.tasks().map(Task::frames).collect();
        for segment in track.segments() {
            let frames = segment.frames();
            let of = tasks.iter().position(|task| task.start <= frames.start && frames.end <= task.end);
            all.push((segment, of.and_then(|at| i64::try_from(at + 1).ok())));
        }
    }
    let of = || all.iter().map(|(segment, _)| *segment);
    let tracks: Vec<String> = of().map(|segment| segment.track().to_string()).collect();
    let rows: Vec<_> = of().map(Segment::rows).collect();
    let frames: Vec<_> = of().map(Segment::frames).collect();
    let mut columns: Columns = vec![
        ("track", texts(tracks.iter().map(String::as_str)), false),
        ("primitive", texts(of().map(Segment::primitive)), false),
        ("object", optional(of().map(Segment::object)), true),
        ("partner", optional(of().map(Segment::partner)), true),
    ];
    columns.extend(spans(of().map(|segment| (segment.start_s(), segment.end_s())), &rows, &frames));
    if !raw {
        columns.push(("task", Arc::new(all.iter().map(|(_, task)| *task).collect::<Int64Array>()), true));
        columns.push(("was", lists(of().map(Segment::was)), false));
        columns.push(("by", lists(of().map(Segment::changed_by)), false));
        if of().any(|segment| segment.confidence().is_some()) {
            columns.push(("confidence", maybe(of().map(|one| one.confidence().map(|it| it.share))), true));
            columns.push(("stability", maybe(of().map(|one| one.confidence().map(|it| it.stability))), true));
            columns.push(("earliest_s", maybe(of().map(|one| one.confidence().map(|it| it.earliest_s))), true));
            columns.push(("latest_s", maybe(of().map(|one| one.confidence().map(|it| it.latest_s))), true));
            columns.push(("margin", maybe(of().map(|one| one.confidence().and_then(|it| it.margin))), true));
        }
    }
    table(columns)
}

/// The tasks of all tracks, by track and time.
pub fn tasks(analysis: &Analysis) -> Result<Table, ArrowError> {
    let all: Vec<Task<'_>> = analysis.tracks().flat_map(teachtree::Track::tasks).collect();
    let of = || all.iter().copied();
    let tracks: Vec<String> = of().map(|task| task.track().to_string()).collect();
    let rows: Vec<_> = of().map(Task::rows).collect();
    let frames: Vec<_> = of().map(Task::frames).collect();
    let mut columns: Columns = vec![
        ("track", texts(tracks.iter().map(String::as_str)), false),
        ("task", texts(of().map(Task::name)), false),
        ("object", optional(of().map(Task::object)), true),
        ("partner", optional(of().map(Task::partner)), true),
    ];
    columns.extend(spans(of().map(|task| (task.start_s(), task.end_s())), &rows, &frames));
    columns.push(("attempt", counts(of().map(Task::attempt)), false));
    columns.push(("failure", Arc::new(of().map(|task| Some(task.is_failure())).collect::<BooleanArray>()), false));
    columns.push(("secondary", lists(of().map(Task::also)), false));
    columns.push((
        "cut_at_start",
        Arc::new(of().map(|task| Some(task.is_cut_at_start())).collect::<BooleanArray>()),
        false,
    ));
    columns.push((
        "cut_at_end",
        Arc::new(of().map(|task| Some(task.is_cut_at_end())).collect::<BooleanArray>()),
        false,
    ));
    if of().any(|task| task.stability().is_some()) {
        columns.push(("stability", maybe(of().map(Task::stability)), true));
    }
    table(columns)
}

/// The issues.
pub fn issues(analysis: &Analysis) -> Result<Table, ArrowError> {
    let all = analysis.issues();
    table(vec![
        ("kind", texts(all.iter().map(|issue| issue.kind.name())), false),
        ("start_s", numbers(all.iter().map(|issue| issue.start_s)), false),
        ("end_s", numbers(all.iter().map(|issue| issue.end_s)), false),
        ("channel", texts(all.iter().map(|issue| issue.channel.as_str())), false),
        ("message", texts(all.iter().map(|issue| issue.message.as_str())), false),
    ])
}

/// A row per frame; columns as `analyze --frames` names them, empty texts as null.
pub fn frames(frames: &FrameTable) -> Result<Table, ArrowError> {
    let mut columns: Vec<(String, ArrayRef, bool)> = Vec::new();
    for (name, unit, values) in frames.columns() {
        let name = if unit.is_empty() { name.to_string() } else { format!("{name} [{unit}]") };
        columns.push(match values {
            FrameValues::Numbers(values) if name == "row" => {
                (name, counts(values.iter().map(|row| *row as usize)), false)
            }
            FrameValues::Numbers(values) => (name, Arc::new(Float64Array::from(values.to_vec())), false),
            FrameValues::Texts(values) => {
                (name, optional(values.iter().map(|text| Some(text.as_str()).filter(|text| !text.is_empty()))), true)
            }
        });
    }
    RecordBatch::try_from_iter_with_nullable(columns).map(Table)
}
