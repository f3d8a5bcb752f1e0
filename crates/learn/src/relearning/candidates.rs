//! What is tried at a site: other numbers, and a guard with one condition less, more, or another one.

use super::super::bank::{Bank, rounded};
use super::super::guards::{Window, Windows, suiting};
use super::super::objective::LabelId;
use super::ScoredTrack;
use super::guard_text::Part;
use super::written_file::{Edit, WrittenFile};
use std::collections::BTreeSet;
use teachtree_engine::runs::Run;
use teachtree_language::guard_sites::{GuardSite, NumberSite, numbers_in};
use teachtree_language::rules::{PrimitiveId, Rules, Type};

/// Factors of a number.
const FACTORS: [f64; 17] = [0.06, 0.12, 0.25, 0.35, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 1.25, 1.4, 1.7, 2.0, 4.0, 8.0, 16.0];
/// Conditions of the vocabulary that are tried of each ranking, and those of them that differ in a threshold only.
const TRIED: usize = 8;
const ALIKE: usize = 2;
/// Conditions that the rules declare and that are tried, at most.
const SIGNALS: usize = 24;

/// What is tried at the sites of a file.
pub(super) struct Candidates<'a> {
    pub file: &'a WrittenFile,
    pub rules: &'a Rules,
    pub bank: &'a Bank,
    pub names: &'a [String],
    /// Whether the labels are of both hands together.
    pub both: bool,
}

/// The recordings for which candidates are ranked.
pub(super) struct RankingData<'a> {
    pub tracks: &'a [usize],
    pub scored: &'a [ScoredTrack],
    pub windows: &'a Windows,
    /// What the rules give the tracks now.
    pub now: &'a [Vec<Run>],
}

/// Candidates that differ in one number only, in the order of the number; most families have one member.
pub(super) type Variants = Vec<Edit>;

impl Candidates<'_> {
    /// What is tried at a site that has `now` instead of what is written.
    pub fn of(&self, site: usize, now: Option<&Edit>, shown: &RankingData) -> Vec<Variants> {
        let Some(guard) = self.file.guard(site) else {
            let Some(number) = self.file.number(site) else { return Vec::new() };
            let value = match now {
                Some(Edit::Number(text)) => text.split(' ').next().and_then(|value| value.parse().ok()),
                _ => Some(number.value),
            };
            let texts = value.map_or_else(Vec::new, |value| other_values(value, &number.unit));
            return vec![texts.into_iter().map(Edit::Number).collect()];
        };
        // A tree of each hand says nothing about labels of both hands together.
        if self.both && !guard.of_both {
            return Vec::new();
        }
        let parts: Vec<Part> = match now {
            Some(Edit::Guard(parts)) => parts.clone(),
            _ => guard.conjuncts.iter().enumerate().map(Part::from).collect(),
        };
        let mut found: Vec<Variants> = Vec::new();
        let changeable: Vec<usize> = (0..parts.len()).filter(|at| !parts[*at].is_fixed).collect();
        for at in &changeable {
            if parts.len() > 1 {
                let mut shorter = parts.clone();
                shorter.remove(*at);
                found.push(vec![Edit::Guard(shorter)]);
            }
            let with = |text: String| {
                let mut changed = parts.clone();
                changed[*at].text = text;
                Edit::Guard(changed)
            };
            found
                .extend(other_numbers(&parts[*at].text).into_iter().map(|texts| texts.into_iter().map(with).collect()));
        }
        for part in self.conditions(guard, shown).into_iter().filter(|part| !parts.iter().any(|it| it.is_same(part))) {
            for at in &changeable {
                let mut changed = parts.clone();
                changed[*at] = part.in_place_of(&parts[*at]);
                found.push(vec![Edit::Guard(changed)]);
            }
            found.push(vec![Edit::Guard([parts.as_slice(), &[part]].concat())]);
        }
        found
    }

    /// Conditions that may suit a guard.
    fn conditions(&self, guard: &GuardSite, shown: &RankingData) -> Vec<Part> {
        let leaves: BTreeSet<LabelId> = guard.leaves.iter().filter_map(|name| self.label(name)).collect();
        if leaves.is_empty() {
            return Vec::new();
        }
        let follows = |label: LabelId| {
            guard
                .after
                .as_ref()
                .is_none_or(|(names, is_not)| names.iter().any(|name| self.label(name) == Some(label)) != *is_not)
        };
        let windows: Vec<Window> = shown
            .windows
            .iter()
            .filter(|((from, to), _)| follows(*from) && leaves.contains(to))
            .flat_map(|(_, windows)| windows.iter().copied())
            .collect();
        let mut atoms: Vec<usize> = Vec::new();
        if !windows.is_empty() {
            atoms.extend(self.different(suiting(self.bank, &windows, &[], 10 * TRIED)));
        }
        for only_found in [false, true] {
            atoms.extend(self.different(self.telling(&leaves, shown, only_found)));
        }
        let mut seen = BTreeSet::new();
        atoms.retain(|atom| seen.insert(*atom));
        let learned = atoms.into_iter().map(|atom| Part::learned(self.bank.atoms[atom].text.clone()));
        learned.chain(self.signals(guard.of_both)).collect()
    }

    /// The conditions of each hand that the rules declare, and their contraries.
    fn signals(&self, of_both: bool) -> Vec<Part> {
        let signals = self.rules.signals.iter().filter(|signal| signal.ty == Type::BOOL);
        let names = signals.take(SIGNALS).flat_map(|signal| match (signal.per_hand, of_both) {
            (true, true) => vec![format!("either.{}", signal.name), format!("both.{}", signal.name)],
            (..) => vec![signal.name.clone()],
        });
        names.flat_map(|name| [Part::written(name.clone()), Part::written(format!("not {name}"))]).collect()
    }

    /// The conditions that hold more often where the truth is one of some labels than elsewhere; `only_found`: of the frames on which the rules give one
    /// of them.
    fn telling(&self, leaves: &BTreeSet<LabelId>, shown: &RankingData, only_found: bool) -> Vec<(f64, usize)> {
        let mut wanted = vec![0_u64; self.bank.words];
        let mut unwanted = wanted.clone();
        for (track, now) in shown.tracks.iter().zip(shown.now) {
            let start = self.bank.tracks[*track].words.start;
            let is_leaf = |label: usize| leaves.contains(&label);
            for span in &shown.scored[*track].truth.spans {
                for run in now.iter().filter(|run| run.start < span.end && span.start < run.end) {
                    if only_found && !run.label.is_some_and(|label| is_leaf(label.primitive.index())) {
                        continue;
                    }
                    let bits = if is_leaf(span.label) { &mut wanted } else { &mut unwanted };
                    for frame in run.start.max(span.start)..run.end.min(span.end) {
                        bits[start + frame / 64] |= 1 << (frame % 64);
                    }
                }
            }
        }
        let count = |bits: &mut dyn Iterator<Item = u64>| bits.map(|word| word.count_ones() as usize).sum::<usize>();
        let [all_wanted, all_unwanted] = [&wanted, &unwanted].map(|bits| count(&mut bits.iter().copied()));
        if all_wanted == 0 || all_unwanted == 0 {
            return Vec::new();
        }
        let share = |atom: usize, bits: &[u64], all: usize| {
            let held = |word: usize| (0..self.bank.slots).fold(0, |any, slot| any | self.bank.row(atom, slot)[word]);
            count(&mut bits.iter().enumerate().map(|(word, bits)| held(word) & bits)) as f64 / all as f64
        };
        let worth = |atom| share(atom, &wanted, all_wanted) - share(atom, &unwanted, all_unwanted);
        let mut found: Vec<(f64, usize)> = (0..self.bank.atoms.len()).map(|atom| (worth(atom), atom)).collect();
        found.sort_by(|one, other| other.0.total_cmp(&one.0).then(one.1.cmp(&other.1)));
        found
    }

    /// The first atoms; few differ in a threshold only.
    fn different(&self, ranked: Vec<(f64, usize)>) -> Vec<usize> {
        let mut found: Vec<usize> = Vec::new();
        for (_, atom) in ranked {
            let family = |atom: usize| self.bank.atoms[atom].family;
            if found.len() < TRIED && found.iter().filter(|known| family(**known) == family(atom)).count() < ALIKE {
                found.push(atom);
            }
        }
        found
    }

    /// The label that a primitive counts for: its own, or that of a primitive that it is a kind of.
    fn label(&self, name: &str) -> Option<LabelId> {
        let mut primitive = self.rules.primitive(name);
        while let Some(it) = primitive.and_then(|PrimitiveId(at)| self.rules.primitives.get(at as usize)) {
            if let Some(label) = self.names.iter().position(|known| *known == it.name) {
                return Some(label);
            }
            primitive = it.is;
        }
        None
    }
}

/// A text with each of its numbers changed: one list for each number, in its order.
fn other_numbers(text: &str) -> Vec<Vec<String>> {
    let of_site = |site: &NumberSite| {
        let written = |number: String| {
            let mut changed = text.to_string();
            changed.replace_range(site.span.start as usize..site.span.end as usize, &number);
            changed
        };
        other_values(site.value, &site.unit).into_iter().map(written).collect()
    };
    numbers_in(text).iter().map(of_site).collect()
}

/// Other values of a number with their unit, in order; none of zero, which no factor changes.
fn other_values(value: f64, unit: &str) -> Vec<String> {
    let mut values: Vec<f64> = FACTORS.iter().filter_map(|factor| rounded(value * factor)).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values.retain(|other| other.to_bits() != value.to_bits());
    values.into_iter().map(|value| format!("{value} {unit}").trim_end().to_string()).collect()
}
