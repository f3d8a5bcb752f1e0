//! Tool points that stay far from the held object: the flange of the arm is bound, not the point between the fingertips.

use super::co_motion::{CoMotion, MOVES, TOGETHER, steps};
use super::survey::{HandSamples, Survey};
use super::{median, mm};
use nalgebra::{UnitQuaternion, Vector3};
use teachtree_base::geometry::Solid;
use teachtree_base::scene::{Body, Role, Scene};
use teachtree_logs::issue::{Issue, IssueKind};

/// Distance of the tool point from the surface of the held object, m: a fingertip beyond the tool point is shorter, a gripper with its mounting longer.
const FAR: std::ops::RangeInclusive<f64> = 0.06..=0.3;
/// Minimum number of steps in which hand and object move together.
const STEPS: usize = 3;
/// And their minimum share of the steps in which the gripper is closed and the object moves.
const NEARLY_ALL: f64 = 0.8;
/// The place of the object in the frame of the tool varies by at most this, m: it is held at other points in other grasps.
const CONSTANT: f64 = 0.02;
/// The flange is behind the fingertips: the object is at most this far from the axis of the tool, rad.
const ALONG_AXIS: f64 = 0.5;

/// The tool points that are far from what their gripper holds.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    let has_size = |body: &Body| !body.parts.is_empty() || body.radius.is_some();
    let is_held = |body: &Body| body.role == Role::Object && body.fixed_to.is_none() && has_size(body);
    let objects: Vec<usize> =
        scene.bodies.values().enumerate().filter(|(_, body)| is_held(body)).map(|(index, _)| index).collect();
    // With two fingertips the point between them is known, and a palm may be far away.
    let hands = survey.hands.iter().filter(|hand| hand.tips.len() == 1 && !hand.closed.is_empty());
    hands.filter_map(|hand| objects.iter().find_map(|object| far(scene, survey, hand, *object))).collect()
}

fn far(scene: &Scene, survey: &Survey, hand: &HandSamples, object: usize) -> Option<Issue> {
    let closed = |step: &CoMotion| step.samples.clone().all(|sample| hand.closed.get(sample) == Some(&true));
    let moved: Vec<CoMotion> =
        steps(survey, hand, object).into_iter().filter(|step| closed(step) && step.object.norm() > MOVES).collect();
    let held: Vec<&CoMotion> = moved.iter().filter(|step| step.mismatch(|hand| *hand) < TOGETHER).collect();
    if held.len() < STEPS || (held.len() as f64) < NEARLY_ALL * moved.len() as f64 {
        return None;
    }
    let samples: Vec<usize> = held.iter().map(|step| step.samples.start).collect();
    let (name, body) = scene.bodies.get_index(object)?;
    let solid = Solid::new(body);
    let distances = samples.iter().filter_map(|at| survey.distance(std::iter::once(hand), (object, &solid), *at));
    let distance = median(distances.collect()).filter(|distance| FAR.contains(distance))?;
    let offsets: Vec<Vector3<f64>> = samples.iter().filter_map(|at| offset(survey, hand, object, *at)).collect();
    let middle = |axis: usize| median(offsets.iter().map(|offset| offset[axis]).collect());
    let offset = Vector3::new(middle(0)?, middle(1)?, middle(2)?);
    if median(offsets.iter().map(|it| (it - offset).norm()).collect())? > CONSTANT {
        return None;
    }
    let [start_s, end_s] = survey.span_of(&(held.first()?.samples.start..held.last()?.samples.end));
    let (finger, _) = hand.tips.first()?;
    let channel = format!("{}.{finger}.position", hand.side);
    let message = format!(
        "while the gripper is closed, it stays {:.0} mm from the surface of `{name}`, which moves with it: {}",
        mm(distance),
        cause(scene, hand, &channel, offset)
    );
    Some(Issue { kind: IssueKind::DISTANT_TOOL_POINT, start_s, end_s, channel, message })
}

/// Where the object is from the tool point, in the frame of the tool, or in the reference frame where the log lacks the rotation of the tool, m.
fn offset(survey: &Survey, hand: &HandSamples, object: usize, sample: usize) -> Option<Vector3<f64>> {
    let rotation = hand.rotation.get(sample).copied().unwrap_or_else(UnitQuaternion::identity);
    Some(rotation.inverse() * (survey.pose(object, sample)?.translation.vector - hand.place(sample)?))
}

/// The probable cause, and the line to write.
fn cause(scene: &Scene, hand: &HandSamples, channel: &str, offset: Vector3<f64>) -> String {
    let axis = if hand.rotation.is_empty() { -scene.up() } else { Vector3::z() };
    let angle = offset.angle(&axis);
    if angle.min(std::f64::consts::PI - angle) > ALONG_AXIS {
        return "its position or that of the object is in another frame, or is that of another point".into();
    }
    let flange = "it is probably the flange of the arm, expected the point between the fingertips";
    let palm = format!("{}.palm", hand.side);
    if hand.rotation.is_empty() {
        let beside =
            format!("bind the rotation of the flange as `{palm}.rotation` and its position as `{palm}.position`");
        return format!(
            "{flange}; {beside}, and write `{channel}: {{at: [0 mm, 0 mm, {} mm], of: {palm}}}` with the length of the gripper along its axis",
            mm(offset.norm())
        );
    }
    let at = [offset.x, offset.y, offset.z].map(mm);
    let [x, y, z] = at;
    format!(
        "{flange}; bind its columns as `{palm}.position`, and write `{channel}: {{at: [{x} mm, {y} mm, {z} mm], of: {palm}}}`"
    )
}
