//! The first guess: for each pair of labels that follow each other a guard, the conjunction of conditions that first holds when the second label begins.

use super::bank::Bank;
use super::model::{Model, Rule};
use super::objective::{LabelId, Span};
use std::collections::BTreeMap;

/// Conjunctions that are kept on each level of the search.
const BEAM: usize = 8;
/// Conditions of a guard.
pub(crate) const MOST_ATOMS: usize = 3;
/// What a condition must bring.
const PENALTY: f64 = 0.01;
/// The share of the exits of a label below which a pair is left out.
const RARE: f64 = 0.03;
/// The settling time before it is searched.
const SETTLE_MS: u32 = 600;

/// A label and the one after it in the labels of a track: frames of the track.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    track: usize,
    start: usize,
    end: usize,
    /// Where the second label begins; the middle where nothing is labeled between them.
    boundary: usize,
}

/// The windows of each pair of labels.
pub(crate) type Windows = BTreeMap<(LabelId, LabelId), Vec<Window>>;

/// The pairs of labels in some tracks.
pub(crate) fn windows(bank: &Bank, tracks: &[usize]) -> Windows {
    let mut windows = Windows::new();
    for track in tracks {
        let mut joined: Vec<Span> = Vec::new();
        for span in &bank.tracks[*track].truth.spans {
            match joined.last_mut() {
                Some(last) if last.label == span.label => last.end = span.end,
                _ => joined.push(*span),
            }
        }
        for pair in joined.windows(2) {
            let (one, next) = (pair[0], pair[1]);
            let window = Window {
                track: *track,
                start: one.start,
                end: next.end,
                boundary: usize::midpoint(one.end, next.start),
            };
            windows.entry((one.label, next.label)).or_default().push(window);
        }
    }
    windows
}

/// How well conditions held together by a guard find boundaries: `held` has the bits of the other conditions for each hand, empty for none.
struct Passage<'a> {
    bank: &'a Bank,
    windows: &'a [Window],
    held: Vec<Vec<u64>>,
}

impl<'a> Passage<'a> {
    fn new(bank: &'a Bank, windows: &'a [Window], atoms: &[usize]) -> Self {
        let held = |slot: usize| -> Vec<u64> {
            let mut held = vec![u64::MAX; bank.words];
            for atom in atoms {
                held.iter_mut().zip(bank.row(*atom, slot)).for_each(|(held, bits)| *held &= bits);
            }
            held
        };
        Self { bank, windows, held: (0..bank.slots).map(held).collect() }
    }

    /// The mean worth of the first passage of these conditions and one more, 0 to 1.
    fn worth(&self, atom: usize) -> f64 {
        let rows: Vec<(&[u64], &[u64])> =
            self.held.iter().enumerate().map(|(slot, held)| (held.as_slice(), self.bank.row(atom, slot))).collect();
        let sum: f64 = self.windows.iter().map(|window| window.worth(self.first(window, &rows))).sum();
        sum / self.windows.len().max(1) as f64
    }

    /// The first frame of a window on which the conditions hold for a hand; its end where they do not.
    fn first(&self, window: &Window, rows: &[(&[u64], &[u64])]) -> usize {
        let begin = self.bank.tracks[window.track].words.start;
        let mut keep = u64::MAX << (window.start % 64);
        for word in window.start / 64..window.end.div_ceil(64) {
            let place = begin + word;
            let any = rows.iter().fold(0, |any, (held, bits)| any | held[place] & bits[place]) & keep;
            keep = u64::MAX;
            if any != 0 {
                return (word * 64 + any.trailing_zeros() as usize).min(window.end);
            }
        }
        window.end
    }
}

impl Window {
    /// How well both labels are found by a boundary at a frame: half their overlaps, and half for those of 50 %.
    fn worth(&self, at: usize) -> f64 {
        let length = |from: usize, to: usize| to.saturating_sub(from) as f64;
        let (first, second) = (length(self.start, self.boundary), length(self.boundary, self.end));
        let overlaps = if at < self.boundary {
            [length(self.start, at) / first, second / length(at, self.end)]
        } else {
            [first / length(self.start, at), length(at, self.end) / second]
        };
        overlaps.iter().map(|overlap| 0.25 * overlap + if *overlap >= 0.5 { 0.25 } else { 0.0 }).sum()
    }
}

/// The atoms that suit some conditions of a guard best, with their worth, best first.
pub(crate) fn suiting(bank: &Bank, windows: &[Window], atoms: &[usize], most: usize) -> Vec<(f64, usize)> {
    let passage = Passage::new(bank, windows, atoms);
    let others = (0..bank.atoms.len()).filter(|atom| !atoms.contains(atom));
    let mut found: Vec<(f64, usize)> = others.map(|atom| (passage.worth(atom), atom)).collect();
    let rank = |one: &(f64, usize), other: &(f64, usize)| other.0.total_cmp(&one.0).then(one.1.cmp(&other.1));
    if found.len() > most {
        found.select_nth_unstable_by(most, rank);
        found.truncate(most);
    }
    found.sort_by(rank);
    found
}

/// The best conjunction for some windows.
fn best(bank: &Bank, windows: &[Window]) -> Option<Vec<usize>> {
    let mut beam: Vec<(f64, Vec<usize>)> = vec![(0.0, Vec::new())];
    let mut all: Vec<(f64, Vec<usize>)> = Vec::new();
    for level in 1..=MOST_ATOMS {
        let mut next: Vec<(f64, Vec<usize>)> = Vec::new();
        for (_, atoms) in &beam {
            for (worth, atom) in suiting(bank, windows, atoms, BEAM) {
                let mut longer = [atoms.as_slice(), &[atom]].concat();
                longer.sort_unstable();
                next.push((worth - PENALTY * level as f64, longer));
            }
        }
        next.sort_by(|one, other| other.0.total_cmp(&one.0).then_with(|| one.1.cmp(&other.1)));
        next.dedup_by(|one, other| one.1 == other.1);
        next.truncate(BEAM);
        all.extend(next.iter().cloned());
        beam = next;
    }
    let better = |best: (f64, Vec<usize>), next: (f64, Vec<usize>)| if next.0 > best.0 { next } else { best };
    all.into_iter().reduce(better).map(|(_, atoms)| atoms)
}

/// A rule for each pair of labels that is not rare, at most `most`: the most frequent ones, in the order of their labels.
pub(crate) fn guards(bank: &Bank, tracks: &[usize], most: usize) -> Model {
    let windows = windows(bank, tracks);
    let mut exits: BTreeMap<LabelId, usize> = BTreeMap::new();
    windows.iter().for_each(|((from, _), found)| *exits.entry(*from).or_default() += found.len());
    let least = (tracks.len() / 2).clamp(1, 3);
    let is_frequent = |from: LabelId, count: usize| {
        count >= least && count as f64 >= RARE * exits.get(&from).copied().unwrap_or_default() as f64
    };
    let mut pairs: Vec<_> = windows.iter().filter(|((from, _), found)| is_frequent(*from, found.len())).collect();
    pairs.sort_by_key(|(pair, found)| (std::cmp::Reverse(found.len()), **pair));
    pairs.truncate(most);
    pairs.sort_by_key(|(pair, found)| (pair.0, std::cmp::Reverse(found.len()), pair.1));
    let rule = |(&(from, to), found): (&(LabelId, LabelId), &Vec<Window>)| {
        Some(Rule { from: 1 << from, atoms: best(bank, found)?, to })
    };
    Model { rules: pairs.into_iter().filter_map(rule).collect(), start: start(bank, tracks), settle_ms: SETTLE_MS }
}

/// The label with which most tracks begin.
pub(crate) fn start(bank: &Bank, tracks: &[usize]) -> LabelId {
    let mut counts = vec![0_usize; bank.labels];
    let first = |track: &usize| bank.tracks[*track].truth.spans.first().map(|span| span.label);
    tracks.iter().filter_map(first).for_each(|label| counts[label] += 1);
    let best = counts.iter().enumerate().max_by_key(|(label, count)| (**count, std::cmp::Reverse(*label)));
    best.map_or(0, |(label, _)| label)
}
