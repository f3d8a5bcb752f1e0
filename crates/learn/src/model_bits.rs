//! A model with the bits of its guards, and the cases in which it is judged: as it is, with thresholds a step away, and with a rule that never holds. In other
//! recordings people are higher or slower, so a guard holds earlier, later or not at all. A model that is good in all these cases depends on no single
//! threshold, and does not wait for a label that is missed.

use super::bank::Bank;
use super::model::{Model, Rule, guard};
use std::sync::Arc;

/// The weights of the cases: guards as they are, with thresholds or durations a step away, and with a rule that never holds.
const WEIGHTS: [f64; 3] = [0.5, 0.25, 0.25];
/// The steps of thresholds and durations; the first one is the guards as they are.
const STEPS: [isize; 3] = [0, 1, -1];

/// A model with the bits of its guards on some tracks; clones share the bits.
#[derive(Clone)]
pub(crate) struct ModelBits {
    model: Model,
    /// Of each rule: as it is, and where other cases count, with the steps above and below it.
    guards: Vec<Vec<Arc<[u64]>>>,
    /// Bits of a guard that never holds, where other cases count.
    never: Option<Arc<[u64]>>,
}

/// A case in which a model is judged.
pub(crate) struct Case<'m> {
    /// The weights of all cases add up to 1.
    pub weight: f64,
    /// The bits of each rule.
    pub guards: Vec<&'m [u64]>,
}

impl ModelBits {
    /// The bits of a model on some tracks. With `has_cases`, they are also those of the other cases.
    pub fn new(bank: &Bank, model: Model, tracks: &[usize], has_cases: bool) -> Self {
        let never = has_cases.then(|| Arc::from(vec![0; bank.words]));
        let mut bits = Self { model, guards: Vec::new(), never };
        bits.guards = bits.model.rules.iter().map(|rule| bits.of(bank, &rule.atoms, tracks)).collect();
        bits
    }

    fn of(&self, bank: &Bank, atoms: &[usize], tracks: &[usize]) -> Vec<Arc<[u64]>> {
        let steps = if self.never.is_some() { &STEPS[..] } else { &STEPS[..1] };
        let stepped = |step: &isize| -> Vec<usize> { atoms.iter().map(|atom| next(bank, *atom, *step)).collect() };
        steps.iter().map(|step| Arc::from(guard(bank, &stepped(step), tracks))).collect()
    }

    pub const fn model(&self) -> &Model {
        &self.model
    }

    pub fn into_model(self) -> Model {
        self.model
    }

    /// The same with other conditions of a rule.
    pub fn with_atoms(&self, bank: &Bank, tracks: &[usize], rule: usize, mut atoms: Vec<usize>) -> Self {
        let mut next = self.clone();
        atoms.sort_unstable();
        next.guards[rule] = self.of(bank, &atoms, tracks);
        next.model.rules[rule].atoms = atoms;
        next
    }

    /// The same with a rule before all others.
    pub fn with_first(&self, bank: &Bank, tracks: &[usize], rule: Rule) -> Self {
        let mut next = self.clone();
        next.guards.insert(0, self.of(bank, &rule.atoms, tracks));
        next.model.rules.insert(0, rule);
        next
    }

    /// The same without a rule.
    pub fn without(&self, rule: usize) -> Self {
        let mut next = self.clone();
        next.guards.remove(rule);
        next.model.rules.remove(rule);
        next
    }

    /// The same with a rule before the one above it.
    pub fn raised(&self, rule: usize) -> Self {
        let mut next = self.clone();
        next.guards.swap(rule - 1, rule);
        next.model.rules.swap(rule - 1, rule);
        next
    }

    /// The same with a rule after other labels.
    pub fn with_from(&self, rule: usize, from: u32) -> Self {
        let mut next = self.clone();
        next.model.rules[rule].from = from;
        next
    }

    /// The same with another settling time.
    pub fn with_settle_ms(&self, settle_ms: u32) -> Self {
        let mut next = self.clone();
        next.model.settle_ms = settle_ms;
        next
    }

    /// The bits of each rule as it is.
    pub fn as_it_is(&self) -> Vec<&[u64]> {
        self.step(0)
    }

    fn step(&self, step: usize) -> Vec<&[u64]> {
        self.guards.iter().filter_map(|steps| steps.get(step)).map(AsRef::as_ref).collect()
    }

    /// All cases: the model as it is, where other cases count its steps, and each rule, in order, that never holds.
    pub fn cases(&self) -> Vec<Case<'_>> {
        let Some(never) = &self.never else { return vec![Case { weight: 1.0, guards: self.as_it_is() }] };
        let [as_it_is, stepped, missed] = WEIGHTS;
        let mut cases = vec![Case { weight: as_it_is, guards: self.as_it_is() }];
        cases.extend((1..STEPS.len()).map(|step| Case { weight: stepped / 2.0, guards: self.step(step) }));
        for rule in 0..self.guards.len() {
            let mut guards = self.as_it_is();
            guards[rule] = never;
            cases.push(Case { weight: missed / self.guards.len() as f64, guards });
        }
        cases
    }

    /// The case of this model that differs least from case `at` of another one, whose rules are the same up to rule `first`.
    pub fn nearest_case(&self, other: &Self, first: usize, at: usize) -> usize {
        let (here, there) = (self.guards.len(), other.guards.len());
        let Some(rule) = at.checked_sub(STEPS.len()) else { return at };
        if rule < first || here == there {
            at
        } else if here > there {
            at + 1
        } else if rule == first {
            0
        } else {
            at - 1
        }
    }
}

/// The atom of the same family that is some steps away; the atom itself where there is none.
fn next(bank: &Bank, atom: usize, step: isize) -> usize {
    let family = |at: usize| bank.atoms.get(at).map(|atom| atom.family);
    atom.checked_add_signed(step).filter(|at| family(*at) == family(atom)).unwrap_or(atom)
}
