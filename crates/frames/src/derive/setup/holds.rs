//! Objects that move while a hand grips, but not together with it: the poses are in different frames, have different clocks, or belong to other bodies.

use super::co_motion::{CoMotion, MOVES, TOGETHER, mismatch, steps};
use super::median;
use super::survey::{HandSamples, Survey};
use nalgebra::{Matrix3, Rotation3, Vector3};
use teachtree_base::scene::{Role, Scene};
use teachtree_logs::issue::{Issue, IssueKind};

/// Minimum number of steps in which hand and object move apart.
const STEPS: usize = 3;
/// Hand and object do not move together in a step in which their displacements differ by this share of the longer one: those of an object that turns about a hinge, or
/// slips, differ by less.
const APART: f64 = 0.7;
/// They are apart in at least this share of the steps where a lag or a turned frame explains it: a vertical way is the same in a frame that is turned about the
/// vertical …
const SOME: f64 = 0.25;
/// … by which nearly all steps are together.
const NEARLY_ALL: f64 = 0.8;
/// Without such an explanation the object is the target, and at most this share of the steps is together.
const FEW: f64 = 0.2;
/// Clocks differ by at most this, s.
const LAG_SECS: f64 = 2.0;
/// Frames that differ by less are not turned, rad.
const TURNED: f64 = 0.3;
/// Displacements whose second extent is a smaller share of the first are along one line, which leaves the rotation unknown.
const PLANAR: f64 = 0.1;

/// The objects that do not move with the hand that grips. Where a lag or a turn explains it, the object need not be the target of the hand: one in another frame is not the nearest one.
pub fn issues(scene: &Scene, survey: &Survey) -> Vec<Issue> {
    let objects = scene.bodies.values().enumerate();
    let objects = objects.filter(|(_, body)| body.role == Role::Object && body.fixed_to.is_none());
    let objects: Vec<usize> = objects.map(|(index, _)| index).collect();
    let pairs = survey.hands.iter().flat_map(|hand| objects.iter().map(move |object| (hand, *object)));
    pairs.filter_map(|(hand, object)| apart(scene, survey, hand, object)).collect()
}

fn apart(scene: &Scene, survey: &Survey, hand: &HandSamples, object: usize) -> Option<Issue> {
    let grips = |step: &CoMotion| step.samples.clone().all(|sample| hand.grips.get(sample) == Some(&true));
    let others: Vec<CoMotion> = survey
        .hands
        .iter()
        .filter(|other| other.side != hand.side)
        .flat_map(|other| steps(survey, other, object))
        .filter(|step| step.mismatch(|hand| *hand) < TOGETHER)
        .collect();
    let carried_by_other = |step: &CoMotion| others.iter().any(|other| other.samples == step.samples);
    let held: Vec<CoMotion> = steps(survey, hand, object)
        .into_iter()
        .filter(|step| step.object.norm() > MOVES && grips(step) && !carried_by_other(step))
        .collect();
    let share = |count: usize| count as f64 / held.len().max(1) as f64;
    let apart = held.iter().filter(|step| step.mismatch(|hand| *hand) > APART).count();
    if apart < STEPS || share(apart) < SOME {
        return None;
    }
    let is_target = |step: &CoMotion| step.samples.clone().all(|sample| hand.touches(object, sample));
    let unexplained = || {
        held.iter().all(is_target).then_some(())?;
        let differ = median(held.iter().map(|step| step.mismatch(|hand| *hand)).collect())?;
        (differ > APART && share(together(&held, |hand| *hand)) < FEW).then(|| {
            "one of the positions is of another body or in another frame, or another hand holds the object".to_string()
        })
    };
    let cause = lag(survey, hand, &held).or_else(|| turned(&held)).or_else(unexplained)?;
    let way = |of: &dyn Fn(&CoMotion) -> f64| held.iter().map(of).sum::<f64>() * 1e3;
    let (name, _) = scene.bodies.get_index(object)?;
    let message = format!(
        "while the {} hand grips, it moves by {:.0} mm and the hand by {:.0} mm, not together: {cause}",
        hand.side,
        way(&|step| step.object.norm()),
        way(&|step| step.hand.norm()),
    );
    let span = survey.span_of(&(held.first()?.samples.start..held.last()?.samples.end));
    Some(Issue {
        kind: IssueKind::INCONSISTENT_HOLD,
        start_s: span[0],
        end_s: span[1],
        channel: format!("{name}.position"),
        message,
    })
}

/// In how many steps hand and object move together, after a change of the hand's ways.
fn together(held: &[CoMotion], change: impl Fn(&Vector3<f64>) -> Vector3<f64>) -> usize {
    held.iter().filter(|step| step.mismatch(&change) < TOGETHER).count()
}

/// Whether a number of the steps is nearly all of them.
fn nearly_all(held: &[CoMotion], count: usize) -> bool {
    count as f64 >= NEARLY_ALL * held.len() as f64
}

/// Says by how much the clocks differ, where the hand moves so at another time.
fn lag(survey: &Survey, hand: &HandSamples, held: &[CoMotion]) -> Option<String> {
    let most = (LAG_SECS / survey.step_s).round() as isize;
    let shifted = |shift: isize| {
        let at = |sample: usize| hand.place(sample.checked_add_signed(shift)?);
        let differs =
            |step: &CoMotion| Some(mismatch(&(at(step.samples.end - 1)? - at(step.samples.start)?), &step.object));
        let differs: Vec<f64> = held.iter().filter_map(differs).collect();
        let together = differs.iter().filter(|differs| **differs < TOGETHER).count();
        (nearly_all(held, together), differs.iter().sum::<f64>() / differs.len().max(1) as f64)
    };
    let shifts = (-most..=most).map(|shift| (shift, shifted(shift))).filter(|(_, (explains, _))| *explains);
    let (shift, _) = shifts.min_by(|(_, (_, one)), (_, (_, other))| one.total_cmp(other))?;
    (shift != 0).then(|| {
        let seconds = -shift as f64 * survey.step_s;
        let (late, by) = if seconds > 0.0 { ("later", seconds) } else { ("earlier", -seconds) };
        format!("the object repeats the motion of the hand {by:.2} s {late}: the clocks of the two sources differ, shift one of them")
    })
}

/// Says by which rotation the frames differ, where the object moves as the hand does in a turned frame.
fn turned(held: &[CoMotion]) -> Option<String> {
    let covariance: Matrix3<f64> = held.iter().map(|step| step.object * step.hand.transpose()).sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let is_planar = svd.singular_values[1] > PLANAR * svd.singular_values[0];
    let sign = (u * v_t).determinant().signum();
    let rotation = Rotation3::from_matrix_unchecked(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t);
    let (axis, angle) = rotation.axis_angle()?;
    (is_planar && angle > TURNED && nearly_all(held, together(held, |hand| rotation * hand))).then(|| {
        let [x, y, z] = [axis.x, axis.y, axis.z].map(|part| (part * 10.0).round() / 10.0 + 0.0);
        format!(
            "their frames differ by a rotation of {:.0}° about [{x}, {y}, {z}]; bring both into one frame (`frame` and transforms in docs/bindings.md)",
            angle.to_degrees()
        )
    })
}
