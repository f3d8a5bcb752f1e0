//! The search: changes of one rule after the other, as long as the labels that the whole model gives become better. A change must bring more than what it
//! adds to be read, and must not be worse for a third of the groups.

use super::bank::Bank;
use super::guards::{MOST_ATOMS, Window, Windows, suiting, windows};
use super::model::{Model, Rule, guard};
use super::objective::Counts;
use super::search_extent::SearchExtent;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What a rule or a condition must bring.
const PENALTY: f64 = 0.0008;
/// What a change that adds something must bring beyond that.
const ADDS: f64 = 0.0015;
/// What another threshold or settling time must bring.
const TUNES: f64 = 0.0005;
/// A group is worse when it loses more than this.
const WORSE: f64 = 0.004;
/// The share of the groups that may be worse.
const VETO: f64 = 0.34;
/// Conditions that are tried in a place.
const TRIED: usize = 40;
/// Conditions that are tried for a new rule.
const TRIED_NEW: usize = 8;
/// Confusions for which a new rule is tried.
const CONFUSIONS: usize = 6;
/// Rounds over all rules, at most.
const ROUNDS: usize = 6;
/// The settling times, ms.
const SETTLE_MS: [u32; 6] = [0, 200, 400, 600, 800, 1200];
/// What a search may cost: words of bits times models.
const MOST_WORK: usize = 60_000_000;

/// A model with the bits of its rules.
#[derive(Clone)]
struct ModelBits {
    model: Model,
    guards: Vec<Arc<[u64]>>,
}

impl ModelBits {
    /// The same with other conditions of a rule.
    fn with_atoms(&self, bank: &Bank, tracks: &[usize], rule: usize, mut atoms: Vec<usize>) -> Self {
        let mut next = self.clone();
        atoms.sort_unstable();
        next.guards[rule] = Arc::from(guard(bank, &atoms, tracks));
        next.model.rules[rule].atoms = atoms;
        next
    }

    fn without(&self, rule: usize) -> Self {
        let mut next = self.clone();
        next.model.rules.remove(rule);
        next.guards.remove(rule);
        next
    }
}

/// The search for a model on some tracks.
pub(crate) struct Search<'a> {
    bank: &'a Bank,
    tracks: &'a [usize],
    windows: Windows,
    now: ModelBits,
    value: f64,
    /// The objective of each group.
    groups: Vec<f64>,
    most_rules: usize,
    left: usize,
    extent: SearchExtent,
}

impl<'a> Search<'a> {
    /// Improves a model; returns what was tried, too.
    pub fn run(bank: &'a Bank, tracks: &'a [usize], model: Model, most_rules: usize) -> (Model, SearchExtent) {
        let guards = model.rules.iter().map(|rule| Arc::from(guard(bank, &rule.atoms, tracks))).collect();
        let now = ModelBits { model, guards };
        let left = MOST_WORK / bank.words.max(64);
        let windows = windows(bank, tracks);
        let (value, groups, extent) = (0.0, Vec::new(), SearchExtent::default());
        let mut search = Self { bank, tracks, windows, now, value, groups, most_rules, left, extent };
        (search.value, search.groups) = search.worth(&search.now);
        for _ in 0..ROUNDS {
            let before = search.value;
            search.round();
            if search.value <= before {
                break;
            }
        }
        search.recover();
        search.center();
        (search.now.model, search.extent)
    }

    /// The value of a model, and the objective of each group.
    fn worth(&self, candidate: &ModelBits) -> (f64, Vec<f64>) {
        let mut groups: BTreeMap<usize, Counts> = BTreeMap::new();
        for track in self.tracks {
            let track = &self.bank.tracks[*track];
            *groups.entry(track.group).or_default() +=
                track.truth.compare(&candidate.model.run(&candidate.guards, track));
        }
        let all: Counts = groups.values().sum();
        let value = all.objective() - PENALTY * candidate.model.size() as f64;
        (value, groups.values().map(|counts| counts.objective()).collect())
    }

    /// Takes the best of some candidates if it brings at least `gain`.
    fn take_best(&mut self, candidates: Vec<ModelBits>, gain: f64) -> bool {
        let mut best: Option<(f64, Vec<f64>, ModelBits)> = None;
        for candidate in candidates {
            if self.left == 0 {
                self.extent.is_cut = true;
                break;
            }
            self.left -= 1;
            self.extent.versions += 1;
            let (value, groups) = self.worth(&candidate);
            let is_better = best.as_ref().map_or(value >= self.value + gain, |best| value > best.0);
            if is_better && !self.is_vetoed(&groups) {
                best = Some((value, groups, candidate));
            }
        }
        let Some((value, groups, candidate)) = best else { return false };
        (self.value, self.groups, self.now) = (value, groups, candidate);
        true
    }

    fn is_vetoed(&self, groups: &[f64]) -> bool {
        let worse = groups.iter().zip(&self.groups).filter(|(now, before)| **now < **before - WORSE).count();
        worse as f64 > VETO * groups.len() as f64
    }

    fn round(&mut self) {
        let mut at = 0;
        while at < self.now.model.rules.len() {
            if self.now.model.rules.len() > 1 && self.take_best(vec![self.now.without(at)], 0.0) {
                continue;
            }
            self.conditions(at);
            self.sources(at);
            at += 1;
        }
        self.new_rules();
        let settled =
            |settle_ms| ModelBits { model: Model { settle_ms, ..self.now.model.clone() }, ..self.now.clone() };
        let others = SETTLE_MS.into_iter().filter(|settle_ms| *settle_ms != self.now.model.settle_ms);
        let candidates = others.map(settled).collect();
        self.take_best(candidates, TUNES);
    }

    fn with_atoms(&self, rule: usize, atoms: Vec<usize>) -> ModelBits {
        self.now.with_atoms(self.bank, self.tracks, rule, atoms)
    }

    /// Removes, replaces, tunes and adds conditions of a rule.
    fn conditions(&mut self, rule: usize) {
        let mut place = 0;
        while place < self.now.model.rules[rule].atoms.len() {
            let atoms = self.now.model.rules[rule].atoms.clone();
            let others: Vec<usize> = atoms.iter().copied().filter(|atom| *atom != atoms[place]).collect();
            if !others.is_empty() && self.take_best(vec![self.with_atoms(rule, others.clone())], 0.0) {
                continue;
            }
            let with = |atom: &usize| self.with_atoms(rule, [others.as_slice(), &[*atom]].concat());
            let near: Vec<usize> = self.neighbors(atoms[place]).into_iter().filter(|it| !others.contains(it)).collect();
            let tuned = near.iter().map(with).collect();
            let replaced: Vec<ModelBits> = self.suiting(rule, &others).iter().map(with).collect();
            self.take_best(tuned, TUNES);
            self.take_best(replaced, TUNES);
            place += 1;
        }
        let atoms = self.now.model.rules[rule].atoms.clone();
        if atoms.len() < MOST_ATOMS {
            let longer = |atom: &usize| self.with_atoms(rule, [atoms.as_slice(), &[*atom]].concat());
            let candidates = self.suiting(rule, &atoms).iter().map(longer).collect();
            self.take_best(candidates, ADDS);
        }
    }

    /// The atoms that suit a rule with these other conditions.
    fn suiting(&self, rule: usize, atoms: &[usize]) -> Vec<usize> {
        let rule = &self.now.model.rules[rule];
        let windows: Vec<Window> = self
            .windows
            .iter()
            .filter(|((from, to), _)| rule.follows(*from) && rule.to == *to)
            .flat_map(|(_, it)| it)
            .copied()
            .collect();
        if windows.is_empty() {
            return Vec::new();
        }
        suiting(self.bank, &windows, atoms, TRIED).into_iter().map(|(_, atom)| atom).collect()
    }

    /// The atoms that differ from one in the threshold, by up to two steps.
    fn neighbors(&self, atom: usize) -> Vec<usize> {
        let family = self.bank.atoms[atom].family;
        let near = atom.saturating_sub(2)..(atom + 3).min(self.bank.atoms.len());
        near.filter(|other| *other != atom && self.bank.atoms[*other].family == family).collect()
    }

    /// Asks a rule after more or fewer labels, and before the rule above it.
    fn sources(&mut self, rule: usize) {
        let to = self.now.model.rules[rule].to;
        for label in (0..self.bank.labels).filter(|label| *label != to) {
            let from = self.now.model.rules[rule].from ^ 1 << label;
            if from != 0 {
                let mut next = self.now.clone();
                next.model.rules[rule].from = from;
                self.take_best(vec![next], ADDS);
            }
        }
        if rule > 0 {
            let mut next = self.now.clone();
            next.model.rules.swap(rule - 1, rule);
            next.guards.swap(rule - 1, rule);
            self.take_best(vec![next], TUNES);
        }
    }

    /// Asks each rule after more labels where that is not worse: then a label that is missed does not hold up those after it.
    fn recover(&mut self) {
        for rule in 0..self.now.model.rules.len() {
            let to = self.now.model.rules[rule].to;
            for label in (0..self.bank.labels).filter(|label| *label != to) {
                if !self.now.model.rules[rule].follows(label) {
                    let mut next = self.now.clone();
                    next.model.rules[rule].from |= 1 << label;
                    self.take_best(vec![next], 0.0);
                }
            }
        }
    }

    /// Tries a rule for each of the greatest confusions: from the label that is wrong to the right one.
    fn new_rules(&mut self) {
        if self.now.model.rules.len() >= self.most_rules {
            return;
        }
        let mut frames: BTreeMap<(usize, usize), Vec<u64>> = BTreeMap::new();
        for track in self.tracks {
            let track = &self.bank.tracks[*track];
            let runs = self.now.model.run(&self.now.guards, track);
            for run in &runs {
                let Some(found) = run.label.map(|label| label.primitive.index()) else { continue };
                for span in &track.truth.spans {
                    let (start, end) = (span.start.max(run.start), span.end.min(run.end));
                    if start >= end {
                        continue;
                    }
                    let bits = frames.entry((found, span.label)).or_insert_with(|| vec![0; self.bank.words]);
                    for frame in start..end {
                        bits[track.words.start + frame / 64] |= 1 << (frame % 64);
                    }
                }
            }
        }
        let count = |bits: &[u64]| bits.iter().map(|word| word.count_ones() as usize).sum::<usize>();
        let mut wrong: Vec<(usize, (usize, usize))> = frames
            .iter()
            .filter(|((found, truth), _)| found != truth)
            .map(|(pair, bits)| (count(bits), *pair))
            .filter(|(count, _)| *count > 0)
            .collect();
        wrong.sort_by_key(|(count, pair)| (std::cmp::Reverse(*count), *pair));
        let mut candidates = Vec::new();
        for (missed, (from, to)) in wrong.into_iter().take(CONFUSIONS) {
            let Some(wanted) = frames.get(&(from, to)) else { continue };
            let unwanted = frames.get(&(from, from));
            let share = |atom: usize, bits: &[u64], all: usize| {
                let held =
                    |word: usize| (0..self.bank.slots).fold(0, |any, slot| any | self.bank.row(atom, slot)[word]);
                let held =
                    bits.iter().enumerate().filter(|(_, bits)| **bits != 0).map(|(word, bits)| held(word) & bits);
                held.map(|word| word.count_ones() as usize).sum::<usize>() as f64 / all.max(1) as f64
            };
            let right = unwanted.map_or(0, |bits| count(bits));
            let worth =
                |atom: usize| share(atom, wanted, missed) - 2.0 * unwanted.map_or(0.0, |bits| share(atom, bits, right));
            let mut atoms: Vec<(f64, usize)> = (0..self.bank.atoms.len()).map(|atom| (worth(atom), atom)).collect();
            atoms.sort_by(|one, other| other.0.total_cmp(&one.0).then(one.1.cmp(&other.1)));
            candidates.extend(atoms.into_iter().take(TRIED_NEW).map(|(_, atom)| {
                let mut next = self.now.clone();
                next.model.rules.insert(0, Rule { from: 1 << from, atoms: vec![atom], to });
                next.guards.insert(0, Arc::from(guard(self.bank, &[atom], self.tracks)));
                next
            }));
        }
        self.take_best(candidates, ADDS);
    }

    /// Moves each threshold to the middle of the thresholds around it that are as good.
    fn center(&mut self) {
        for rule in 0..self.now.model.rules.len() {
            for place in 0..self.now.model.rules[rule].atoms.len() {
                let atoms = self.now.model.rules[rule].atoms.clone();
                let family = self.bank.atoms[atoms[place]].family;
                let is_as_good = |atom: usize| {
                    let mut changed = atoms.clone();
                    changed[place] = atom;
                    let candidate = self.with_atoms(rule, changed);
                    let (value, groups) = self.worth(&candidate);
                    (value >= self.value - TUNES && !self.is_vetoed(&groups)).then_some((value, groups, candidate))
                };
                let is_near = |atom: &usize| self.bank.atoms.get(*atom).is_some_and(|other| other.family == family);
                let below =
                    (0..atoms[place]).rev().take_while(is_near).take_while(|atom| is_as_good(*atom).is_some()).count();
                let above =
                    (atoms[place] + 1..).take_while(is_near).take_while(|atom| is_as_good(*atom).is_some()).count();
                let middle = atoms[place] + above / 2 - below / 2;
                let middle = if middle == atoms[place] || atoms.contains(&middle) { None } else { is_as_good(middle) };
                if let Some((value, groups, candidate)) = middle {
                    (self.value, self.groups, self.now) = (value, groups, candidate);
                }
            }
        }
    }
}
