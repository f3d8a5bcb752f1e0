//! Objects that are inserted beside the socket of the scene.
//!
//! Such an object is below the rim of the socket: where the shape of the socket's body is, in the wall of the hole, or at a height to which the
//! object does not come when it stands elsewhere.

use super::rests::{SCENE_ERROR, gap_of, rests};
use super::survey::Survey;
use super::{in_scene, median, mm};
use crate::derive::convex_gap::gaps;
use nalgebra::{Point3, Vector3};
use std::ops::Range;
use teachtree_base::scene::{Body, Part, Role, Scene, Socket};
use teachtree_logs::issue::{Issue, IssueKind};

/// Distance beyond the radius of a socket within which insertions are searched, m.
const BESIDE: f64 = 0.050;
/// A plug point is in something when it is this far below the rim, m: until then it may tilt over the edge.
const BELOW: f64 = 5e-3;
/// Minimum depth of an insertion without shapes, m.
const DEEP: f64 = 0.010;
/// And is guided: it deviates from a line along the axis by less than this, m, which a hand without a hole does not.
const GUIDED: f64 = 3e-3;
/// The wall of a hole is thicker than this, m.
const WALL: f64 = 2e-3;
/// The part of an object that enters a hole ends within this length of the plug point, m. A ring that is put on a peg extends beyond it.
const TIP: f64 = 3e-3;
/// It lasts at least this long, s.
const LASTS: f64 = 0.3;
/// Insertions into one hole differ by less than this, m.
const ALIKE: f64 = 5e-3;

/// A socket of a body.
#[derive(Clone, Copy)]
pub struct Hole<'s> {
    /// The body, as an index of the scene.
    pub body: usize,
    /// The name of the socket.
    pub name: &'s str,
    /// The socket.
    pub socket: &'s Socket,
}

/// An object below the rim of a socket, beside it.
struct Visit {
    samples: Range<usize>,
    /// The depth of the plug point at the deepest sample, m.
    depth: f64,
    /// The sample.
    deepest: usize,
    /// Offset of the plug point from the axis there, frame of the body of the socket, m.
    beside: Vector3<f64>,
    /// How far the plug point is from that line during the visit at most, m.
    deviation: f64,
}

/// The sockets that are beside the insertions.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    pairs(scene, survey).filter_map(|(hole, object)| inserted_beside(scene, survey, &hole, object)).collect()
}

/// Each socket with each object that it takes, by its index, whose position the log has.
pub fn pairs<'s>(scene: &'s Scene, survey: &'s Survey) -> impl Iterator<Item = (Hole<'s>, usize)> {
    let bodies = scene.bodies.values().enumerate();
    let holes = bodies.flat_map(|(body, it)| it.sockets.iter().map(move |(name, socket)| Hole { body, name, socket }));
    holes.flat_map(move |hole| {
        let logged = scene.bodies.iter().zip(&survey.bodies).enumerate();
        let taken = logged.filter(move |(index, ((name, body), samples))| {
            body.role == Role::Object && samples.is_logged && *index != hole.body && hole.socket.takes(name)
        });
        taken.map(move |(index, _)| (hole, index))
    })
}

/// Where the plug point of an object is as seen from the rim of a socket: along the axis, and beside it in the frame of the socket's body, m.
pub fn seen(scene: &Scene, survey: &Survey, hole: &Hole, object: usize, sample: usize) -> Option<(f64, Vector3<f64>)> {
    let (_, body) = scene.bodies.get_index(object)?;
    let holder = survey.pose(hole.body, sample)?;
    let plug = survey.pose(object, sample)? * body.plug_point();
    let seen = hole.socket.frame().see(&holder.inverse_transform_point(&plug));
    Some((seen.height, seen.beside))
}

fn inserted_beside(scene: &Scene, survey: &Survey, hole: &Hole, object: usize) -> Option<Issue> {
    let radius = hole.socket.radius.0;
    let places: Vec<Option<(f64, Vector3<f64>)>> =
        (0..survey.time.len()).map(|sample| seen(scene, survey, hole, object, sample)).collect();
    let at = |sample: usize| places.get(sample).copied().flatten();
    let inserted = &survey.bodies.get(object)?.is_inserted;
    let is_in = |sample: usize| inserted.get(sample) == Some(&true);
    let was_in = (0..places.len()).any(|sample| {
        is_in(sample) && at(sample).is_some_and(|(height, beside)| height < -BELOW && beside.norm() < 2.0 * radius)
    });
    if was_in {
        return None;
    }
    let is_beside = |sample: usize| {
        at(sample).is_some_and(|(height, beside)| {
            let deepest = hole.socket.depth.0 + BESIDE;
            (-deepest..-BELOW).contains(&height) && beside.norm() < radius + BESIDE && !is_in(sample)
        })
    };
    let visits = survey.runs(LASTS, is_beside);
    let visits: Vec<Visit> = visits.into_iter().filter_map(|samples| visit(samples, at)).collect();
    let elsewhere = heights_elsewhere(survey, object, radius, at);
    let is_impossible = |visit: &&Visit| {
        overlaps(scene, survey, hole, object, visit.deepest) || is_in_wall(scene, survey, hole, object, visit)
    };
    let overlapping: Vec<&Visit> = visits.iter().filter(is_impossible).collect();
    let stands = |visit: &Visit| elsewhere.iter().any(|height| (height + visit.depth).abs() < ALIKE);
    let guided = |visit: &&Visit| visit.depth > DEEP && visit.deviation < GUIDED && !stands(visit);
    let guided: Vec<&Visit> = visits.iter().filter(guided).collect();
    let proved = match (overlapping.is_empty(), elsewhere.is_empty() && guided.len() < 2) {
        (false, _) => overlapping,
        // Nothing shows at which height the object stands on a support.
        (true, true) => return None,
        (true, false) => guided,
    };
    report(scene, survey, hole, object, &proved)
}

fn visit(samples: Range<usize>, at: impl Fn(usize) -> Option<(f64, Vector3<f64>)>) -> Option<Visit> {
    let places = || samples.clone().filter_map(|sample| Some((sample, at(sample)?)));
    let (deepest, (height, beside)) = places().min_by(|(_, (one, _)), (_, (other, _))| one.total_cmp(other))?;
    let deviation = places().map(|(_, (_, it))| (it - beside).norm()).fold(0.0, f64::max);
    Some(Visit { deepest, depth: -height, beside, deviation, samples })
}

/// Whether an object overlaps the body of a socket.
fn overlaps(scene: &Scene, survey: &Survey, hole: &Hole, object: usize, sample: usize) -> bool {
    gap_of(scene, survey, object, hole.body, (sample, 0.0)).is_some_and(|gap| gap.width < -SCENE_ERROR)
}

/// Whether an object at its deepest sample is in the wall of a hole in a body without a shape. The wall begins where the plug of the object would be in the hole.
fn is_in_wall(scene: &Scene, survey: &Survey, hole: &Hole, object: usize, visit: &Visit) -> bool {
    let found = || {
        let (_, holder) = scene.bodies.get_index(hole.body)?;
        let (_, body) = scene.bodies.get_index(object)?;
        let pose = survey.pose(object, visit.deepest)?;
        let turn = survey.pose(hole.body, visit.deepest)?.rotation;
        let into = pose.inverse_transform_vector(&(turn * -Vector3::from(hole.socket.axis)));
        let plug = plug_of(body, &into).filter(|_| holder.parts.is_empty() && visit.depth > DEEP)?;
        let mut in_hole = *pose;
        in_hole.translation.vector -= turn * visit.beside;
        gaps((&plug, pose), (&plug, &in_hole), 0.0).into_iter().map(|gap| gap.width).min_by(f64::total_cmp)
    };
    found().is_some_and(|width| width < WALL)
}

/// The part of a body at its plug point, alone; `None` where it extends beyond this point in a direction, which is unit and in the frame of the body.
fn plug_of(body: &Body, into: &Vector3<f64>) -> Option<Body> {
    let distance =
        |part: &Part, point: &Point3<f64>| part.shape.distance(&part.pose().inverse_transform_point(point).coords);
    let (tip, beyond) = (body.plug_point(), body.plug_point() + into * TIP);
    let of_tip = |one: &&Part, other: &&Part| distance(one, &tip).total_cmp(&distance(other, &tip));
    let part = body.parts.iter().min_by(of_tip)?;
    (distance(part, &beyond) > 0.0).then(|| Body { parts: vec![part.clone()], ..body.clone() })
}

/// How high above the rim of a socket the plug point of an object is when the object rests far from the socket, m.
fn heights_elsewhere(
    survey: &Survey,
    object: usize,
    radius: f64,
    at: impl Fn(usize) -> Option<(f64, Vector3<f64>)>,
) -> Vec<f64> {
    let far = rests(survey, object, |_| true).into_iter().filter_map(|rest| at(rest.start + rest.len() / 2));
    far.filter(|(_, beside)| beside.norm() > radius + BESIDE).map(|(height, _)| height).collect()
}

fn report(scene: &Scene, survey: &Survey, hole: &Hole, object: usize, visits: &[&Visit]) -> Option<Issue> {
    let part = |axis: usize| median(visits.iter().map(|visit| visit.beside[axis]).collect());
    let offset = Vector3::new(part(0)?, part(1)?, part(2)?);
    let radius = hole.socket.radius.0;
    if offset.norm() <= radius.max(ALIKE) || visits.iter().any(|visit| (visit.beside - offset).norm() > ALIKE) {
        return None;
    }
    let depth = median(visits.iter().map(|visit| visit.depth).collect())?;
    let (name, _) = scene.bodies.get_index(object)?;
    let (its, holder) = scene.bodies.get_index(hole.body)?;
    let times = if visits.len() > 1 { format!(" {} times", visits.len()) } else { String::new() };
    let line = if survey.bodies.get(hole.body)?.is_logged {
        let rim = hole.socket.rim.map(|length| length.0);
        let moved = Vector3::from(rim) + offset;
        format!("`rim: {}` of the socket instead of `{}`, or `plug` of `{name}`", in_scene(moved.into()), in_scene(rim))
    } else {
        let found = holder.position.map(|length| length.0);
        let turn = survey.pose(hole.body, 0)?.rotation;
        let moved = Vector3::from(found) + turn * offset;
        format!(
            "`position: {}` of `{its}` instead of `{}`, or `plug` of `{name}`",
            in_scene(moved.into()),
            in_scene(found)
        )
    };
    let message = format!(
        "`{name}` is inserted{times} {} mm beside the socket `{}`, {} mm below its rim: the scene is wrong there ({line})",
        mm(offset.norm()),
        hole.name,
        mm(depth)
    );
    let [start_s, end_s] = survey.span_of(&(visits.first()?.samples.start..visits.last()?.samples.end));
    Some(Issue { kind: IssueKind::MISPLACED_SOCKET, start_s, end_s, channel: format!("{its}.position"), message })
}
