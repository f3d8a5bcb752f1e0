//! Forces at wrists: whether a log has the force on the object or on the hand, and their level at rest.

use super::Survey;
use super::bodies::Body;
use super::contacts::Line;
use super::hands::Hand;
use super::motion::{LEAST_S, MOVED_M, WINDOW_S, goes_with};
use super::parts::{Part, distance};
use super::quantiles::{median, quantile};
use super::recorded::{paths, vector};
use super::yaml_scalar::scalar;
use crate::inspect::ColumnReport;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// The sign of a force that nothing shows.
pub const UNKNOWN_SIGN: &str = "taken for the force on the object, as nothing in the log shows the sign; if it is the force on the hand, write `-` before it";

/// An object that is higher than before by this distance is off its table, m.
const LIFTED_M: f64 = 0.03;

/// The least change of a vertical force that is a weight, N.
const LEAST_N: f64 = 0.2;
/// The hand is at rest for this long at the beginning, s.
const REST_S: f64 = 0.3;
/// Speeds are measured over this time, s.
const SPEED_S: f64 = 0.1;

/// Turns a force at the wrist that is that on the hand: it points down, from its level without a load, while an object is carried, or against the motion of what
/// the hand pushes, or with which the hand meets something.
pub fn turn(line: &mut Line, side: Side, hand: &Hand, survey: &Survey) {
    let Some(force) = &hand.force else { return };
    let force = Force { part: force, rest: rest_level(survey, force), turn: sensor_rotation(hand) };
    let is_clear = |rise: &f64| rise.abs() > LEAST_N;
    // Only the bound log has the rotation of a sensor whose link other links carry.
    let rise = match hand.tool.as_ref().is_some_and(|tool| tool.carried_in.is_some()) {
        true => survey.force_rises.get(&side).copied(),
        false => rise_with_objects(&force, survey).or_else(|| rise_with_hand(&force, side, hand, survey)),
    };
    let rise = rise.filter(is_clear);
    let pushed = || is_along_push(&force, side, hand, survey);
    let (is_on_hand, why) = match rise {
        Some(rise) if rise < 0.0 => (true, "it points down while an object is lifted".to_string()),
        Some(_) => (false, "it points up while the object is lifted".to_string()),
        None => match pushed().or_else(|| Some((is_along_motion(&force, hand)?, None))) {
            Some((false, Some(object))) => (true, format!("the hand pushes {object}, which moves against it")),
            Some((true, Some(object))) => (false, format!("the hand pushes {object}, which moves along it")),
            Some((false, None)) => (true, "it points against the motion that ends in a contact".to_string()),
            Some((true, None)) => (false, "it points along the motion that ends in a contact".to_string()),
            None => return,
        },
    };
    let reason = if is_on_hand { "the log has the force on the hand" } else { "on the object" };
    let reason = format!("{reason}: {why}");
    let other = negated(&line.columns);
    let other = if is_on_hand { std::mem::replace(&mut line.columns, other) } else { other };
    line.reason = line.reason.replacen(UNKNOWN_SIGN, &reason, 1)
        + &format!(
            ". If yours has the other sign{}, bind `{}`",
            if force.turn.is_some() { "" } else { ", or the sensor turns with a hand that points down" },
            scalar(&other)
        );
}

/// A force at a wrist.
struct Force<'a> {
    part: &'a Part<'a>,
    /// Its level at rest, in the frame of the sensor, N.
    rest: Option<[f64; 3]>,
    /// How the sensor is turned, if it turns with the hand.
    turn: Option<&'a Part<'a>>,
}

impl Force<'_> {
    /// The change from the level at rest in the frame of the positions, N. A rotation that is not a quaternion cannot be used.
    fn change(&self, row: usize) -> Option<[f64; 3]> {
        let force = Vector3::from(self.part.position(row)?) - Vector3::from(self.rest.unwrap_or_default());
        let Some(turn) = self.turn else { return Some(force.into()) };
        let [w, x, y, z] = turn.at(self.part.row_in(row, turn))[..] else { return None };
        Some((UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9)? * force).into())
    }
}

/// The rotation of a hand if its wrist force is in the frame of the sensor: the messages name another frame than those of the poses.
pub fn sensor_rotation<'a>(hand: &'a Hand) -> Option<&'a Part<'a>> {
    let (force, tool) = (frame_id(hand.force.as_ref()?)?, frame_id(hand.tool.as_ref()?)?);
    hand.rotation.as_ref().filter(|_| force != tool)
}

/// The frame that the header of a message names, without the slash that some programs write before it.
fn frame_id<'a>(part: &Part<'a>) -> Option<&'a str> {
    let mut path = part.members.first()?.name.as_str();
    while let Some((above, _)) = path.rsplit_once('.') {
        path = above;
        let is_header = |name: &str| name.strip_prefix(path) == Some(".header.frame_id");
        if let Some(column) = part.sheet.columns.iter().find(|column| is_header(&column.name)) {
            return only_frame(column);
        }
    }
    part.sheet.columns.iter().find(|column| column.name == "header.frame_id").and_then(only_frame)
}

/// The frame of a column that names one only.
fn only_frame(column: &ColumnReport) -> Option<&str> {
    let [frame] = &column.texts[..] else { return None };
    Some(frame.trim_start_matches('/'))
}

/// How far the vertical force rises from its level at rest while an object is carried above its table, N.
fn rise_with_objects(force: &Force, survey: &Survey) -> Option<f64> {
    let height = |at: [f64; 3]| survey.upright(at)[2];
    let mut lifted = vec![];
    for body in &survey.bodies {
        let (Some(part), Some(start)) = (body.positions.first(), body.start()) else { continue };
        let is_up = |row: &usize| part.position(*row).is_some_and(|at| height(at) > height(start) + LIFTED_M);
        let rows = fast(part, (0..part.rows()).filter(is_up).collect());
        lifted.extend(rows.into_iter().filter_map(|row| force.change(part.row_in(row, force.part))).map(height));
    }
    median(lifted)
}

/// How far the vertical force of each wrist of a bound log rises from its level at rest while an object is carried above its table, N.
pub fn rises(recording: &Recording) -> BTreeMap<Side, f64> {
    let start_s = recording.time.first().copied().unwrap_or_default();
    let before = |row: usize| recording.time.partition_point(|time| *time < recording.time[row] - SPEED_S);
    let mut carried: Vec<usize> = vec![];
    for (_, path) in paths(recording) {
        let Some(start) = path.iter().flatten().next() else { continue };
        let way = |row: usize| path[before(row)].zip(path[row]).map_or(0.0, |(from, to)| (to - from).norm());
        let is_up = |row: &usize| path[*row].is_some_and(|at| at.z > start.z + LIFTED_M);
        carried.extend(fastest((0..path.len()).filter(is_up).collect(), way));
    }
    let rise = |side: Side| {
        let forces = vector(recording, &format!("{side}.palm.force"))?;
        let level =
            |rows: &mut dyn Iterator<Item = usize>| median(rows.filter_map(|row| Some(forces[row]?.z)).collect());
        let at_rest = recording.time.partition_point(|time| *time < start_s + REST_S);
        Some((side, level(&mut carried.iter().copied())? - level(&mut (0..at_rest))?))
    };
    Side::BOTH.into_iter().filter_map(rise).collect()
}

/// Those of these rows in which a point is at least half as fast as in the fastest tenth. What is inserted, pressed or at rest moves slower.
fn fast(part: &Part, rows: Vec<usize>) -> Vec<usize> {
    let step = part.rows_in(SPEED_S);
    let way = |row: usize| Some(distance(part.position(row.checked_sub(step)?)?, part.position(row)?));
    fastest(rows, |row| way(row).unwrap_or_default())
}

/// Those of these rows whose way is at least half of the 90th percentile of their ways.
fn fastest(rows: Vec<usize>, way: impl Fn(usize) -> f64) -> Vec<usize> {
    let top = quantile(rows.iter().map(|row| way(*row)).collect(), 0.9).unwrap_or_default();
    rows.into_iter().filter(|row| way(*row) >= top / 2.0).collect()
}

/// Whether the force points along the motion of an object that the hand moves without holding it, as that on the object does, and the object; `None` if the log does
/// not show it.
fn is_along_push<'a>(force: &Force, side: Side, hand: &Hand, survey: &'a Survey) -> Option<(bool, Option<&'a str>)> {
    /// The force is larger than this, N.
    const FEELS_N: f64 = 0.5;
    /// The least cosine of the angle between them.
    const ALONG: f64 = 0.5;
    let tool = hand.tool.as_ref().filter(|tool| hand.tips.is_empty() && tool.carried_in.is_none())?;
    force.rest?;
    let gripper = survey.grippers.get(&side);
    let way = |part: &Part, from: usize, to: usize| {
        Some(Vector3::from(part.position(to)?) - Vector3::from(part.position(from)?))
    };
    let of_body = |body: &'a Body| {
        let (part, start) = (body.positions.first()?, body.start()?);
        let step = part.rows_in(WINDOW_S);
        let cosine = |row: usize| {
            let (from, middle) = (row - step, row - step / 2);
            let moved = way(part, from, row).filter(|moved| moved.norm() > MOVED_M)?;
            let of_tool = way(tool, part.row_in(from, tool), part.row_in(row, tool))?;
            let lifted_m = survey.upright(part.position(row)?)[2] - survey.upright(start)[2];
            let is_held = gripper.is_some_and(|gripper| gripper.is_closed(part.time_s(middle)));
            let is_pushed = !is_held && lifted_m < LIFTED_M && goes_with(&moved, &of_tool);
            let pushes = Vector3::from(force.change(part.row_in(middle, force.part))?);
            (is_pushed && pushes.norm() > FEELS_N).then(|| pushes.dot(&moved) / (pushes.norm() * moved.norm()))
        };
        let cosines: Vec<f64> = (step..part.rows()).filter_map(cosine).collect();
        (cosines.len() >= part.rows_in(LEAST_S)).then(|| Some((median(cosines)?, body.name.as_str())))?
    };
    let shown = survey.bodies.iter().filter(|body| body.moves()).filter_map(of_body);
    let (cosine, object) = shown.max_by(|(one, _), (other, _)| one.abs().total_cmp(&other.abs()))?;
    (cosine.abs() > ALONG).then_some((cosine > 0.0, Some(object)))
}

/// Whether the force points along the motion with which the hand meets something, as that on the object does; `None` if the log does not show it.
fn is_along_motion(force: &Force, hand: &Hand) -> Option<bool> {
    /// The least force of a contact, N and as a share of the largest one, and the least way before it, m, in this time, s.
    const CONTACT: (f64, f64) = (0.5, 0.1);
    const WAY_M: f64 = 0.005;
    const BEFORE_S: f64 = 0.5;
    /// It lasts this long, s: a shorter one is a blow.
    const LASTS_S: f64 = 0.2;
    /// The least cosine of the angle between them.
    const ALONG: f64 = 0.5;
    let tool = hand.tool.as_ref()?;
    force.rest?;
    let rows: Vec<Option<[f64; 3]>> = (0..force.part.rows()).map(|row| force.change(row)).collect();
    let norm = |vector: &[f64; 3]| distance(*vector, [0.0; 3]);
    let most = quantile(rows.iter().flatten().map(norm).collect(), 0.98)?;
    let limit = (most * CONTACT.1).max(CONTACT.0);
    let is_above = |row: usize| rows[row].as_ref().is_some_and(|it| norm(it) > limit);
    let before = force.part.rows_in(BEFORE_S);
    let lasts = force.part.rows_in(LASTS_S);
    let is_steady = |row: usize| (row..=row + lasts).all(|row| row < rows.len() && is_above(row));
    let begins = (before..rows.len()).filter(|row| is_steady(*row) && !(row - before..*row).any(is_above));
    let cosines: Vec<f64> = begins
        .filter_map(|row| {
            let at = |row: usize| tool.position(force.part.row_in(row, tool));
            let (from, to, pushes) = (at(row - before)?, at(row)?, rows[row]?);
            let way = distance(from, to);
            let dot: f64 = (0..3).map(|axis| (to[axis] - from[axis]) * pushes[axis]).sum();
            (way > WAY_M).then(|| dot / (way * norm(&pushes)))
        })
        .collect();
    match () {
        () if cosines.is_empty() => None,
        () if cosines.iter().all(|cosine| *cosine > ALONG) => Some(true),
        () if cosines.iter().all(|cosine| *cosine < -ALONG) => Some(false),
        () => None,
    }
}

/// How far the vertical force is higher with a closed gripper that is above the place where it closed than with an open one that is above its lowest place, N.
fn rise_with_hand(force: &Force, side: Side, hand: &Hand, survey: &Survey) -> Option<f64> {
    let gripper = survey.grippers.get(&side)?;
    let place = hand.tool.as_ref().or_else(|| hand.tips.values().next())?;
    let height = |at: [f64; 3]| survey.upright(at)[2];
    let height_of = |row: usize| place.position(row).map(height);
    let lowest = (0..place.rows()).filter_map(height_of).fold(f64::INFINITY, f64::min);
    let (mut lifted, mut free, mut from) = (vec![], vec![], None);
    for row in 0..place.rows() {
        let Some(at) = height_of(row) else { continue };
        let is_closed = gripper.is_closed(place.time_s(row));
        let closed_at = if is_closed { *from.get_or_insert(at) } else { lowest };
        let rows = if is_closed { &mut lifted } else { &mut free };
        rows.extend((at > closed_at + LIFTED_M).then_some(row));
        from = from.filter(|_| is_closed);
    }
    let level = |rows: Vec<usize>| {
        median(rows.into_iter().filter_map(|row| force.change(place.row_in(row, force.part))).map(height).collect())
    };
    Some(level(fast(place, lifted))? - level(free)?)
}

/// Columns with the other sign.
fn negated(columns: &str) -> String {
    let negated = |column: &str| match column.strip_prefix('-') {
        Some(column) => column.to_string(),
        None => format!("-{column}"),
    };
    let Some(list) = columns.strip_prefix("[\"").and_then(|list| list.strip_suffix("\"]")) else {
        return negated(columns);
    };
    let columns: Vec<String> = list.split("\", \"").map(|column| format!("\"{}\"", negated(column))).collect();
    format!("[{}]", columns.join(", "))
}

/// The middle of a force at the beginning, where the hand is at rest. A force of another table that begins later has no sample there.
fn rest_level(survey: &Survey, force: &Part) -> Option<[f64; 3]> {
    let parts = survey.hands.values().flat_map(|hand| hand.tool.iter().chain(hand.tips.values()).chain(&hand.force));
    let starts = parts.chain(survey.bodies.iter().flat_map(|body| &body.positions)).map(|part| part.sheet.start_s);
    if force.sheet.start_s > starts.fold(f64::INFINITY, f64::min) + REST_S / 3.0 {
        return None;
    }
    let rows = ((REST_S / force.sheet.duration_s.max(REST_S)) * force.rows() as f64).ceil() as usize;
    let first: Vec<[f64; 3]> = (0..rows.max(1)).filter_map(|row| force.position(row)).collect();
    let mean = |axis: usize| first.iter().filter_map(|at| at.get(axis)).sum::<f64>() / first.len().max(1) as f64;
    Some([0, 1, 2].map(mean))
}

/// A line that tares forces at the wrist that begin off zero while the hand is at rest.
pub fn tare(survey: &Survey) -> String {
    const BIAS_N: f64 = 0.2;
    let is_fixed = survey.is_fixed_tool();
    let mut channels = vec![];
    for (side, hand) in &survey.hands {
        let Some([x, y, z]) = hand.force.as_ref().and_then(|force| rest_level(survey, force)) else { continue };
        let bias = (x * x + y * y + z * z).sqrt();
        if bias > BIAS_N && bias.is_finite() {
            let part = if !hand.tips.is_empty() || is_fixed { "palm" } else { "wrist" };
            channels.push(format!("{side}.{part}.force"));
        }
    }
    if channels.is_empty() {
        return String::new();
    }
    format!(
        "\ntare: {{channels: [{}], from: 0 s, to: 0.3 s}}    # the force is not zero at the beginning; leave this out if the hand holds something there\n",
        channels.join(", ")
    )
}
