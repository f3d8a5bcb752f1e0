//! The search for a guard and its place: a beam search over conjunctions of conditions at each place of the tree, measured on the marked frames and intervals.
//! A guard may begin the primitive only, and another condition sustain it.

use super::evidence::{Evidence, Stretch};
use rayon::prelude::*;
use std::cmp::{Ordering, Reverse};
use std::ops::Range;

/// Conditions of a guard, at most.
const MOST_CONDITIONS: usize = 3;
/// Conjunctions that are kept of each place and size.
const BEAM: usize = 8;
/// Places that are searched beyond single conditions.
const PLACES: usize = 10;
/// What a condition must bring, times its cost.
const PENALTY: f64 = 0.012;
/// Guards that begin the primitive for which what sustains it is searched, and how much of an interval is its beginning.
const STARTERS: usize = 12;
const BEGINNING: f64 = 0.4;
/// Guards whose intervals are compared.
const RANKED: usize = 120;
/// What a place costs that the tree gets to on all frames: where the tree has asked more, the guard is less often wrong in other recordings.
const GENERAL: f64 = 0.1;
/// What a guard loses for each share of the time for which it takes its choice in recordings without labels, up to a share that is not rare, and beyond:
/// a primitive that these recordings have is not given up for it.
const ELSEWHERE: f64 = 2.0;
const RARE: f64 = 0.05;
const BEYOND: f64 = 0.3;
/// What a guard loses whose threshold moves.
const TUNES: f64 = 0.004;

/// A guard at a place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Guard {
    pub place: usize,
    /// What holds together when the primitive begins, and while it lasts where nothing else sustains it.
    pub conditions: Vec<usize>,
    /// What sustains it.
    pub sustains: Option<usize>,
    /// How well it finds the marks, 0 to 1, less what there is to read and what it takes elsewhere.
    pub worth: f64,
    /// The loss for what it takes elsewhere.
    pub elsewhere: f64,
}

impl Guard {
    const fn at(place: usize) -> Self {
        Self { place, conditions: Vec::new(), sustains: None, worth: 0.0, elsewhere: 0.0 }
    }
}

/// Frames and intervals that are right and wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Counts {
    right: usize,
    wrong: usize,
    missed: usize,
    /// Frames of the result in recordings without labels.
    elsewhere: usize,
    /// Marked intervals, intervals of the result, and those that overlap by half.
    marked: usize,
    found: usize,
    matched: usize,
}

impl Counts {
    /// Adds frames of a word: right, wrong, and of recordings without labels.
    fn add(&mut self, split: [u64; 3]) {
        let [right, wrong, elsewhere] = split.map(|bits| bits.count_ones() as usize);
        self.right += right;
        self.wrong += wrong;
        self.elsewhere += elsewhere;
    }

    /// The frames of marks and results together that are of both, 0 to 1.
    fn overlap(&self) -> f64 {
        self.right as f64 / ((self.right + self.wrong + self.missed) as f64).max(1.0)
    }

    /// F1 of the intervals at 50 % overlap, 0 to 1.
    fn f1(&self) -> f64 {
        2.0 * self.matched as f64 / ((self.marked + self.found) as f64).max(1.0)
    }

    fn worth(&self) -> f64 {
        0.5 * (self.overlap() + self.f1())
    }
}

/// Compares intervals with marks, both in order.
fn matched(marked: &[Range<usize>], found: &[Range<usize>]) -> usize {
    let is_match = |one: &Range<usize>, other: &Range<usize>| {
        let both = one.end.min(other.end).saturating_sub(one.start.max(other.start));
        let either = one.end.max(other.end) - one.start.min(other.start);
        2 * both >= either
    };
    marked.iter().filter(|mark| found.iter().any(|it| is_match(mark, it))).count()
}

/// The search for guards on some recordings.
pub(super) struct Search<'a> {
    evidence: &'a Evidence,
    /// The frames of the recordings; those of recordings without labels are known to be rarely right.
    marked: Vec<u64>,
    known: Vec<u64>,
    count: usize,
    /// The number of frames of recordings without labels.
    elsewhere: usize,
    stretches: Vec<&'a Stretch>,
    words: Vec<Range<usize>>,
    /// The share of the frames on which the tree gets to each place.
    shares: Vec<f64>,
    /// The bits of the beginnings of intervals: words and what they hold.
    beginnings: Vec<Vec<(usize, u64)>>,
}

impl<'a> Search<'a> {
    pub fn new(evidence: &'a Evidence, recordings: &[usize]) -> Self {
        let stretches: Vec<&Stretch> =
            evidence.stretches.iter().filter(|it| it.is_elsewhere || recordings.contains(&it.recording)).collect();
        let mut made = Self {
            evidence,
            marked: vec![0; evidence.words],
            known: vec![0; evidence.words],
            count: 0,
            elsewhere: 0,
            words: stretches.iter().map(|it| it.words.clone()).collect(),
            beginnings: stretches.iter().flat_map(|it| it.marked.iter().map(|mark| beginning(it, mark))).collect(),
            stretches,
            shares: Vec::new(),
        };
        for word in made.words.iter().flat_map(Clone::clone) {
            made.marked[word] = evidence.marked[word];
            made.known[word] = evidence.known[word] | evidence.elsewhere[word];
        }
        let count = |bits: &mut dyn Iterator<Item = u64>| bits.map(|bits| bits.count_ones() as usize).sum::<usize>();
        made.count = count(&mut made.marked.iter().copied());
        made.elsewhere = count(&mut evidence.elsewhere.iter().copied());
        let known = count(&mut made.known.iter().copied()).max(1) as f64;
        let share = |reached: &Vec<u64>| {
            count(&mut reached.iter().zip(&made.known).map(|(reached, known)| reached & known)) as f64 / known
        };
        made.shares = evidence.reached.iter().map(share).collect();
        made
    }

    /// The best guards, at most `most` that ask different things, best first.
    pub fn best(&self, most: usize) -> Vec<Guard> {
        let mut places: Vec<(f64, usize, Vec<Guard>)> = (0..self.evidence.places.len())
            .into_par_iter()
            .map(|place| (place, self.longer(&Guard::at(place))))
            .map(|(place, found)| (found.first().map_or(0.0, |guard| guard.worth), place, found))
            .collect();
        places.sort_by(|one, other| other.0.total_cmp(&one.0).then(one.1.cmp(&other.1)));
        places.truncate(PLACES);
        let mut all: Vec<Guard> = places
            .into_par_iter()
            .flat_map_iter(|(.., found)| {
                let (mut all, mut beam) = (found.clone(), found);
                for _ in 1..MOST_CONDITIONS {
                    let mut next: Vec<Guard> = beam.iter().flat_map(|guard| self.longer(guard)).collect();
                    sort(&mut next);
                    next.dedup_by(|one, other| one.conditions == other.conditions);
                    next.truncate(BEAM);
                    all.extend(next.iter().cloned());
                    beam = next;
                }
                all
            })
            .collect();
        sort(&mut all);
        all.truncate(RANKED);
        all.extend(self.sustained());
        let mut ranked: Vec<Guard> = all.into_par_iter().map(|guard| self.measured(guard)).collect();
        sort(&mut ranked);
        let mut best: Vec<Guard> = Vec::new();
        for guard in ranked {
            if best.len() < most && best.iter().all(|known| self.families(known) != self.families(&guard)) {
                best.push(guard);
            }
        }
        best.into_par_iter().map(|guard| self.centered(guard)).collect()
    }

    /// What a guard asks, without thresholds and its place. Guards that ask the same differ little in other recordings.
    fn families(&self, guard: &Guard) -> (Vec<usize>, Option<usize>) {
        let family = |at: &usize| self.evidence.conditions[*at].family;
        (guard.conditions.iter().map(family).collect(), guard.sustains.as_ref().map(family))
    }

    /// What the conditions of a guard must bring.
    pub fn cost(&self, guard: &Guard) -> f64 {
        let conditions = guard.conditions.iter().chain(&guard.sustains);
        // Another choice is to be read, too.
        let choice = if guard.sustains.is_some() { 1.0 } else { 0.0 };
        let cost = PENALTY * (conditions.map(|at| self.evidence.conditions[*at].cost).sum::<f64>() + choice);
        cost + GENERAL * self.shares[guard.place]
    }

    /// The best guards that only begin the primitive, each with the conditions that sustain it best.
    fn sustained(&self) -> Vec<Guard> {
        let of_place = |place: usize| {
            let mut found = self.starters(&Guard::at(place));
            let longer: Vec<Guard> = found.iter().take(BEAM / 2).flat_map(|guard| self.starters(guard)).collect();
            found.extend(longer);
            found
        };
        let mut starters: Vec<Guard> =
            (0..self.evidence.places.len()).into_par_iter().flat_map_iter(of_place).collect();
        sort(&mut starters);
        let mut different: Vec<(Guard, Vec<u64>)> = Vec::new();
        for guard in starters {
            let fires = self.fires(&guard);
            if different.len() < STARTERS && different.iter().all(|(_, known)| *known != fires) {
                different.push((guard, fires));
            }
        }
        different.into_par_iter().flat_map_iter(|(guard, _)| self.sustaining(&guard)).collect()
    }

    /// The guard with one more condition, those first that begin most intervals and hold nowhere else.
    fn starters(&self, guard: &Guard) -> Vec<Guard> {
        let fires = self.fires(guard);
        let words = self.taken(&fires);
        let worth = |held: &Vec<u64>| {
            let begins = |beginning: &&Vec<(usize, u64)>| {
                beginning.iter().any(|(word, bits)| fires[*word] & held[*word] & bits != 0)
            };
            let begun = self.beginnings.iter().filter(begins).count();
            let it = self.counted(&words, held);
            begun as f64 / self.beginnings.len().max(1) as f64
                - 2.0 * (it.wrong as f64 / self.count.max(1) as f64 + self.loss(it.elsewhere))
        };
        self.ranked(guard, |at| worth(&self.evidence.held[at]))
    }

    /// The guard with each of the conditions that sustain it best.
    fn sustaining(&self, guard: &Guard) -> Vec<Guard> {
        let known: Vec<u64> =
            self.evidence.reached[guard.place].iter().zip(&self.known).map(|(it, known)| it & known).collect();
        let begun = self.fires(guard);
        let worth = |at: usize| {
            let mut counts = Counts::default();
            for words in &self.words {
                let mut before = 0;
                for word in words.clone() {
                    let bits = sustain(begun[word], known[word] & self.evidence.held[at][word], before);
                    before = bits >> 63;
                    counts.add(self.split(word, bits));
                }
            }
            self.worth(&counts) - PENALTY * self.evidence.conditions[at].cost
        };
        let mut found: Vec<(f64, usize)> = (0..self.evidence.held.len()).map(|at| (worth(at), at)).collect();
        found.sort_by(|one, other| other.0.total_cmp(&one.0).then(one.1.cmp(&other.1)));
        found.truncate(BEAM);
        found.into_iter().map(|(worth, at)| Guard { sustains: Some(at), worth, ..guard.clone() }).collect()
    }

    /// The guard with each of the conditions of the greatest worth, best first.
    fn ranked(&self, guard: &Guard, worth: impl Fn(usize) -> f64) -> Vec<Guard> {
        let cost = self.cost(guard);
        let worth = |at: usize| worth(at) - cost - PENALTY * self.evidence.conditions[at].cost;
        let mut found: Vec<(f64, usize)> = (0..self.evidence.held.len()).map(|at| (worth(at), at)).collect();
        let order = |one: &(f64, usize), other: &(f64, usize)| other.0.total_cmp(&one.0).then(one.1.cmp(&other.1));
        if found.len() > BEAM {
            found.select_nth_unstable_by(BEAM, order);
            found.truncate(BEAM);
        }
        let made = |(worth, at): (f64, usize)| {
            let mut conditions = [guard.conditions.as_slice(), &[at]].concat();
            conditions.sort_unstable();
            conditions.dedup();
            Guard { conditions, worth, ..guard.clone() }
        };
        let mut longer: Vec<Guard> = found.into_iter().map(made).collect();
        sort(&mut longer);
        longer
    }

    /// The guard with one more condition, best first.
    fn longer(&self, guard: &Guard) -> Vec<Guard> {
        let fires = self.fires(guard);
        let words = self.taken(&fires);
        self.ranked(guard, |at| self.worth(&self.counted(&words, &self.evidence.held[at])))
    }

    /// The words of frames on which a choice is taken, split; most words are zero behind the first conditions.
    fn taken(&self, fires: &[u64]) -> Vec<(usize, [u64; 3])> {
        (0..fires.len()).filter(|word| fires[*word] != 0).map(|word| (word, self.split(word, fires[word]))).collect()
    }

    /// Frames of a word that are right, wrong, and of recordings without labels.
    fn split(&self, word: usize, bits: u64) -> [u64; 3] {
        let (marked, elsewhere) = (self.marked[word], self.evidence.elsewhere[word]);
        [bits & marked, bits & !marked & !elsewhere, bits & elsewhere]
    }

    /// The frames of split words on which a condition holds.
    fn counted(&self, words: &[(usize, [u64; 3])], held: &[u64]) -> Counts {
        let mut counts = Counts::default();
        for (word, split) in words {
            counts.add(split.map(|bits| bits & held[*word]));
        }
        counts
    }

    /// The overlap with the marks, less the loss for what is taken elsewhere.
    fn worth(&self, counts: &Counts) -> f64 {
        let Counts { right, wrong, elsewhere, .. } = counts;
        *right as f64 / ((self.count + wrong) as f64).max(1.0) - self.loss(*elsewhere)
    }

    /// What a guard loses for frames of recordings without labels.
    fn loss(&self, frames: usize) -> f64 {
        let share = frames as f64 / self.elsewhere.max(1) as f64;
        ELSEWHERE * share.min(RARE) + BEYOND * (share - RARE).max(0.0)
    }

    /// The known frames on which a guard takes its choice.
    fn fires(&self, guard: &Guard) -> Vec<u64> {
        let mut fires: Vec<u64> =
            self.evidence.reached[guard.place].iter().zip(&self.known).map(|(it, known)| it & known).collect();
        for at in &guard.conditions {
            fires.iter_mut().zip(&self.evidence.held[*at]).for_each(|(fires, held)| *fires &= held);
        }
        if let Some(at) = guard.sustains {
            let reached = &self.evidence.reached[guard.place];
            for words in &self.words {
                let mut before = 0;
                for word in words.clone() {
                    let keep = reached[word] & self.known[word] & self.evidence.held[at][word];
                    fires[word] = sustain(fires[word], keep, before);
                    before = fires[word] >> 63;
                }
            }
        }
        fires
    }

    fn counts(&self, guard: &Guard) -> Counts {
        let fires = self.fires(guard);
        let mut counts = Counts::default();
        for stretch in &self.stretches {
            let found = settled(&intervals(&fires[stretch.words.clone()], stretch.frames), stretch.settle);
            if stretch.is_elsewhere {
                counts.elsewhere += found.iter().map(Range::len).sum::<usize>();
                continue;
            }
            counts.marked += stretch.marked.len();
            counts.found += found.len();
            counts.matched += matched(&stretch.marked, &found);
            for word in stretch.words.clone() {
                counts.add(self.split(word, fires[word]));
            }
        }
        counts.missed = self.count - counts.right;
        counts
    }

    /// The guard, measured.
    fn measured(&self, guard: Guard) -> Guard {
        let counts = self.counts(&guard);
        let elsewhere = self.loss(counts.elsewhere);
        Guard { worth: counts.worth() - elsewhere - self.cost(&guard), elsewhere, ..guard }
    }

    /// Moves each threshold to the middle of the thresholds around it that are as good.
    fn centered(&self, mut guard: Guard) -> Guard {
        for place in 0..guard.conditions.len() + usize::from(guard.sustains.is_some()) {
            let now = guard.conditions.get(place).copied().or(guard.sustains).unwrap_or_default();
            let of_family = |at: &usize| {
                self.evidence.conditions.get(*at).is_some_and(|it| it.family == self.evidence.conditions[now].family)
            };
            let with = |at: usize| {
                let mut changed = guard.clone();
                match changed.conditions.get_mut(place) {
                    Some(condition) => *condition = at,
                    None => changed.sustains = Some(at),
                }
                self.measured(changed)
            };
            let is_as_good = |at: &usize| with(*at).worth >= guard.worth - TUNES;
            let below = (0..now).rev().take_while(of_family).take_while(is_as_good).count();
            let above = (now + 1..).take_while(of_family).take_while(is_as_good).count();
            let middle = now + above / 2 - below / 2;
            if middle != now && is_as_good(&middle) {
                guard = with(middle);
            }
        }
        guard
    }
}

/// Better guards first; of those that are as good, those behind more choices of the tree.
fn rank(one: &Guard, other: &Guard) -> Ordering {
    let key = |guard: &Guard| (guard.conditions.len(), Reverse(guard.place), guard.conditions.clone(), guard.sustains);
    other.worth.total_cmp(&one.worth).then_with(|| key(one).cmp(&key(other)))
}

fn sort(guards: &mut [Guard]) {
    guards.sort_by(rank);
}

/// The bits of the beginning of a marked interval.
fn beginning(stretch: &Stretch, mark: &Range<usize>) -> Vec<(usize, u64)> {
    let end = mark.start + ((mark.len() as f64 * BEGINNING).ceil() as usize).max(1);
    let mut bits: Vec<(usize, u64)> = Vec::new();
    for frame in mark.start..end {
        let (word, bit) = (stretch.words.start + frame / 64, 1 << (frame % 64));
        match bits.last_mut() {
            Some((last, bits)) if *last == word => *bits |= bit,
            _ => bits.push((word, bit)),
        }
    }
    bits
}

/// A word of bits that are set, and stay as long as others hold; `before` is the bit before, 0 or 1.
const fn sustain(set: u64, mut hold: u64, before: u64) -> u64 {
    let mut bits = set | (before & hold);
    let mut step = 1;
    while step < 64 {
        bits |= hold & (bits << step);
        hold &= hold << step;
        step *= 2;
    }
    bits
}

/// The intervals of set bits.
fn intervals(bits: &[u64], frames: usize) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for (at, word) in bits.iter().enumerate() {
        let mut rest = *word;
        while rest != 0 {
            let start = rest.trailing_zeros() as usize;
            let len = (rest >> start).trailing_ones() as usize;
            let (first, end) = (64 * at + start, (64 * at + start + len).min(frames));
            match found.last_mut() {
                Some(last) if last.end == first => last.end = end,
                _ => found.push(first..end),
            }
            rest = if start + len >= 64 { 0 } else { rest >> (start + len) << (start + len) };
        }
    }
    found
}

/// Intervals as settling leaves them: gaps that are too short are closed, then intervals that are too short are left out.
fn settled(intervals: &[Range<usize>], settle: usize) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for interval in intervals {
        match found.last_mut() {
            Some(last) if interval.start - last.end < settle => last.end = interval.end,
            _ => found.push(interval.clone()),
        }
    }
    found.retain(|interval| interval.len() >= settle);
    found
}
