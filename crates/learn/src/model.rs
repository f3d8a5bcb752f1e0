//! What is learned: an automaton of labels. Its rules are choices `from(A, B) and CONDITIONS => C` of a tree, in order; without one the label stays.

use super::bank::{Bank, Track, label};
use super::objective::LabelId;
use teachtree_engine::runs::{Run, append, settle};
use teachtree_engine::semantics::samples;

/// The most labels: a set of them is a word.
pub(crate) const MOST_LABELS: usize = 32;

/// A choice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Rule {
    /// The labels before, a bit each.
    pub from: u32,
    /// The conditions, which hold together; at least one. In a track of both hands they hold for one of the hands.
    pub atoms: Vec<usize>,
    pub to: LabelId,
}

impl Rule {
    /// Whether it is asked after a label.
    pub const fn follows(&self, label: LabelId) -> bool {
        self.from >> label & 1 == 1
    }
}

/// A tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Model {
    pub rules: Vec<Rule>,
    /// The label at the beginning.
    pub start: LabelId,
    /// How long a label must last.
    pub settle_ms: u32,
}

impl Model {
    /// How much there is to read: rules and conditions.
    pub fn size(&self) -> usize {
        self.rules.iter().map(|rule| 1 + rule.atoms.len()).sum()
    }

    /// The labels of a track, settled; `guards` has the bits of each rule.
    pub fn run(&self, guards: &[impl AsRef<[u64]>], track: &Track) -> Vec<Run> {
        let frames = samples(f64::from(self.settle_ms) * 1e-3, track.rate_hz).map_or(0, |frames| frames as usize);
        settle(&self.leaves(guards, track), frames)
    }

    /// The leaves of a track before settling.
    fn leaves(&self, guards: &[impl AsRef<[u64]>], track: &Track) -> Vec<Run> {
        let mut leaves = Vec::new();
        let (mut state, mut begin, mut at) = (self.start, 0, 1);
        while let Some((frame, to)) = self.next(guards, track, state, at) {
            append(&mut leaves, Run { start: begin, end: frame, label: Some(label(state)) });
            (state, begin, at) = (to, frame, frame + 1);
        }
        append(&mut leaves, Run { start: begin, end: track.frames, label: Some(label(state)) });
        leaves
    }

    /// The first frame from `at` on with a rule that is taken after label `state`, and its label.
    fn next(&self, guards: &[impl AsRef<[u64]>], track: &Track, state: LabelId, at: usize) -> Option<(usize, LabelId)> {
        let asked = || self.rules.iter().zip(guards).filter(|(rule, _)| rule.follows(state));
        let mut keep = u64::MAX << (at % 64);
        for word in at / 64..track.words.len() {
            let place = track.words.start + word;
            let any = asked().fold(0, |any, (_, guard)| any | guard.as_ref()[place]) & keep;
            keep = u64::MAX;
            if any != 0 {
                let bit = any.trailing_zeros();
                let (rule, _) = asked().find(|(_, guard)| guard.as_ref()[place] >> bit & 1 == 1)?;
                return Some((word * 64 + bit as usize, rule.to));
            }
        }
        None
    }
}

/// The labels that a model gives some tracks.
pub(crate) fn labels(bank: &Bank, model: &Model, tracks: &[usize]) -> Vec<Vec<Run>> {
    let guards: Vec<Vec<u64>> = model.rules.iter().map(|rule| guard(bank, &rule.atoms, tracks)).collect();
    tracks.iter().map(|track| model.run(&guards, &bank.tracks[*track])).collect()
}

/// The frames of some tracks on which conditions hold together for a hand, as bits of the bank.
pub(crate) fn guard(bank: &Bank, atoms: &[usize], tracks: &[usize]) -> Vec<u64> {
    let mut guard = vec![0; bank.words];
    let Some((first, others)) = atoms.split_first() else { return guard };
    for slot in 0..bank.slots {
        let (first, others) = (bank.row(*first, slot), others.iter().map(|atom| bank.row(*atom, slot)));
        let others: Vec<&[u64]> = others.collect();
        for track in tracks {
            for word in bank.tracks[*track].words.clone() {
                guard[word] |= others.iter().fold(first[word], |held, other| held & other[word]);
            }
        }
    }
    guard
}
