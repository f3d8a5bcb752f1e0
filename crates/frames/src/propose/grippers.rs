//! Grippers: which column is their opening, and at which end of it they are closed.

use super::bodies::Body;
use super::hands::side_of;
use super::holds::{Holds, Levels};
use super::parts::{Part, Quantity};
use super::strokes::{Scale, is_beside_ur};
use super::{low_closings, words};
use crate::inspect::{ColumnReport, ValueKind};
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_base::short_number::ShortNumber;
use teachtree_base::units::{Dimension, compound_of_log, symbol};

/// Words for the opening of a gripper, the best one first.
const OPENINGS: [&str; 14] = [
    "opening",
    "width",
    "aperture",
    "closed",
    "gripper",
    "grip",
    "jaw",
    "jaws",
    "gap",
    "leftfinger",
    "finger",
    "fingers",
    "robotiq",
    "greifer",
];
/// Words for other quantities of a gripper.
const OTHERS: [&str; 16] = [
    "force",
    "forces",
    "current",
    "velocity",
    "vel",
    "effort",
    "torque",
    "status",
    "speed",
    "temperature",
    "voltage",
    "object",
    "target",
    "max",
    "load",
    "id",
];

/// A gripper.
#[derive(Clone, Debug)]
pub struct Gripper {
    /// When it is closed, as a binding writes it.
    pub closed: String,
    /// Why.
    pub reason: String,
    /// The other end.
    pub alternative: Option<String>,
    /// How far it is open, as a binding writes it, where the unit is known or its values show it.
    pub opening: Option<(String, String)>,
    /// How far it is open on an object, m.
    pub held_m: Option<f64>,
    /// How far from the bounding ball of an object it holds it at most, m, where positions of both fingertips show it.
    pub reach_m: Option<f64>,
    /// When it is closed, s: at each sample.
    pub closed_at: Vec<(f64, bool)>,
    /// Whether nothing but the name shows the closed end.
    pub is_guess: bool,
    /// The sheet of its column.
    pub sheet: String,
}

impl Gripper {
    /// Whether it is closed at a time, s.
    pub fn is_closed(&self, time_s: f64) -> bool {
        let before = self.closed_at.partition_point(|(at, _)| *at <= time_s);
        self.closed_at.get(before.saturating_sub(1)).is_some_and(|(_, closed)| *closed)
    }
}

/// The grippers, and the parts that are of none of them. Those of the hands in `turned` are closed at the other end than usual.
pub fn grippers<'a>(
    parts: Vec<Part<'a>>,
    tools: &BTreeMap<Side, &Part<'_>>,
    bodies: &[Body<'_>],
    turned: &[Side],
) -> (BTreeMap<Side, Gripper>, Vec<Part<'a>>) {
    let only = match tools.keys().collect::<Vec<_>>()[..] {
        [side] => *side,
        _ => Side::Right,
    };
    let mut found: BTreeMap<Side, Vec<(usize, Part<'a>)>> = BTreeMap::new();
    let mut rest = vec![];
    for part in parts {
        match rank(&part) {
            Some(rank) => found
                .entry(side_of(&part).or_else(|| aloha_side(&part)).unwrap_or(only))
                .or_default()
                .push((rank, part)),
            None => rest.push(part),
        }
    }
    let mut grippers = BTreeMap::new();
    for (side, mut candidates) in found {
        candidates.sort_by_key(|(rank, _)| *rank);
        let mut candidates = candidates.into_iter().map(|(_, part)| part);
        let Some(first) = candidates.next() else { continue };
        let others: Vec<Part> = candidates.collect();
        let second = others.iter().find(|other| is_other_finger(&first, other)).cloned();
        let gripper = gripper(&first, second.as_ref(), tools.get(&side).copied(), bodies, turned.contains(&side));
        grippers.extend(gripper.map(|gripper| (side, gripper)));
        rest.extend(others);
    }
    (grippers, rest)
}

/// How good a column is as the opening of a gripper.
fn rank(part: &Part) -> Option<usize> {
    if !is_number(part) || does_not_move(part) {
        return None;
    }
    // The second finger of robosuite is open at its lowest value.
    let is_mirrored = part.members.iter().all(|column| column.max <= 0.0);
    let rank = rank_by_name(part);
    let rank = rank.or_else(|| aloha_side(part).map(|_| OPENINGS.len()));
    let rank = rank.or_else(|| is_output(part).then_some(OPENINGS.len()));
    rank.map(|rank| if is_mirrored { rank + 100 } else { rank })
}

/// Whether it is a number or a flag, and neither a command nor another quantity of a gripper.
fn is_number(part: &Part) -> bool {
    let is_number = matches!(part.quantity, Quantity::Number | Quantity::Flag);
    is_number && !words::has(&part.words, &OTHERS) && !words::is_command(&part.words)
}

/// How good its name is as that of the opening of a gripper.
fn rank_by_name(part: &Part) -> Option<usize> {
    let closing = part.words.iter().any(|word| word.starts_with("clos") || word == "grasped");
    let by_word = || OPENINGS.iter().position(|known| part.words.iter().any(|word| word == known));
    if closing { Some(0) } else { by_word() }
}

/// Whether it is a gripper that does not move.
pub fn is_at_rest(part: &Part) -> bool {
    is_number(part) && rank_by_name(part).is_some() && does_not_move(part)
}

/// Whether values do not move: they differ by less than 1 mm, 10 mrad, or 1 % of what they may count, which is noise.
fn does_not_move(part: &Part) -> bool {
    let unit = if part.unit.is_empty() { usual_unit(part) } else { &part.unit };
    let (factor, dimension) = compound_of_log(unit).unwrap_or((1.0, Dimension::NONE));
    let is_still = |column: &&ColumnReport| {
        let most = column.max.abs().max(column.min.abs());
        let noise = match dimension {
            Dimension::LENGTH => 1e-3,
            Dimension::ANGLE => 0.01,
            // A share, an angle or a way of a finger; otherwise a percentage or counts.
            _ if most < 0.1 => 1e-3,
            _ if most < 2.0 => 0.01,
            _ => 1.5,
        };
        (column.max - column.min) * factor < noise
    };
    part.is_constant() || part.members.iter().all(is_still)
}

/// Whether it is the digital outputs of a controller, with two values: it switches the gripper.
fn is_output(part: &Part) -> bool {
    let [column] = part.members[..] else { return false };
    let is_at_end = |value: &f64| [column.min, column.max].contains(value) || value.is_nan();
    words::has(&part.words, &["digital"])
        && words::has(&part.words, &["output", "outputs", "out"])
        && column.samples.iter().all(is_at_end)
}

/// Whether it counts up to 255, as the grippers of Robotiq do: they are shut there.
fn is_of_robotiq(part: &Part) -> bool {
    // A gripper that stops at an object may stay below the middle.
    let is_named = words::has(&part.words, &["robotiq"]) || is_beside_ur(part);
    let least = if is_named { 2.0 } else { 128.0 };
    let is_count = |column: &&ColumnReport| {
        column.max > least
            && column.max <= 255.0
            && column.samples.iter().all(|value| value.is_nan() || value.fract() == 0.0)
    };
    part.unit.is_empty() && part.members.iter().all(|column| column.min >= 0.0 && is_count(column))
}

/// The arm of a gripper in an array of ALOHA: 7 joints of the left arm with the gripper last, then those of the right arm.
fn aloha_side(part: &Part) -> Option<Side> {
    let name = part.name.strip_prefix('/').unwrap_or(&part.name);
    let of_array = name.strip_prefix("observations/qpos").or_else(|| name.strip_prefix("observation.state"))?;
    let siblings = |at: usize| {
        let wanted = name.strip_suffix(of_array).map(|head| format!("{head}[{at}]"));
        part.sheet.columns.iter().any(|column| Some(column.name.trim_start_matches('/').to_string()) == wanted)
    };
    let is_two_arms = siblings(13) && !siblings(14);
    match of_array {
        "[6]" if is_two_arms => Some(Side::Left),
        "[13]" if is_two_arms => Some(Side::Right),
        _ => None,
    }
}

/// Whether columns are the two fingers of one gripper: as far, or mirrored.
fn is_other_finger(one: &Part, other: &Part) -> bool {
    let is_finger = |part: &Part| {
        words::has(&part.words, &["finger", "leftfinger", "rightfinger", "joint1", "joint2", "qpos", "states"])
            || part.name.contains("finger")
    };
    let ([first], [second]) = (&one.members[..], &other.members[..]) else { return false };
    let range = |low: f64, high: f64| high - low;
    let (ours, theirs) = (range(first.min, first.max), range(second.min, second.max));
    is_finger(one) && is_finger(other) && ours > 0.0 && (ours - theirs).abs() < 0.2 * ours
}

fn gripper(
    part: &Part,
    second: Option<&Part>,
    tool: Option<&Part>,
    bodies: &[Body],
    is_turned: bool,
) -> Option<Gripper> {
    let column = part.members.first()?;
    let [low, high] = column.groups.unwrap_or([column.min, column.max]);
    let holds = Holds::new(part, column, tool, bodies);
    let by_motion = holds.is_low_closed(part, f64::midpoint(low, high));
    let says_closed = part.words.iter().any(|word| word.starts_with("clos") || word == "grasped");
    let (is_counted, is_switched) = (is_of_robotiq(part), is_output(part));
    let is_low = by_motion.unwrap_or((says_closed || is_counted || is_switched) == is_turned);
    let is_flag = column.kind == ValueKind::Flag;
    let unit = if part.unit.is_empty() { usual_unit(part) } else { symbol(&part.unit) };
    let named = |unit: &str| match unit {
        "" => part.pattern.clone(),
        _ if !column.unit.is_empty() => part.pattern.clone(),
        unit => format!("{} [{unit}]", part.pattern),
    };
    let Levels { closed, open, limit } = holds.levels([low, high], is_low);
    let mut limit = short(limit);
    let fingers = if second.is_some() { 2.0 } else { fingers(part) };
    let factor = compound_of_log(unit).map_or(1.0, |(factor, _)| factor) * fingers;
    let is_length = matches!(unit, "m" | "mm" | "cm") && !is_flag;
    let is_scaled = !is_length && !is_flag && aloha_side(part).is_none();
    let scale = Scale::of(part, is_counted).filter(|_| is_scaled);
    let stroke = scale.and_then(|scale| scale.stroke(part, closed, is_low, by_motion.is_some()));
    // Without the opening, the flag alone shows when the gripper closes on an object and lets go.
    if !is_length && stroke.is_none() && !is_flag && by_motion.is_some() {
        limit = holds.plateau_limit(open, is_low).map_or(limit, short);
    }
    let flag = |is_low: bool| match (is_flag, is_low) {
        (true, false) => part.pattern.clone(),
        (_, is_low) => {
            format!("{} {} {limit} {unit}", named(unit), if is_low { "<" } else { ">" }).trim_end().to_string()
        }
    };
    let [closed_at, open_at] = [closed, open].map(|value| ShortNumber(short(value)));
    let why = match by_motion {
        Some(_) => "an object moves with it there",
        None if is_turned => low_closings::REASON,
        None if says_closed => "by its name",
        None if is_counted => "it counts up to 255, as grippers of Robotiq do",
        None if is_switched => "an output that is switched on",
        None => "the lower end: the log does not show at which end objects move with it",
    };
    let length = || {
        let columns = if fingers > 1.0 { format!("{} * 2 [{unit}]", part.pattern) } else { named(unit) };
        let by_range = part.unit.is_empty().then(|| format!("in {unit} by its range"));
        let twice = (fingers > 1.0).then(|| "twice the way of a finger".to_string());
        let reasons: Vec<String> = by_range.into_iter().chain(twice).collect();
        (columns, reasons.join(", "))
    };
    let held_m = if is_length { Some(closed * factor) } else { stroke.as_ref().map(|stroke| stroke.closed_m) };
    Some(Gripper {
        closed: flag(is_low),
        reason: if is_flag {
            format!("closed where it is {closed_at}: {why}")
        } else {
            format!("closed about {closed_at}, open about {open_at}: {why}")
        },
        alternative: Some(flag(!is_low)),
        held_m,
        reach_m: None,
        closed_at: (0..part.rows())
            .zip(&column.samples)
            .filter(|(_, value)| value.is_finite())
            .map(|(row, value)| (part.time_s(row), (*value < limit) == is_low))
            .collect(),
        opening: (is_length && is_low).then(length).or_else(|| stroke.map(|stroke| (stroke.columns, stroke.reason))),
        is_guess: by_motion.is_none() && !says_closed,
        sheet: part.sheet.name.clone(),
    })
}

/// How many fingers move as far as a column of one finger shows.
fn fingers(part: &Part) -> f64 {
    let is_finger = part.name.contains("finger") || words::has(&part.words, &["qpos"]);
    if is_finger && !words::has(&part.words, &["width", "opening", "gap", "aperture"]) { 2.0 } else { 1.0 }
}

/// The unit that the range of an opening shows; empty where it may be a share, counts or an angle.
fn usual_unit(part: &Part) -> &'static str {
    let most = part.members.iter().map(|column| column.max).fold(0.0, f64::max);
    let least = part.members.iter().map(|column| column.min).fold(f64::INFINITY, f64::min);
    let is_width = words::has(&part.words, &["opening", "width", "aperture", "gap"]);
    match () {
        () if least < -1e-3 => "",
        () if most > 0.01 && most <= 0.25 => "m",
        () if is_width && most > 2.0 && most <= 300.0 => "mm",
        () => "",
    }
}

/// Three digits are more than a middle is worth.
fn short(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}
