//! The names of a canonical log: what a column measures, read off its name (docs/logs.md).
//!
//! ```text
//! time                                            s
//! <hand>.<finger>.position.{x,y,z}                m, reference frame
//! <hand>.<finger>.force.{x,y,z}                   N, of the fingertip on the object, reference frame
//! <hand>.<finger>.noise                           N, of that force at rest; `tare` in a binding gives it
//! <hand>.<finger>.level                           N, from which force on it is in contact; learned where it is left out
//! <hand>.<finger>.contact                         1 while the finger touches an object
//! <hand>.<finger>.contact.<object>                1 while it touches this object
//! <hand>.palm.rotation.{w,x,y,z}                  reference_from_palm
//! <hand>.gripper.closed, <hand>.gripper.opening   1 while closed; m
//! <body>.position.{x,y,z} .rotation.{w,x,y,z} .velocity.{x,y,z} .angular_velocity.{x,y,z}
//! <object>.depth.<socket>                         m, positive inside
//! <object>.angle.<socket>                         rad, of a latch or a valve that never leaves its socket
//! contact.<a>.<b>                                 1 while they touch
//! contact.<a>.<b>.force.{x,y,z}                   N, of b on a, reference frame
//! contact.<a>.<b>.normal.{x,y,z}                  unit normal from b to a, reference frame
//! left.label, right.label, both.label             true primitive, text, never read by the rules
//! left.task, right.task                           true task, text, never read by the rules
//! ```

use crate::base::channels::Shape;
use crate::base::hands::{Finger, Side};
use crate::base::units::{Dimension, compound};

/// What a column is, as far as its name shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Meaning<'a> {
    /// The name without the component: `right.thumb.force`.
    pub channel: &'a str,
    /// The component among `shape.components()`.
    pub component: usize,
    /// What the whole channel is.
    pub shape: Shape,
    /// Its dimension.
    pub dimension: Dimension,
    /// The bodies that the name mentions, which a scene has to know.
    pub bodies: [Option<&'a str>; 2],
}

/// What a channel is, as far as its name shows: its shape, its dimension and the bodies it mentions.
type Channel<'a> = (Shape, Dimension, [Option<&'a str>; 2]);

/// The meaning of a column, or `None` for a name that is not canonical.
pub fn meaning(column: &str) -> Option<Meaning<'_>> {
    if let Some((shape, dimension, bodies)) = channel(column)
        && shape.components().len() == 1
    {
        return Some(Meaning { channel: column, component: 0, shape, dimension, bodies });
    }
    let (name, last) = column.rsplit_once('.')?;
    let (shape, dimension, bodies) = channel(name)?;
    let component = shape.components().iter().position(|component| *component == last)?;
    (shape.components().len() > 1).then_some(Meaning { channel: name, component, shape, dimension, bodies })
}

/// What a channel is by its name without component, or `None` for a name that is not canonical.
pub fn channel(name: &str) -> Option<Channel<'_>> {
    let parts: Vec<&str> = name.split('.').collect();
    if parts.iter().any(|part| part.is_empty()) {
        return None;
    }
    if let [side, rest @ ..] = parts.as_slice()
        && Side::from_name(side).is_some()
    {
        return hand_channel(rest);
    }
    Some(match *parts.as_slice() {
        ["contact", a, b] => (Shape::Bool, Dimension::NONE, [Some(a), Some(b)]),
        ["contact", a, b, "force"] => (Shape::Vec3, Dimension::FORCE, [Some(a), Some(b)]),
        ["contact", a, b, "normal"] => (Shape::Vec3, Dimension::NONE, [Some(a), Some(b)]),
        ["contact" | "both" | "time", ..] => return None,
        [body, "position"] => (Shape::Vec3, Dimension::LENGTH, [Some(body), None]),
        [body, "rotation"] => (Shape::Rotation, Dimension::NONE, [Some(body), None]),
        [body, "velocity"] => (Shape::Vec3, Dimension::SPEED, [Some(body), None]),
        [body, "angular_velocity"] => (Shape::Vec3, Dimension::ANGULAR_SPEED, [Some(body), None]),
        [body, "angle", _socket] => (Shape::Scalar, Dimension::ANGLE, [Some(body), None]),
        [body, "depth", _socket] => (Shape::Scalar, Dimension::LENGTH, [Some(body), None]),
        _ => return None,
    })
}

fn hand_channel<'a>(rest: &[&'a str]) -> Option<Channel<'a>> {
    let finger = |name: &str| Finger::from_name(name).is_some();
    Some(match *rest {
        [name, "position"] if finger(name) => (Shape::Vec3, Dimension::LENGTH, [None, None]),
        [name, "noise" | "level"] if finger(name) => (Shape::Scalar, Dimension::FORCE, [None, None]),
        [name, "force"] if finger(name) => (Shape::Vec3, Dimension::FORCE, [None, None]),
        [name, "contact"] if finger(name) => (Shape::Bool, Dimension::NONE, [None, None]),
        [name, "contact", object] if finger(name) => (Shape::Bool, Dimension::NONE, [Some(object), None]),
        ["palm", "rotation"] => (Shape::Rotation, Dimension::NONE, [None, None]),
        ["gripper", "closed"] => (Shape::Bool, Dimension::NONE, [None, None]),
        ["gripper", "opening"] => (Shape::Scalar, Dimension::LENGTH, [None, None]),
        _ => return None,
    })
}

/// Whether this column is ground truth: text that no rule reads.
pub fn is_label(column: &str) -> bool {
    matches!(column, "left.label" | "right.label" | "both.label" | "left.task" | "right.task")
}

/// Whether a body may have this name: it must not be taken for another part of a channel name.
pub fn is_body_name(name: &str) -> bool {
    let reserved = Side::from_name(name).is_some() || matches!(name, "contact" | "both" | "time");
    !name.is_empty()
        && !reserved
        && !name.contains(|c: char| c == '.' || c == ',' || c.is_whitespace() || c.is_control())
}

/// Splits `right.thumb.force.x [mN]` into name and unit; the unit is `None` when it is left out. The place in a list, `state[3]`, is no unit.
pub fn split_unit(header: &str) -> (&str, Option<&str>) {
    let header = header.trim();
    let is_place = |text: &str| text.contains('<') || text.bytes().all(|byte| byte.is_ascii_digit());
    match header.strip_suffix(']').and_then(|head| head.rsplit_once('[')) {
        Some((name, unit)) if unit.is_empty() || !is_place(unit) => (name.trim_end(), Some(unit.trim())),
        _ => (header, None),
    }
}

/// Splits a title into name and unit where brackets hold a unit, `F_x [N]` or `F_x (N)`; else they are part of the name, as in `state[3]`.
pub fn split_known_unit(title: &str) -> (&str, Option<&str>) {
    let title = title.trim();
    let is_unit = |unit: &str| !unit.is_empty() && !unit.starts_with('1') && compound(unit).is_ok();
    let (name, unit) = match title.strip_suffix(')').and_then(|head| head.rsplit_once('(')) {
        Some((name, unit)) => (name.trim_end(), Some(unit.trim())),
        None => split_unit(title),
    };
    match unit {
        Some(unit) if is_unit(unit) && !name.is_empty() => (name, Some(unit)),
        _ => (title, None),
    }
}

/// The known name nearest to `name`, if it is near enough to be meant: at most a third of its letters differ.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // A name this long is no slip of the pen, and the comparison takes the product of the lengths.
    const LONGEST: usize = 100;
    let length = name.chars().count();
    if length > LONGEST {
        return None;
    }
    known
        .into_iter()
        .filter(|other| other.chars().count() <= LONGEST)
        .map(|other| (distance(name, other), other))
        .filter(|(distance, _)| *distance > 0 && distance * 3 <= length)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, other)| other)
}

/// The number of letters to insert, delete, replace or swap with their neighbour.
fn distance(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    // The last rows of the table: the one before the last knows what a swap costs.
    let (mut before, mut last): (Vec<usize>, Vec<usize>) = (vec![], (0..=to.len()).collect());
    let mut left = None;
    for (i, a) in from.chars().enumerate() {
        let mut row = vec![i + 1];
        for (j, b) in to.iter().enumerate() {
            let at = |row: &[usize], column: usize| row.get(column).copied().unwrap_or(usize::MAX - 1);
            let replaced = at(&last, j) + usize::from(a != *b);
            let mut best = replaced.min(at(&last, j + 1) + 1).min(at(&row, j) + 1);
            if let Some(j) = j.checked_sub(1)
                && left == Some(*b)
                && to.get(j) == Some(&a)
            {
                best = best.min(at(&before, j) + 1);
            }
            row.push(best);
        }
        before = std::mem::replace(&mut last, row);
        left = Some(a);
    }
    last.last().copied().unwrap_or_default()
}
