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

/// How well other conditions of a guard and one more find boundaries.
struct Passage<'a> {
    bank: &'a Bank,
    windows: Vec<HeldWindow<'a>>,
    /// The sum of the most that each window can be worth.
    most: f64,
}

/// A window with the frames on which the other conditions hold.
struct HeldWindow<'a> {
    window: &'a Window,
    places: Vec<Place>,
    /// The worth of the best of these frames.
    most: f64,
}

/// A word of the bank with frames of a window on which the other conditions hold.
struct Place {
    word: usize,
    /// The frame of its first bit in the track.
    frame: usize,
    /// The frames of each hand; those of a second hand are zero in a track of one.
    held: [u64; 2],
}

impl<'a> Passage<'a> {
    fn new(bank: &'a Bank, windows: &'a [Window], atoms: &[usize]) -> Self {
        let held = |slot: usize, word: usize, keep: u64| {
            if slot >= bank.slots {
                return 0;
            }
            atoms.iter().fold(keep, |held, atom| held & bank.row(*atom, slot)[word])
        };
        let held_window = |window: &'a Window| {
            let begin = bank.tracks[window.track].words.start;
            let place = |at: usize| {
                let (frame, word) = (at * 64, begin + at);
                let after_start = u64::MAX << window.start.saturating_sub(frame);
                let before_end = u64::MAX >> (frame + 64).saturating_sub(window.end);
                Place { word, frame, held: [0, 1].map(|slot| held(slot, word, after_start & before_end)) }
            };
            let all = (window.start / 64..window.end.div_ceil(64)).map(place);
            let places: Vec<Place> = all.filter(|place| place.held != [0; 2]).collect();
            let most = window.most(&places);
            HeldWindow { window, places, most }
        };
        let windows: Vec<HeldWindow> = windows.iter().map(held_window).collect();
        Self { bank, most: windows.iter().map(|it| it.most).sum(), windows }
    }

    /// The mean worth of the first passage of the conditions and one more, 0 to 1; `None` where it is less than `least`.
    fn worth(&self, atom: usize, least: f64) -> Option<f64> {
        let rows = [self.bank.row(atom, 0), self.bank.row(atom, self.bank.slots - 1)];
        let count = self.windows.len().max(1) as f64;
        // What the windows that are left must bring; sums are rounded.
        let mut owed = least * count - self.most - 1e-6;
        let mut sum = 0.0;
        for HeldWindow { window, places, most } in &self.windows {
            let first = places.iter().find_map(|Place { word, frame, held }| {
                let both = held[0] & rows[0][*word] | held[1] & rows[1][*word];
                (both != 0).then(|| frame + both.trailing_zeros() as usize)
            });
            let worth = window.worth(first.unwrap_or(window.end));
            sum += worth;
            owed += most - worth;
            if owed > 0.0 {
                return None;
            }
        }
        Some(sum / count)
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

    /// The most that a first passage on some frames, or none, is worth: a frame nearer to the boundary is worth more.
    fn most(&self, places: &[Place]) -> f64 {
        let (mut before, mut after) = (None, None);
        for Place { frame, held, .. } in places {
            let held = held[0] | held[1];
            let is_before = match self.boundary.saturating_sub(*frame) {
                frames @ 0..64 => (1 << frames) - 1,
                _ => u64::MAX,
            };
            before = (held & is_before).checked_ilog2().map(|bit| frame + bit as usize).or(before);
            let later = held & !is_before;
            after = after.or_else(|| (later != 0).then(|| frame + later.trailing_zeros() as usize));
        }
        let frames = before.into_iter().chain(after).chain([self.end]);
        frames.map(|frame| self.worth(frame)).fold(0.0, f64::max)
    }
}

/// The atoms that suit some conditions of a guard best, with their worth, best first.
pub(crate) fn suiting(bank: &Bank, windows: &[Window], atoms: &[usize], most: usize) -> Vec<(f64, usize)> {
    let passage = Passage::new(bank, windows, atoms);
    let rank = |one: &(f64, usize), other: &(f64, usize)| other.0.total_cmp(&one.0).then(one.1.cmp(&other.1));
    let mut found: Vec<(f64, usize)> = Vec::with_capacity(most + 1);
    for atom in (0..bank.atoms.len()).filter(|atom| !atoms.contains(atom)) {
        let least = if found.len() < most { 0.0 } else { found.last().map_or(0.0, |(worth, _)| *worth) };
        let Some(next) = passage.worth(atom, least).map(|worth| (worth, atom)) else { continue };
        found.insert(found.partition_point(|it| rank(it, &next).is_lt()), next);
        found.truncate(most);
    }
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
