//! A primitive learned from marked intervals: a guard and a place in the tree of given rules, as a rule file that extends them.
//!
//! `vocabulary` lists conditions, `evidence` evaluates them and the tree by the engine, `places` are those where a choice may be inserted, `guards` searches,
//! `rule_text` writes, `recognition` measures. Each marked recording is held out once. Guards that are about as good as the chosen one vote on each interval.

mod evidence;
mod guards;
mod places;
mod recognition;
mod rule_text;
mod vocabulary;

pub use recognition::Recognition;

use super::FramesOf;
use evidence::Evidence;
use guards::{Guard, Search};
use rayon::prelude::*;
use recognition::{FoundTrack, Question, Span, found, length_s, overlap_s};
use teachtree_base::error::InputError;
use teachtree_base::hands::{Side, TrackId};
use teachtree_language::evidence::EVIDENCE;
use teachtree_language::graph::compare::{ExtensionProof, prove_extension};
use teachtree_language::rules::{Rules, TreeScope};

/// Recordings with marks from which a primitive is learned, at least.
pub const LEAST_RECORDINGS: usize = 3;
/// Guards that the engine compares, and that vote.
const COMPARED: usize = 10;
/// What a voter may be worse than the chosen guard.
const NEAR: f64 = 0.08;

/// Loads the rules that are extended with a text behind them.
pub type LoadRules<'a> = dyn Fn(&str) -> Result<Rules, InputError> + Send + Sync + 'a;

/// A new primitive as it is declared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Declaration {
    /// Its name.
    pub name: String,
    /// Whether it is sided.
    pub sided: bool,
    /// `is Translate`, `does hold`; without it, the new one is a kind of what the rules call most of the marked time.
    pub meaning: Option<String>,
}

/// A recording, with marks or without.
pub struct ShownRecording<'a> {
    /// Its name, for messages.
    pub name: String,
    /// The hands that it measures, left first.
    pub hands: Vec<Side>,
    /// How long it is, s.
    pub duration_s: f64,
    /// Its frames.
    pub frames: Box<FramesOf<'a>>,
    /// What is known about it; empty where nothing is.
    pub tracks: Vec<MarkedTrack>,
}

/// What is known about a track.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkedTrack {
    /// Whose it is.
    pub who: TrackId,
    /// The side of a sided primitive, whose marks these are.
    pub side: Option<Side>,
    /// When the primitive takes place, `[start, end]`, s.
    pub marked: Vec<[f64; 2]>,
    /// When it is known whether it does, s; `None` for the whole recording.
    pub known: Option<Vec<[f64; 2]>>,
}

/// A time at which the extension finds the primitive, or might.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundInterval {
    /// Position of the recording.
    pub recording: usize,
    /// Whose track it is.
    pub who: TrackId,
    /// Start and end, s.
    pub time_s: [f64; 2],
    /// Whether the extension finds it.
    pub is_found: bool,
    /// Whether a mark overlaps it.
    pub is_marked: bool,
    /// The share of the other guards that agree, 0 to 1.
    pub agreement: f64,
}

impl FoundInterval {
    /// `found`, `missed`, for people.
    pub const fn state(&self) -> &'static str {
        match (self.is_found, self.is_marked) {
            (true, true) => "found, labeled",
            (true, false) => "found",
            (false, true) => "missed",
            (false, false) => "not found",
        }
    }
}

/// An extension that was learned.
#[derive(Clone, Debug, PartialEq)]
pub struct Extension {
    /// The declarations, the choice and the task.
    pub text: String,
    /// Whether it only adds to the rules.
    pub proof: ExtensionProof,
    /// On the recordings that it was learned from.
    pub learned: Recognition,
    /// Each recording by an extension that was learned without it.
    pub held_out: Recognition,
    /// How many conditions and places were tried.
    pub tried: [usize; 2],
    /// Where it finds the primitive, and where the other guards find it, least certain first.
    pub intervals: Vec<FoundInterval>,
}

/// Learns a primitive. `shown` receives the share that is done, 0 to 1.
///
/// # Errors
/// Too few recordings with marks; rules without a tree for them; recordings that cannot be evaluated; no guard that finds a mark.
pub fn extend(
    declaration: &Declaration,
    recordings: &[ShownRecording],
    load: &LoadRules,
    shown: &(dyn Fn(f64) + Sync),
) -> Result<Extension, InputError> {
    let of = |is_wanted: &dyn Fn(&ShownRecording) -> bool| -> Vec<usize> {
        (0..recordings.len()).filter(|at| is_wanted(&recordings[*at])).collect()
    };
    let marked = of(&|one| one.tracks.iter().any(|track| !track.marked.is_empty()));
    if marked.len() < LEAST_RECORDINGS {
        let name = &declaration.name;
        let message = format!("mark `{name}` in {} recordings, expected {LEAST_RECORDINGS} or more", marked.len());
        return Err(
            InputError::new("the labels", message).help("label it in more recordings, at other places and speeds")
        );
    }
    let of_both = recordings.iter().flat_map(|one| &one.tracks).any(|track| track.who == TrackId::Both);
    recordings.iter().try_for_each(check_hands)?;
    let scope = if of_both { TreeScope::BothHands } else { TreeScope::EachHand };
    let base = load("")?;
    if base.primitive(&declaration.name).is_some() {
        let message = format!("found `{}`, expected a name that the rules do not have", declaration.name);
        return Err(InputError::new("--new", message).help("give the new primitive another name"));
    }
    let evidence = Evidence::new(load, recordings, scope, declaration.sided)?;
    shown(0.3);
    let learner = Learner { declaration, recordings, load, scope, base: &base, evidence: &evidence };
    let (known, unknown) = (of(&|one| !one.tracks.is_empty()), of(&|one| one.tracks.is_empty()));
    let folds: Vec<Recognition> = marked
        .par_iter()
        .map(|held_out| {
            let others: Vec<usize> = known.iter().copied().filter(|at| at != held_out).collect();
            let candidates = learner.candidates(&others, &[])?;
            let found = candidates.first().map(|best| learner.found(*held_out, &[&best.rules])).transpose()?;
            Ok(found.map_or_else(Recognition::default, |found| learner.recognition(*held_out, &found[0])))
        })
        .collect::<Result<_, InputError>>()?;
    shown(0.7);
    let candidates = learner.candidates(&known, &unknown)?;
    let Some(best) = candidates.first() else {
        return Err(InputError::new("the labels", format!("no condition tells `{}` from the rest", declaration.name)));
    };
    let held_out = sum(folds.into_iter());
    let learned = sum(known.iter().map(|at| learner.recognition(*at, &best.found[*at])));
    let comment = format!(
        "    {EVIDENCE}{} intervals of {} recordings, held out {} of {}",
        learned.marked,
        marked.len(),
        held_out.matched,
        held_out.marked
    );
    let (text, rules) = learner.rules(&best.guard, &comment)?;
    Ok(Extension {
        text,
        proof: prove_extension(&base, &rules),
        learned,
        held_out,
        tried: [evidence.conditions.len(), evidence.places.len()],
        intervals: learner.intervals(&candidates),
    })
}

/// Refuses labels of hands that a recording does not measure.
fn check_hands(recording: &ShownRecording) -> Result<(), InputError> {
    for track in &recording.tracks {
        match track.who {
            TrackId::Both if recording.hands.len() < 2 => return Err(super::lacks_second_hand(&recording.name)),
            TrackId::Hand(side) if !recording.hands.contains(&side) => {
                return Err(super::bank::lacks_hand(&recording.name, &recording.hands, track.who));
            }
            TrackId::Both | TrackId::Hand(_) => {}
        }
    }
    Ok(())
}

fn sum(all: impl Iterator<Item = Recognition>) -> Recognition {
    all.fold(Recognition::default(), |mut sum, one| {
        sum += one;
        sum
    })
}

/// A guard with its rules, and where they find the primitive, by recording and track.
struct Candidate {
    guard: Guard,
    rules: Rules,
    found: Vec<Vec<FoundTrack>>,
}

/// What a primitive is learned from.
struct Learner<'a> {
    declaration: &'a Declaration,
    recordings: &'a [ShownRecording<'a>],
    load: &'a LoadRules<'a>,
    scope: TreeScope,
    base: &'a Rules,
    evidence: &'a Evidence,
}

impl Learner<'_> {
    /// The rule text of a guard, and its rules.
    fn rules(&self, guard: &Guard, comment: &str) -> Result<(String, Rules), InputError> {
        let text = rule_text::body(self.evidence, guard, self.base, self.declaration, self.lasting_s(), comment);
        rule_text::checked(self.load, &text)
    }

    /// Half of the shortest marked interval, in steps of 10 ms, s.
    fn lasting_s(&self) -> f64 {
        let marks = self.recordings.iter().flat_map(|one| &one.tracks).flat_map(|track| &track.marked);
        let shortest_s = marks.map(length_s).fold(f64::INFINITY, f64::min);
        if shortest_s.is_finite() { (shortest_s * 50.0).floor().max(1.0) / 100.0 } else { 0.1 }
    }

    fn found(&self, recording: usize, rules: &[&Rules]) -> Result<Vec<Vec<FoundTrack>>, InputError> {
        let question = Question { name: &self.declaration.name, scope: self.scope, sided: self.declaration.sided };
        found(&self.recordings[recording], rules, question)
    }

    fn recognition(&self, recording: usize, found: &[FoundTrack]) -> Recognition {
        let of_track = |track: &MarkedTrack| {
            let found = found.iter().find(|it| it.who == track.who && it.side == track.side);
            Recognition::new(track, found.map_or(&[], |it| &it.spans))
        };
        sum(self.recordings[recording].tracks.iter().map(of_track))
    }

    /// The guards that find the marks of some recordings as the engine runs them, best first, and where they find the primitive in other recordings. A guard whose place another file extends is left out.
    fn candidates(&self, known: &[usize], unknown: &[usize]) -> Result<Vec<Candidate>, InputError> {
        let search = Search::new(self.evidence, known);
        let (mut guards, mut failure) = (Vec::new(), None);
        for guard in search.best(COMPARED) {
            match self.rules(&guard, "") {
                Ok((_, rules)) => guards.push((guard, rules)),
                Err(error) => failure = Some(error),
            }
        }
        if let (true, Some(failure)) = (guards.is_empty(), failure) {
            return Err(failure);
        }
        let rules: Vec<&Rules> = guards.iter().map(|(_, rules)| rules).collect();
        let asked: Vec<usize> = known.iter().chain(unknown).copied().collect();
        let found: Vec<Vec<Vec<FoundTrack>>> =
            asked.par_iter().map(|at| self.found(*at, &rules)).collect::<Result<_, _>>()?;
        let mut candidates: Vec<Candidate> = Vec::new();
        for (at, (mut guard, rules)) in guards.into_iter().enumerate() {
            let mut of_guard = vec![Vec::new(); self.recordings.len()];
            for (recording, found) in asked.iter().zip(&found) {
                of_guard[*recording].clone_from(&found[at]);
            }
            let worth = sum(known.iter().map(|at| self.recognition(*at, &of_guard[*at]))).worth();
            guard.worth = worth - search.cost(&guard) - guard.elsewhere;
            candidates.push(Candidate { guard, rules, found: of_guard });
        }
        candidates.sort_by(|one, other| other.guard.worth.total_cmp(&one.guard.worth));
        Ok(candidates)
    }

    /// Where the first candidate finds the primitive, and where others do that are about as good, least certain first.
    fn intervals(&self, candidates: &[Candidate]) -> Vec<FoundInterval> {
        let best = candidates.first().map_or(0.0, |it| it.guard.worth);
        let voters: Vec<&Candidate> = candidates.iter().filter(|it| it.guard.worth >= best - NEAR).collect();
        let mut all = Vec::new();
        for (recording, shown) in self.recordings.iter().enumerate() {
            let tracks = voters.first().map_or(&[][..], |it| &it.found[recording]);
            for (place, FoundTrack { who, side, .. }) in tracks.iter().enumerate() {
                let marks = shown.tracks.iter().filter(|track| track.who == *who && track.side == *side);
                let marks: Vec<Span> = marks.flat_map(|track| track.marked.iter().copied()).collect();
                let found: Vec<&[Span]> = voters.iter().map(|it| it.found[recording][place].spans.as_slice()).collect();
                all.extend(votes(&found).into_iter().map(|(time_s, is_found, agreement)| FoundInterval {
                    recording,
                    who: *who,
                    time_s,
                    is_found,
                    is_marked: marks.iter().any(|mark| overlap_s(mark, &time_s) > 0.0),
                    agreement,
                }));
            }
        }
        let start_s = |it: &FoundInterval| it.time_s[0];
        all.sort_by(|one, other| {
            let order = one.agreement.total_cmp(&other.agreement).then(one.recording.cmp(&other.recording));
            order.then(start_s(one).total_cmp(&start_s(other)))
        });
        all
    }
}

/// The intervals of the first voter, and those of others that it does not find, each with the share of the other voters that agree.
fn votes(found: &[&[Span]]) -> Vec<(Span, bool, f64)> {
    let Some((first, others)) = found.split_first() else { return Vec::new() };
    let share = |time_s: &Span| {
        let covered = |spans: &&[Span]| spans.iter().map(|span| overlap_s(span, time_s)).sum::<f64>();
        let covered_s: f64 = others.iter().map(covered).sum();
        covered_s / (length_s(time_s) * others.len() as f64).max(f64::MIN_POSITIVE)
    };
    let mut all: Vec<(Span, bool, f64)> =
        first.iter().map(|time_s| (*time_s, true, if others.is_empty() { 1.0 } else { share(time_s) })).collect();
    let mut missed: Vec<Span> = Vec::new();
    for time_s in others.iter().copied().flatten() {
        if first.iter().all(|known| overlap_s(known, time_s) == 0.0) {
            match missed.iter_mut().find(|known| overlap_s(known, time_s) > 0.0) {
                Some(known) => *known = [known[0].min(time_s[0]), known[1].max(time_s[1])],
                None => missed.push(*time_s),
            }
        }
    }
    all.extend(missed.into_iter().map(|time_s| (time_s, false, 1.0 - share(&time_s))));
    all
}
