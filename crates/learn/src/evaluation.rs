//! The worth of versions of a model. A version chooses as the present one on most frames, so it is run from the first frame on which it chooses otherwise, and
//! a track without such a frame is not run again.

use super::bank::{Bank, Track};
use super::model::Rule;
use super::model_bits::{Case, ModelBits};
use super::objective::Counts;
use std::rc::Rc;
use teachtree_engine::runs::Run;

/// What a rule or a condition must bring.
const PENALTY: f64 = 0.0008;

/// The most that a case is taken to gain over the present model when the cases before it have lost: a version that would need more is given up.
const MOST_GAIN: f64 = 0.1;

/// What a model gives a track.
struct TrackResult {
    /// Before settling.
    leaves: Rc<[Run]>,
    counts: Counts,
}

/// The worth of a model on some tracks.
pub(crate) struct Evaluation {
    /// The objective less what is to be read.
    pub value: f64,
    /// The objective of each group.
    pub groups: Vec<f64>,
    /// The objective of each case.
    cases: Vec<f64>,
    /// Of each case, by track.
    results: Vec<Vec<Rc<TrackResult>>>,
}

/// Evaluates models on some tracks.
pub(crate) struct Evaluator<'a> {
    tracks: Vec<&'a Track>,
    /// The position of the group of each track among all groups.
    groups: Vec<usize>,
    group_count: usize,
}

/// A model that was evaluated.
pub(crate) struct EvaluatedModel<'m> {
    version: &'m ModelBits,
    cases: Vec<Case<'m>>,
    evaluation: &'m Evaluation,
}

impl<'m> EvaluatedModel<'m> {
    pub fn new(version: &'m ModelBits, evaluation: &'m Evaluation) -> Self {
        Self { version, cases: version.cases(), evaluation }
    }
}

impl<'a> Evaluator<'a> {
    pub fn new(bank: &'a Bank, tracks: &[usize]) -> Self {
        let tracks: Vec<&Track> = tracks.iter().map(|track| &bank.tracks[*track]).collect();
        let mut all: Vec<usize> = tracks.iter().map(|track| track.group).collect();
        all.sort_unstable();
        all.dedup();
        let groups = tracks.iter().map(|track| all.partition_point(|group| *group < track.group)).collect();
        Self { tracks, groups, group_count: all.len() }
    }

    /// The worth of a model.
    pub fn evaluate(&self, model: &ModelBits) -> Evaluation {
        let mut evaluation = self.without_cases(model);
        for case in model.cases() {
            let of_track =
                |track: &&Track| Rc::new(counted(model, track, model.model().leaves(&case.guards, track).into()));
            self.add(&mut evaluation, &case, self.tracks.iter().map(of_track).collect());
        }
        evaluation
    }

    /// The same for a version of a model that is known; `None` where it will not be worth `least`, as far as [`MOST_GAIN`] is true.
    pub fn evaluate_version(&self, version: &ModelBits, known: &EvaluatedModel, least: f64) -> Option<Evaluation> {
        let mut evaluation = self.without_cases(version);
        let cases = version.cases();
        let as_it_is = Difference::new((known.version, &known.cases[0]), (version, &cases[0]));
        let near: Vec<usize> =
            (0..cases.len()).map(|at| known.version.nearest_case(version, as_it_is.first, at)).collect();
        let hope = |at: usize| cases[at].weight * (known.evaluation.cases[near[at]] + MOST_GAIN);
        let is_settled_alike = known.version.model().settle_ms == version.model().settle_ms;
        for (at, case) in cases.iter().enumerate() {
            let difference = Difference::new((known.version, &known.cases[near[at]]), (version, case));
            let known = known.evaluation.results[near[at]].iter();
            let of_track = |(track, known): (&&Track, &Rc<TrackResult>)| {
                rerun(version, case, track, known, &difference, is_settled_alike)
            };
            self.add(&mut evaluation, case, self.tracks.iter().zip(known).map(of_track).collect());
            let hopes: f64 = (at + 1..cases.len()).map(hope).sum();
            if evaluation.value + hopes < least {
                return None;
            }
        }
        Some(evaluation)
    }

    fn without_cases(&self, model: &ModelBits) -> Evaluation {
        let value = -PENALTY * model.model().size() as f64;
        Evaluation { value, groups: vec![0.0; self.group_count], cases: Vec::new(), results: Vec::new() }
    }

    fn add(&self, evaluation: &mut Evaluation, case: &Case, results: Vec<Rc<TrackResult>>) {
        let mut counts = vec![Counts::default(); self.group_count];
        self.groups.iter().zip(&results).for_each(|(group, result)| counts[*group] += result.counts);
        let objective = counts.iter().sum::<Counts>().objective();
        evaluation.value += case.weight * objective;
        evaluation.groups.iter_mut().zip(&counts).for_each(|(sum, counts)| *sum += case.weight * counts.objective());
        evaluation.cases.push(objective);
        evaluation.results.push(results);
    }
}

/// The result of a version on a track, from the one of a model that differs.
fn rerun(
    version: &ModelBits,
    case: &Case,
    track: &Track,
    known: &Rc<TrackResult>,
    difference: &Difference,
    is_settled_alike: bool,
) -> Rc<TrackResult> {
    match difference.frame(&known.leaves, track) {
        Some((run, frame)) => {
            let leaves = version.model().leaves_from(&case.guards, track, &known.leaves[..=run], frame);
            Rc::new(counted(version, track, leaves.into()))
        }
        None if is_settled_alike => known.clone(),
        None => Rc::new(counted(version, track, known.leaves.clone())),
    }
}

fn counted(version: &ModelBits, track: &Track, leaves: Rc<[Run]>) -> TrackResult {
    let counts = track.truth.compare(&version.model().settled(&leaves, track));
    TrackResult { leaves, counts }
}

/// A rule and the bits of its guard.
type BitRule<'m> = (&'m Rule, &'m [u64]);

/// The rules in which two models differ.
struct Difference<'m> {
    /// How many rules before them are the same.
    first: usize,
    one: Vec<BitRule<'m>>,
    other: Vec<BitRule<'m>>,
}

impl<'m> Difference<'m> {
    fn new(one: (&'m ModelBits, &Case<'m>), other: (&'m ModelBits, &Case<'m>)) -> Self {
        let rules = |(version, case): (&'m ModelBits, &Case<'m>)| -> Vec<BitRule<'m>> {
            version.model().rules.iter().zip(case.guards.iter().copied()).collect()
        };
        let (mut one, mut other) = (rules(one), rules(other));
        let is_same = |(one, other): &(&BitRule, &BitRule)| {
            one.0.from == other.0.from && one.0.to == other.0.to && std::ptr::eq(one.1, other.1)
        };
        let last = one.iter().rev().zip(other.iter().rev()).take_while(is_same).count();
        one.truncate(one.len() - last);
        other.truncate(other.len() - last);
        let first = one.iter().zip(&other).take_while(is_same).count();
        Self { first, one: one.split_off(first), other: other.split_off(first) }
    }

    /// The first frame of a track on which the models choose differently, and the leaf of one that it follows.
    fn frame(&self, leaves: &[Run], track: &Track) -> Option<(usize, usize)> {
        leaves.iter().enumerate().find_map(|(at, run)| {
            let state = run.label?.primitive.index();
            let after = |rules: &[BitRule<'m>]| -> Vec<(usize, &'m [u64])> {
                let asked = rules.iter().filter(|(rule, _)| rule.follows(state));
                asked.map(|(rule, bits)| (rule.to, &bits[track.words.clone()])).collect()
            };
            let (one, other) = (after(&self.one), after(&self.other));
            if one.is_empty() && other.is_empty() {
                return None;
            }
            // A rule that holds on the first frame of the next run ends this one.
            let (begin, end) = (run.start + 1, (run.end + 1).min(track.frames));
            let mut keep = u64::MAX << (begin % 64);
            for word in begin / 64..end.div_ceil(64) {
                let differing = differing(&one, &other, word) & keep;
                keep = u64::MAX;
                if differing != 0 {
                    let frame = word * 64 + differing.trailing_zeros() as usize;
                    return (frame < end).then_some((at, frame));
                }
            }
            None
        })
    }
}

/// The frames of a word on which the first rule that holds leads to different labels.
fn differing(one: &[(usize, &[u64])], other: &[(usize, &[u64])], word: usize) -> u64 {
    let (mut alike, mut held) = (0, 0);
    for (to, bits) in one {
        let chosen = bits[word] & !held;
        held |= bits[word];
        let mut held = 0;
        for (other_to, bits) in other {
            alike |= if to == other_to { chosen & bits[word] & !held } else { 0 };
            held |= bits[word];
        }
    }
    other.iter().fold(held, |held, (_, bits)| held | bits[word]) & !alike
}
