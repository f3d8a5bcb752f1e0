//! Bodies whose place the log shows: a fixture that stands elsewhere in each recording is where an object first touched it, or came to rest in it.

use super::body_poses::{BodyPoses, columns, vector};
use super::{BindingFile, Instant, Place};
use crate::clean::preprocess;
use crate::clean::unknown_columns::UnknownColumn;
use nalgebra::Point3;
use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::quantity::Quantity;
use teachtree_base::recording::Recording;
use teachtree_logs::issue::{Issue, IssueKind};

/// A contact that ends earlier is passed over, s.
const LASTS_SECS: f64 = 0.1;
/// The plug point at a contact is its median over this time: where a pose jumps as the contact begins, one row says little, s.
const LOOKED_AT_SECS: f64 = 0.2;
/// A rest lasts at least this long, s,
const RESTS_SECS: f64 = 0.5;
/// the plug point stays within this distance of where the rest began, m,
const RESTS_WITHIN: f64 = 0.002;
/// and it is farther than this from where the plug point was at first, m.
const MOVED: f64 = 0.020;

/// Moves each body of `places` to where the log shows it. A body whose place the log does not show loses its sockets, and that is an issue:
/// no object can be found in them.
///
/// # Errors
/// When a body or object is not in the scene, or nothing says when the two touch.
pub fn learn(recording: &mut Recording, file: &BindingFile) -> Result<Vec<Issue>, InputError> {
    check(recording, file)?;
    let mut issues = vec![];
    for (name, place) in &file.binding.places {
        let found = find(recording, name, place, file)?;
        let Some(body) = recording.scene.bodies.get_mut(name) else { continue };
        if let Some(found) = found {
            for (length, found) in body.position.iter_mut().zip(&found.coords) {
                *length = Quantity(length.0 + found);
            }
        } else {
            body.sockets.clear();
            let lacks = match place.when {
                Instant::FirstContact => "never touches it while its position is measured",
                Instant::Rest => "never comes to rest away from its start",
            };
            let message = format!("`{}` {lacks}; no object is found in its sockets", place.by);
            issues.push(preprocess::over_all(&recording.time, IssueKind::UNKNOWN_PLACE, name, message));
        }
    }
    Ok(issues)
}

/// Checks that the scene has the bodies, and that a channel shows when they touch.
///
/// # Errors
/// When a body is not in the scene, or nothing shows when two touch.
pub fn check(recording: &Recording, file: &BindingFile) -> Result<(), InputError> {
    for (name, place) in &file.binding.places {
        for body in [name, &place.by] {
            if !recording.scene.bodies.contains_key(body) {
                return Err(file.error("places", UnknownColumn::Body(body).message(body, &recording.scene)));
            }
        }
        if place.when == Instant::FirstContact {
            touches(recording, name, place, file).map(drop)?;
        }
    }
    Ok(())
}

/// The plug point of the object at the instant, reference frame, m.
fn find(
    recording: &Recording,
    name: &str,
    place: &Place,
    file: &BindingFile,
) -> Result<Option<Point3<f64>>, InputError> {
    let object = BodyPoses::new(recording, &place.by);
    let plug = |row: usize| Some(object.pose(row)? * object.body?.plug_point());
    let lasts = |rows: &Range<usize>, least_secs: f64| {
        let at = |row: usize| recording.time.get(row).copied().unwrap_or_default();
        at(rows.end - 1) - at(rows.start) >= least_secs
    };
    let rows = recording.time.len();
    Ok(match place.when {
        Instant::FirstContact => {
            let contacts = runs(rows, touches(recording, name, place, file)?);
            contacts.into_iter().find(|rows| lasts(rows, LASTS_SECS)).and_then(|rows| {
                let from = recording.time.get(rows.start)?;
                let to = recording.time.partition_point(|time| *time <= from + LOOKED_AT_SECS);
                median(rows.start..to.min(rows.end), &plug)
            })
        }
        Instant::Rest => {
            let first = (0..rows).find_map(plug);
            let moved = |place: &Point3<f64>| first.is_some_and(|first| (place - first).norm() > MOVED);
            let rests = rests(0..rows, &plug).into_iter().filter(|rows| lasts(rows, RESTS_SECS));
            rests.filter_map(|rows| median(rows, &plug)).rfind(moved)
        }
    })
}

/// The median place of the plug point, component by component.
fn median(rows: Range<usize>, plug: &impl Fn(usize) -> Option<Point3<f64>>) -> Option<Point3<f64>> {
    let places: Vec<Point3<f64>> = rows.filter_map(plug).collect();
    let middle = |axis: usize| {
        let mut values: Vec<f64> = places.iter().filter_map(|place| place.coords.get(axis).copied()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    Some(Point3::new(middle(0)?, middle(1)?, middle(2)?))
}

/// Stretches of rows in which a condition holds.
fn runs(rows: usize, holds: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = vec![];
    for row in (0..rows).filter(|row| holds(*row)) {
        match runs.last_mut() {
            Some(run) if run.end == row => run.end += 1,
            _ => runs.push(row..row + 1),
        }
    }
    runs
}

/// Divides rows where the plug point has left the surroundings of where it was.
fn rests(rows: Range<usize>, plug: &impl Fn(usize) -> Option<Point3<f64>>) -> Vec<Range<usize>> {
    let mut rests: Vec<(Point3<f64>, Range<usize>)> = vec![];
    for row in rows {
        let Some(at) = plug(row) else { continue };
        match rests.last_mut() {
            Some((from, rest)) if rest.end == row && (at - *from).norm() <= RESTS_WITHIN => rest.end += 1,
            _ => rests.push((at, row..row + 1)),
        }
    }
    rests.into_iter().map(|(_, rest)| rest).collect()
}

/// Whether the two bodies touch in a row: the logged flag or force of their contact, else the force of the palm that the object is fixed to.
fn touches<'a>(
    recording: &'a Recording,
    name: &str,
    place: &Place,
    file: &BindingFile,
) -> Result<Box<dyn Fn(usize) -> bool + 'a>, InputError> {
    let contacts = [format!("contact.{}.{name}", place.by), format!("contact.{name}.{}", place.by)];
    if let Some(flag) = contacts.iter().find_map(|channel| recording.columns.get(channel)) {
        return Ok(Box::new(|row| flag.values.get(row).is_some_and(|flag| *flag > 0.5)));
    }
    let palm = recording.scene.bodies.get(&place.by).and_then(|body| body.fixed_to).map(|side| format!("{side}.palm"));
    let channels = contacts.into_iter().chain(palm).map(|owner| format!("{owner}.force"));
    let force = channels.into_iter().find_map(|channel| columns(recording, &channel, ["x", "y", "z"]));
    match (force, place.above) {
        (Some(force), Some(above)) => Ok(Box::new(move |row| vector(&force, row).norm() > above.0)),
        (Some(_), None) => {
            Err(file
                .error(name, "expected `above`, the force from which on it is touched, such as `above: 3 N`".into()))
        }
        (None, _) => {
            let by = &place.by;
            let message = format!(
                "no channel shows when `{by}` touches `{name}`: expected `contact.{by}.{name}`, its force, or the force of the palm that `{by}` is `fixed_to`"
            );
            Err(file.error("places", message))
        }
    }
}
