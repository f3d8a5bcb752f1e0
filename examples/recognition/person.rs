//! One person in one scene: taught once, analysed under every condition, and what is counted of it. A recording lives no longer than that takes.

use crate::coordination::Coordination;
use crate::ruleset::{RuleSet, Said};
use crate::transforms::{resampled, reversed, slowed, turned, without_contacts, without_flags};
use std::collections::BTreeSet;
use std::ops::Range;
use teachtree::analysis::json::Meta;
use teachtree::analysis::score::{self, Known, NameMap, Sequences, Share, Stage, Tally, TaskPair, TrackTruth, Truth};
use teachtree::analysis::{Segment, Track};
use teachtree::base::error::InputError;
use teachtree::base::recording::Recording;
use teachtree::world;

/// All rules that are tried.
pub struct Rulesets {
    pub shipped: RuleSet,
    /// Without the primitives that need force.
    pub base: RuleSet,
    /// All numbers smaller, and larger.
    pub lower: RuleSet,
    pub higher: RuleSet,
    /// The numbers that stand at the end of their range in `lower`, and in `higher`.
    pub at_their_end: [Vec<String>; 2],
    /// What tasks look like (docs/sources.md, Experiments).
    pub expected: Sequences,
}

impl Rulesets {
    /// Of one hand, or of two.
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
        let expected = Sequences::read(sequences, file, &Known::new(&shipped.rules));
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

/// Another way in which the same demonstration could have been recorded, or judged.
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
        name: "turned by 50° about the vertical",
        change: |recording| turned(recording, 50_f64.to_radians()),
        rules: |rules| &rules.shipped,
    },
    Stress { name: "all numbers of the rules × 0.75", change: |recording| recording, rules: |rules| &rules.lower },
    Stress { name: "all numbers of the rules × 1.25", change: |recording| recording, rules: |rules| &rules.higher },
];

/// What is counted of a recording.
pub struct Person {
    pub scene: &'static str,
    pub seed: u64,
    /// Something happened to this person that the script did not want.
    pub incident: bool,
    /// With all channels, without contact flags, and with forces and poses of fingers and objects only.
    pub seen: [Seen; 3],
    /// Of the tasks that pass [`Person::by_paper`].
    pub expected: Share,
    /// Whether the tasks stay right, for each of [`STRESSES`]; none when they were not tried.
    pub stress: Vec<bool>,
    /// Whether a peg-in-hole played backwards is one.
    pub backwards: Option<bool>,
    pub additive: Option<Additive>,
    /// The coordination of two hands, with all channels; nothing of a scene with one hand.
    pub both: Option<Coordination>,
    /// What could not be analysed at all.
    pub refused: Vec<String>,
}

/// A result against the truth.
pub struct Seen {
    pub tally: Tally,
    /// Negative cases: stretches in which the hand deals with something and does no task. Right when none is found there.
    pub negative: Share,
}

/// What the base rules alone say.
pub struct Additive {
    /// None of the primitives that they lack occurred.
    pub apart: bool,
    /// They say the same: frame for frame when `apart`, else the same tasks.
    pub same: bool,
}

impl Person {
    /// Teaches and analyses.
    ///
    /// # Errors
    /// A scene or an operator that cannot be performed, or a recording that the rules refuse.
    pub fn watch(scene: &'static str, seed: u64, rules: &Rulesets, stressed: bool) -> Result<Self, InputError> {
        let recording = world::teach(&world::scene(scene)?, &world::operator(scene)?, seed)?;
        let incidents = ["incident_happened", "object_lost"];
        let incident = recording.events.iter().any(|event| incidents.contains(&event.kind.as_str()));
        let said = rules.shipped.over(&recording)?;
        let full = Seen::new(&rules.shipped, &recording, &said)?;
        let both = Coordination::new(&recording, &said.analysis);
        let blind = |recording: &Recording| Seen::new(&rules.shipped, recording, &rules.shipped.over(recording)?);
        let unflagged = without_flags(recording.clone());
        let seen_unflagged = blind(&unflagged)?;
        let bare = blind(&without_contacts(unflagged))?;

        let mut by_paper = Tally { tasks: full.tally.tasks.clone(), ..Tally::default() };
        by_paper.tasks.iter_mut().flatten().for_each(|pair| pair.true_sequence.clear());
        rules.expected.expect(&mut by_paper);
        let mut person = Self {
            scene,
            seed,
            incident,
            expected: by_paper.task_sequences(),
            seen: [full, seen_unflagged, bare],
            stress: vec![],
            backwards: None,
            additive: None,
            both,
            refused: vec![],
        };
        if stressed {
            person.additive =
                if person.both.is_some() { None } else { additive(rules, &recording, &said, person.seen[0].pairs())? };
            if scene.starts_with("peg_in_hole") {
                let said = rules.shipped.over(&reversed(recording.clone()))?;
                let mut tasks = said.analysis.tracks.iter().flat_map(|track| &track.tasks);
                person.backwards = Some(tasks.any(|task| task.task == "peg_in_hole"));
            }
            for stress in STRESSES {
                let changed = (stress.change)(recording.clone());
                let rules = (stress.rules)(rules);
                let seen = rules.over(&changed).and_then(|said| Seen::new(rules, &changed, &said));
                person.stress.push(seen.as_ref().is_ok_and(Seen::is_right));
                person.refused.extend(seen.err().map(|error| format!("{scene} {seed}, {}: {error}", stress.name)));
            }
        }
        Ok(person)
    }
}

impl Seen {
    fn new(rules: &RuleSet, recording: &Recording, said: &Said) -> Result<Self, InputError> {
        let truth = Truth::of_recording(recording, &NameMap::default()).unwrap_or_default();
        let truth = truth.retold(&rules.rules, &said.frames)?;
        let meta = Meta {
            log: recording.scene.name.clone(),
            binding: None,
            rules: vec![],
            digest: String::new(),
            params: vec![],
        };
        let mut seen = Self { tally: Tally::default(), negative: Share::default() };
        let rows = score::score(&truth, &said.analysis, Stage::Relabelled, &meta)?;
        for (row, truth) in rows.iter().zip(&truth.tracks) {
            seen.tally.add(&row.tally);
            for stretch in idle(truth) {
                let there = |pair: &&TaskPair| pair.time_s.0 < stretch.end && stretch.start < pair.time_s.1;
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

/// The stretches, s, of the truth without a task, in which the hand does more than move.
fn idle(truth: &TrackTruth) -> Vec<Range<f64>> {
    let (Some(first), Some(last)) = (truth.primitives.first(), truth.primitives.last()) else { return vec![] };
    let mut stretches = vec![];
    let mut start = first.start_s;
    let tasks = truth.tasks.iter().flatten().map(|task| (task.start_s, task.end_s));
    for (begins, ends) in tasks.chain([(last.end_s, last.end_s)]) {
        stretches.push(start..begins);
        start = ends;
    }
    let deals = |stretch: &Range<f64>| {
        // More than the step between two rows, whatever rounding says.
        let inside = |start_s: f64, end_s: f64| end_s.min(stretch.end) - start_s.max(stretch.start) > 0.06;
        truth.primitives.iter().any(|span| span.name() != "Move" && inside(span.start_s, span.end_s))
    };
    stretches.retain(deals);
    stretches
}

/// Compares the shipped rules with those of the base alone; nothing where the base is not asked: its tasks are not the true ones.
fn additive(
    rules: &Rulesets,
    recording: &Recording,
    said: &Said,
    truth: &[TaskPair],
) -> Result<Option<Additive>, InputError> {
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
    Ok(Some(Additive { apart, same: same && said.analysis.tracks.len() == base.analysis.tracks.len() }))
}

fn frame_for_frame(one: &Track, other: &Track) -> bool {
    let equal = |one: &[Segment], other: &[Segment]| {
        let plain = |segment: &Segment| (segment.primitive.clone(), segment.frames.clone());
        one.iter().map(plain).eq(other.iter().map(plain))
    };
    let tasks =
        |track: &Track| track.tasks.iter().map(|task| (task.task.clone(), task.frames.clone())).collect::<Vec<_>>();
    equal(&one.segments, &other.segments) && equal(&one.relabelled, &other.relabelled) && tasks(one) == tasks(other)
}

fn same_tasks((one, other): (&Track, &Track)) -> bool {
    one.tasks.iter().map(|task| &task.task).eq(other.tasks.iter().map(|task| &task.task))
}
