//! A trial: one simulated operator in one scene, recorded once and analyzed under every condition. Only the counts are kept, not the recording.

use crate::coordination::Coordination;
use crate::ruleset::{RuleRun, RuleSet};
use crate::transforms::{resampled, reversed, slowed, turned, without_contacts, without_flags};
use std::collections::BTreeSet;
use std::ops::Range;
use teachtree_analysis::json::Meta;
use teachtree_analysis::score::{
    self, KnownNames, NameMap, Sequences, Share, Stage, Tally, TaskPair, TrackTruth, Truth,
};
use teachtree_analysis::{Segment, Track};
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_world as world;

/// The rule sets of all conditions.
pub struct Rulesets {
    pub shipped: RuleSet,
    /// Without the primitives that need force.
    pub base: RuleSet,
    /// All params scaled down, and up.
    pub lower: RuleSet,
    pub higher: RuleSet,
    /// The params that are at the end of their range in `lower`, and in `higher`.
    pub at_their_end: [Vec<String>; 2],
    /// The expected sequences of the tasks (docs/sources.md, Experiments).
    pub expected: Sequences,
}

impl Rulesets {
    /// Loads the rules of one hand, or of two.
    pub fn load(both_hands: bool) -> Result<Self, String> {
        let [all, base, file, sequences] = if both_hands {
            let file = "sequences_both_hands.yaml";
            ["bimanual.rules", "contact.rules", file, include_str!("sequences_both_hands.yaml")]
        } else {
            ["contact.rules", "single_hand.rules", "sequences.yaml", include_str!("sequences.yaml")]
        };
        let shipped = RuleSet::load(all, vec![])?;
        let (less, low_end) = shipped.scaled(0.75);
        let (more, high_end) = shipped.scaled(1.25);
        let expected = Sequences::read(sequences, file, &KnownNames::new(&shipped.rules));
        Ok(Self {
            base: RuleSet::load(base, vec![])?,
            lower: RuleSet::load(all, less)?,
            higher: RuleSet::load(all, more)?,
            at_their_end: [low_end, high_end],
            expected: expected.map_err(|error| error.to_string())?,
            shipped,
        })
    }
}

/// A stress condition: a change of the recording or of the rules.
#[derive(Clone, Copy)]
pub struct Stress {
    pub name: &'static str,
    change: fn(Recording) -> Recording,
    rules: fn(&Rulesets) -> &RuleSet,
}

pub const STRESSES: [Stress; 7] = [
    Stress { name: "time × 0.7", change: |recording| slowed(recording, 0.7), rules: |rules| &rules.shipped },
    Stress { name: "time × 1.4", change: |recording| slowed(recording, 1.4), rules: |rules| &rules.shipped },
    Stress { name: "at 100 Hz", change: |recording| resampled(recording, 100.0), rules: |rules| &rules.shipped },
    Stress { name: "at 20 Hz", change: |recording| resampled(recording, 20.0), rules: |rules| &rules.shipped },
    Stress {
        name: "rotated by 50° about the vertical",
        change: |recording| turned(recording, 50_f64.to_radians()),
        rules: |rules| &rules.shipped,
    },
    Stress { name: "all values of the rules × 0.75", change: |recording| recording, rules: |rules| &rules.lower },
    Stress { name: "all values of the rules × 1.25", change: |recording| recording, rules: |rules| &rules.higher },
];

/// The counts of one recording.
pub struct Trial {
    pub scene: &'static str,
    pub seed: u64,
    /// A perturbation happened, or an object was lost.
    pub perturbation: bool,
    /// With all channels, without contact flags, and with forces and poses of fingers and objects only.
    pub seen: [TruthComparison; 3],
    /// The tasks whose sequence is an expected one.
    pub expected: Share,
    /// Whether the tasks are right, for each of [`STRESSES`]; empty if these were not run.
    pub stress: Vec<bool>,
    /// Whether a peg-in-hole played backward is recognized as one.
    pub backwards: Option<bool>,
    pub additive: Option<BaseRulesResult>,
    /// The coordination of two hands, with all channels; `None` for a scene with one hand.
    pub both: Option<Coordination>,
    /// Messages of recordings that the rules refused.
    pub refused: Vec<String>,
}

/// A result compared with the truth.
pub struct TruthComparison {
    pub tally: Tally,
    /// Negative cases: intervals in which the hand is at an object and does no task. Right if no task is found there.
    pub negative: Share,
}

/// The result of the base rules alone.
pub struct BaseRulesResult {
    /// None of the primitives that the base rules lack occurs.
    pub apart: bool,
    /// The results agree: frame by frame if `apart`, otherwise in their tasks.
    pub same: bool,
}

impl Trial {
    /// Records a demonstration and analyzes it under all conditions.
    ///
    /// # Errors
    /// A scene or an operator that cannot be performed, or a recording that the rules refuse.
    pub fn run(scene: &'static str, seed: u64, rules: &Rulesets, stressed: bool) -> Result<Self, InputError> {
        let recording = world::teach(&world::scene(scene)?, &world::operator(scene)?, seed)?;
        let perturbations = ["perturbation_started", "object_lost"];
        let perturbation = recording.events.iter().any(|event| perturbations.contains(&event.kind.as_str()));
        let said = rules.shipped.over(&recording)?;
        let full = TruthComparison::new(&rules.shipped, &recording, &said)?;
        let both = Coordination::new(&recording, &said.analysis);
        let blind =
            |recording: &Recording| TruthComparison::new(&rules.shipped, recording, &rules.shipped.over(recording)?);
        let unflagged = without_flags(recording.clone());
        let seen_unflagged = blind(&unflagged)?;
        let bare = blind(&without_contacts(unflagged))?;

        let mut by_paper = Tally { tasks: full.tally.tasks.clone(), ..Tally::default() };
        by_paper.tasks.iter_mut().flatten().for_each(|pair| pair.true_sequence.clear());
        rules.expected.expect(&mut by_paper);
        let mut trial = Self {
            scene,
            seed,
            perturbation,
            expected: by_paper.task_sequences(),
            seen: [full, seen_unflagged, bare],
            stress: vec![],
            backwards: None,
            additive: None,
            both,
            refused: vec![],
        };
        if stressed {
            trial.additive =
                if trial.both.is_some() { None } else { additive(rules, &recording, &said, trial.seen[0].pairs())? };
            if scene.starts_with("peg_in_hole") {
                let said = rules.shipped.over(&reversed(recording.clone()))?;
                let mut tasks = said.analysis.tracks.iter().flat_map(|track| &track.tasks);
                trial.backwards = Some(tasks.any(|task| task.task == "peg_in_hole"));
            }
            for stress in STRESSES {
                let changed = (stress.change)(recording.clone());
                let rules = (stress.rules)(rules);
                let seen = rules.over(&changed).and_then(|said| TruthComparison::new(rules, &changed, &said));
                trial.stress.push(seen.as_ref().is_ok_and(TruthComparison::is_right));
                trial.refused.extend(seen.err().map(|error| format!("{scene} {seed}, {}: {error}", stress.name)));
            }
        }
        Ok(trial)
    }
}

impl TruthComparison {
    fn new(rules: &RuleSet, recording: &Recording, said: &RuleRun) -> Result<Self, InputError> {
        let truth = Truth::of_recording(recording, &NameMap::default()).unwrap_or_default();
        let truth = truth.relabeled(&rules.rules, &said.frames)?;
        let meta = Meta { log: recording.scene.name.clone(), ..Meta::default() };
        let mut seen = Self { tally: Tally::default(), negative: Share::default() };
        let rows = score::score(&truth, &said.analysis, Stage::Relabeled, &meta)?;
        for (row, truth) in rows.iter().zip(&truth.tracks) {
            seen.tally.add(&row.tally);
            for interval in idle(truth) {
                let there = |pair: &&TaskPair| pair.time_s.0 < interval.end && interval.start < pair.time_s.1;
                let mut falsely = row.tally.task_pairs().iter().filter(|pair| pair.is_false_alarm());
                seen.negative.count(!falsely.any(|pair| there(&pair)));
            }
        }
        Ok(seen)
    }

    pub fn pairs(&self) -> &[TaskPair] {
        self.tally.task_pairs()
    }

    /// Every true task has its name, and no other task is found.
    pub fn is_right(&self) -> bool {
        self.pairs().iter().all(|pair| if pair.is_true() { pair.is_right() } else { !pair.is_false_alarm() })
    }
}

/// Returns the intervals, s, without a true task, in which the hand does more than Move.
fn idle(truth: &TrackTruth) -> Vec<Range<f64>> {
    let (Some(first), Some(last)) = (truth.primitives.first(), truth.primitives.last()) else { return vec![] };
    let mut intervals = vec![];
    let mut start = first.start_s;
    let tasks = truth.tasks.iter().flatten().map(|task| (task.start_s, task.end_s));
    for (begins, ends) in tasks.chain([(last.end_s, last.end_s)]) {
        intervals.push(start..begins);
        start = ends;
    }
    let is_active = |interval: &Range<f64>| {
        // Longer than the step between two rows, in spite of rounding.
        let inside = |start_s: f64, end_s: f64| end_s.min(interval.end) - start_s.max(interval.start) > 0.06;
        truth.primitives.iter().any(|span| span.name() != "Move" && inside(span.start_s, span.end_s))
    };
    intervals.retain(is_active);
    intervals
}

/// Compares the shipped rules with the base rules alone. `None` where the base rules lack both a primitive and a true task.
fn additive(
    rules: &Rulesets,
    recording: &Recording,
    said: &RuleRun,
    truth: &[TaskPair],
) -> Result<Option<BaseRulesResult>, InputError> {
    let all = &rules.shipped.rules;
    let of_base: BTreeSet<&str> = rules.base.rules.primitives.iter().map(|primitive| primitive.name.as_str()).collect();
    let labels = said.leaves.iter().flat_map(|leaves| leaves.hands.values().flatten()).filter_map(|run| run.label);
    let apart = labels.map(|label| all.label_name(label)).all(|name| of_base.contains(name.as_str()));
    let known = |pair: &TaskPair| !pair.is_true() || rules.base.rules.tasks.iter().any(|task| task.name == pair.truth);
    if !apart && !truth.iter().all(known) {
        return Ok(None);
    }
    let base = rules.base.over(recording)?;
    let tracks = || said.analysis.tracks.iter().zip(&base.analysis.tracks);
    let same = if apart { tracks().all(|(one, other)| frame_for_frame(one, other)) } else { tracks().all(same_tasks) };
    Ok(Some(BaseRulesResult { apart, same: same && said.analysis.tracks.len() == base.analysis.tracks.len() }))
}

fn frame_for_frame(one: &Track, other: &Track) -> bool {
    let equal = |one: &[Segment], other: &[Segment]| {
        let plain = |segment: &Segment| (segment.primitive.clone(), segment.frames.clone());
        one.iter().map(plain).eq(other.iter().map(plain))
    };
    let tasks =
        |track: &Track| track.tasks.iter().map(|task| (task.task.clone(), task.frames.clone())).collect::<Vec<_>>();
    equal(&one.segments, &other.segments) && equal(&one.relabeled, &other.relabeled) && tasks(one) == tasks(other)
}

fn same_tasks((one, other): (&Track, &Track)) -> bool {
    one.tasks.iter().map(|task| &task.task).eq(other.tasks.iter().map(|task| &task.task))
}
