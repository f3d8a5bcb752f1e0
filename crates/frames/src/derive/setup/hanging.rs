//! Objects that hang in the air at rest: a table that the scene has too low, or that it lacks.

use super::rests::{SCENE_ERROR, gap, gap_of, objects, rests, samples};
use super::survey::Survey;
use super::{in_scene, median, mm};
use nalgebra::Vector3;
use std::ops::Range;
use teachtree_base::geometry::Solid;
use teachtree_base::scene::{Role, Scene};
use teachtree_logs::issue::{Issue, IssueKind};

/// A hand whose fingertips are this far from an object holds nothing of it, m.
const AWAY: f64 = 0.050;
/// The gaps below an object at rest differ by less than this, m, where the scene is wrong.
const ALIKE: f64 = 5e-3;
/// Smallest gap below an object at which nothing carries it, m.
const DEEPEST: f64 = 1.0;
/// The search for the surface below ends this near to it, m, or after as many steps.
const REACHED: f64 = 0.1e-3;
const SEARCHES: usize = 200;

/// How an object hangs in the air.
struct HangingRest {
    /// The gap to what is below, m, and the body; nothing where nothing is below.
    below: Option<(f64, usize)>,
    rest: Range<usize>,
}

/// The objects that hang in the air at rest.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    let is_shaped = scene.bodies.values().all(|body| !body.parts.is_empty());
    if !is_shaped || scene.up().norm() == 0.0 || !survey.knows_hands(scene) {
        return vec![];
    }
    let free = objects(scene, survey)
        .filter(|object| scene.bodies.get_index(*object).is_some_and(|(_, body)| body.fixed_to.is_none()));
    free.filter_map(|object| hangs(scene, survey, object)).collect()
}

/// An object that hangs in the air whenever it rests on no other object.
fn hangs(scene: &Scene, survey: &Survey, object: usize) -> Option<Issue> {
    let (name, body) = scene.bodies.get_index(object)?;
    let solid = Solid::new(body);
    let is_away =
        |sample: usize| survey.distance(survey.hands.iter(), (object, &solid), sample).is_some_and(|it| it > AWAY);
    let mut found: Vec<HangingRest> = vec![];
    for rest in rests(survey, object, is_away) {
        let others = (0..scene.bodies.len()).filter(|other| *other != object);
        let near = others.filter_map(|other| Some((gap(scene, survey, object, other, &rest)?.width, other)));
        let (least, nearest) = near.min_by(|one, other| one.0.total_cmp(&other.0))?;
        let carries = |other: usize| scene.bodies.get_index(other).is_some_and(|(_, body)| body.role != Role::Object);
        match (least > SCENE_ERROR, carries(nearest)) {
            (true, _) => found.push(HangingRest { below: below(scene, survey, object, &rest), rest }),
            (false, true) => return None,
            // An object on another one hangs as that does.
            (false, false) => {}
        }
    }
    let (first, last) = (found.first()?, found.last()?);
    let depths: Vec<f64> = found.iter().filter_map(|it| it.below.map(|(depth, _)| depth)).collect();
    let span = survey.span_of(&(first.rest.start..last.rest.end));
    let on = first.below.map(|(_, other)| other);
    if found.iter().any(|it| it.below.map(|(_, other)| other) != on) {
        return None;
    }
    let message = match (median(depths.clone()), on.and_then(|other| scene.bodies.get_index(other))) {
        (Some(depth), Some((its, other))) => {
            if depths.iter().any(|it| (it - depth).abs() > ALIKE) {
                return None;
            }
            let found = other.position.map(|length| length.0);
            let moved = Vector3::from(found) + scene.up() * depth;
            format!(
                "it hangs {} mm above `{its}` at rest, and no hand is near: `{its}` is misplaced in the scene (`position: {}` instead of `{}`), the scene lacks \
                 what carries `{name}`, or the `parts` or the tracked point of `{name}` are wrong",
                mm(depth),
                in_scene(moved.into()),
                in_scene(found)
            )
        }
        _ => format!(
            "it hangs in the air at rest, no hand is near, and nothing is below it in the scene: the scene lacks the support of `{name}`, or the position is in \
             another frame"
        ),
    };
    Some(Issue {
        kind: IssueKind::HANGING_OBJECT,
        start_s: span[0],
        end_s: span[1],
        channel: format!("{name}.position"),
        message,
    })
}

/// The body below an object at rest, and how far the object would fall onto it, m. A gap is never wider than it is, so each step down is safe.
fn below(scene: &Scene, survey: &Survey, object: usize, rest: &Range<usize>) -> Option<(f64, usize)> {
    let sample = samples(rest).next()?;
    let mut fallen = 0.0;
    for _ in 0..SEARCHES {
        let others = (0..scene.bodies.len()).filter(|other| *other != object);
        let widths =
            others.filter_map(|other| Some((gap_of(scene, survey, object, other, (sample, fallen))?.width, other)));
        let (width, other) = widths.min_by(|one, other| one.0.total_cmp(&other.0))?;
        if width < REACHED {
            return Some((fallen, other));
        }
        fallen += width;
        if fallen > DEEPEST {
            return None;
        }
    }
    None
}
