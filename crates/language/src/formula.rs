//! Conditions as formulas, and whether some of them can hold together: decided on intervals of quantities, on states of hystereses and on
//! the leaf before. Different quantities are free, so what is found impossible is impossible on every log.

mod canonical_text;
mod frame;
mod interval;
mod reader;

pub use canonical_text::{canonical_text, label};
pub use frame::{Frame, shown};
pub use interval::Interval;
pub use reader::Reader;

use crate::rules::Comparison;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use teachtree_base::units::Dimension;

/// Steps of one search; beyond them the answer is "perhaps".
const MAX_STEPS: usize = 100_000;

/// A condition.
#[derive(Clone, Debug)]
pub enum Formula {
    /// Known.
    Constant(bool),
    /// Something that holds or does not.
    Atom(Rc<Atom>),
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
    /// By which equal ones are known; shared, since a search copies what it knows at every step.
    key: Rc<str>,
    /// As its author wrote it.
    text: String,
    /// Its constraint on a quantity.
    bound: Option<Bound>,
}

/// The constraint of a condition on a quantity.
#[derive(Clone, Debug)]
struct Bound {
    quantity: Quantity,
    test: Test,
}

/// A number that conditions bound.
#[derive(Clone, Debug)]
enum Quantity {
    /// One number.
    One(Rc<Number>),
    /// The first one minus the second one; only the sign is used.
    Difference(Rc<Number>, Rc<Number>),
}

/// A number of a frame.
#[derive(Clone, Debug)]
struct Number {
    /// By which equal ones are known; shared, since a search copies what it knows at every step.
    key: Rc<str>,
    /// As its author wrote it, with its dimension; `None` if it is derived.
    shown: Option<(String, Dimension)>,
    /// The interval that always contains it, unless it is NaN.
    natural: Interval,
    /// Whether it is counted.
    whole: bool,
    /// Whether it may be not a number.
    undefined: bool,
}

/// A requirement on a number.
#[derive(Clone, Copy, Debug)]
enum Test {
    /// A comparison with a limit; for a difference, with zero.
    Compared(Comparison, f64),
    /// The state of a hysteresis.
    Hysteresis { on: f64, off: f64, rising: bool },
}

impl Test {
    /// Returns the interval of a number for this outcome, and a value in it that is excluded.
    fn lies(self, holds: bool) -> (Interval, Option<f64>) {
        let (below, above) = (Interval::below, Interval::above);
        match self {
            Self::Compared(comparison, limit) => match (comparison, holds) {
                (Comparison::Less, true) | (Comparison::GreaterEqual, false) => (below(limit, true), None),
                (Comparison::LessEqual, true) | (Comparison::Greater, false) => (below(limit, false), None),
                (Comparison::Greater, true) | (Comparison::LessEqual, false) => (above(limit, true), None),
                (Comparison::GreaterEqual, true) | (Comparison::Less, false) => (above(limit, false), None),
                (Comparison::Equal, true) | (Comparison::NotEqual, false) => (Interval::at(limit), None),
                (Comparison::NotEqual, true) | (Comparison::Equal, false) => (Interval::ALL, Some(limit)),
            },
            Self::Hysteresis { on, off, rising } => match (rising, holds) {
                (true, true) => (above(on.min(off), false), None),
                (true, false) => (below(on, false), None),
                (false, true) => (below(on.max(off), false), None),
                (false, false) => (above(on, false), None),
            },
        }
    }

    /// Whether this may come out so for what is not a number: there a hysteresis stays as it was.
    fn is_undefined(self, holds: bool) -> bool {
        match self {
            Self::Compared(comparison, limit) => comparison.holds(f64::NAN, limit) == holds,
            Self::Hysteresis { .. } => true,
        }
    }
}

impl Formula {
    /// Returns the required outcomes of the smallest parts for the wanted outcome.
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
            Self::Constant(_) | Self::Not(_) | Self::All(_) | Self::Any(_) => None,
        }
    }

    /// Returns the number of its parts.
    pub fn size(&self) -> usize {
        match self {
            Self::Constant(_) | Self::Atom(_) | Self::From(_) => 1,
            Self::Not(inner) => 1 + inner.size(),
            Self::All(parts) | Self::Any(parts) => 1 + parts.iter().map(Self::size).sum::<usize>(),
        }
    }
}

/// A state in which formulas come out as they were asked to.
#[derive(Clone, Debug, Default)]
pub struct Case {
    /// The truth of conditions, by key.
    atoms: BTreeMap<Rc<str>, (Rc<Atom>, bool)>,
    /// The bounds of numbers, by key.
    numbers: BTreeMap<Rc<str>, (Rc<Number>, Domain)>,
    /// The bounds of differences of two numbers, by the keys of both.
    differences: BTreeMap<(Rc<str>, Rc<str>), Domain>,
    /// The leaves that may come before.
    pub before: Rc<BTreeSet<String>>,
    /// Whether it matters which of them does.
    asks_before: bool,
}

/// The values that a number can have.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Domain {
    /// Its interval if it is a number; `None` for the empty set.
    lies: Option<Interval>,
    /// Whether it may be not a number.
    undefined: bool,
}

impl Domain {
    /// Whether there is anything that it may be.
    const fn is_possible(self) -> bool {
        self.lies.is_some() || self.undefined
    }
}

impl Case {
    /// The truth of conditions, by their source texts.
    pub fn conditions(&self) -> impl Iterator<Item = (&str, bool)> {
        self.atoms.values().map(|(atom, holds)| (atom.text.as_str(), *holds))
    }

    fn assume(&mut self, atom: &Rc<Atom>, holds: bool) -> bool {
        if let Some((_, known)) = self.atoms.get(&atom.key) {
            return *known == holds;
        }
        self.atoms.insert(Rc::clone(&atom.key), (Rc::clone(atom), holds));
        let Some(Bound { quantity, test }) = &atom.bound else { return true };
        let (lies, undefined) = (test.lies(holds).0, test.is_undefined(holds));
        match quantity {
            Quantity::One(number) => self.narrow(number, lies, undefined),
            Quantity::Difference(one, other) => {
                let may_be = one.undefined || other.undefined;
                let free = Domain { lies: Some(Interval::ALL), undefined: may_be };
                let known = self.differences.entry((Rc::clone(&one.key), Rc::clone(&other.key))).or_insert(free);
                known.lies = known.lies.and_then(|known| known.with(lies));
                known.undefined &= undefined;
                let known = *known;
                // A difference is a number when both are.
                known.is_possible()
                    && self.narrow(one, Interval::ALL, known.undefined)
                    && self.narrow(other, Interval::ALL, known.undefined)
            }
        }
    }

    /// Takes in that a number lies here, unless it is `undefined` and may be so.
    fn narrow(&mut self, number: &Rc<Number>, lies: Interval, undefined: bool) -> bool {
        let (known_number, known) = self
            .numbers
            .entry(Rc::clone(&number.key))
            .or_insert_with(|| (Rc::clone(number), Domain { lies: Some(number.natural), undefined: number.undefined }));
        if known_number.shown.is_none() {
            known_number.clone_from(number);
        }
        known.lies = known.lies.and_then(|known| number.fitting(known.with(lies)?));
        known.undefined &= undefined;
        known.is_possible() && self.compare()
    }

    /// Narrows the numbers that one number is compared with by what is known of it; false when nothing of one is left.
    fn compare(&mut self) -> bool {
        // Each bound may wander along all differences; stopping before it has is not a mistake.
        for _ in 0..=self.differences.len() {
            let mut changed = false;
            for ((one, other), difference) in self.differences.iter().filter(|(_, difference)| !difference.undefined) {
                let Some(lies) = difference.lies else { return false };
                let [Some((_, a)), Some((_, b))] = [one, other].map(|key| self.numbers.get(key)) else { continue };
                // Both are numbers, since their difference is one.
                let (Some(a), Some(b)) = (a.lies, b.lies) else { return false };
                let Some([narrower_a, narrower_b]) = lies.between(a, b) else { return false };
                changed |= narrower_a != a || narrower_b != b;
                for (key, narrower) in [(one, narrower_a), (other, narrower_b)] {
                    if let Some((number, known)) = self.numbers.get_mut(key) {
                        *known = Domain { lies: number.fitting(narrower), undefined: false };
                        if !known.is_possible() {
                            return false;
                        }
                    }
                }
            }
            if !changed {
                return true;
            }
        }
        true
    }
}

impl Number {
    /// What of an interval such a number may be in.
    fn fitting(&self, lies: Interval) -> Option<Interval> {
        if self.whole { lies.whole() } else { Some(lies) }
    }
}

/// Whether formulas can have their wanted results.
pub enum Answer {
    /// Never.
    No,
    /// In this case.
    Yes(Case),
    /// The proof exceeded its step limit.
    Unknown,
}

/// Looks for a case in which each formula comes out as wanted, after one of the leaves `before`.
pub fn solve(wanted: &[(&Formula, bool)], before: impl Into<Rc<BTreeSet<String>>>) -> Answer {
    let mut left = MAX_STEPS;
    solve_within(wanted, before, &mut left)
}

/// The same with the steps that are `left`, which become fewer.
pub fn solve_within(wanted: &[(&Formula, bool)], before: impl Into<Rc<BTreeSet<String>>>, left: &mut usize) -> Answer {
    let case = Case { before: before.into(), ..Case::default() };
    match search(wanted.iter().copied().rev().collect(), Vec::new(), case, left) {
        Some(case) => Answer::Yes(case),
        None if *left == 0 => Answer::Unknown,
        None => Answer::No,
    }
}

/// Formulas with their wanted results.
type Goals<'a> = Vec<(&'a Formula, bool)>;

/// First everything that leaves no choice, then the alternatives in `later`, the last one first.
fn search<'a>(mut open: Goals<'a>, mut later: Goals<'a>, mut case: Case, left: &mut usize) -> Option<Case> {
    let mut split = Vec::new();
    while let Some((formula, wanted)) = open.pop() {
        *left = left.saturating_sub(1);
        if *left == 0 {
            return None;
        }
        match (formula, wanted) {
            (Formula::Constant(value), _) if *value == wanted => {}
            (Formula::Constant(_), _) => return None,
            (Formula::Atom(atom), _) => {
                if !case.assume(atom, wanted) {
                    return None;
                }
            }
            (Formula::From(leaves), _) => {
                case.asks_before = true;
                Rc::make_mut(&mut case.before).retain(|leaf| leaves.iter().any(|name| covers(name, leaf)) == wanted);
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
        // Copies count as steps too.
        *left = left.saturating_sub((later.len() + case.atoms.len()) / 16);
        search(vec![(part, wanted)], later.clone(), case.clone(), left)
    })
}

/// Whether a label in `from` matches a leaf. A label without a side matches both sides.
fn covers(name: &str, leaf: &str) -> bool {
    name == leaf || leaf.split_once('(').is_some_and(|(bare, _)| bare == name)
}
