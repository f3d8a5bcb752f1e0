//! The evidence: for each condition of the vocabulary and each place of the tree the frames of all marked recordings on which it holds, as bits. The engine
//! evaluates them with the rules that are extended.

use super::super::bank::rounded;
use super::places::{Place, places};
use super::vocabulary::{Family, Number, Vocabulary};
use super::{LoadRules, MarkedTrack, ShownRecording};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::hands::{Side, TrackId};
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::inspect::Inspector;
use teachtree_engine::runs::{Leaves, Run};
use teachtree_frames::frames::Frames;
use teachtree_language::graph::lower;
use teachtree_language::rules::{Expr, PrimitiveId, Rules, TreeScope};

/// The rate to which evidence is thinned out: a guard differs little between neighboring frames, and the engine compares the best ones on all frames.
const RATE_HZ: f64 = 100.0;
/// The kept frames of all recordings without labels together, about: longer ones are thinned out further.
const MOST_ELSEWHERE: f64 = 200_000.0;
/// Conditions that are evaluated together: a rule text has a bounded number of words.
const CHUNK: usize = 1000;
/// Thresholds of a number by quantiles, and evenly between its outer values.
const QUANTILES: usize = 12;
const STEPS: usize = 10;
/// The outer quantiles.
const OUTER: f64 = 0.005;
/// Values of a number that are kept of a track for quantiles, at most.
const SAMPLES: usize = 4000;
/// The most memory that bits of conditions may take, bytes.
const MOST_BYTES: usize = 1 << 30;

/// The hands of a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Whose {
    /// The hand of the tree, or no hand.
    Own,
    /// The other hand.
    Other,
    /// One hand at least, or both; in a tree over both hands.
    Either,
    /// See `Either`.
    Both,
}

/// A condition.
#[derive(Clone, Debug)]
pub(super) struct Condition {
    /// As it is written in a choice of a hand.
    pub text: String,
    pub whose: Whose,
    /// Conditions of one family differ in a threshold only, and are in its order.
    pub family: usize,
    pub cost: f64,
    pub reads_latch: bool,
}

/// A gap-free stretch of a marked track. Its frames are those that are kept.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    /// Position of the recording.
    pub recording: usize,
    /// The words of the evidence with its frames.
    pub words: Range<usize>,
    pub frames: usize,
    /// The frames a label must last.
    pub settle: usize,
    /// The marked intervals, frames of the stretch.
    pub marked: Vec<Range<usize>>,
    /// Whether its recording has no labels.
    pub is_elsewhere: bool,
}

/// Conditions, places and marks.
pub(super) struct Evidence {
    pub vocabulary: Vocabulary,
    pub conditions: Vec<Condition>,
    pub places: Vec<Place>,
    pub stretches: Vec<Stretch>,
    pub words: usize,
    /// The frames on which the primitive is right, and those on which it is right or wrong.
    pub marked: Vec<u64>,
    pub known: Vec<u64>,
    /// The frames of recordings without labels: the primitive is rarely right there.
    pub elsewhere: Vec<u64>,
    /// The leaves of the extended tree on marked frames, with the number of frames.
    pub leaves: BTreeMap<PrimitiveId, usize>,
    /// The bits of each place, and of each condition.
    pub reached: Vec<Vec<u64>>,
    pub held: Vec<Vec<u64>>,
}

/// A recording with the values of the base rules.
struct BaseRun {
    recording: usize,
    frames: Frames,
    leaves: Vec<Leaves>,
    /// The marked tracks; of a recording without labels all that the primitive could be in.
    tracks: Vec<MarkedTrack>,
    is_elsewhere: bool,
    /// The frames that one kept frame stands for.
    stride: usize,
}

/// A stretch of a track while the evidence is collected.
struct TrackStretch<'a> {
    based: &'a BaseRun,
    stretch: usize,
    track: &'a MarkedTrack,
}

impl TrackStretch<'_> {
    /// The kept frames.
    fn len(&self) -> usize {
        self.based.leaves[self.stretch].frames.len().div_ceil(self.based.stride)
    }

    /// The kept frames of some frames of the stretch.
    fn kept(&self, frames: &Range<usize>) -> Range<usize> {
        frames.start.div_ceil(self.based.stride)..frames.end.div_ceil(self.based.stride)
    }

    /// The hand in whose declarations conditions are evaluated.
    fn hand(&self) -> Option<Side> {
        self.track.who.side().or(self.track.side)
    }

    /// The hands in whose declarations numbers are evaluated.
    fn hands(&self) -> Vec<Side> {
        self.hand().map_or_else(|| Side::BOTH.to_vec(), |side| vec![side])
    }

    /// The hand for which a condition is evaluated.
    fn hand_of(&self, whose: Whose) -> Option<Side> {
        match whose {
            Whose::Either | Whose::Both => None,
            Whose::Own | Whose::Other => self.hand().or(Some(Side::Left)),
        }
    }

    /// The bits of some conditions of a rule set.
    fn truths(&self, rules: &Rules, conditions: &[(&Expr, Option<Side>)]) -> Result<Vec<Vec<u64>>, InputError> {
        let columns = Inspector::new(rules, &self.based.frames, &self.based.leaves[self.stretch]).truths(conditions)?;
        let (all, stride) = (self.based.leaves[self.stretch].frames.len(), self.based.stride);
        Ok(columns.iter().map(|column| thinned(column.words(0, all), all, stride)).collect())
    }

    /// Spans of time as frames of the stretch: those whose middle they contain.
    fn ranges(&self, spans: &[[f64; 2]]) -> Vec<Range<usize>> {
        let frames = &self.based.frames;
        let half = 0.5 / frames.layout.rate_hz;
        let time = frames.time.get(self.based.leaves[self.stretch].frames.clone()).unwrap_or(&[]);
        let frame = |at_s: f64| time.partition_point(|time| time + half < at_s);
        let kept = |[start_s, end_s]: &[f64; 2]| self.kept(&(frame(*start_s)..frame(*end_s)));
        spans.iter().map(kept).filter(|it| !it.is_empty()).collect()
    }
}

/// The bits of every `stride`-th frame.
fn thinned(words: Vec<u64>, frames: usize, stride: usize) -> Vec<u64> {
    if stride == 1 {
        return words;
    }
    let mut kept = vec![0; frames.div_ceil(stride).div_ceil(64)];
    for (at, frame) in (0..frames).step_by(stride).enumerate() {
        kept[at / 64] |= (words[frame / 64] >> (frame % 64) & 1) << (at % 64);
    }
    kept
}

impl Evidence {
    /// Evaluates the vocabulary on all recordings that have a track for the primitive.
    ///
    /// # Errors
    /// Rules without a tree of the marked tracks; a recording that cannot be evaluated, or too long ones.
    pub fn new(
        load: &LoadRules,
        recordings: &[ShownRecording],
        scope: TreeScope,
        sided: bool,
    ) -> Result<Self, InputError> {
        let base = load("")?;
        let two_hands = recordings.iter().filter(|one| !one.tracks.is_empty()).all(|one| one.hands.len() > 1);
        let vocabulary = Vocabulary::new(&base, two_hands);
        let declarations = vocabulary.declarations();
        let texts = vocabulary.numbers.iter().map(|number| number.template.replace('@', ""));
        let lines: Vec<String> =
            texts.enumerate().map(|(at, text)| format!("  signal value_{at} = {text}\n")).collect();
        let rules = load(&format!("{declarations}for each hand {{\n{}}}\n", lines.concat()))?;
        let graph = lower(&rules);
        let elsewhere_s: f64 = recordings.iter().filter(|one| one.tracks.is_empty()).map(|one| one.duration_s).sum();
        let elsewhere_hz = RATE_HZ.min(MOST_ELSEWHERE / elsewhere_s.max(1.0));
        let based: Vec<BaseRun> = recordings
            .par_iter()
            .enumerate()
            .filter(|(_, one)| scope == TreeScope::EachHand || one.hands.len() > 1)
            .map(|(recording, one)| {
                let frames = (one.frames)(&rules.channels)?;
                let leaves = evaluate(&graph, &frames)?;
                let is_elsewhere = one.tracks.is_empty();
                let tracks = if is_elsewhere { tracks_of(&one.hands, scope, sided) } else { one.tracks.clone() };
                let kept_hz = if is_elsewhere { elsewhere_hz } else { RATE_HZ };
                let stride = ((frames.layout.rate_hz / kept_hz).floor() as usize).max(1);
                Ok(BaseRun { recording, frames, leaves, tracks, is_elsewhere, stride })
            })
            .collect::<Result<_, InputError>>()?;
        let collected: Vec<TrackStretch> = based
            .iter()
            .flat_map(|based| {
                let stretches = 0..based.leaves.len();
                stretches
                    .flat_map(move |stretch| based.tracks.iter().map(move |it| (stretch, it)))
                    .map(move |(stretch, track)| TrackStretch { based, stretch, track })
            })
            .collect();
        let tree = rules.tree(scope).ok_or_else(|| lacks_tree(scope))?;
        let thresholds = thresholds(&vocabulary.numbers, &rules, &collected)?;
        let mut conditions = Vec::new();
        let hands = match (scope, sided, two_hands) {
            (TreeScope::BothHands, false, _) => &[Whose::Own, Whose::Either, Whose::Both][..],
            (.., true) => &[Whose::Own, Whose::Other],
            (.., false) => &[Whose::Own],
        };
        let of_both = hands.contains(&Whose::Either);
        for whose in hands {
            let is_asked = |family: &Family| match whose {
                Whose::Own => !of_both || !family.is_of_hand(),
                Whose::Other => family.has_other(),
                Whose::Either | Whose::Both => family.is_of_hand(),
            };
            for (at, family) in vocabulary.families.iter().enumerate().filter(|(_, family)| is_asked(family)) {
                let steps = family
                    .number
                    .map_or_else(|| vec![None], |number| thresholds[number].iter().copied().map(Some).collect());
                for step in steps {
                    conditions.push(Condition {
                        text: family.spelled(*whose == Whose::Other, step, &vocabulary.numbers),
                        whose: *whose,
                        family: 2 * at + usize::from(matches!(whose, Whose::Other | Whose::Both)),
                        cost: family.cost + if *whose == Whose::Own { 0.0 } else { 0.5 },
                        reads_latch: family.reads_latch,
                    });
                }
            }
        }
        let words: usize = collected.iter().map(|one| one.len().div_ceil(64)).sum();
        let bytes = conditions.len().saturating_mul(words * 8);
        if bytes > MOST_BYTES {
            let message = format!("the conditions of all recordings need {} MB", bytes >> 20);
            return Err(InputError::new("the recordings", format!("{message}, expected at most {}", MOST_BYTES >> 20))
                .help("leave recordings out, or bind them at a lower rate: `resample: 100 Hz`"));
        }
        let chunks: Vec<Vec<Vec<u64>>> = conditions
            .par_chunks(CHUNK)
            .map(|chunk| held(load, &declarations, chunk, &collected))
            .collect::<Result<_, _>>()?;
        let (places, asked) = places(&rules, tree);
        let whose = |one: &TrackStretch| if scope == TreeScope::EachHand { one.hand() } else { None };
        let of_tree: Vec<Vec<Vec<u64>>> = collected
            .iter()
            .map(|one| {
                let asked: Vec<(&Expr, Option<Side>)> = asked.iter().map(|expr| (*expr, whose(one))).collect();
                one.truths(&rules, &asked)
            })
            .collect::<Result<_, _>>()?;
        let of_tree: Vec<Vec<u64>> =
            (0..asked.len()).map(|at| of_tree.iter().flat_map(|one| one[at].iter().copied()).collect()).collect();
        let reached = places.iter().map(|place| place.reached(&of_tree, words)).collect();
        let mut made = Self {
            vocabulary,
            conditions: Vec::new(),
            places,
            stretches: Vec::new(),
            words,
            marked: vec![0; words],
            known: vec![0; words],
            elsewhere: vec![0; words],
            leaves: BTreeMap::new(),
            reached,
            held: Vec::new(),
        };
        made.add_marks(&rules, scope, &collected);
        made.add_conditions(conditions, chunks.into_iter().flatten());
        Ok(made)
    }

    fn add_marks(&mut self, rules: &Rules, scope: TreeScope, collected: &[TrackStretch]) {
        let settle_s = rules.tree(scope).and_then(|tree| tree.settle.as_ref()).map_or(0.0, |settle| settle.value);
        let mut word = 0;
        for one in collected {
            let words = word..word + one.len().div_ceil(64);
            word = words.end;
            let marked = one.ranges(&one.track.marked);
            let all = std::iter::once(0..one.len()).collect();
            let known = one.track.known.as_ref().map_or(all, |known| one.ranges(known));
            let leaves = &one.based.leaves[one.stretch];
            let start = leaves.frames.start;
            let of_track = match (scope, one.hand()) {
                (TreeScope::EachHand, Some(side)) => leaves.hands.get(&side).map_or(&[][..], Vec::as_slice),
                _ => &leaves.both,
            };
            let local = |run: &Run| one.kept(&(run.start - start..run.end - start));
            for run in of_track {
                let frames = local(run);
                let both = marked.iter().map(|it| it.end.min(frames.end).saturating_sub(it.start.max(frames.start)));
                if let (count @ 1.., Some(label)) = (both.sum::<usize>(), run.label) {
                    *self.leaves.entry(label.primitive).or_default() += count;
                }
            }
            let is_elsewhere = one.based.is_elsewhere;
            let asked = if is_elsewhere { &mut self.elsewhere } else { &mut self.known };
            set(asked, words.start, &known, true);
            set(asked, words.start, &marked, true);
            set(&mut self.marked, words.start, &marked, true);
            if scope == TreeScope::EachHand {
                // A leaf of the tree over both hands covers those of a hand.
                let covered: Vec<Range<usize>> =
                    leaves.both.iter().filter(|run| run.label.is_some()).map(local).collect();
                self.reached.iter_mut().for_each(|bits| set(bits, words.start, &covered, false));
            }
            let settle = (settle_s * one.based.frames.layout.rate_hz / one.based.stride as f64).round() as usize;
            let (recording, frames) = (one.based.recording, one.len());
            self.stretches.push(Stretch { recording, words, frames, settle, marked, is_elsewhere });
        }
        let asked: Vec<u64> = self.known.iter().zip(&self.elsewhere).map(|(known, other)| known | other).collect();
        for bits in &mut self.reached {
            bits.iter_mut().zip(&asked).for_each(|(bits, asked)| *bits &= asked);
        }
    }

    /// Keeps the conditions that vary where the primitive is known; of those with equal bits the family that is easiest to read, and of its thresholds the middle one.
    fn add_conditions(&mut self, conditions: Vec<Condition>, held: impl Iterator<Item = Vec<u64>>) {
        let mut places: HashMap<Vec<u64>, usize> = HashMap::new();
        let mut equal: Vec<Vec<Condition>> = Vec::new();
        for (condition, held) in conditions.into_iter().zip(held) {
            let known = || held.iter().zip(&self.known);
            if known().all(|(held, known)| held & known == 0) || known().all(|(held, known)| held & known == *known) {
                continue;
            }
            let asked = self.known.iter().zip(&self.elsewhere).map(|(known, other)| known | other);
            let masked: Vec<u64> = held.iter().zip(asked).map(|(held, asked)| held & asked).collect();
            if let Some(at) = places.get(&masked) {
                let first = &equal[*at][0];
                if first.family == condition.family {
                    equal[*at].push(condition);
                } else if condition.cost < first.cost {
                    equal[*at] = vec![condition];
                }
            } else {
                places.insert(masked.clone(), equal.len());
                equal.push(vec![condition]);
                self.held.push(masked);
            }
        }
        self.conditions = equal.into_iter().map(|mut equal| equal.swap_remove(equal.len() / 2)).collect();
    }
}

/// The tracks of a recording without labels in which the primitive could be.
fn tracks_of(hands: &[Side], scope: TreeScope, sided: bool) -> Vec<MarkedTrack> {
    let track = |who, side| MarkedTrack { who, side, marked: Vec::new(), known: None };
    match (scope, sided) {
        (TreeScope::EachHand, _) => hands.iter().map(|side| track(TrackId::Hand(*side), None)).collect(),
        (TreeScope::BothHands, true) => Side::BOTH.map(|side| track(TrackId::Both, Some(side))).to_vec(),
        (TreeScope::BothHands, false) => vec![track(TrackId::Both, None)],
    }
}

fn lacks_tree(scope: TreeScope) -> InputError {
    let whose = if scope == TreeScope::EachHand { "for each hand" } else { "for left, right" };
    InputError::new("the rules", format!("have no tree `{whose}` that could be extended"))
        .help("name rules with such a tree: `--rules contact.rules`, `--rules bimanual.rules`")
}

/// Sets or clears the bits of some frames of a stretch that begins with a word.
fn set(bits: &mut [u64], word: usize, frames: &[Range<usize>], to: bool) {
    for frame in frames.iter().flat_map(Clone::clone) {
        let mask = 1 << (frame % 64);
        let place = &mut bits[word + frame / 64];
        *place = if to { *place | mask } else { *place & !mask };
    }
}

/// The bits of some conditions on all stretches, put together.
fn held(
    load: &LoadRules,
    declarations: &str,
    conditions: &[Condition],
    collected: &[TrackStretch],
) -> Result<Vec<Vec<u64>>, InputError> {
    // A latch that copies a condition may read latches, which a signal must not.
    let declared = |condition: &Condition, name: &str, text: &str| match condition.reads_latch {
        true => format!("  latch {name} set {text} clear not ({text})\n"),
        false => format!("  signal {name} = {text}\n"),
    };
    let (mut of_hand, mut shared) = (String::new(), String::new());
    for (at, condition) in conditions.iter().enumerate() {
        let (name, part) = (format!("holds_{at}"), format!("part_{at}"));
        let joined = match condition.whose {
            Whose::Own | Whose::Other => None,
            Whose::Either => Some(format!("either.{part}")),
            Whose::Both => Some(format!("both.{part}")),
        };
        of_hand += &declared(condition, if joined.is_some() { &part } else { &name }, &condition.text);
        shared += &joined.map_or_else(String::new, |joined| declared(condition, &name, &joined));
    }
    let rules = load(&format!("{declarations}for each hand {{\n{of_hand}}}\n{shared}"))?;
    let signals: HashMap<&str, &Expr> = rules.signals.iter().map(|it| (it.name.as_str(), &it.expr)).collect();
    let latches: HashMap<&str, &Expr> = rules.latches.iter().map(|it| (it.name.as_str(), &it.set)).collect();
    let expr = |at: usize| {
        let name = format!("holds_{at}");
        let found = signals.get(name.as_str()).or_else(|| latches.get(name.as_str()));
        found.copied().ok_or_else(|| internal(format!("`{}` is no condition", conditions[at].text)))
    };
    let exprs: Vec<&Expr> = (0..conditions.len()).map(expr).collect::<Result<_, _>>()?;
    let mut held = vec![Vec::new(); conditions.len()];
    for one in collected {
        let asked: Vec<(&Expr, Option<Side>)> =
            exprs.iter().zip(conditions).map(|(expr, it)| (*expr, one.hand_of(it.whose))).collect();
        for (held, bits) in held.iter_mut().zip(one.truths(&rules, &asked)?) {
            held.extend(bits);
        }
    }
    Ok(held)
}

fn internal(message: String) -> InputError {
    InputError::new("teachtree learn", message).or_kind(ErrorKind::Internal)
}

/// The thresholds of each number in its unit: quantiles and even steps, two digits. No mark is used for them.
fn thresholds(numbers: &[Number], rules: &Rules, collected: &[TrackStretch]) -> Result<Vec<Vec<f64>>, InputError> {
    let expr = |at: usize| {
        let name = format!("value_{at}");
        let found = rules.signals.iter().find(|signal| signal.name == name);
        found.map(|signal| &signal.expr).ok_or_else(|| internal(format!("`{name}` is no signal")))
    };
    let exprs: Vec<&Expr> = (0..numbers.len()).map(expr).collect::<Result<_, _>>()?;
    let mut values = vec![Vec::new(); numbers.len()];
    let labeled = collected.iter().filter(|one| !one.based.is_elsewhere);
    for (one, hand) in labeled.flat_map(|one| one.hands().into_iter().map(move |hand| (one, hand))) {
        let asked: Vec<(&Expr, Option<Side>)> = exprs.iter().map(|expr| (*expr, Some(hand))).collect();
        let inspector = Inspector::new(rules, &one.based.frames, &one.based.leaves[one.stretch]);
        for (values, column) in values.iter_mut().zip(inspector.columns(&asked)?) {
            let frames = one.based.leaves[one.stretch].frames.len();
            values.extend((0..frames).step_by(frames.div_ceil(SAMPLES).max(1)).map(|frame| column.number(0, frame)));
        }
    }
    Ok(values.into_iter().zip(numbers).map(|(values, number)| of_values(values, number.per_si)).collect())
}

fn of_values(values: Vec<f64>, per_si: f64) -> Vec<f64> {
    let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let quantile = |part: f64| values.get((part * (values.len().max(1) - 1) as f64).round() as usize).copied();
    let (Some(low), Some(high)) = (quantile(OUTER), quantile(1.0 - OUTER)) else { return Vec::new() };
    let parts = |count: usize| (1..=count).map(move |at| at as f64 / (count + 1) as f64);
    let even = parts(STEPS).map(|part| low + part * (high - low));
    let mut found: Vec<f64> = parts(QUANTILES)
        .filter_map(quantile)
        .chain(even)
        .filter(|value| *value > low && *value < high)
        .filter_map(|value| rounded(value * per_si))
        .collect();
    found.sort_by(f64::total_cmp);
    found.dedup();
    found
}
