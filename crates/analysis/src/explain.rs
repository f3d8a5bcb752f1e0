//! Why a frame has its label: the way through the tree with every condition on it, what settling and relabeling made of the leaf, and how
//! its task came to its name. Nothing here is computed unless it is asked for.

mod change;
mod fact;
mod reason;
mod rows;
mod shortfall;
mod task;
mod tree_trace;
mod value;
mod why_not;

pub use change::{Change, ConditionChange, ConditionState, DecidingChoice, change, task};
pub use fact::{Fact, Wait, quantities};
pub use reason::{Reason, slots, text};
pub use rows::{Row, of_channel, of_expr};
pub use task::{CompositePart, Requirement, TaskCandidate, TaskReason};
pub use tree_trace::{TreeTrace, tree_trace};
pub use value::{frame_at, value};
pub use why_not::{NearestPath, Obstacle};

use super::json::{self, Meta, VERSION, printed};
use super::{Analysis, Segment, Subject, TrackId};
use reason::{EvalPoint, Reasons};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::spelling::nearest;
use teachtree_engine::inspect::Inspector;
use teachtree_engine::runs::Leaves;
use teachtree_frames::frames::Frames;
use teachtree_language::evidence::evidence;
use teachtree_language::rules::{Branch, Consequent, Expr, ExprKind, Label, LeafPath, RelabelRule, Rules};

use serde::Serialize;
use std::ops::Range;

/// The name and version of the schema.
pub const SCHEMA: &str = "teachtree.explain/1";

/// Blocks of an interval that are explained; more would not be read.
pub const MAX_BLOCKS: usize = 50;

/// Why a track has its label from one frame on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// Whose it is.
    pub track: TrackId,
    /// The time that is explained, s.
    pub time_s: f64,
    /// The frame.
    pub frame: usize,
    /// Until when the same choices are taken, s; not beyond what was asked.
    pub until_s: f64,
    /// The tree.
    pub tree: String,
    /// The leaf of the tree; `separate` for the tree over both hands without coordination.
    pub leaf: String,
    /// The object of the segment that this frame came to be in.
    pub object: Option<String>,
    /// The body that the object is in or against.
    pub partner: Option<String>,
    /// The start of that leaf, s.
    pub since_s: f64,
    /// The evaluated choices, from the root to the leaf.
    pub path: Vec<Step>,
    /// The latches that the path read, by name.
    pub latches: Vec<LatchState>,
    /// The settled segment, where it is another one than the leaf says, and why.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settled: Option<LabelChange>,
    /// The segment after relabeling, where rules changed it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relabeled: Option<LabelChange>,
    /// The task.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub task: Option<TaskReason>,
    /// The nearest path to the primitive that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_not: Option<NearestPath>,
}

/// An evaluated choice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// The depth of its branch; 0 at the root.
    pub depth: usize,
    /// As its author wrote it, up to its leaf or brace.
    pub choice: String,
    /// Where it stands.
    pub place: String,
    /// Whether it was taken.
    pub taken: bool,
    /// What `learn` has found for it, from the comment behind it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learned: Option<String>,
    /// Why; none for `else`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<Reason>,
}

/// A latch on a frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LatchState {
    /// Its name, as the path reads it.
    pub latch: String,
    /// Whether it is set.
    pub on: bool,
    /// The time at which it was set or cleared, s; `None` if it has not changed since the beginning.
    pub since_s: Option<f64>,
}

/// A label that came to be another one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LabelChange {
    /// The segment's primitive.
    pub primitive: String,
    /// When it starts, s.
    pub start_s: f64,
    /// When it ends, s.
    pub end_s: f64,
    /// The raw primitives of this time.
    pub was: Vec<String>,
    /// Why, each with the place of the rule, if it is one.
    pub by: Vec<ChangeCause>,
}

/// The rule that changed a label.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChangeCause {
    /// The rule as its author wrote it, or what happened.
    pub what: String,
    /// Where the rule stands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
}

/// A recording that was analyzed.
#[derive(Clone, Copy)]
pub struct AnalyzedRecording<'a> {
    /// The rules.
    pub rules: &'a Rules,
    /// The inputs of the rules.
    pub frames: &'a Frames,
    /// The leaves of the trees.
    pub leaves: &'a [Leaves],
    /// The analysis.
    pub analysis: &'a Analysis,
}

/// A question.
#[derive(Clone, Debug)]
pub struct Question {
    /// Whose labels.
    pub who: TrackId,
    /// Start and end, s; an end that is not after the start asks for one frame.
    pub time_s: (f64, f64),
    /// The primitive that was expected.
    pub why_not: Option<String>,
}

/// Explains a track over an interval: one explanation for each stretch of frames on which the same choices are taken.
///
/// # Errors
/// When the recording does not say anything at that time, when the primitive that is asked for is unknown or given by no leaf of the
/// tree, and when the rate cannot honour a duration of the rules.
pub fn explain(analyzed: &AnalyzedRecording, question: &Question) -> Result<Vec<Explanation>, InputError> {
    let labels = question.why_not.as_ref().map(|name| labels(analyzed.rules, name)).transpose()?;
    let side = question.who.side();
    let mut explained: Vec<Explanation> = Vec::new();
    for (leaves, frames) in asked(analyzed, question)? {
        let mut inspector = Inspector::new(analyzed.rules, analyzed.frames, leaves);
        if inspector.tree(side).is_none() {
            let message = format!("there is no tree that labels `{}` in this recording", question.who);
            let tracks: Vec<String> = analyzed.analysis.tracks.iter().map(|track| format!("`{}`", track.who)).collect();
            return Err(InputError::new("--track", message).help(format!("its tracks are {}", tracks.join(", "))));
        }
        let nearest = match &labels {
            Some(labels) => why_not::why_not(&mut inspector, side, frames.clone(), labels)?,
            None => None,
        };
        if labels.is_some() && nearest.is_none() {
            let name = question.why_not.as_deref().unwrap_or_default();
            let message = format!("no leaf of the tree over `{}` gives `{name}`", question.who);
            let patterns: Vec<Label> = labels.into_iter().flatten().collect();
            return Err(InputError::new("--why-not", message).help(what_to_ask(
                analyzed,
                &inspector,
                question.who,
                &patterns,
            )));
        }
        let mut before: Option<(Vec<usize>, Option<Label>)> = None;
        for frame in frames.clone() {
            let now = (inspector.path(side, frame)?, inspector.leaf(side, frame));
            if before.as_ref() != Some(&now) {
                if explained.len() == MAX_BLOCKS {
                    return Ok(explained);
                }
                let mut block = block(analyzed, &mut inspector, question.who, frame)?;
                block.task = side.and_then(|side| task::of(analyzed, leaves, side, frame));
                explained.push(block);
                before = Some(now);
            }
            if let Some(last) = explained.last_mut() {
                last.until_s = analyzed.frames.end_of(frame);
            }
        }
        if let Some(first) = explained.first_mut() {
            first.why_not = nearest;
        }
    }
    Ok(explained)
}

/// The explanations as JSON, schema `teachtree.explain/1` (docs/formats.md): the fields of an explanation are those of [`Explanation`].
pub fn json(explained: &[Explanation], meta: &Meta) -> String {
    let explanations = serde_json::to_value(explained).unwrap_or_default();
    printed(&serde_json::json!({
        "schema": SCHEMA,
        "version": VERSION,
        "log": meta.log,
        "name": meta.name,
        "zero_stamp_s": meta.zero_stamp_s,
        "rules": json::rules(meta),
        "explanations": explanations,
    }))
}

/// The frames that are asked about, by stretch.
fn asked<'a>(
    analyzed: &AnalyzedRecording<'a>,
    question: &Question,
) -> Result<Vec<(&'a Leaves, Range<usize>)>, InputError> {
    let frames = analyzed.frames;
    let (from, to) = question.time_s;
    let half = 0.5 / frames.layout.rate_hz;
    // The frame whose start is nearest; of an interval, those that start within it.
    let begin = frames.time.partition_point(|time| *time < from - half);
    let end = frames.time.partition_point(|time| *time < to - half).max(begin + 1);
    let within = analyzed.leaves.iter().filter_map(|leaves| {
        let range = begin.max(leaves.frames.start)..end.min(leaves.frames.end);
        let near = frames.time.get(range.start).is_some_and(|time| time - from <= half || to > from);
        (range.start < range.end && near).then_some((leaves, range))
    });
    let found: Vec<_> = within.collect();
    if found.is_empty() {
        let start = frames.time.first().copied().unwrap_or_default();
        let end = frames.len.checked_sub(1).map_or(0.0, |last| frames.end_of(last));
        let message = format!("there is no frame at {from:.3} s: the recording goes from {start:.3} s to {end:.3} s");
        return Err(
            InputError::new("--at", message).help("frames within gaps have no labels either; `inspect` lists gaps")
        );
    }
    Ok(found)
}

/// The labels that a name stands for: `Follow`, `MainGrasp`, `MainGrasp(left)`.
fn labels(rules: &Rules, name: &str) -> Result<Vec<Label>, InputError> {
    let (bare, side) = match name.strip_suffix(')').and_then(|name| name.split_once('(')) {
        Some((bare, side)) => (bare, Side::from_name(side.trim())),
        None => (name, None),
    };
    match rules.primitive(bare.trim()) {
        Some(primitive) => Ok(vec![Label { primitive, side }]),
        None => {
            let known: Vec<&str> = rules.primitives.iter().map(|primitive| primitive.name.as_str()).collect();
            let help = match nearest(bare.trim(), known.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("they have {}", known.join(", ")),
            };
            Err(InputError::new("--why-not", format!("the rules have no primitive `{name}`")).help(help))
        }
    }
}

/// The question that a tree can answer where that of the track gives none of the labels: about another track, or about a label that relabeling rewrites to one of
/// them.
fn what_to_ask(analyzed: &AnalyzedRecording, inspector: &Inspector, who: TrackId, patterns: &[Label]) -> String {
    let rules = analyzed.rules;
    let given = |who: TrackId| -> Vec<Label> {
        let tree = inspector.tree(who.side());
        let leaf = |path: LeafPath| match path.choice.then {
            Consequent::Primitive(label) => Some(label),
            _ => None,
        };
        tree.map(|tree| tree.root.paths()).unwrap_or_default().into_iter().filter_map(leaf).collect()
    };
    let others: Vec<TrackId> =
        { analyzed.analysis.tracks.iter() }.map(|track| track.who).filter(|it| *it != who).collect();
    let quoted = |names: &mut dyn Iterator<Item = String>| -> String {
        names.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(" or ")
    };
    let gives = |other: &&TrackId| given(**other).iter().any(|leaf| patterns.iter().any(|it| it.covers(*leaf)));
    let tracks: Vec<&TrackId> = others.iter().filter(gives).collect();
    if !tracks.is_empty() {
        return format!("ask {}", quoted(&mut tracks.iter().map(|other| format!("--track {other}"))));
    }
    let sources = rewritten(rules, patterns);
    for track in std::iter::once(who).chain(others) {
        let leaves = given(track);
        let names = { sources.iter() }.filter(|source| leaves.iter().any(|leaf| source.covers(*leaf)));
        let names: Vec<String> = names.map(|source| rules.label_name(*source)).collect();
        if let Some(first) = names.first() {
            let of_track = if track == who { String::new() } else { format!("--track {track} ") };
            let all = quoted(&mut names.iter().cloned());
            return format!("relabeling makes it of {all}: ask `{of_track}--why-not {first}`");
        }
    }
    "no leaf of another tree and no relabeling rule gives it".into()
}

/// The labels that relabeling rewrites to one of these patterns, each once.
fn rewritten(rules: &Rules, patterns: &[Label]) -> Vec<Label> {
    let is_asked = |label: &Label| patterns.iter().any(|pattern| pattern.covers(*label));
    let makes = |rule: &&RelabelRule| rule.kind.becomes().is_some_and(|label| is_asked(&label));
    let mut labels = Vec::new();
    for label in rules.relabels.iter().filter(makes).flat_map(|rule| rule.kind.rewrites()) {
        if !labels.contains(&label) && !is_asked(&label) {
            labels.push(label);
        }
    }
    labels
}

/// Why a track has its label on a frame, without the task.
fn block<'a>(
    analyzed: &AnalyzedRecording<'a>,
    inspector: &mut Inspector<'a>,
    who: TrackId,
    frame: usize,
) -> Result<Explanation, InputError> {
    let rules = analyzed.rules;
    let side = who.side();
    let time = |frame: usize| analyzed.frames.time.get(frame).copied().unwrap_or_default();
    let taken = inspector.path(side, frame)?;
    let mut path = Vec::new();
    let mut latches: Vec<LatchState> = Vec::new();
    let root: Option<&Branch> = inspector.tree(side).map(|tree| &tree.root);
    let mut branch = root;
    for (depth, taken) in taken.iter().enumerate() {
        let Some(open) = branch else { break };
        for (at, choice) in open.choices.iter().enumerate().take(taken + 1) {
            let reason = match &choice.condition {
                Some(condition) => {
                    latches_of(inspector, condition, side, frame, &mut latches)?;
                    Some(Reasons { inspector, opens_counts: false }.reason(condition, EvalPoint::new(side, frame))?)
                }
                None => None,
            };
            path.push(Step {
                depth,
                choice: rules.choice_text(choice),
                place: rules.sources.place(choice.span),
                taken: at == *taken,
                learned: root.and_then(|root| evidence(rules, root, choice)),
                reason,
            });
        }
        branch = open.choices.get(*taken).and_then(|choice| match &choice.then {
            Consequent::Branch(below) => Some(below),
            _ => None,
        });
    }
    let run = inspector.run(side, frame);
    let leaf = run.and_then(|run| run.label).map_or("separate".to_string(), |label| rules.label_name(label));
    let track = analyzed.analysis.track(who);
    let segment = |segments: &[Segment]| segments.iter().find(|segment| segment.frames.contains(&frame)).cloned();
    let raw = track.and_then(|track| segment(&track.segments));
    let settled = raw.filter(|raw| raw.primitive != leaf).map(|raw| {
        let lasted = run.map_or(0.0, |run| (run.end - run.start) as f64 / analyzed.frames.layout.rate_hz);
        let covered = side
            .and_then(|_| inspector.leaf(None, frame))
            .is_some_and(|label| rules.label_name(label) == raw.primitive);
        let what = if covered {
            "the tree over both hands labels this hand here".to_string()
        } else {
            format!("the leaf {leaf} lasted {}, which is too short to settle", fact::time(lasted))
        };
        became(rules, raw, what)
    });
    let relabeled = track.and_then(|track| segment(&track.relabeled));
    let Subject { object, partner } = relabeled.as_ref().map(|segment| segment.subject.clone()).unwrap_or_default();
    let relabeled = relabeled.filter(|segment| !segment.by.is_empty());
    Ok(Explanation {
        track: who,
        time_s: time(frame),
        frame,
        until_s: time(frame),
        tree: inspector.tree(side).map_or(String::new(), |tree| tree.name.clone()),
        leaf,
        object,
        partner,
        since_s: time(run.map_or(frame, |run| run.start)),
        path,
        latches,
        settled,
        relabeled: relabeled.map(|segment| became(rules, segment, String::new())),
        task: None,
        why_not: None,
    })
}

fn became(rules: &Rules, segment: Segment, what: String) -> LabelChange {
    let by = segment.by.iter().map(|text| {
        let rule = rules.relabels.iter().find(|rule| rule.text == *text);
        ChangeCause { what: text.clone(), place: rule.map(|rule| rules.sources.place(rule.span)) }
    });
    let happened = (!what.is_empty()).then_some(ChangeCause { what, place: None });
    LabelChange {
        primitive: segment.primitive,
        start_s: segment.start_s,
        end_s: segment.end_s,
        was: segment.was,
        by: happened.into_iter().chain(by).collect(),
    }
}

/// The latches that a condition names itself.
fn latches_of<'a>(
    inspector: &mut Inspector<'a>,
    condition: &'a Expr,
    side: Option<Side>,
    frame: usize,
    found: &mut Vec<LatchState>,
) -> Result<(), InputError> {
    let mut named = Vec::new();
    condition.walk(&mut |part| {
        if matches!(part.kind, ExprKind::Latch(..)) {
            named.push(part);
        }
    });
    for part in named {
        let reasons = Reasons { inspector, opens_counts: false };
        let latch = reasons.text(part);
        if found.iter().any(|known| known.latch == latch) {
            continue;
        }
        let start = inspector.leaves().frames.start;
        let column = inspector.truth(part, side)?;
        let on = column.holds(0, frame - start);
        let differs = column.last_otherwise(0, frame - start, on);
        let since_s = differs.and_then(|at| inspector.frames().time.get(start + at + 1).copied());
        found.push(LatchState { latch, on, since_s });
    }
    Ok(())
}
