//! Rules learned from labels: labeled recordings in, a rule file out that a person can read. docs/learning.md describes the method.
//!
//! `quantities` is the vocabulary, `bank` evaluates it by the engine, `guards` and `tree` are first guesses, `search` improves them, `evaluation` measures
//! its versions in the cases of `model_bits`, `medoid` chooses between models of parts of the recordings, `validation` measures all of them on groups that are
//! held out and chooses, `rule_file` writes. `extension` learns one new primitive, `relearning` single guards and numbers of a written file.
//!
//! Invariants: nothing is read, written or printed here; the same recordings give the same bytes on any number of threads; a rule file gives the labels that
//! the learner computed for it.

mod bank;
mod evaluation;
mod extension;
mod guards;
mod medoid;
mod model;
mod model_bits;
mod objective;
mod quantities;
mod relearning;
mod rule_file;
mod search;
mod search_extent;
mod tree;
mod validation;

pub use extension::{
    Declaration, Extension, FoundInterval, LEAST_RECORDINGS, LoadRules, MarkedTrack, Recognition, ShownRecording,
    extend,
};

pub use relearning::{LineChange, MOST_RUNS, RelearnedRules, RunText, relearn};
pub use search_extent::SearchExtent;

use bank::Bank;
use model::{MOST_LABELS, labels};
use std::collections::BTreeSet;
use teachtree_base::channels::ChannelSpec;
use teachtree_base::error::InputError;
use teachtree_base::hands::{Side, TrackId};
use teachtree_engine::runs::Run;
use teachtree_frames::frames::Frames;
use validation::{FOLDS, FoldCounts, MethodResult, choice, fitted, measured};

/// Groups below which little is known about others.
pub const FEW_GROUPS: usize = 4;
/// The name of the candidate that is the present rules as they are.
const PRESENT: &str = "the present rules";
/// The name of the candidate that is the present rules with fitted params.
pub const REFITTED: &str = "the same, fitted";
/// Lines of a rule file, at most.
pub const MOST_LINES: usize = 40;

/// Derives the frames of a recording with some channels.
pub type FramesOf<'a> = dyn Fn(&[ChannelSpec]) -> Result<Frames, InputError> + Send + Sync + 'a;

/// A recording with labels.
pub struct Demonstration<'a> {
    /// Its name, for errors.
    pub name: String,
    /// The number of its group, from 0 on without gaps.
    pub group: usize,
    /// The hands that it measures, left first.
    pub hands: Vec<Side>,
    /// Its frames.
    pub frames: Box<FramesOf<'a>>,
    /// Its true label.
    pub tracks: Vec<LabeledTrack>,
}

/// What is true of a track.
#[derive(Clone, Debug, PartialEq)]
pub struct LabeledTrack {
    /// Whose it is.
    pub who: TrackId,
    /// The labels, in order and apart.
    pub spans: Vec<LabeledSpan>,
    /// The result of the present rules, if there are some.
    pub present: Option<Vec<LabeledSpan>>,
    /// The result of the present rules with params that were fitted without the fold of this recording, if any can be.
    pub refitted: Option<Vec<LabeledSpan>>,
}

/// The fold in which a group is held out.
pub const fn fold_of(group: usize) -> usize {
    group % FOLDS
}

/// A label over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabeledSpan {
    /// Its position in the list of labels; in the result of the present rules also after its end, for any other name.
    pub label: usize,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
}

/// A row of the table: the present rules, or what a method has learned.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// `guards`.
    pub name: &'static str,
    /// F1 of the segments at 50 % overlap, 0 to 1. Of learned rules on groups that were held out, all together.
    pub f1: f64,
    /// The share of the labeled frames with the right label, 0 to 1, of the same labels.
    pub accuracy: f64,
    /// Lines of the file; `None` of the present rules.
    pub lines: Option<usize>,
}

/// What was learned.
#[derive(Clone, Debug, PartialEq)]
pub struct LearningResult {
    /// The candidates; the present rules first.
    pub candidates: Vec<Candidate>,
    /// The position of the chosen one among them.
    pub chosen: usize,
    /// Its rule file.
    pub text: String,
    /// The labels that the file gives each labeled stretch, in the order of recordings, stretches and tracks; frames count from the start of the stretch.
    pub labels: Vec<Vec<Run>>,
    /// How many boundaries the labels have, and of how many kinds.
    pub boundaries: (usize, usize),
    /// How many conditions were tried.
    pub conditions: usize,
    /// What the searches of all candidates have tried, also without each group.
    pub extent: SearchExtent,
}

impl LearningResult {
    /// The present rules, as they are or with fitted params, whichever are better; `None` where there are none.
    pub fn present(&self) -> Option<&Candidate> {
        let present = self.candidates.iter().filter(|candidate| candidate.lines.is_none());
        present.reduce(|best, next| if next.f1 > best.f1 { next } else { best })
    }

    /// Whether the chosen file is better than the present rules, also with fitted params; true where there are none.
    pub fn is_better(&self) -> bool {
        let chosen = self.candidates.get(self.chosen);
        self.present().is_none_or(|present| chosen.is_some_and(|chosen| chosen.f1 > present.f1))
    }
}

/// Learns rules for `names`, the list of labels. `shown` receives the share that is done, 0 to 1.
///
/// # Errors
/// Recordings from which nothing can be learned: too few groups, too many or too few labels, tracks of both hands beside tracks of one; a recording that
/// cannot be evaluated.
pub fn learn(
    demonstrations: &[Demonstration],
    names: &[String],
    shown: &(dyn Fn(f64) + Sync),
) -> Result<LearningResult, InputError> {
    let both = checked(demonstrations, names)?;
    let bank = Bank::new(demonstrations, names.len(), both)?;
    let boundaries = || bank.tracks.iter().flat_map(|track| track.truth.boundaries());
    let kinds: BTreeSet<(usize, usize)> = boundaries().map(|(from, to, _)| (from, to)).collect();
    if kinds.is_empty() {
        return Err(wrong("no label follows another one, so there is no boundary to learn")
            .help("label whole recordings, or compare the times of the labels with those of the recordings"));
    }
    let of_all = |name: &'static str, labels: fn(&bank::Track) -> Option<&Vec<Run>>| -> Option<Candidate> {
        let labels: Option<Vec<Vec<Run>>> = bank.tracks.iter().map(|track| labels(track).cloned()).collect();
        labels.map(|labels| row(name, &measured(&bank, &labels), None))
    };
    let present = of_all(PRESENT, |track| track.present.as_ref());
    let refitted = of_all(REFITTED, |track| track.refitted.as_ref());
    let mut candidates: Vec<Candidate> = present.into_iter().chain(refitted).collect();
    let mut files = Vec::new();
    let groups = bank.tracks.iter().map(|track| track.group).collect::<BTreeSet<_>>().len();
    let (fitted, extent) = fitted(&bank, shown);
    for MethodResult { method, model, held_out } in &fitted {
        let measured = measured(&bank, held_out);
        let [f1, frames] = [measured.all.f1(), measured.all.accuracy()].map(|part| part * 100.0);
        let about = format!(
            "Learned from {} recordings in {groups} groups ({}). Held out: F1@50 {f1:.1} %, frames {frames:.1} %.",
            demonstrations.len(),
            method.name()
        );
        let text = rule_file::rule_file(&bank, model, held_out, names, &about)?;
        candidates.push(row(method.name(), &measured, Some(text.lines().count())));
        files.push((text, model, measured));
    }
    let short: Vec<usize> = (0..files.len()).filter(|at| files[*at].0.lines().count() <= MOST_LINES).collect();
    let ranked: Vec<(usize, &FoldCounts)> = short.iter().map(|at| (files[*at].1.size(), &files[*at].2)).collect();
    let Some(at) = choice(&ranked).map(|at| short[at]) else {
        return Err(wrong(&format!("no rule file for {} labels has {MOST_LINES} lines or fewer", names.len()))
            .help("map labels to fewer names with --map"));
    };
    let all: Vec<usize> = (0..bank.tracks.len()).collect();
    Ok(LearningResult {
        chosen: candidates.len() - files.len() + at,
        labels: labels(&bank, files[at].1, &all),
        text: files[at].0.clone(),
        candidates,
        boundaries: (boundaries().count(), kinds.len()),
        conditions: bank.atoms.len(),
        extent,
    })
}

fn row(name: &'static str, measured: &FoldCounts, lines: Option<usize>) -> Candidate {
    Candidate { name, f1: measured.all.f1(), accuracy: measured.all.accuracy(), lines }
}

fn wrong(message: &str) -> InputError {
    InputError::new("the labels", message)
}

/// Refuses what nothing can be learned from; returns whether the labels are of both hands together.
fn checked(demonstrations: &[Demonstration], names: &[String]) -> Result<bool, InputError> {
    if !(2..=MOST_LABELS).contains(&names.len()) {
        return Err(wrong(&format!("the number of names is {}, expected 2 to {MOST_LABELS}", names.len()))
            .help("map labels to other names with --map, `NAME=mask` leaves one out"));
    }
    let groups: BTreeSet<usize> = demonstrations.iter().map(|demonstration| demonstration.group).collect();
    if groups.len() < 2 {
        return Err(wrong(&format!("are of {} group, expected at least 2, so that one can be held out", groups.len()))
            .help("name groups with --group-by, or add recordings"));
    }
    let tracks = || demonstrations.iter().flat_map(|demonstration| &demonstration.tracks);
    let both = tracks().any(|track| track.who == TrackId::Both);
    if both && tracks().any(|track| track.who != TrackId::Both) {
        return Err(wrong("are of single hands and of both hands together")
            .help("write them into folders of their own, and learn from each folder"));
    }
    if let Some(one) = demonstrations.iter().find(|demonstration| both && demonstration.hands.len() < 2) {
        return Err(lacks_second_hand(&one.name));
    }
    Ok(both)
}

fn lacks_second_hand(recording: &str) -> InputError {
    InputError::new(recording, "measures one hand, and the labels are of both hands together")
        .help("name the hand with --track")
}
