//! Contacts that a log measures: flags and forces of fingers on bodies, and of bodies on each other.

use super::bodies::Body;
use super::hands::{Hand, side_of};
use super::parts::{Part, Quantity, distance};
use super::quantiles::median;
use super::words;
use crate::inspect::ValueKind;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::hands::{Finger, Side};

/// The body that stands for everything that no object is.
const ROOM: [&str; 4] = ["env", "table", "ground", "floor"];
/// The share of frames in contact without a force from which forces are not to be relied on.
const MOST_ZERO: f64 = 0.2;

/// Words of sensors in a fingertip that show whether it touches something.
const SENSORS: [&str; 10] =
    ["touch", "touches", "touching", "contact", "contacts", "switch", "bumper", "tactile", "fsr", "pressure"];

/// A channel, the columns of it, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The channel.
    pub channel: String,
    /// The columns, as a binding writes them.
    pub columns: String,
    /// The reason; empty where the names show it.
    pub reason: String,
}

impl Line {
    /// The body whose touch by a finger the channel is: `cube` of `right.thumb.contact.cube`.
    pub fn object(&self) -> Option<&str> {
        self.channel.split_once(".contact.").map(|(_, object)| object)
    }
}

/// The two bodies of a contact.
#[derive(Clone, Debug, PartialEq)]
enum Touch {
    Finger(Side, Finger, String),
    Bodies(String, String),
}

/// A finger that touches something, by the name of its sensor, and the columns of the flag.
type FingerFlag = (Side, Finger, String, String);

/// The contacts of a log.
#[derive(Default)]
pub struct Contacts {
    /// The channels.
    pub lines: Vec<Line>,
    /// Bodies without a position that carry objects.
    pub supports: BTreeSet<String>,
    /// Whether flags name the body that a finger touches beside its force: no sensor does, so both are those of a simulation.
    pub are_simulated: bool,
    /// How far fingertips that touch a body usually are from its origin, m.
    pub touched_at_m: BTreeMap<String, f64>,
    /// How far the fingertips are apart on an object, m, where only their flags show that they hold one.
    pub held_m: Option<f64>,
    /// Why forces of fingers were left out.
    pub left_out: Option<String>,
}

impl Contacts {
    /// Whether the log shows which bodies touch each other.
    pub fn are_of_bodies(&self) -> bool {
        self.lines.iter().any(|line| line.channel.starts_with("contact."))
    }

    /// Whether the log shows what fingers of a hand touch.
    pub fn are_of(&self, side: Side) -> bool {
        self.lines.iter().any(|line| line.channel.starts_with(side.name()))
    }

    /// Whether flags show what the thumb and the index of a hand touch.
    pub fn are_of_grasp(&self, side: Side) -> bool {
        let is_touched = |finger: Finger| {
            let flag = format!("{side}.{finger}.contact");
            self.lines.iter().any(|line| line.channel.starts_with(&flag))
        };
        is_touched(Finger::Thumb) && is_touched(Finger::Index)
    }

    /// Whether the log shows that fingers touch.
    pub fn are_of_fingers(&self) -> bool {
        self.lines.iter().any(|line| line.channel.contains(".contact"))
    }
}

/// Finds the contacts; the parts that are none are left.
pub fn contacts<'a>(
    parts: Vec<Part<'a>>,
    bodies: &[Body],
    hands: &BTreeMap<Side, Hand<'_>>,
) -> (Contacts, Vec<Part<'a>>) {
    let mut found = Contacts::default();
    let mut flags: Vec<(Touch, Part)> = vec![];
    let mut forces: Vec<(Touch, Part)> = vec![];
    let mut rest = vec![];
    let mut of_tips: Vec<(Side, Finger, Part)> = vec![];
    for part in parts {
        let touch = match part.quantity {
            Quantity::Flag | Quantity::Number | Quantity::Force => touch(&part, bodies),
            _ => None,
        };
        match touch {
            // Sensors that never touch have no ones.
            Some(touch) if part.quantity == Quantity::Force => forces.push((touch, part)),
            Some(touch) if is_flag(&part) => flags.push((touch, part)),
            _ => match finger_flag(&part, hands) {
                Some((side, finger, columns, reason)) => {
                    let channel = format!("{side}.{}.contact", finger.name());
                    found.lines.push(Line { channel, columns, reason });
                    of_tips.push((side, finger, part));
                }
                None => rest.push(part),
            },
        }
    }
    found.touched_at_m = touched_at_m(&flags, bodies, hands);
    found.held_m = hands.iter().find_map(|(side, hand)| width_m(*side, hand, &of_tips));
    for (touch, part) in &flags {
        let channel = match touch {
            Touch::Finger(side, finger, object) => format!("{side}.{finger}.contact.{object}"),
            Touch::Bodies(one, other) => format!("contact.{one}.{other}"),
        };
        found.lines.push(Line { channel, columns: part.pattern.clone(), reason: String::new() });
        if let Touch::Bodies(_, other) = touch
            && bodies.iter().all(|body| body.name != *other)
        {
            found.supports.insert(other.clone());
        }
    }
    let reliable = found.lines.is_empty() || forces_are_reliable(&flags, &forces);
    if !reliable {
        found.left_out =
            Some("forces of fingers: they are zero in many frames with a contact, or no fingertip has one".into());
    }
    for (touch, part) in forces {
        let line = match &touch {
            // The forces on all objects count together.
            Touch::Finger(side, finger, object) if reliable => {
                found.are_simulated |= flags.iter().any(|(known, _)| *known == touch);
                let several = bodies.len() > 1;
                let columns =
                    if several { part.pattern.replace(object.as_str(), "<object>") } else { part.pattern.clone() };
                Line { channel: format!("{side}.{finger}.force"), columns, reason: String::new() }
            }
            Touch::Finger(..) => continue,
            Touch::Bodies(one, other) if ROOM.contains(&other.as_str()) => {
                let sign = if is_downward(&part) { "-" } else { "" };
                Line {
                    channel: format!("contact.{one}.{other}.force"),
                    columns: format!("{sign}{}", part.pattern),
                    reason: format!("on {one}, which it carries"),
                }
            }
            Touch::Bodies(..) => continue,
        };
        if !found.lines.contains(&line) {
            found.lines.push(line);
        }
    }
    (found, rest)
}

/// Whether a column has the values of a flag, or is always 0.
fn is_flag(part: &Part) -> bool {
    part.members
        .iter()
        .all(|column| column.min >= 0.0 && column.max <= 1.0 && column.samples.iter().all(|value| value.fract() == 0.0))
}

/// The contact that a name describes: `C_R_f1_cube`, `contact_cube_table`, `F_cube_env_<xyz>`.
fn touch(part: &Part, bodies: &[Body]) -> Option<Touch> {
    let says = words::has(&part.words, &["c", "f", "contact", "contacts", "touch", "touches", "force", "collision"]);
    let name = part.name.trim().trim_end_matches(['_', '.', '/']);
    let is_named = says && name.contains(['_', '.', '/']);
    let objects = bodies.iter().map(|body| body.name.as_str());
    let names: Vec<&str> = objects.chain(ROOM).filter(|_| is_named).collect();
    let mut ends = names.iter().filter_map(|body| {
        let head = name.strip_suffix(body)?;
        head.ends_with(['_', '.', '/']).then(|| (head.trim_end_matches(['_', '.', '/']), (*body).to_string()))
    });
    let (head, other) = ends.next()?;
    let one = names.iter().find(|body| head.ends_with(&format!("_{body}")) || head.ends_with(&format!(".{body}")));
    if let Some(one) = one.filter(|one| !ROOM.contains(one)) {
        return Some(Touch::Bodies((*one).to_string(), other));
    }
    let of_hand = words::words(head);
    let side = side_of(part).unwrap_or(Side::Right);
    if ROOM.contains(&other.as_str()) {
        return None;
    }
    let finger = words::finger(&of_hand).or_else(|| words::has(&of_hand, &["palm", "hand"]).then_some(Finger::Palm))?;
    Some(Touch::Finger(side, finger, other))
}

/// The flag of a sensor in a fingertip that touches anything: `touch_a` of `pad_a`, `fsr_1` above the middle of its two usual values.
fn finger_flag(part: &Part, hands: &BTreeMap<Side, Hand<'_>>) -> Option<FingerFlag> {
    let [column] = part.members[..] else { return None };
    if !words::has(&part.words, &SENSORS) || part.is_constant() {
        return None;
    }
    // `left` is a hand where there are two, else a finger.
    let mut words = part.words.clone();
    if hands.len() > 1 {
        words.retain(|word| !["left", "right", "l", "r"].contains(&word.as_str()));
    }
    let finger = words::finger(&words).or_else(|| words::jaw(&words))?;
    let has_tip = |side: &Side| hands.get(side).is_some_and(|hand| hand.tips.contains_key(&finger));
    let named = words::side(&part.words).filter(|_| hands.len() > 1);
    let side = named.or_else(|| hands.keys().next().copied().filter(|_| hands.len() == 1)).filter(has_tip)?;
    if column.kind == ValueKind::Flag {
        return Some((side, finger, part.pattern.clone(), String::new()));
    }
    let [low, high] = column.groups.filter(|_| part.quantity == Quantity::Number)?;
    let limit: f64 = format!("{:.2e}", (low + high) / 2.0).parse().ok()?;
    let unit = if part.unit.is_empty() { String::new() } else { format!(" {}", part.unit) };
    let reason = format!("in the middle between its two usual values, {low:.3} and {high:.3}");
    Some((side, finger, format!("{} > {limit}{unit}", part.pattern), reason))
}

/// The usual distance of the fingertips or the palm that touch a body from its origin, m, by body.
fn touched_at_m(flags: &[(Touch, Part)], bodies: &[Body], hands: &BTreeMap<Side, Hand<'_>>) -> BTreeMap<String, f64> {
    let mut all: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (touch, flag) in flags {
        let Touch::Finger(side, finger, object) = touch else { continue };
        let hand = hands.get(side);
        let tip =
            hand.and_then(|hand| if *finger == Finger::Palm { hand.tool.as_ref() } else { hand.tips.get(finger) });
        let body = bodies.iter().find(|body| body.name == *object).and_then(|body| body.positions.first());
        let (Some(tip), Some(body)) = (tip, body) else { continue };
        let touching = (0..flag.rows()).filter(|row| flag.at(*row).first().is_some_and(|value| *value > 0.5));
        let distances = touching.filter_map(|row| {
            Some(distance(tip.position(flag.row_in(row, tip))?, body.position(flag.row_in(row, body))?))
        });
        all.entry(object.clone()).or_default().extend(distances);
    }
    all.into_iter().filter_map(|(object, distances)| Some((object, median(distances)?))).collect()
}

/// The usual distance of the tips of thumb and index while the flags of both are set, m.
fn width_m(side: Side, hand: &Hand, flags: &[(Side, Finger, Part)]) -> Option<f64> {
    let of = |wanted: Finger| {
        let flag = flags.iter().find(|(of, finger, _)| *of == side && *finger == wanted).map(|(.., part)| part)?;
        let limit = flag.members.first().map(|column| f64::midpoint(column.min, column.max) * flag.scale())?;
        Some((hand.tips.get(&wanted)?, flag, limit))
    };
    let (one, first, least) = of(Finger::Thumb)?;
    let (other, second, lowest) = of(Finger::Index)?;
    let is_set = |flag: &Part, limit: f64, row: usize| {
        flag.at(one.row_in(row, flag)).first().is_some_and(|value| *value > limit)
    };
    let held = (0..one.rows()).filter(|row| is_set(first, least, *row) && is_set(second, lowest, *row));
    let width = |row: usize| Some(distance(one.position(row)?, other.position(one.row_in(row, other))?));
    median(held.filter_map(width).collect())
}

/// Whether the forces of fingertips are there in most frames in which their flags are set, and there are such frames.
fn forces_are_reliable(flags: &[(Touch, Part)], forces: &[(Touch, Part)]) -> bool {
    let (mut touching, mut zero) = (0_usize, 0_usize);
    let is_tip = |touch: &Touch| matches!(touch, Touch::Finger(_, finger, _) if *finger != Finger::Palm);
    for (touch, flag) in flags.iter().filter(|(touch, _)| is_tip(touch)) {
        let Some((_, force)) = forces.iter().find(|(other, _)| other == touch) else { continue };
        for row in 0..flag.rows() {
            if flag.at(row).first().is_some_and(|value| *value > 0.5) {
                touching += 1;
                let norm = force.at(flag.row_in(row, force)).iter().map(|part| part * part).sum::<f64>().sqrt();
                zero += usize::from(norm < 0.05);
            }
        }
    }
    touching > 0 && (zero as f64) < MOST_ZERO * touching as f64
}

/// Whether a force points down on average: it is that on what carries.
fn is_downward(part: &Part) -> bool {
    let rows = part.rows();
    let sum: f64 = (0..rows).filter_map(|row| part.at(row).get(2).copied()).filter(|value| value.is_finite()).sum();
    sum < 0.0
}
