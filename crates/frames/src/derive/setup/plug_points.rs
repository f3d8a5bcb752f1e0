//! Objects without a plug point that rest in a socket with their origin above its rim: their lower end enters it, and the rules look for the origin.

use super::insertions::{Hole, pairs, seen};
use super::rests::rests;
use super::survey::Survey;
use super::{in_scene, mm};
use nalgebra::{Point3, Vector3};
use teachtree_base::geometry::Solid;
use teachtree_base::scene::{Body, Scene};
use teachtree_logs::issue::{Issue, IssueKind};

/// The lower end of an object is at most this far from its origin, m; it is searched in as many steps.
const LONGEST: f64 = 0.15;
const STEPS: u32 = 150;
/// The lower end is this far below the rim, m: otherwise the object stands on it. Without a shape, the origin is as far above it.
const DEEP: f64 = 0.01;
/// The origin of an object that is not in a socket is at most this far below the rim, m.
const BELOW: f64 = 0.005;

/// The objects that lack a plug point.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    pairs(scene, survey).filter_map(|(hole, object)| without_plug(scene, survey, &hole, object)).collect()
}

fn without_plug(scene: &Scene, survey: &Survey, hole: &Hole, object: usize) -> Option<Issue> {
    let (name, body) = scene.bodies.get_index(object)?;
    let samples = survey.bodies.get(object)?;
    // A body turns in a bearing without axial travel.
    if body.plug.is_some() || hole.socket.pitch.is_some() || samples.is_inserted.contains(&true) {
        return None;
    }
    let found = rests(survey, object, |_| true).into_iter().find_map(|rest| {
        let middle = rest.start + rest.len() / 2;
        let (height, beside) = seen(scene, survey, hole, object, middle)?;
        let turn = survey.pose(hole.body, middle)?.rotation;
        let into = survey.pose(object, middle)?.inverse_transform_vector(&(turn * -Vector3::from(hole.socket.axis)));
        let end = (!body.parts.is_empty()).then(|| end(body, &into));
        let is_in = end.map_or(height > DEEP, |end| end > height + DEEP);
        ((-BELOW..LONGEST).contains(&height) && beside.norm() < hole.socket.radius.0 && is_in)
            .then_some((rest, height, into, end))
    });
    let (rest, height, into, end) = found?;
    let line = match end {
        Some(end) => format!("`plug: {}`", in_scene((into * end).into())),
        None => format!("`plug` with its lower end, which is beyond `{}`", in_scene((into * height).into())),
    };
    let [start_s, end_s] = survey.span_of(&rest);
    let message = format!(
        "its origin never enters the socket `{}`, and rests {} mm above the rim, on the axis: if `{name}` is in the socket there, write {line}, the point that enters",
        hole.name,
        mm(height)
    );
    Some(Issue { kind: IssueKind::MISPLACED_SOCKET, start_s, end_s, channel: format!("{name}.position"), message })
}

/// How far the shape of a body extends from its origin in a direction, which is unit and in the frame of the body, m.
fn end(body: &Body, direction: &Vector3<f64>) -> f64 {
    let solid = Solid::new(body);
    let lengths = (0..=STEPS).rev().map(|step| LONGEST * f64::from(step) / f64::from(STEPS));
    let is_in = |length: &f64| solid.distance(&Point3::from(direction * *length)) <= 1e-6;
    lengths.into_iter().find(is_in).unwrap_or_default()
}
