//! The vocabulary of an extension: the signals and latches of the extended rules, and quantities of the hand and its target, as texts of the rule language.
//!
//! A template is such a text with two marks: `@` stands before each name of a hand and becomes `other.` or nothing, `#` becomes a threshold.

use teachtree_base::channels::Shape;
use teachtree_base::units::Dimension;
use teachtree_language::Rules;
use teachtree_language::rules::Type;

/// The unit in which thresholds of a dimension are written, and the value of 1 SI unit in it.
const UNITS: [(Dimension, &str, f64); 9] = [
    (Dimension::NONE, "", 1.0),
    (Dimension::LENGTH, "mm", 1e3),
    (Dimension::SPEED, "mm/s", 1e3),
    (Dimension::ACCELERATION, "m/s^2", 1.0),
    (Dimension::ANGLE, "deg", 180.0 / std::f64::consts::PI),
    (Dimension::ANGULAR_SPEED, "rad/s", 1.0),
    (Dimension::FORCE, "N", 1.0),
    (Dimension::TORQUE, "N m", 1.0),
    (Dimension::TIME, "s", 1.0),
];

/// A quantity of each hand that the extension may declare.
struct Quantity {
    name: &'static str,
    definition: &'static str,
    dimension: Dimension,
}

const fn quantity(name: &'static str, definition: &'static str, dimension: Dimension) -> Quantity {
    Quantity { name, definition, dimension }
}

const QUANTITIES: [Quantity; 13] = [
    quantity("object_speed", "norm(target.velocity)", Dimension::SPEED),
    quantity("object_climb", "target.velocity.z", Dimension::SPEED),
    quantity("object_acceleration", "norm(rate(target.velocity, 100 ms))", Dimension::ACCELERATION),
    // The speed that does not lead away from where the target was.
    quantity(
        "to_and_fro",
        "mean(norm(target.velocity) over last 800 ms) - norm(rate(target.position, 800 ms))",
        Dimension::SPEED,
    ),
    quantity("turning_speed", "norm(target.angular_velocity)", Dimension::ANGULAR_SPEED),
    quantity("tilt", "angle(from_frame(vec3(0, 0, 1), target.rotation), vec3(0, 0, 1))", Dimension::ANGLE),
    quantity("turned_by", "angle(target.rotation, earliest(target.rotation since touching))", Dimension::ANGLE),
    quantity("raised_by", "target.position.z - earliest(target.position.z since touching)", Dimension::LENGTH),
    quantity("moved_by", "norm(target.position - earliest(target.position since touching))", Dimension::LENGTH),
    quantity("toward_other_hand", TOWARD_OTHER, Dimension::SPEED),
    quantity("hand_speed", "norm(rate(mean(fingers.position[tips]), 100 ms))", Dimension::SPEED),
    quantity("hand_climb", "rate(mean(fingers.position[tips]).z, 100 ms)", Dimension::SPEED),
    quantity("hand_distance", "norm(mean(fingers.position[tips]) - target.position)", Dimension::LENGTH),
];

/// The speed of the target toward the fingertips of the other hand.
const TOWARD_OTHER: &str = "dot(target.velocity, mean(other.fingers.position[tips]) - target.position) / norm(mean(other.fingers.position[tips]) - target.position)";

/// Channels that are conditions or numbers by themselves.
const CHANNELS: [(&str, Option<Dimension>); 7] = [
    ("target.in_plain_socket", None),
    ("target.over_socket", None),
    ("target.spin", Some(Dimension::ANGULAR_SPEED)),
    ("target.depth", Some(Dimension::LENGTH)),
    ("target.sinking", Some(Dimension::SPEED)),
    ("load", Some(Dimension::FORCE)),
    ("closing", Some(Dimension::SPEED)),
];

/// A condition other than a comparison, with its definition.
const WORKED_AT: (&str, &str) = ("worked_at", "any(contacts.handled and norm(contacts.normal) > 0.5)");

/// Durations around a condition or comparison.
const SHORT: [&str; 2] = ["250 ms", "600 ms"];
const WINDOWS: [&str; 2] = ["300 ms", "1 s"];
const EVENT_WINDOWS: [&str; 5] = ["500 ms", "1 s", "2 s", "4 s", "8 s"];

/// A number that is compared with thresholds.
#[derive(Clone, Debug)]
pub(super) struct Number {
    pub template: String,
    unit: &'static str,
    /// The value of 1 SI unit in the unit of its thresholds.
    pub per_si: f64,
}

/// Conditions that differ in a threshold or a duration only, in its order.
#[derive(Clone, Debug)]
pub(super) struct Family {
    template: String,
    /// The number whose thresholds `#` stands for.
    pub number: Option<usize>,
    /// How much there is to read.
    pub cost: f64,
    /// Whether it reads a latch: signals must not.
    pub reads_latch: bool,
}

/// What conditions may be made of.
#[derive(Clone, Debug)]
pub(super) struct Vocabulary {
    /// Declarations of each hand: a name and its definition.
    signals: Vec<(String, String)>,
    pub numbers: Vec<Number>,
    pub families: Vec<Family>,
}

impl Vocabulary {
    /// The vocabulary for some rules. Only channels that they read are used, so that no log lacks one.
    pub fn new(rules: &Rules, two_hands: bool) -> Self {
        let mut made = Self { signals: Vec::new(), numbers: Vec::new(), families: Vec::new() };
        let reads = |start: &str| rules.channels.iter().any(|channel| channel.name.starts_with(start));
        let touching = rules.signals.iter().any(|it| it.name == "touching" && it.per_hand && it.ty == Type::BOOL);
        let can_read = |definition: &str| {
            (touching || !definition.contains("since touching"))
                && (two_hands || !definition.contains("other."))
                && (reads("target.") || !definition.contains("target."))
                && (reads("fingers.position") || !definition.contains("fingers.position"))
        };
        let mut conditions = Vec::new();
        for signal in rules.signals.iter().filter(|signal| signal.ty.axis.is_none()) {
            let template = if signal.per_hand { format!("@{}", signal.name) } else { signal.name.clone() };
            match signal.ty.shape {
                Shape::Bool => conditions.push((template, false)),
                Shape::Scalar => made.add_number(template, signal.ty.dimension),
                Shape::Vec3 | Shape::Rotation | Shape::Object => {}
            }
        }
        let latches = rules.latches.iter();
        conditions.extend(
            latches.map(|latch| (if latch.per_hand { format!("@{}", latch.name) } else { latch.name.clone() }, true)),
        );
        for quantity in QUANTITIES.iter().filter(|quantity| can_read(quantity.definition)) {
            let name = made.declare(rules, quantity.name, quantity.definition);
            made.add_number(format!("@{name}"), quantity.dimension);
        }
        if reads("contacts.") && two_hands {
            let name = made.declare(rules, WORKED_AT.0, WORKED_AT.1);
            conditions.push((format!("@{name}"), false));
        }
        for (channel, dimension) in CHANNELS.iter().filter(|(channel, _)| reads(channel)) {
            let is_of_hand = rules.channels.iter().any(|it| it.name.starts_with(channel) && it.per_hand);
            let template = if is_of_hand { format!("@{channel}") } else { (*channel).to_string() };
            match dimension {
                Some(dimension) => made.add_number(template, *dimension),
                None => conditions.push((template, false)),
            }
        }
        for (template, reads_latch) in conditions {
            made.add_condition(&template, reads_latch);
        }
        for at in 0..made.numbers.len() {
            made.add_comparisons(at);
        }
        made
    }

    /// Adds a declaration; a name that the rules use gets a number.
    fn declare(&mut self, rules: &Rules, name: &str, definition: &str) -> String {
        let is_used = |name: &str| {
            rules.signals.iter().any(|it| it.name == name)
                || rules.latches.iter().any(|it| it.name == name)
                || rules.params.iter().any(|it| it.name == name)
                || rules.tasks.iter().any(|it| it.name == name)
        };
        let free = std::iter::once(name.to_string()).chain((2..).map(|at| format!("{name}_{at}")));
        let name = free.into_iter().find(|name| !is_used(name)).unwrap_or_default();
        self.signals.push((name.clone(), definition.to_string()));
        name
    }

    fn add_number(&mut self, template: String, dimension: Dimension) {
        if let Some((_, unit, per_si)) = UNITS.iter().find(|(known, ..)| *known == dimension) {
            self.numbers.push(Number { template, unit, per_si: *per_si });
        }
    }

    fn add_condition(&mut self, template: &str, reads_latch: bool) {
        let mut add = |template: String, cost| self.families.push(Family { template, number: None, cost, reads_latch });
        add(template.to_string(), 1.0);
        add(format!("not {template}"), 1.0);
        if reads_latch {
            return;
        }
        for duration in SHORT {
            add(format!("({template}) bridging {duration}"), 1.3);
            add(format!("({template}) lasting {duration}"), 1.3);
        }
        for window in WINDOWS {
            for when in ["last", "next"] {
                add(format!("({template}) within {when} {window}"), 1.3);
                add(format!("not ({template}) within {when} {window}"), 1.4);
            }
        }
        for window in EVENT_WINDOWS {
            for event in ["rises", "falls"] {
                for when in ["last", "next"] {
                    add(format!("({event}({template})) within {when} {window}"), 1.4);
                    add(format!("not ({event}({template})) within {when} {window}"), 1.5);
                }
            }
        }
    }

    fn add_comparisons(&mut self, number: usize) {
        let template = self.numbers[number].template.clone();
        let mut add = |template: String, cost| {
            self.families.push(Family { template, number: Some(number), cost, reads_latch: false });
        };
        for sign in [">", "<"] {
            let compared = format!("{template} {sign} #");
            add(compared.clone(), 1.0);
            for duration in SHORT {
                add(format!("({compared}) bridging {duration}"), 1.3);
                add(format!("({compared}) lasting {duration}"), 1.3);
            }
            for window in WINDOWS {
                for when in ["last", "next"] {
                    add(format!("({compared}) within {when} {window}"), 1.3);
                }
            }
        }
    }

    /// The declarations of all quantities, for rules that evaluate them.
    pub fn declarations(&self) -> String {
        let lines: Vec<String> =
            self.signals.iter().map(|(name, definition)| format!("  signal {name} = {definition}\n")).collect();
        if lines.is_empty() { String::new() } else { format!("for each hand {{\n{}}}\n", lines.concat()) }
    }

    /// The declarations that some conditions read.
    pub fn declarations_of(&self, conditions: &[&str]) -> Vec<String> {
        let is_read = |name: &str| conditions.iter().any(|text| names(text).any(|word| word == name));
        let read = self.signals.iter().filter(|(name, _)| is_read(name));
        read.map(|(name, definition)| format!("signal {name} = {definition}")).collect()
    }
}

impl Family {
    /// Whether it is about a hand.
    pub fn is_of_hand(&self) -> bool {
        self.template.contains('@')
    }

    /// Whether it has a form for the other hand. Only plain forms are asked of it.
    pub fn has_other(&self) -> bool {
        self.template.contains('@') && self.cost <= 1.0
    }

    /// The condition of a hand, or of the other one, with a threshold.
    pub fn spelled(&self, other: bool, threshold: Option<f64>, numbers: &[Number]) -> String {
        let text = self.template.replace('@', if other { "other." } else { "" });
        let unit = self.number.and_then(|at| numbers.get(at)).map_or("", |number| number.unit);
        threshold.map_or(text.clone(), |value| text.replace('#', format!("{value} {unit}").trim_end()))
    }
}

/// The names in a text.
fn names(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_alphanumeric() && letter != '_')
}
