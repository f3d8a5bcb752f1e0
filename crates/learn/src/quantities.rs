//! The vocabulary of learned rules: quantities of a hand, and the conditions on them, as texts of the rule language.
//!
//! A template is such a text with two marks: `@` stands before each name of a hand and becomes `other.` or nothing, `#` becomes a threshold or a duration.

use std::collections::{BTreeMap, BTreeSet};

/// The unit in which thresholds are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unit {
    name: &'static str,
    /// The value of 1 SI unit.
    pub per_si: f64,
}

const MM: Unit = Unit { name: "mm", per_si: 1e3 };
const MM_PER_S: Unit = Unit { name: "mm/s", per_si: 1e3 };
const NEWTON: Unit = Unit { name: "N", per_si: 1.0 };

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Place,
    Condition,
    Number(Unit),
}

/// What a quantity is measured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// The hand, which every recording has; a force that is not measured is constant.
    Hand,
    /// Whether the gripper is closed.
    Closing,
    /// The contacts of fingers, or the forces that they follow from.
    Contacts,
    /// How far the gripper is open.
    Opening,
    /// The objects that may be the target.
    Objects,
}

impl Source {
    /// Those that a recording may lack.
    pub const OPTIONAL: [Self; 4] = [Self::Closing, Self::Contacts, Self::Opening, Self::Objects];

    /// The channel that `stream.rules` does not declare.
    const fn channel(self) -> Option<&'static str> {
        match self {
            Self::Closing => Some("gripper.closed : bool"),
            Self::Opening => Some("gripper.opening : scalar m"),
            Self::Hand | Self::Contacts | Self::Objects => None,
        }
    }

    /// The declarations of its quantities.
    pub fn declarations(self) -> Declarations {
        Declarations::of(OF_HAND.iter().filter(|quantity| quantity.source == self).map(|quantity| quantity.name))
    }
}

/// A signal.
struct Quantity {
    name: &'static str,
    definition: &'static str,
    kind: Kind,
    source: Source,
}

const fn quantity(name: &'static str, source: Source, definition: &'static str, kind: Kind) -> Quantity {
    Quantity { name, definition, kind, source }
}

/// The quantities of each hand; each reads only earlier ones.
const OF_HAND: &[Quantity] = &[
    quantity("closed", Source::Closing, "gripper.closed", Kind::Condition),
    quantity("touching", Source::Contacts, "any(fingers.contact)", Kind::Condition),
    quantity("place", Source::Hand, "mean(fingers.position)", Kind::Place),
    quantity("height", Source::Hand, "place.z", Kind::Number(MM)),
    quantity("speed", Source::Hand, "norm(rate(place, 500 ms))", Kind::Number(MM_PER_S)),
    quantity("climb", Source::Hand, "rate(height, 500 ms)", Kind::Number(MM_PER_S)),
    quantity("force", Source::Hand, "norm(sum(fingers.force))", Kind::Number(NEWTON)),
    quantity("opening", Source::Opening, "gripper.opening", Kind::Number(MM)),
    quantity("distance", Source::Objects, "norm(place - target.position)", Kind::Number(MM)),
    quantity("object_speed", Source::Objects, "norm(target.velocity)", Kind::Number(MM_PER_S)),
    quantity("depth", Source::Objects, "target.depth", Kind::Number(MM)),
];

/// What all recordings measure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Sensors {
    pub two_hands: bool,
    pub sources: Vec<Source>,
}

impl Sensors {
    fn quantities(&self) -> impl Iterator<Item = &'static Quantity> {
        OF_HAND.iter().filter(|quantity| self.sources.contains(&quantity.source))
    }

    fn conditions(&self) -> impl Iterator<Item = &'static str> {
        self.quantities().filter(|quantity| quantity.kind == Kind::Condition).map(|quantity| quantity.name)
    }
}

/// The distance between the two hands.
const APART: Quantity = quantity(
    "apart",
    Source::Hand,
    "norm(mean(left.fingers.position) - mean(right.fingers.position))",
    Kind::Number(MM),
);

/// Durations of windows around events.
const EVENT_WINDOWS: [&str; 9] = ["300 ms", "500 ms", "800 ms", "1.2 s", "1.8 s", "2.5 s", "3.5 s", "5 s", "7 s"];
/// Durations of windows in which a length or force passes a threshold.
const WINDOWS: &[&str] = &["1 s", "2 s", "4 s"];
/// Durations of windows in which a speed does.
const SPEED_WINDOWS: &[&str] = &["2 s"];

/// A number that is compared with thresholds.
#[derive(Clone, Debug)]
pub(crate) struct Number {
    pub template: String,
    pub unit: Unit,
    /// The windows in which it is compared, too.
    windows: &'static [&'static str],
}

/// Conditions that differ in one threshold or duration only.
#[derive(Clone, Debug)]
pub(crate) struct Family {
    pub template: String,
    pub steps: Steps,
}

/// What `#` stands for in a family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Steps {
    /// Nothing.
    Single,
    /// The durations around events.
    Durations,
    /// The thresholds of a number, by position.
    Thresholds(usize),
}

impl Steps {
    /// The texts of the steps, given the thresholds of all numbers in their units.
    pub fn texts(self, numbers: &[Number], thresholds: &[Vec<f64>]) -> Vec<String> {
        match self {
            Self::Single => vec![String::new()],
            Self::Durations => EVENT_WINDOWS.map(String::from).to_vec(),
            Self::Thresholds(number) => {
                let unit = numbers.get(number).map_or("", |number| number.unit.name);
                thresholds.get(number).into_iter().flatten().map(|value| format!("{value} {unit}")).collect()
            }
        }
    }
}

/// The numbers that are compared with thresholds.
pub(crate) fn numbers(measured: &Sensors) -> Vec<Number> {
    let mut numbers = Vec::new();
    let two_hands = measured.two_hands;
    for quantity in measured.quantities().chain(two_hands.then_some(&APART)) {
        let mark = if quantity.name == APART.name { "" } else { "@" };
        if let Kind::Number(unit) = quantity.kind {
            let windows = if unit == MM_PER_S { SPEED_WINDOWS } else { WINDOWS };
            numbers.push(Number { template: format!("{mark}{}", quantity.name), unit, windows });
        }
    }
    for condition in measured.conditions() {
        let mut add = |template: String| numbers.push(Number { template, unit: MM, windows: &[] });
        for since in [format!("@{condition}"), format!("not @{condition}")] {
            add(format!("@height - earliest(@height since {since})"));
            add(format!("norm(@place - earliest(@place since {since}))"));
            add(format!("earliest(@height since {since})"));
            if two_hands {
                add(format!("earliest(apart since {since})"));
            }
        }
    }
    numbers
}

/// All families, plain ones first.
pub(crate) fn families(numbers: &[Number], measured: &Sensors) -> Vec<Family> {
    let mut families = Vec::new();
    let mut add = |template: String, steps| families.push(Family { template, steps });
    for condition in measured.conditions() {
        add(format!("@{condition}"), Steps::Single);
        add(format!("not @{condition}"), Steps::Single);
    }
    for (at, Number { template, .. }) in numbers.iter().enumerate() {
        add(format!("{template} > #"), Steps::Thresholds(at));
        add(format!("{template} < #"), Steps::Thresholds(at));
    }
    for condition in measured.conditions() {
        for event in ["rises", "falls"] {
            for when in ["last", "next"] {
                add(format!("({event}(@{condition})) within {when} #"), Steps::Durations);
                add(format!("not ({event}(@{condition})) within {when} #"), Steps::Durations);
            }
        }
    }
    for (at, Number { template, windows, .. }) in numbers.iter().enumerate() {
        for window in *windows {
            for when in ["last", "next"] {
                for sign in [">", "<"] {
                    add(format!("({template} {sign} #) within {when} {window}"), Steps::Thresholds(at));
                    add(format!("not ({template} {sign} #) within {when} {window}"), Steps::Thresholds(at));
                }
            }
        }
    }
    families
}

/// A template as a text of the language.
pub(crate) fn spelled(template: &str, other: bool, step: &str) -> String {
    template.replace('@', if other { "other." } else { "" }).replace('#', step)
}

/// Whether a template has a form for the other hand.
pub(crate) fn has_other(template: &str) -> bool {
    template.contains('@')
}

/// The quantities with their definitions.
pub(crate) fn definitions() -> impl Iterator<Item = (&'static str, &'static str)> {
    OF_HAND.iter().chain([&APART]).map(|quantity| (quantity.name, quantity.definition))
}

/// A text in which quantities have other names; a part of a channel, such as `closed` in `gripper.closed`, is none.
pub(crate) fn renamed(text: &str, others: &BTreeMap<String, String>) -> String {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    let mut made = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(is_part) {
        let (blank, word) = rest.split_at(start);
        let (word, after) = word.split_at(word.find(|letter| !is_part(letter)).unwrap_or(word.len()));
        made.push_str(blank);
        let is_channel = made.ends_with('.') && !made.ends_with("other.");
        made.push_str(others.get(word).filter(|_| !is_channel).map_or(word, String::as_str));
        rest = after;
    }
    made + rest
}

/// The names in a text.
fn names(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_')
}

/// The declarations of quantities.
#[derive(Clone, Debug, Default)]
pub(crate) struct Declarations {
    /// Channels of each hand, as in `stream`.
    pub channels: Vec<String>,
    /// Signals of no hand.
    pub shared: Vec<String>,
    /// Signals of each hand.
    pub signals: Vec<String>,
}

impl Declarations {
    /// All of them.
    pub fn all(measured: &Sensors) -> Self {
        Self {
            channels: measured.sources.iter().filter_map(|source| source.channel()).map(String::from).collect(),
            shared: measured.two_hands.then(|| signal(&APART)).into_iter().collect(),
            signals: measured.quantities().map(signal).collect(),
        }
    }

    /// Those that some conditions read.
    pub fn of<'t>(conditions: impl Iterator<Item = &'t str>) -> Self {
        let mut used: BTreeSet<&str> = conditions.flat_map(names).collect();
        let mut found = Self::default();
        for quantity in OF_HAND.iter().rev() {
            if used.contains(quantity.name) {
                found.channels.extend(quantity.source.channel().map(String::from));
                found.signals.push(signal(quantity));
                used.extend(names(quantity.definition));
            }
        }
        found.channels.reverse();
        found.signals.reverse();
        found.shared.extend(used.contains(APART.name).then(|| signal(&APART)));
        found
    }

    /// A rule text with these declarations and more signals of each hand, without a tree.
    pub fn text(&self, more: impl Iterator<Item = String>) -> String {
        let channels = self.channels.join("\n");
        let shared = self.shared.join("\n");
        let signals: Vec<String> = self.signals.iter().cloned().chain(more).collect();
        format!(
            "use \"stream.rules\"\nstream {{ for each hand {{\n{channels}\n}} }}\n{shared}\nfor each hand {{\n{}\n}}\n",
            signals.join("\n")
        )
    }
}

fn signal(quantity: &Quantity) -> String {
    format!("signal {} = {}", quantity.name, quantity.definition)
}
