//! The search: changes of one rule after the other, as long as the labels that the whole model gives become better. A change must bring more than what it
//! adds to be read, and must not be worse for a third of the groups.

use super::bank::Bank;
use super::evaluation::{EvaluatedModel, Evaluation, Evaluator};
use super::guards::{MOST_ATOMS, Window, Windows, suiting, windows};
use super::model::{Model, Rule};
use super::model_bits::ModelBits;
use super::objective::LabelId;
use super::search_extent::SearchExtent;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Labeled segments below which a model must also be good with thresholds a step away, and when a label is missed.
const FEW_SEGMENTS: usize = 240;
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
/// The settling times, ms.
const SETTLE_MS: [u32; 6] = [0, 200, 400, 600, 800, 1200];
/// What a search may cost: words of bits times versions of the rules.
const MOST_WORK: usize = 60_000_000;

/// The search for a model on some tracks.
pub(crate) struct Search<'a> {
    bank: &'a Bank,
    tracks: &'a [usize],
    evaluator: Evaluator<'a>,
    windows: Windows,
    now: ModelBits,
    evaluation: Evaluation,
    most_rules: usize,
    left: usize,
    extent: SearchExtent,
    /// Versions that do not bring this gain over the present one.
    refused: HashSet<(Model, u64)>,
    /// The atoms that suit a rule with other conditions.
    suiting: HashMap<(u32, LabelId, Vec<usize>), Vec<usize>>,
}

impl<'a> Search<'a> {
    /// Improves a model; returns what was tried, too.
    pub fn run(bank: &'a Bank, tracks: &'a [usize], model: Model, most_rules: usize) -> (Model, SearchExtent) {
        let mut search = Self::new(bank, tracks, model, most_rules);
        loop {
            let before = search.evaluation.value;
            search.round();
            if search.evaluation.value <= before {
                break;
            }
        }
        search.recover();
        search.center();
        (search.now.into_model(), search.extent)
    }

    /// A model whose rules follow more labels, where that is not worse.
    pub fn recovered(bank: &'a Bank, tracks: &'a [usize], model: Model) -> Model {
        let mut search = Self::new(bank, tracks, model, 0);
        search.recover();
        search.now.into_model()
    }

    fn new(bank: &'a Bank, tracks: &'a [usize], model: Model, most_rules: usize) -> Self {
        let segments: usize = tracks.iter().map(|track| 1 + bank.tracks[*track].truth.boundaries().count()).sum();
        let now = ModelBits::new(bank, model, tracks, segments < FEW_SEGMENTS);
        let evaluator = Evaluator::new(bank, tracks);
        let evaluation = evaluator.evaluate(&now);
        Self {
            bank,
            tracks,
            evaluator,
            windows: windows(bank, tracks),
            now,
            evaluation,
            most_rules,
            left: MOST_WORK / bank.words.max(64),
            extent: SearchExtent::default(),
            refused: HashSet::new(),
            suiting: HashMap::new(),
        }
    }

    fn model(&self) -> &Model {
        self.now.model()
    }

    /// Takes the best of some candidates if it brings at least `gain`.
    fn take_best(&mut self, candidates: Vec<ModelBits>, gain: f64) -> bool {
        let known = EvaluatedModel::new(&self.now, &self.evaluation);
        let mut best: Option<(Evaluation, ModelBits)> = None;
        for candidate in candidates {
            let key = (candidate.model().clone(), gain.to_bits());
            if self.refused.contains(&key) {
                continue;
            }
            if self.left == 0 {
                self.extent.is_cut = true;
                break;
            }
            self.left -= 1;
            self.extent.versions += 1;
            let least = best.as_ref().map_or(self.evaluation.value + gain, |(best, _)| best.value);
            let evaluation = self.evaluator.evaluate_version(&candidate, &known, least);
            let is_better = |it: &Evaluation| if best.is_some() { it.value > least } else { it.value >= least };
            match evaluation.filter(|it| is_better(it) && !self.is_vetoed(it)) {
                Some(evaluation) => best = Some((evaluation, candidate)),
                None => _ = self.refused.insert(key),
            }
        }
        let Some((evaluation, candidate)) = best else { return false };
        self.take(evaluation, candidate);
        true
    }

    fn take(&mut self, evaluation: Evaluation, version: ModelBits) {
        (self.evaluation, self.now) = (evaluation, version);
        self.refused.clear();
    }

    fn is_vetoed(&self, evaluation: &Evaluation) -> bool {
        let groups = evaluation.groups.iter().zip(&self.evaluation.groups);
        let worse = groups.filter(|(now, before)| **now < **before - WORSE).count();
        worse as f64 > VETO * evaluation.groups.len() as f64
    }

    fn round(&mut self) {
        let mut at = 0;
        while at < self.model().rules.len() {
            if self.model().rules.len() > 1 && self.take_best(vec![self.now.without(at)], 0.0) {
                continue;
            }
            self.conditions(at);
            self.sources(at);
            at += 1;
        }
        self.new_rules();
        let others = SETTLE_MS.into_iter().filter(|settle_ms| *settle_ms != self.model().settle_ms);
        let candidates = others.map(|settle_ms| self.now.with_settle_ms(settle_ms)).collect();
        self.take_best(candidates, TUNES);
    }

    fn with_atoms(&self, rule: usize, atoms: Vec<usize>) -> ModelBits {
        self.now.with_atoms(self.bank, self.tracks, rule, atoms)
    }

    /// Removes, replaces, tunes and adds conditions of a rule.
    fn conditions(&mut self, rule: usize) {
        let mut place = 0;
        while place < self.model().rules[rule].atoms.len() {
            let atoms = self.model().rules[rule].atoms.clone();
            let others: Vec<usize> = atoms.iter().copied().filter(|atom| *atom != atoms[place]).collect();
            if !others.is_empty() && self.take_best(vec![self.with_atoms(rule, others.clone())], 0.0) {
                continue;
            }
            let suiting = self.suiting(rule, &others);
            let with = |atom: &usize| self.with_atoms(rule, [others.as_slice(), &[*atom]].concat());
            let near: Vec<usize> = self.neighbors(atoms[place]).into_iter().filter(|it| !others.contains(it)).collect();
            let tuned = near.iter().map(with).collect();
            let replaced: Vec<ModelBits> = suiting.iter().map(with).collect();
            self.take_best(tuned, TUNES);
            self.take_best(replaced, TUNES);
            place += 1;
        }
        let atoms = self.model().rules[rule].atoms.clone();
        if atoms.len() < MOST_ATOMS {
            let suiting = self.suiting(rule, &atoms);
            let longer = |atom: &usize| self.with_atoms(rule, [atoms.as_slice(), &[*atom]].concat());
            let candidates = suiting.iter().map(longer).collect();
            self.take_best(candidates, ADDS);
        }
    }

    /// The atoms that suit a rule with these other conditions.
    fn suiting(&mut self, rule: usize, atoms: &[usize]) -> Vec<usize> {
        let rule = &self.now.model().rules[rule];
        let known = self.suiting.entry((rule.from, rule.to, atoms.to_vec()));
        let find = || suiting_rule(self.bank, &self.windows, rule, atoms);
        known.or_insert_with(find).clone()
    }

    /// The atoms that differ from one in the threshold, by up to two steps.
    fn neighbors(&self, atom: usize) -> Vec<usize> {
        let family = self.bank.atoms[atom].family;
        let near = atom.saturating_sub(2)..(atom + 3).min(self.bank.atoms.len());
        near.filter(|other| *other != atom && self.bank.atoms[*other].family == family).collect()
    }

    /// Asks a rule after more or fewer labels, and before the rule above it.
    fn sources(&mut self, rule: usize) {
        let to = self.model().rules[rule].to;
        for label in (0..self.bank.labels).filter(|label| *label != to) {
            let from = self.model().rules[rule].from ^ 1 << label;
            if from != 0 {
                self.take_best(vec![self.now.with_from(rule, from)], ADDS);
            }
        }
        if rule > 0 {
            self.take_best(vec![self.now.raised(rule)], TUNES);
        }
    }

    /// Asks each rule after more labels where that is not worse: then a label that is missed does not hold up those after it.
    fn recover(&mut self) {
        for rule in 0..self.model().rules.len() {
            let to = self.model().rules[rule].to;
            for label in (0..self.bank.labels).filter(|label| *label != to) {
                let from = self.model().rules[rule].from;
                if from >> label & 1 == 0 {
                    self.take_best(vec![self.now.with_from(rule, from | 1 << label)], 0.0);
                }
            }
        }
    }

    /// Tries a rule for each of the greatest confusions: from the label that is wrong to the right one.
    fn new_rules(&mut self) {
        if self.model().rules.len() >= self.most_rules {
            return;
        }
        let mut frames: BTreeMap<(usize, usize), Vec<u64>> = BTreeMap::new();
        let guards = self.now.as_it_is();
        for track in self.tracks {
            let track = &self.bank.tracks[*track];
            let runs = self.model().run(&guards, track);
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
        let words = |bits: &[u64]| -> Vec<(usize, u64)> {
            bits.iter().copied().enumerate().filter(|(_, bits)| *bits != 0).collect()
        };
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
            let right = unwanted.map_or(0, |bits| count(bits));
            let wanted = words(wanted);
            let unwanted = unwanted.map_or_else(Vec::new, |bits| words(bits));
            let share = |atom: usize, words: &[(usize, u64)], all: usize| {
                let held =
                    |word: usize| (0..self.bank.slots).fold(0, |any, slot| any | self.bank.row(atom, slot)[word]);
                let found = words.iter().map(|(word, bits)| (held(*word) & bits).count_ones() as usize);
                found.sum::<usize>() as f64 / all.max(1) as f64
            };
            let mut best: Vec<(f64, usize)> = Vec::with_capacity(TRIED_NEW + 1);
            for atom in 0..self.bank.atoms.len() {
                let least = if best.len() < TRIED_NEW { -2.0 } else { best.last().map_or(-2.0, |(worth, _)| *worth) };
                let found = share(atom, &wanted, missed);
                if found > least {
                    let worth = found - 2.0 * share(atom, &unwanted, right);
                    best.insert(best.partition_point(|(other, _)| *other >= worth), (worth, atom));
                    best.truncate(TRIED_NEW);
                }
            }
            let rule = |atom: usize| Rule { from: 1 << from, atoms: vec![atom], to };
            let version = |(_, atom)| self.now.with_first(self.bank, self.tracks, rule(atom));
            candidates.extend(best.into_iter().map(version));
        }
        self.take_best(candidates, ADDS);
    }

    /// Moves each threshold to the middle of the thresholds around it that are as good.
    fn center(&mut self) {
        for rule in 0..self.model().rules.len() {
            for place in 0..self.model().rules[rule].atoms.len() {
                let atoms = self.model().rules[rule].atoms.clone();
                let family = self.bank.atoms[atoms[place]].family;
                let known = EvaluatedModel::new(&self.now, &self.evaluation);
                let is_as_good = |atom: usize| {
                    let mut changed = atoms.clone();
                    changed[place] = atom;
                    let candidate = self.with_atoms(rule, changed);
                    let least = self.evaluation.value - TUNES;
                    let evaluation = self.evaluator.evaluate_version(&candidate, &known, least)?;
                    (evaluation.value >= least && !self.is_vetoed(&evaluation)).then_some((evaluation, candidate))
                };
                let is_near = |atom: &usize| self.bank.atoms.get(*atom).is_some_and(|other| other.family == family);
                let below =
                    (0..atoms[place]).rev().take_while(is_near).take_while(|atom| is_as_good(*atom).is_some()).count();
                let above =
                    (atoms[place] + 1..).take_while(is_near).take_while(|atom| is_as_good(*atom).is_some()).count();
                let middle = atoms[place] + above / 2 - below / 2;
                let middle = if middle == atoms[place] || atoms.contains(&middle) { None } else { is_as_good(middle) };
                if let Some((evaluation, candidate)) = middle {
                    self.take(evaluation, candidate);
                }
            }
        }
    }
}

/// The atoms that suit a rule with these other conditions.
fn suiting_rule(bank: &Bank, windows: &Windows, rule: &Rule, atoms: &[usize]) -> Vec<usize> {
    let asked = windows.iter().filter(|((from, to), _)| rule.follows(*from) && rule.to == *to);
    let asked: Vec<Window> = asked.flat_map(|(_, windows)| windows).copied().collect();
    if asked.is_empty() {
        return Vec::new();
    }
    suiting(bank, &asked, atoms, TRIED).into_iter().map(|(_, atom)| atom).collect()
}
