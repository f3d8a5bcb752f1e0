//! One frame that shows a case: a number for each quantity, whether each other condition holds, and the leaf before.

use super::{Bound, Case, Formula, Interval, Number, Quantity, Test, covers};
use std::collections::BTreeMap;
use teachtree_base::units::Dimension;

/// A frame, as far as it matters.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// Numbers in SI, by `canonical_text`.
    pub numbers: BTreeMap<String, f64>,
    /// The truth of conditions, by `canonical_text`.
    pub holds: BTreeMap<String, bool>,
    /// The leaf before, where it matters.
    pub before: Option<String>,
    /// The same for people, each a sentence.
    sentences: Vec<String>,
}

impl Case {
    /// A frame of this case; `None` unless on it every formula comes out as wanted.
    pub fn frame(&self, wanted: &[(&Formula, bool)]) -> Option<Frame> {
        let mut case = self.clone();
        let mut frame = Frame::default();
        for key in self.numbers.keys() {
            let (number, known) = case.numbers.get(key)?.clone();
            let value = match known.lies {
                Some(lies) => self.pick(&number, lies)?,
                None => f64::NAN,
            };
            if known.lies.is_some() && !case.narrow(&number, Interval::at(value), false) {
                return None;
            }
            frame.numbers.insert(key.to_string(), value);
            if let Some((text, dimension)) = &number.shown {
                frame.sentences.push(format!("`{text}` is {}", shown(value, *dimension)));
            }
        }
        for (key, (atom, holds)) in &self.atoms {
            frame.holds.insert(key.to_string(), *holds);
            let is_told = match &atom.bound {
                Some(bound @ Bound { quantity: Quantity::One(number), .. }) => {
                    let shown = self.numbers.get(&number.key).is_some_and(|(number, _)| number.shown.is_some());
                    shown && bound.decides(&frame).is_some()
                }
                _ => false,
            };
            if !is_told {
                frame.sentences.push(format!("`{}` {}", atom.text, if *holds { "holds" } else { "does not hold" }));
            }
        }
        if self.asks_before {
            // At the beginning of a recording much has not been yet.
            let before = self.before.iter().find(|leaf| *leaf != "none").or_else(|| self.before.first())?;
            frame.sentences.push(match before.as_str() {
                "none" => "there is no leaf before".to_string(),
                leaf => format!("the leaf before is `{leaf}`"),
            });
            frame.before = Some(before.clone());
        }
        // The frame is replayed before it is shown.
        let is_shown = wanted.iter().all(|(formula, wanted)| formula.on(&frame) == Some(*wanted));
        is_shown.then_some(frame)
    }

    /// A number that is none of those that a condition excludes one by one.
    fn pick(&self, number: &Number, lies: Interval) -> Option<f64> {
        let is_about = |bound: &&Bound| matches!(&bound.quantity, Quantity::One(other) if other.key == number.key);
        let excluded = self.atoms.values().filter_map(|(atom, holds)| {
            let bound = atom.bound.as_ref().filter(is_about)?;
            bound.test.lies(*holds).1
        });
        let mut open = vec![lies];
        for gone in excluded {
            let around = open.iter().flat_map(|lies| lies.around(gone)).flatten();
            open = around.filter_map(|lies| number.fitting(lies)).collect();
        }
        open.first().map(|lies| lies.number(number.whole))
    }
}

impl Frame {
    /// Returns a description of the frame.
    pub fn text(&self) -> String {
        match self.sentences.split_last() {
            None => "any values do so".into(),
            Some((last, [])) => last.clone(),
            Some((last, others)) => format!("{} and {last}", others.join(", ")),
        }
    }
}

impl Bound {
    /// Whether the condition holds for the numbers of a frame; `None` when they leave it open.
    fn decides(&self, frame: &Frame) -> Option<bool> {
        let number = |number: &Number| frame.numbers.get(&*number.key).copied();
        match (&self.quantity, self.test) {
            (Quantity::One(one), Test::Compared(comparison, limit)) => Some(comparison.holds(number(one)?, limit)),
            (Quantity::One(one), Test::Hysteresis { on, off, rising }) => {
                let value = number(one)?;
                let (set, cleared) = if rising { (value > on, value < off) } else { (value < on, value > off) };
                (set != cleared).then_some(set)
            }
            (Quantity::Difference(one, other), Test::Compared(comparison, _)) => {
                Some(comparison.holds(number(one)?, number(other)?))
            }
            (Quantity::Difference(..), Test::Hysteresis { .. }) => None,
        }
    }
}

impl Formula {
    /// Returns the outcome on a frame; `None` if the frame does not determine it.
    fn on(&self, frame: &Frame) -> Option<bool> {
        let joined = |parts: &[Self], decides: bool| {
            let all: Vec<Option<bool>> = parts.iter().map(|part| part.on(frame)).collect();
            if all.contains(&Some(decides)) {
                Some(decides)
            } else if all.contains(&None) {
                None
            } else {
                Some(!decides)
            }
        };
        match self {
            Self::Constant(value) => Some(*value),
            Self::Atom(atom) => {
                let by_number = atom.bound.as_ref().and_then(|bound| bound.decides(frame));
                by_number.or_else(|| frame.holds.get(&*atom.key).copied())
            }
            Self::From(leaves) => frame.before.as_ref().map(|before| leaves.iter().any(|name| covers(name, before))),
            Self::Not(inner) => inner.on(frame).map(|value| !value),
            Self::All(parts) => joined(parts, false),
            Self::Any(parts) => joined(parts, true),
        }
    }
}

/// A number in SI with a unit, such as people write it: `2.5 mm`.
pub fn shown(value: f64, dimension: Dimension) -> String {
    if value.is_nan() {
        return "not a number, as after a division by zero".into();
    }
    let unit = dimension.si_unit();
    let is_small = match dimension {
        Dimension::LENGTH | Dimension::SPEED | Dimension::TIME | Dimension::ACCELERATION => value.abs() < 1.0,
        Dimension::FORCE => value.abs() < 0.1,
        _ => false,
    };
    let (value, unit) = if is_small && value.abs() > 0.0 { (value * 1e3, format!("m{unit}")) } else { (value, unit) };
    // Twelve digits do not show what a product of two such numbers is off by.
    let value = format!("{value:.11e}").parse().unwrap_or(value);
    if unit.is_empty() { format!("{value}") } else { format!("{value} {unit}") }
}
