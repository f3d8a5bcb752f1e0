//! What was found, with the labels of a person in its place: what exports are made of.

use super::labels::Line;
use std::ops::Range;
use teachtree_analysis::{Analysis, Segment, TaskSpan, Track};

/// An analysis with labels over it. Where a track has labels of tasks, they are all of its tasks. `row_time` is when each row of the log was, s.
pub fn merged_labels(found: &Analysis, lines: &[Line], row_time: &[f64]) -> Analysis {
    let mut merged_labels = found.clone();
    let row = |time: f64| row_time.partition_point(|at| *at < time - 1e-6);
    for track in &mut merged_labels.tracks {
        let who = track.who.to_string();
        let of =
            |kind: &'static str| lines.iter().filter(|line| line.track == who).filter(move |line| line.kind == kind);
        let own: Vec<&Line> = of("primitive").collect();
        let left = track.relabeled.iter().flat_map(|segment| uncovered(segment, &own, &row));
        let set = own.iter().map(|line| segment(line, track, &row));
        let mut segments: Vec<Segment> = left.chain(set).collect();
        segments.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
        let tasks: Vec<&Line> = of("task").collect();
        if !tasks.is_empty() {
            track.tasks = tasks.iter().map(|line| task(line, track, &segments, &row)).collect();
        }
        track.relabeled = segments;
    }
    merged_labels
}

/// The parts of a segment that no label covers.
fn uncovered(segment: &Segment, lines: &[&Line], row: &dyn Fn(f64) -> usize) -> Vec<Segment> {
    let mut parts = Vec::new();
    let mut from = segment.start_s;
    let mut take = |start_s: f64, end_s: f64| {
        if end_s > start_s + 1e-6 {
            parts.push(Segment { start_s, end_s, rows: row(start_s)..row(end_s), ..segment.clone() });
        }
    };
    for line in lines.iter().filter(|line| line.end_s > segment.start_s && line.start_s < segment.end_s) {
        take(from, line.start_s.min(segment.end_s));
        from = from.max(line.end_s);
    }
    take(from, segment.end_s);
    parts
}

/// Of some spans the one that shares the most time with a line.
fn best_overlap<'a, T>(line: &Line, spans: &'a [T], time: impl Fn(&T) -> Range<f64>) -> Option<&'a T> {
    let shared = |span: &T| {
        let Range { start, end } = time(span);
        end.min(line.end_s) - start.max(line.start_s)
    };
    spans.iter().filter(|span| shared(span) > 0.0).max_by(|a, b| shared(a).total_cmp(&shared(b)))
}

fn segment(line: &Line, track: &Track, row: &dyn Fn(f64) -> usize) -> Segment {
    let same = best_overlap(line, &track.relabeled, |segment| segment.start_s..segment.end_s);
    Segment {
        primitive: line.label.clone(),
        does: same.filter(|same| same.primitive == line.label).and_then(|same| same.does),
        subject: same.map(|same| same.subject.clone()).unwrap_or_default(),
        rows: row(line.start_s)..row(line.end_s),
        start_s: line.start_s,
        end_s: line.end_s,
        ..Segment::default()
    }
}

fn task(line: &Line, track: &Track, segments: &[Segment], row: &dyn Fn(f64) -> usize) -> TaskSpan {
    let same = best_overlap(line, &track.tasks, |task| task.start_s..task.end_s);
    let inside = |segment: &&Segment| segment.start_s < line.end_s && segment.end_s > line.start_s;
    TaskSpan {
        task: line.label.clone(),
        failure: same.is_some_and(|same| same.failure && same.task == line.label),
        attempt: same.map_or(1, |same| same.attempt),
        subject: same.map(|same| same.subject.clone()).unwrap_or_default(),
        rows: row(line.start_s)..row(line.end_s),
        start_s: line.start_s,
        end_s: line.end_s,
        segments: segments.iter().filter(inside).cloned().collect(),
        ..TaskSpan::default()
    }
}
