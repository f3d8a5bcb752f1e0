//! The bodies of a log: what has a position and is not a hand, with a size and a table that make contacts plausible.

use super::parts::{Part, Quantity};
use super::words;

/// The size of a body where nothing shows it, m.
const USUAL_M: f64 = 0.05;
/// What moves less than this stands still, m.
const STILL_M: f64 = 0.01;
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

/// The bodies, and the parts that are of none of them.
pub fn bodies<'a>(parts: Vec<Part<'a>>) -> (Vec<Body<'a>>, Vec<Part<'a>>) {
    let mut bodies: Vec<Body<'a>> = vec![];
    let mut rest = vec![];
    for part in parts {
        let name = words::body(&part.name).filter(|_| !words::is_part(&part.words));
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
        let at = rest
            .iter()
            .position(|part| part.quantity == Quantity::Rotation && key(&part.name) == body.name.to_lowercase());
        body.rotation = at.map(|at| rest.remove(at));
    }
    (merged(bodies), rest)
}

/// Bodies with the markers of one body put together: `pillow_top`, `pillow_left`, `pillow_right`.
fn merged(bodies: Vec<Body<'_>>) -> Vec<Body<'_>> {
    let first = |body: &Body| body.name.split_once('_').map(|(first, _)| first.to_string());
    let mut all: Vec<Body> = vec![];
    for body in bodies {
        let prefix = first(&body).filter(|_| body.rotation.is_none());
        let known = all.iter().position(|known| {
            let is_alike = first(known) == prefix || Some(&known.name) == prefix.as_ref() && known.positions.len() > 1;
            known.rotation.is_none() && prefix.is_some() && is_alike && is_rigid(&known.positions, &body.positions)
        });
        match (known, prefix) {
            (Some(at), Some(prefix)) => {
                if let Some(known) = all.get_mut(at) {
                    known.name = prefix;
                    known.positions.extend(body.positions);
                }
            }
            _ => all.push(body),
        }
    }
    all
}

/// Whether markers keep their distance, to a fifth.
fn is_rigid(known: &[Part], new: &[Part]) -> bool {
    let (Some(one), Some(other)) = (known.first(), new.first()) else { return false };
    let mut distances: Vec<f64> = (0..one.rows())
        .filter_map(|row| Some(distance(one.position(row)?, other.position(one.row_in(row, other))?)))
        .collect();
    distances.sort_by(f64::total_cmp);
    let at = |share: f64| distances.get((distances.len() as f64 * share) as usize).copied().unwrap_or_default();
    !distances.is_empty() && at(0.9) - at(0.1) < 0.2 * at(0.5) && at(0.5) < 0.4
}

/// The distance of two points.
pub fn distance(one: [f64; 3], other: [f64; 3]) -> f64 {
    one.iter().zip(other).map(|(one, other)| (one - other).powi(2)).sum::<f64>().sqrt()
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

    /// The axis that points up, 1 for y: the one along which it begins and ends at the bottom.
    pub fn up(&self) -> Option<usize> {
        let part = self.positions.first()?;
        let rises = |axis: usize| {
            let values: Vec<f64> = (0..part.rows()).filter_map(|row| part.position(row)?.get(axis).copied()).collect();
            let (first, last) = (values.first()?, values.last()?);
            let (low, high) =
                values.iter().fold((*first, *first), |(low, high), value| (low.min(*value), high.max(*value)));
            let is_bottom = |value: f64| value - low < 0.15 * (high - low).max(1e-3);
            (high - low > 0.03 && is_bottom(*first) && is_bottom(*last)).then_some(high - low)
        };
        match (rises(2), rises(1)) {
            (None, Some(_)) => Some(1),
            (Some(_), _) => Some(2),
            _ => None,
        }
    }
}

/// The edge of a box for bodies, m, and why: as wide as the gripper is on them.
pub fn edge(held_m: Option<f64>) -> (f64, &'static str) {
    match held_m.filter(|held| (0.005..0.2).contains(held)) {
        Some(held) => ((held * 1e3).round() / 1e3, "as wide as the closed gripper is open"),
        None => (USUAL_M, "its size is not in the log"),
    }
}
