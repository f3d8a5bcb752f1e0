//! Why each boundary is where it is, and why each task has its name: explanations as small JSON. Equal texts and equal reasons stand once.

use serde_json::{Value, json};
use std::collections::BTreeMap;
use teachtree_analysis::explain::{
    AnalyzedRecording, Change, ConditionChange, ConditionState, Explanation, Fact, Reason, Step, TaskReason, change,
    task,
};
use teachtree_analysis::{Track, TrackId};
use teachtree_base::error::InputError;
use teachtree_engine::inspect::Inspector;

/// Reasons in all explanations together: with more, the page would be slow to open. What comes later is left to `teachtree explain`.
const MAX_REASONS: usize = 30_000;

/// The texts and reasons of all explanations.
#[derive(Default)]
pub(super) struct ReasonTables {
    texts: Vec<String>,
    text_at: BTreeMap<String, usize>,
    reasons: Vec<Value>,
    reason_at: BTreeMap<String, usize>,
}

impl ReasonTables {
    /// `texts` and `reasons`: of a reason whether it holds, its condition, its slot or "", its fact, and the reasons below it.
    pub fn tables(self) -> (Vec<String>, Vec<Value>) {
        (self.texts, self.reasons)
    }

    fn text(&mut self, text: &str) -> usize {
        if let Some(at) = self.text_at.get(text) {
            return *at;
        }
        self.texts.push(text.to_string());
        self.text_at.insert(text.to_string(), self.texts.len() - 1);
        self.texts.len() - 1
    }

    fn reason(&mut self, reason: &Reason) -> usize {
        let below: Vec<usize> = reason.because.iter().map(|reason| self.reason(reason)).collect();
        let at = reason.at_s.map_or(String::new(), |at| format!(" at {at:.3} s"));
        let reason = json!([
            u8::from(reason.holds),
            self.text(&format!("{}{at}", reason.condition)),
            self.text(reason.slot.as_deref().unwrap_or("")),
            fact(reason.fact.as_ref(), reason.holds),
            below
        ]);
        let key = reason.to_string();
        if let Some(at) = self.reason_at.get(&key) {
            return *at;
        }
        self.reasons.push(reason);
        self.reason_at.insert(key, self.reasons.len() - 1);
        self.reasons.len() - 1
    }

    fn step(&mut self, step: &Step) -> Value {
        let (choice, place) = (self.text(&step.choice), self.text(&step.place));
        let reason = step.reason.as_ref().map(|reason| self.reason(reason));
        json!([step.depth, u8::from(step.taken), choice, place, reason])
    }

    fn explanation(&mut self, change: &Explanation) -> Value {
        let path: Vec<Value> = change.path.iter().map(|step| self.step(step)).collect();
        let latches: Vec<String> = (change.latches.iter())
            .map(|latch| {
                let fact = Fact::Latch { on: latch.on, since_s: latch.since_s };
                format!("{} {}", latch.latch, fact.words(latch.on))
            })
            .collect();
        let mut value = json!({ "leaf": change.leaf, "time": change.time_s, "since": change.since_s, "tree": change.tree,
            "path": path, "latches": latches });
        let outcomes = [("settled", &change.settled), ("relabeled", &change.relabeled)];
        for (word, became) in outcomes {
            let (Some(became), Some(fields)) = (became, value.as_object_mut()) else { continue };
            let by: Vec<Value> =
                became.by.iter().map(|by| json!([by.what, by.place.as_deref().unwrap_or("")])).collect();
            fields.insert(word.into(), json!({ "primitive": became.primitive, "was": became.was, "by": by }));
        }
        value
    }

    fn changed(&mut self, changed: &ConditionChange) -> Value {
        let state = |state: &ConditionState| json!([u8::from(state.holds), fact(state.fact.as_ref(), state.holds)]);
        let below: Vec<Value> = changed.below.iter().map(|below| self.changed(below)).collect();
        let slot = changed.slot.as_deref().unwrap_or("");
        json!([self.text(&changed.condition), slot, state(&changed.before), state(&changed.after), below])
    }

    fn change(&mut self, change: &Change) -> Value {
        let decided = change.decided.as_ref().map(|decided| {
            let changed: Vec<Value> = decided.changed.iter().map(|changed| self.changed(changed)).collect();
            json!({ "choice": decided.choice, "place": decided.place, "taken": decided.taken, "changed": changed })
        });
        let before = change.before.as_ref().map(|before| json!({ "leaf": before.leaf, "time": before.time_s }));
        json!({ "before": before, "after": self.explanation(&change.after), "decided": decided })
    }
}

/// What was measured: `[value, threshold, margin]` of a comparison, else `[words]`, nothing where nothing was.
fn fact(fact: Option<&Fact>, holds: bool) -> Vec<String> {
    match fact.map(|fact| (fact.measured(holds), fact)) {
        Some((Some(measured), _)) => vec![measured.value, measured.threshold, measured.margin],
        Some((None, fact)) => vec![fact.words(holds)],
        None => Vec::new(),
    }
}

/// The explanations of the boundaries of a track's raw segments, in their order: nothing where none is known, or where the page has enough.
///
/// # Errors
/// When the rate of the log cannot honour a duration of the rules.
pub(super) fn boundaries<'a>(
    analyzed: &AnalyzedRecording<'a>,
    inspectors: &mut [Inspector<'a>],
    track: &Track,
    book: &mut ReasonTables,
) -> Result<Vec<Value>, InputError> {
    let mut reasons = Vec::new();
    for segment in &track.segments {
        let frame = segment.frames.start;
        let inspector = inspectors.iter_mut().find(|inspector| inspector.leaves().frames.contains(&frame));
        let enough = book.reasons.len() >= MAX_REASONS;
        let change = match inspector {
            Some(inspector) if !enough => {
                let both = match track.who {
                    // What both hands do begins or ends here, and speaks for the hand while it lasts.
                    TrackId::Hand(_) if frame > 0 && inspector.leaf(None, frame) != inspector.leaf(None, frame - 1) => {
                        change(analyzed, inspector, TrackId::Both, frame)?
                    }
                    _ => None,
                };
                change(analyzed, inspector, track.who, frame)?.map(|own| (own, both))
            }
            _ => None,
        };
        reasons.push(change.map_or(Value::Null, |(own, both)| {
            let mut value = book.change(&own);
            if let (Some(both), Some(fields)) = (both, value.as_object_mut()) {
                fields.insert("both".into(), book.change(&both));
            }
            value
        }));
    }
    Ok(reasons)
}

/// How each task of a track came to its name.
pub(super) fn tasks(analyzed: &AnalyzedRecording, inspectors: &[Inspector], track: &Track) -> Vec<Value> {
    let reason = |frame: usize| {
        let TrackId::Hand(side) = track.who else { return None };
        let inspector = inspectors.iter().find(|inspector| inspector.leaves().frames.contains(&frame))?;
        Some(tried(&task(analyzed, inspector, side, frame)?))
    };
    track.tasks.iter().map(|task| reason(task.frames.start).unwrap_or(Value::Null)).collect()
}

fn tried(reason: &TaskReason) -> Value {
    let tried = reason.tried.iter().map(|tried| {
        let asked: Vec<Value> =
            tried.asked.iter().map(|asked| json!([u8::from(asked.holds), asked.what, asked.found])).collect();
        json!([u8::from(tried.matches), tried.task, tried.place, asked])
    });
    tried.collect()
}
