//! Recognition: a lane in, named spans out (grammar/README.md, Meaning of a run, point 6; docs/sources.md, C30).
//!
//! Tasks are tried in order of priority and the first that matches takes its span. Different tasks may run from and to different
//! primitives; spans that are taken never overlap. A span in which something was let go but no key was found is a task
//! without a name. A span that is cut off before a key or its last primitive is not a task.

use super::labeled_span::LabeledSpan;
use super::measures::Measures;
use super::spans::{Span, Spans, join};
use teachtree_language::rules::{Pattern, Rules, Task, TaskId};

/// A span with its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NamedSpan {
    /// The task; `None` when no task has its keys here.
    pub task: Option<TaskId>,
    /// The other tasks that match here too, by priority.
    pub secondary: Vec<TaskId>,
    /// Its interval in its track.
    pub span: Span,
    /// Its pieces, to be relabeled.
    pub pieces: Vec<LabeledSpan>,
}

/// Names the tasks of a lane, in order of time.
pub(super) fn recognize(rules: &Rules, lane: &[LabeledSpan], measures: &Measures) -> Vec<NamedSpan> {
    let lane = Lane { rules, pieces: lane, measures };
    let mut claims: Vec<(bool, TaskId, Span)> = Vec::new();
    for (id, task) in (0..).map(TaskId).zip(&rules.tasks) {
        let spans = lane.spans(task);
        let matching = spans.into_iter().filter(|span| lane.matches(task, span));
        // A span without its first and its last primitive is the whole stretch: it only counts when nothing better is found.
        claims.extend(matching.map(|span| (!span.has_first && !span.has_last, id, span)));
    }
    claims.sort_by_key(|(vague, id, span)| (*vague, *id, span.pieces.start));

    let mut taken = vec![false; lane.pieces.len()];
    let mut take = |span: &Span| {
        let pieces = taken.get_mut(span.pieces.clone()).unwrap_or_default();
        let free = !pieces.contains(&true);
        if free {
            pieces.fill(true);
        }
        free
    };
    let mut named: Vec<NamedSpan> = Vec::new();
    for (_, id, span) in claims {
        if take(&span) {
            let secondary = lane.matching(&span).filter(|other| *other != id).collect();
            named.push(NamedSpan { task: Some(id), secondary, pieces: lane.of(&span).to_vec(), span });
        }
    }
    for (first, last) in ends(rules) {
        for span in Spans::of(lane.pieces, first, last) {
            if span.has_last && lane.matching(&span).next().is_none() && take(&span) {
                named.push(NamedSpan { task: None, secondary: Vec::new(), pieces: lane.of(&span).to_vec(), span });
            }
        }
    }
    named.sort_by_key(|named| named.span.pieces.start);
    with_touches_before(named, &lane)
}

/// Gives a touch that came to nothing to the task that follows it without a new first primitive: a failed touch
/// before the grasp belongs to that task.
fn with_touches_before(named: Vec<NamedSpan>, lane: &Lane) -> Vec<NamedSpan> {
    let mut kept: Vec<NamedSpan> = Vec::with_capacity(named.len());
    for mut next in named {
        let fumbled = |before: &mut NamedSpan| {
            before.task.is_none() && !next.span.has_first && before.span.pieces.end == next.span.pieces.start
        };
        if let Some(before) = kept.pop_if(fumbled) {
            next.span = Span {
                pieces: before.span.pieces.start..next.span.pieces.end,
                has_first: before.span.has_first,
                open_start: before.span.open_start,
                ..next.span
            };
            next.pieces = lane.of(&next.span).to_vec();
        }
        kept.push(next);
    }
    kept
}

/// Returns the pairs of first and last primitives of tasks, each pair once, by priority.
fn ends(rules: &Rules) -> Vec<(&Pattern, &Pattern)> {
    let mut ends: Vec<(&Pattern, &Pattern)> = Vec::new();
    for task in &rules.tasks {
        if !ends.contains(&(&task.first, &task.last)) {
            ends.push((&task.first, &task.last));
        }
    }
    ends
}

/// A lane with what is known about it.
struct Lane<'a> {
    rules: &'a Rules,
    pieces: &'a [LabeledSpan],
    measures: &'a Measures<'a>,
}

impl Lane<'_> {
    fn of(&self, span: &Span) -> &[LabeledSpan] {
        self.pieces.get(span.pieces.clone()).unwrap_or(&[])
    }

    /// The spans in which a task is looked for. For a joined one, touches of one target follow each other in one span as long as
    /// each has a key primitive of the task, or nothing that makes it a task of its own.
    fn spans(&self, task: &Task) -> Vec<Span> {
        let spans = Spans::of(self.pieces, &task.first, &task.last);
        if !task.joined {
            return spans;
        }
        let is_key = |piece: &LabeledSpan| task.keys.iter().any(|key| key.label.covers(piece.label));
        let is_stroke = |span: &Span| self.of(span).iter().any(is_key) || self.matching(span).next().is_none();
        join(&spans, |one, next| self.target(one) == self.target(next) && is_stroke(one) && is_stroke(next))
    }

    /// The target of a touch: it changes only while the hand touches nothing, so it is the one just before it is let go.
    fn target(&self, span: &Span) -> Option<i64> {
        let last = self.of(span).last()?;
        let touching = if span.has_last { last.frames.start } else { last.frames.end };
        self.measures.target(touching.checked_sub(1)?)
    }

    fn matching(&self, span: &Span) -> impl Iterator<Item = TaskId> {
        let tasks = (0..).map(TaskId).zip(&self.rules.tasks);
        tasks.filter(|(_, task)| self.matches(task, span)).map(|(id, _)| id)
    }

    /// Whether a span has the keys of a task and nothing that it must be without.
    fn matches(&self, task: &Task, span: &Span) -> bool {
        let pieces = self.of(span);
        let found = |key| self.measures.found(key, pieces);
        let keys = if task.all_keys { task.keys.iter().all(found) } else { task.keys.iter().any(found) };
        keys && !pieces.iter().any(|piece| task.without.iter().any(|label| label.covers(piece.label)))
    }
}
