//! The bodies of a log: what has a position and is not a hand, with a size and a table that make contacts plausible.

use super::parts::{Part, Quantity, distances};
use super::quantiles::quantile;
use super::words;
use crate::inspect::Inspection;
use std::collections::{BTreeMap, BTreeSet};

/// The size of a body where nothing shows it, m.
const USUAL_M: f64 = 0.05;
/// What moves less than this stands still, m.
const STILL_M: f64 = 0.01;
/// What is carried is moved by more than this, m.
const CARRIED_M: f64 = 0.03;
/// The most bodies that are looked for.
const MAX_BODIES: usize = 100;

/// A body.
#[derive(Clone, Debug)]
pub struct Body<'a> {
    /// Its name.
    pub name: String,
    /// Its position, or the markers whose middle it is.
    pub positions: Vec<Part<'a>>,
    /// How it is turned.
    pub rotation: Option<Part<'a>>,
}

/// What a name is of: the words that name no quantity.
pub fn key(name: &str) -> String {
    words::body(name).unwrap_or_default().to_lowercase()
}

/// The bodies, and the parts that are of none of them. `subject` is the beginning of all names.
pub fn bodies<'a>(parts: Vec<Part<'a>>, subject: Option<&str>) -> (Vec<Body<'a>>, Vec<Part<'a>>) {
    let mut bodies: Vec<Body<'a>> = vec![];
    let mut rest = vec![];
    let several = of_several(&parts, subject);
    let name_of = |part: &Part| {
        let name = words::body(own(&part.name, subject))?;
        if several.contains(&name) { words::numbered_body(own(&part.name, subject)) } else { Some(name) }
    };
    for part in parts {
        let name = name_of(&part).filter(|_| !words::is_part(&part.words));
        match (part.quantity, name) {
            (Quantity::Position, Some(name))
                if bodies.len() < MAX_BODIES && bodies.iter().all(|body| body.name != name) =>
            {
                bodies.push(Body { name, positions: vec![part], rotation: None });
            }
            _ => rest.push(part),
        }
    }
    for body in &mut bodies {
        let at = rest.iter().position(|part| {
            part.quantity == Quantity::Rotation && name_of(part).is_some_and(|name| is_same(&name, &body.name))
        });
        body.rotation = at.map(|at| rest.remove(at));
    }
    shorten_names(&mut bodies);
    if bodies.is_empty() {
        (bodies, rest) = of_states(rest);
    }
    (bodies, rest)
}

/// Leaves the source of each body out of its name, unless another body has or gets the shorter name: `cube` and `vicon_cube` keep their names.
fn shorten_names(bodies: &mut [Body]) {
    let names: Vec<String> = bodies.iter().map(|body| body.name.clone()).collect();
    let shorter: Vec<String> = names.iter().map(|name| words::without_source(name)).collect();
    for (at, (body, name)) in bodies.iter_mut().zip(&shorter).enumerate() {
        let is_free =
            |others: &[String]| others.iter().enumerate().all(|(other, taken)| other == at || !is_same(taken, name));
        if is_free(&names) && is_free(&shorter) {
            body.name.clone_from(name);
        }
    }
}

/// The free bodies in the states of MuJoCo, which have no names there.
fn of_states(parts: Vec<Part<'_>>) -> (Vec<Body<'_>>, Vec<Part<'_>>) {
    let is_state = |part: &Part| part.words.first().is_some_and(|word| word == "states") && part.words.len() == 2;
    let is_of = |part: &Part, quantity: Quantity| part.quantity == quantity && is_state(part);
    let (positions, mut rest): (Vec<Part>, Vec<Part>) =
        parts.into_iter().partition(|part| is_of(part, Quantity::Position));
    let mut bodies: Vec<Body> = vec![];
    for mut position in positions {
        let at = rest.iter().position(|part| is_of(part, Quantity::Rotation) && part.name == position.name);
        let name = if bodies.is_empty() { "object".into() } else { format!("object_{}", bodies.len() + 1) };
        position.reason = Some("a free body in the state of MuJoCo, which has no names".into());
        bodies.push(Body { name, positions: vec![position], rotation: at.map(|at| rest.remove(at)) });
    }
    (bodies, rest)
}

fn is_same(one: &str, other: &str) -> bool {
    one.to_lowercase() == other.to_lowercase()
}

/// A name without the subject before it.
fn own<'a>(name: &'a str, subject: Option<&str>) -> &'a str {
    subject.and_then(|subject| name.strip_prefix(subject)).unwrap_or(name)
}

/// The names of several bodies that differ in a number only: `cube` of `cube_1` and `cube_2`.
fn of_several(parts: &[Part], subject: Option<&str>) -> BTreeSet<String> {
    let mut numbered: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for part in parts.iter().filter(|part| part.quantity == Quantity::Position) {
        let own = own(&part.name, subject);
        if let (Some(name), Some(with_number)) = (words::body(own), words::numbered_body(own)) {
            numbered.entry(name).or_default().insert(with_number);
        }
    }
    numbered.into_iter().filter(|(_, numbers)| numbers.len() > 1).map(|(name, _)| name).collect()
}

impl Body<'_> {
    /// Whether it moves.
    pub fn moves(&self) -> bool {
        self.positions.first().is_some_and(|part| part.extent() > STILL_M)
    }

    /// Where it is first, m.
    pub fn start(&self) -> Option<[f64; 3]> {
        let part = self.positions.first()?;
        (0..part.rows()).find_map(|row| part.position(row))
    }

    /// Whether it is carried about by a tool and keeps its distance from it in the whole log.
    pub fn is_fixed_to(&self, tool: &Part) -> bool {
        const VARIES_M: f64 = 0.005;
        let Some(part) = self.positions.first().filter(|part| part.extent() > CARRIED_M) else { return false };
        let distances = distances(part, tool);
        let at = |share: f64| quantile(distances.clone(), share);
        at(0.05).zip(at(0.95)).is_some_and(|(least, most)| most - least < VARIES_M)
    }

    /// The axis that points up, 1 for y: the one along which it is lifted. What is lifted along y is also carried to another z, unlike what is pushed to and fro on
    /// a table, unless y points up in files of this kind. There it may end at any height. In other files it ends where it began or lower: what is carried along
    /// y and held in the air may also pass its last place.
    fn up(&self, is_y_usual: bool) -> Option<usize> {
        /// A lift is this high, m; what rests at its ends is not below them by more than this share of the way.
        const LIFT_M: f64 = 0.03;
        const BELOW: f64 = 0.15;
        let part = self.positions.first()?;
        let way = |axis: usize| {
            let values: Vec<f64> = (0..part.rows()).filter_map(|row| part.position(row)?.get(axis).copied()).collect();
            let (first, last) = (*values.first()?, *values.last()?);
            let (low, high) = values.iter().fold((first, first), |(low, high), at| (low.min(*at), high.max(*at)));
            Some((first, last, low, high))
        };
        // The height of a lift above both of its ends; if it is level, both are low.
        let lift = |axis: usize, is_level: bool| {
            let (first, last, low, high) = way(axis)?;
            let is_bottom = |height: f64| height - low < BELOW * (high - low);
            let is_of_ends = is_bottom(first.min(last)) && (!is_level || is_bottom(first.max(last)));
            Some(high - first.max(last)).filter(|height| *height > LIFT_M && is_of_ends)
        };
        let (any_y, level_y, level_z) = (lift(1, false), lift(1, true), lift(2, true));
        let is_put_lower = way(1).is_some_and(|(first, last, ..)| last < first);
        let is_carried = way(2).is_some_and(|(first, last, ..)| (first - last).abs() > CARRIED_M);
        match () {
            () if is_y_usual && any_y.is_some() && (level_y.is_some() || any_y >= level_z) => Some(1),
            () if level_z.is_some() => Some(2),
            () if is_carried && level_y.is_some() => Some(1),
            () if is_carried && any_y.is_some() && is_put_lower && lift(2, false).is_none() => Some(1),
            () => None,
        }
    }
}

/// Why y points up in a log; `None` if z does. Motive exports it so unless it is set otherwise.
pub fn y_up_reason(bodies: &[Body], log: &Inspection) -> Option<&'static str> {
    let is_motive = log.sheets.iter().any(|sheet| {
        sheet.time.as_deref().is_some_and(|time| time.starts_with("Time (Seconds)"))
            && sheet.columns.iter().any(|column| column.name.ends_with(".Position.Y"))
    });
    let ups: Vec<usize> = bodies.iter().filter_map(|body| body.up(is_motive)).collect();
    match () {
        () if ups.contains(&2) => None,
        () if !ups.is_empty() => Some("an object is lifted along it"),
        () => is_motive.then_some("Motive exports it so"),
    }
}

/// The edge of a box for bodies, m, and why: as wide as the gripper is on them.
pub fn edge(held_m: Option<f64>) -> (f64, &'static str) {
    match held_m.filter(|held| (0.005..0.2).contains(held)) {
        Some(held) => ((held * 1e3).round() / 1e3, "the width that the gripper holds; replace the other edges"),
        None => (USUAL_M, "its size is not in the log"),
    }
}
