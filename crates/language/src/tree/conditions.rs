//! Proofs about conditions without a log: conditions are formulas over atoms (expressions other than `and`, `or`, `not` and `from`),
//! equal pieces are one atom, different pieces are free. So a proof holds for every log; where none is found, nothing is said.

use crate::ops::{Samples, TemporalOperator};
use crate::rules::{Constant, Expr, ExprKind, Label, PrimitiveId};
use teachtree_base::hands::Side;

/// Formulas with more atoms than this are not tried.
const MAX_ATOMS: usize = 12;
/// Bound on the steps of one proof.
const MAX_STEPS: usize = 1 << 18;

/// A condition as a formula.
enum Formula {
    Constant(bool),
    Atom(usize),
    From { labels: Vec<Label>, none: bool },
    Not(Box<Formula>),
    All(Vec<Formula>),
    Any(Vec<Formula>),
}

/// Formulas that share their atoms.
struct Formulas<'a> {
    formulas: Vec<Formula>,
    atoms: Vec<&'a Expr>,
    mentioned: Vec<Label>,
    size: usize,
}

impl<'a> Formulas<'a> {
    fn new(conditions: &[&'a Expr]) -> Self {
        let mut all = Self { formulas: Vec::new(), atoms: Vec::new(), mentioned: Vec::new(), size: 0 };
        for condition in conditions {
            let formula = all.formula(condition);
            all.formulas.push(formula);
        }
        all
    }

    fn formula(&mut self, expr: &'a Expr) -> Formula {
        self.size += 1;
        match &expr.kind {
            ExprKind::Bool(value) => Formula::Constant(*value),
            ExprKind::Not(inner) => Formula::Not(Box::new(self.formula(inner))),
            ExprKind::And(parts) => Formula::All(parts.iter().map(|part| self.formula(part)).collect()),
            ExprKind::Or(parts) => Formula::Any(parts.iter().map(|part| self.formula(part)).collect()),
            ExprKind::From { labels, none } => {
                self.mentioned.extend(labels);
                Formula::From { labels: labels.clone(), none: *none }
            }
            // Beyond the bound the proof is given up; more atoms need not be distinguished.
            _ if self.atoms.len() > MAX_ATOMS => Formula::Atom(0),
            _ => Formula::Atom(self.atoms.iter().position(|known| same(known, expr)).unwrap_or_else(|| {
                self.atoms.push(expr);
                self.atoms.len() - 1
            })),
        }
    }

    /// Whether `test` holds for the values of the formulas in every case; false when that is too much work to find out.
    fn always(&self, test: impl Fn(&dyn Fn(&Formula) -> bool, &[Formula]) -> bool) -> bool {
        if self.atoms.len() > MAX_ATOMS {
            return false;
        }
        // The leaf before: none, each one that is mentioned (on either side), and any other.
        let other = Label { primitive: PrimitiveId(u32::MAX), side: None };
        let mut before: Vec<Option<Label>> = vec![None, Some(other)];
        for label in &self.mentioned {
            // A primitive whose side is mentioned anywhere has one.
            let sided = self.mentioned.iter().any(|other| other.primitive == label.primitive && other.side.is_some());
            let sides: &[Option<Side>] = if sided { &[Some(Side::Left), Some(Side::Right)] } else { &[None] };
            for side in sides {
                let concrete = Some(Label { side: *side, ..*label });
                if !before.contains(&concrete) {
                    before.push(concrete);
                }
            }
            if before.len() > MAX_STEPS >> 8 {
                return false;
            }
        }
        let cases = before.len() << self.atoms.len();
        if cases.saturating_mul(self.size) > MAX_STEPS {
            return false;
        }
        before.iter().all(|before| {
            (0..1_usize << self.atoms.len()).all(|bits| test(&|formula| value(formula, bits, *before), &self.formulas))
        })
    }
}

fn value(formula: &Formula, bits: usize, before: Option<Label>) -> bool {
    match formula {
        Formula::Constant(value) => *value,
        Formula::Atom(at) => bits >> at & 1 == 1,
        Formula::From { labels, none } => match before {
            None => *none,
            Some(before) => labels.iter().any(|label| label.covers(before)),
        },
        Formula::Not(inner) => !value(inner, bits, before),
        Formula::All(parts) => parts.iter().all(|part| value(part, bits, before)),
        Formula::Any(parts) => parts.iter().any(|part| value(part, bits, before)),
    }
}

/// Whether it is proved that one of the conditions holds on every frame.
pub fn exhaustive(conditions: &[&Expr]) -> bool {
    Formulas::new(conditions).always(|holds, formulas| formulas.iter().any(holds))
}

/// Whether it is proved that the conditions never hold together.
pub fn exclusive(one: &Expr, two: &Expr) -> bool {
    Formulas::new(&[one, two]).always(|holds, formulas| !formulas.iter().all(holds))
}

/// What is known of a condition while the leaf before is `none`, which is so on the first frame of a stretch only.
pub fn at_start(expr: &Expr) -> Option<bool> {
    match &expr.kind {
        ExprKind::Bool(value) => Some(*value),
        ExprKind::From { none, .. } => Some(*none),
        // There is no frame before.
        ExprKind::Temporal(temporal, inner) if inner.ty.axis.is_none() => temporal.operator()?.at_start,
        ExprKind::Not(inner) => at_start(inner).map(|value| !value),
        ExprKind::And(parts) => joined(parts, false),
        ExprKind::Or(parts) => joined(parts, true),
        _ => None,
    }
}

/// A conjunction (`decides` false) or disjunction (`decides` true): decided by one part, or by all.
fn joined(parts: &[Expr], decides: bool) -> Option<bool> {
    let values: Vec<Option<bool>> = parts.iter().map(at_start).collect();
    if values.contains(&Some(decides)) {
        Some(decides)
    } else if values.contains(&None) {
        None
    } else {
        Some(!decides)
    }
}

/// Whether two expressions say the same, wherever they stand.
fn same(one: &Expr, two: &Expr) -> bool {
    use ExprKind as E;
    let bits = |temporal: &TemporalOperator<Constant>| temporal.map(|constant| Some(constant.value.to_bits()));
    let all =
        |one: &[Expr], two: &[Expr]| one.len() == two.len() && one.iter().zip(two).all(|(one, two)| same(one, two));
    one.ty == two.ty
        && match (&one.kind, &two.kind) {
            (E::Bool(a), E::Bool(b)) => a == b,
            (E::Number(a), E::Number(b)) => a.to_bits() == b.to_bits(),
            (E::Param(a), E::Param(b)) => a == b,
            (E::Channel(a, x), E::Channel(b, y)) => a == b && x == y,
            (E::Signal(a, x), E::Signal(b, y)) => a == b && x == y,
            (E::Latch(a, x), E::Latch(b, y)) => a == b && x == y,
            (E::Pick(a, x), E::Pick(b, y)) => x == y && same(a, b),
            (E::Component(a, x), E::Component(b, y)) => x == y && same(a, b),
            (E::Negate(a), E::Negate(b)) | (E::Not(a), E::Not(b)) => same(a, b),
            (E::Arithmetic(a, p, q), E::Arithmetic(b, r, s)) => a == b && same(p, r) && same(q, s),
            (E::Compare(a, p, q), E::Compare(b, r, s)) => a == b && same(p, r) && same(q, s),
            (E::And(a), E::And(b)) | (E::Or(a), E::Or(b)) => all(a, b),
            (E::Call(a, p), E::Call(b, q)) => a == b && all(p, q),
            (E::Temporal(a, p), E::Temporal(b, q)) => bits(a) == bits(b) && same(p, q),
            (E::Summary(a, p, Samples::Last(d)), E::Summary(b, q, Samples::Last(e))) => {
                a == b && same(p, q) && d.value.to_bits() == e.value.to_bits()
            }
            (E::Summary(a, p, Samples::Since(c)), E::Summary(b, q, Samples::Since(d))) => {
                a == b && same(p, q) && same(c, d)
            }
            (E::Rate(p, d), E::Rate(q, e)) => same(p, q) && d.value.to_bits() == e.value.to_bits(),
            (
                E::Hysteresis { value: p, on: a, off: b, rising: r },
                E::Hysteresis { value: q, on: c, off: d, rising: s },
            ) => {
                r == s && same(p, q) && a.value.to_bits() == c.value.to_bits() && b.value.to_bits() == d.value.to_bits()
            }
            _ => false,
        }
}
