//! Conditions as formulas, and whether some of them can hold together: decided on intervals of quantities, on states of hystereses and on
//! the leaf before. Different quantities are free, so what is found impossible is impossible on every log.

mod read;
mod written;

pub use read::Reader;
pub use written::{label, written};

use std::collections::{BTreeMap, BTreeSet};

/// Steps of one search; beyond them the answer is "perhaps".
const MAX_STEPS: usize = 100_000;

/// A condition.
#[derive(Clone, Debug)]
pub enum Formula {
    /// Known.
    Known(bool),
    /// Something that holds or does not.
    Atom(Atom),
    /// `from`: the names of the leaves, `none` among them.
    From(Vec<String>),
    /// Not.
    Not(Box<Self>),
    /// All of them.
    All(Vec<Self>),
    /// At least one.
    Any(Vec<Self>),
}

/// Something that holds or does not.
#[derive(Clone, Debug)]
pub struct Atom {
    /// By which equal ones are known.
    key: String,
    /// As its author wrote it.
    text: String,
    /// The quantity that it bounds, with where that lies when it holds and when it does not; `None` for nowhere.
    bound: Option<(String, [Option<Interval>; 2])>,
}

impl Formula {
    /// What has to come out how, so that this comes out as wanted: as many single things as it can be taken apart into.
    pub fn parts(&self, wanted: bool) -> Vec<(&Self, bool)> {
        match (self, wanted) {
            (Self::Not(inner), _) => inner.parts(!wanted),
            (Self::All(parts), true) | (Self::Any(parts), false) => {
                parts.iter().flat_map(|part| part.parts(wanted)).collect()
            }
            _ => vec![(self, wanted)],
        }
    }

    /// A single thing as its author wrote it.
    pub fn text(&self) -> Option<String> {
        match self {
            Self::Atom(atom) => Some(atom.text.clone()),
            Self::From(leaves) => Some(format!("from({})", leaves.join(", "))),
            Self::Known(_) | Self::Not(_) | Self::All(_) | Self::Any(_) => None,
        }
    }

    /// How many pieces it has.
    pub fn size(&self) -> usize {
        match self {
            Self::Known(_) | Self::Atom(_) | Self::From(_) => 1,
            Self::Not(inner) => 1 + inner.size(),
            Self::All(parts) | Self::Any(parts) => 1 + parts.iter().map(Self::size).sum::<usize>(),
        }
    }
}

/// Where a quantity lies: the ends, and whether each is left out.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    low: (f64, bool),
    high: (f64, bool),
}

impl Interval {
    const ALL: Self = Self { low: (f64::NEG_INFINITY, false), high: (f64::INFINITY, false) };

    const fn above(low: f64, open: bool) -> Self {
        Self { low: (low, open), ..Self::ALL }
    }

    const fn below(high: f64, open: bool) -> Self {
        Self { high: (high, open), ..Self::ALL }
    }

    const fn at(value: f64) -> Self {
        Self { low: (value, false), high: (value, false) }
    }

    /// Of the number with the other sign.
    fn mirrored(self) -> Self {
        Self { low: (-self.high.0, self.high.1), high: (-self.low.0, self.low.1) }
    }

    fn with(self, other: Self) -> Option<Self> {
        let low = match self.low.0.total_cmp(&other.low.0) {
            std::cmp::Ordering::Less => other.low,
            std::cmp::Ordering::Greater => self.low,
            std::cmp::Ordering::Equal => (self.low.0, self.low.1 || other.low.1),
        };
        let high = match self.high.0.total_cmp(&other.high.0) {
            std::cmp::Ordering::Less => self.high,
            std::cmp::Ordering::Greater => other.high,
            std::cmp::Ordering::Equal => (self.high.0, self.high.1 || other.high.1),
        };
        let empty = low.0 > high.0 || low.0 >= high.0 && (low.1 || high.1);
        (!empty).then_some(Self { low, high })
    }
}

/// A state in which formulas come out as they were asked to.
#[derive(Clone, Debug, Default)]
pub struct Case {
    /// What holds and what does not, by key, with its text.
    atoms: BTreeMap<String, (String, bool)>,
    quantities: BTreeMap<String, Interval>,
    /// The leaves that may come before.
    pub before: BTreeSet<String>,
}

impl Case {
    /// What holds and what does not, as their authors wrote it.
    pub fn conditions(&self) -> impl Iterator<Item = (&str, bool)> {
        self.atoms.values().map(|(text, holds)| (text.as_str(), *holds))
    }

    fn assume(&mut self, atom: &Atom, holds: bool) -> bool {
        if let Some((_, known)) = self.atoms.get(&atom.key) {
            return *known == holds;
        }
        self.atoms.insert(atom.key.clone(), (atom.text.clone(), holds));
        let Some((quantity, [when, when_not])) = &atom.bound else { return true };
        let known = self.quantities.get(quantity).copied().unwrap_or(Interval::ALL);
        match (if holds { *when } else { *when_not }).and_then(|interval| known.with(interval)) {
            Some(narrower) => {
                self.quantities.insert(quantity.clone(), narrower);
                true
            }
            None => false,
        }
    }
}

/// Whether formulas can come out as wanted.
pub enum Answer {
    /// Never.
    No,
    /// In this case.
    Yes(Case),
    /// It was too much work to find out.
    Perhaps,
}

/// Looks for a case in which each formula comes out as wanted, after one of the leaves `before`.
pub fn possible(wanted: &[(&Formula, bool)], before: BTreeSet<String>) -> Answer {
    let mut left = MAX_STEPS;
    possible_within(wanted, before, &mut left)
}

/// The same with the steps that are `left`, which become fewer.
pub fn possible_within(wanted: &[(&Formula, bool)], before: BTreeSet<String>, left: &mut usize) -> Answer {
    let case = Case { before, ..Case::default() };
    match search(wanted.iter().copied().rev().collect(), Vec::new(), case, left) {
        Some(case) => Answer::Yes(case),
        None if *left == 0 => Answer::Perhaps,
        None => Answer::No,
    }
}

/// What still has to come out how.
type Open<'a> = Vec<(&'a Formula, bool)>;

/// First everything that leaves no choice, then the alternatives in `later`, the last one first.
fn search<'a>(mut open: Open<'a>, mut later: Open<'a>, mut case: Case, left: &mut usize) -> Option<Case> {
    let mut split = Vec::new();
    while let Some((formula, wanted)) = open.pop() {
        *left = left.saturating_sub(1);
        if *left == 0 {
            return None;
        }
        match (formula, wanted) {
            (Formula::Known(value), _) if *value == wanted => {}
            (Formula::Known(_), _) => return None,
            (Formula::Atom(atom), _) => {
                if !case.assume(atom, wanted) {
                    return None;
                }
            }
            (Formula::From(leaves), _) => {
                case.before.retain(|leaf| leaves.iter().any(|name| covers(name, leaf)) == wanted);
                if case.before.is_empty() {
                    return None;
                }
            }
            (Formula::Not(inner), _) => open.push((inner, !wanted)),
            (Formula::All(parts), true) | (Formula::Any(parts), false) => {
                open.extend(parts.iter().rev().map(|part| (part, wanted)));
            }
            (Formula::All(_) | Formula::Any(_), _) => split.push((formula, wanted)),
        }
    }
    later.extend(split.into_iter().rev());
    let Some((formula, wanted)) = later.pop() else { return Some(case) };
    let (Formula::All(parts) | Formula::Any(parts)) = formula else { return None };
    parts.iter().find_map(|part| {
        // What is copied counts too.
        *left = left.saturating_sub((later.len() + case.atoms.len()) / 16);
        search(vec![(part, wanted)], later.clone(), case.clone(), left)
    })
}

/// Whether a label as it is written in `from` stands for a leaf: one without a side for both.
fn covers(name: &str, leaf: &str) -> bool {
    name == leaf || leaf.split_once('(').is_some_and(|(bare, _)| bare == name)
}
