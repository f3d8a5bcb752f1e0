//! What is learned: an automaton of labels. Its rules are choices `from(A, B) and CONDITIONS => C` of a tree, in order; without one the label stays.

use super::bank::{Bank, Track, label};
use super::objective::LabelId;
use teachtree_engine::runs::{Run, append, settle};
use teachtree_engine::semantics::samples;

/// The most labels: a set of them is a word.
pub(crate) const MOST_LABELS: usize = 32;

/// A choice.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
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
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
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
        self.settled(&self.leaves(guards, track), track)
    }

    /// Settles the leaves of a track.
    pub fn settled(&self, leaves: &[Run], track: &Track) -> Vec<Run> {
        let frames = samples(f64::from(self.settle_ms) * 1e-3, track.rate_hz).map_or(0, |frames| frames as usize);
        settle(leaves, frames)
    }

    /// The leaves of a track before settling.
    pub fn leaves(&self, guards: &[impl AsRef<[u64]>], track: &Track) -> Vec<Run> {
        let first = Run { start: 0, end: track.frames, label: Some(label(self.start)) };
        self.leaves_from(guards, track, &[first], 1)
    }

    /// The same where the leaves are `known` up to frame `at`, which is in the last one or at its end.
    pub fn leaves_from(&self, guards: &[impl AsRef<[u64]>], track: &Track, known: &[Run], mut at: usize) -> Vec<Run> {
        let Some((last, known)) = known.split_last() else { return Vec::new() };
        let mut leaves = known.to_vec();
        let (mut state, mut begin) = (last.label.map_or(self.start, |label| label.primitive.index()), last.start);
        let mut asked = Vec::with_capacity(guards.len());
        loop {
            let rules = self.rules.iter().zip(guards).filter(|(rule, _)| rule.follows(state));
            asked.clear();
            asked.extend(rules.map(|(rule, guard)| (rule.to, &guard.as_ref()[track.words.clone()])));
            let Some((frame, to)) = next(&asked, at) else { break };
            append(&mut leaves, Run { start: begin, end: frame, label: Some(label(state)) });
            (state, begin, at) = (to, frame, frame + 1);
        }
        append(&mut leaves, Run { start: begin, end: track.frames, label: Some(label(state)) });
        leaves
    }
}

/// The first frame from `at` on with a rule that holds, and its label; rules have their label and the words of a track.
fn next(rules: &[(LabelId, &[u64])], at: usize) -> Option<(usize, LabelId)> {
    let words = rules.first()?.1.len();
    let mut keep = u64::MAX << (at % 64);
    for word in at / 64..words {
        let any = rules.iter().fold(0, |any, (_, guard)| any | guard[word]) & keep;
        keep = u64::MAX;
        if any != 0 {
            let bit = any.trailing_zeros();
            let (to, _) = rules.iter().find(|(_, guard)| guard[word] >> bit & 1 == 1)?;
            return Some((word * 64 + bit as usize, *to));
        }
    }
    None
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
