//! Contacts that a log measures: flags and forces of fingers on bodies, and of bodies on each other.

use super::bodies::Body;
use super::hands::side_of;
use super::parts::{Part, Quantity};
use super::words;
use std::collections::BTreeSet;
use teachtree_base::hands::{Finger, Side};

/// The body that stands for everything that no object is.
const ROOM: [&str; 4] = ["env", "table", "ground", "floor"];
/// The share of frames in contact without a force from which forces are not to be relied on.
const MOST_ZERO: f64 = 0.2;

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

/// What touches what.
#[derive(Clone, Debug, PartialEq)]
enum Touch {
    Finger(Side, Finger, String),
    Bodies(String, String),
}

/// The contacts of a log.
#[derive(Default)]
pub struct Contacts {
    /// The channels.
    pub lines: Vec<Line>,
    /// Bodies without a position that carry objects.
    pub supports: BTreeSet<String>,
    /// Why forces of fingers were left out.
    pub left_out: Option<String>,
}

/// Finds the contacts; the parts that are none are left.
pub fn contacts<'a>(parts: Vec<Part<'a>>, bodies: &[Body]) -> (Contacts, Vec<Part<'a>>) {
    let mut found = Contacts::default();
    let mut flags: Vec<(Touch, Part)> = vec![];
    let mut forces: Vec<(Touch, Part)> = vec![];
    let mut rest = vec![];
    for part in parts {
        let touch = match part.quantity {
            Quantity::Flag | Quantity::Number | Quantity::Force => touch(&part, bodies),
            _ => None,
        };
        match touch {
            // Sensors that never touch have no ones.
            Some(touch) if part.quantity == Quantity::Force => forces.push((touch, part)),
            Some(touch) if is_flag(&part) => flags.push((touch, part)),
            _ => rest.push(part),
        }
    }
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
        found.left_out = Some("forces of fingers are zero in many frames in which their flags report a contact".into());
    }
    for (touch, part) in forces {
        let line = match &touch {
            // The forces on all objects count together.
            Touch::Finger(side, finger, object) if reliable => {
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

/// Whether the forces of fingers are there in most frames in which their flags are set.
fn forces_are_reliable(flags: &[(Touch, Part)], forces: &[(Touch, Part)]) -> bool {
    let (mut touching, mut zero) = (0_usize, 0_usize);
    for (touch, flag) in flags.iter().filter(|(touch, _)| matches!(touch, Touch::Finger(..))) {
        let Some((_, force)) = forces.iter().find(|(other, _)| other == touch) else { continue };
        for row in 0..flag.rows() {
            if flag.at(row).first().is_some_and(|value| *value > 0.5) {
                touching += 1;
                let norm = force.at(flag.row_in(row, force)).iter().map(|part| part * part).sum::<f64>().sqrt();
                zero += usize::from(norm < 0.05);
            }
        }
    }
    (zero as f64) < MOST_ZERO * touching.max(1) as f64
}

/// Whether a force points down on average: it is that on what carries.
fn is_downward(part: &Part) -> bool {
    let rows = part.rows();
    let sum: f64 = (0..rows).filter_map(|row| part.at(row).get(2).copied()).filter(|value| value.is_finite()).sum();
    sum < 0.0
}
